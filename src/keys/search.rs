//! The proof: branch and bound over sets of frames, in parallel.
//!
//! A set T of m frames beats the limit β when λ_min(K_T) ≥ λ_max(K_T)/β. Let λ be any lower bound
//! of λ_max over the completions T of a partial set S, and σ = λ/β. By Cauchy's interlacing theorem
//! every principal submatrix of K_T − σI must then be positive definite too:
//! - S itself, else the branch ends;
//! - S with one further frame j: the Schur complement M_jj > 0, else j leaves the candidates;
//! - S with two further frames: M_ii·M_jj > M_ij², else i and j are not joined in the graph in
//!   which the rest of the set must be a clique. Vertices with too few neighbours fall away, and a
//!   greedy colouring bounds the clique: with r frames to find, all but r − 1 colour classes must
//!   be branched on.
//!
//! λ: m·λ_max(T) ≥ 1ᵀK_T 1, the sum of all entries. Of the frames to come at most one lies in each
//! colour class, so the smallest admissible row sums, one a class, bound it from below.
//!
//! The β of the early passes are fractions of the best condition found: they are quick and leave a
//! lower bound when time runs out.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::condition::{SHIFT_SLACK, SINGULAR, condition_within, rayleigh, tie_tolerance};
use super::graph::Graph;
use super::problem::Problem;

/// Depth of the search tree down to which children run in parallel; deeper they are too short.
const PARALLEL_DEPTH: usize = 2;

/// Passes before the last, as shares of the way from 1 to the best condition known. Measured on
/// noisy rings: the three together cost less than a third of the last pass.
const EARLY_PASSES: [f64; 3] = [0.5, 0.75, 0.9];

/// A second look with the sharper λ pays when it rose by this factor.
const WORTH_A_SECOND_LOOK: f64 = 1.02;

/// Units of progress of one pass.
const PASS_UNITS: usize = 1000;

const TICK: Duration = Duration::from_millis(100);

/// The clock, the caller's progress callback and the stop they can call for.
pub(super) struct Watch<'a> {
    deadline: Option<Instant>,
    progress: &'a (dyn Fn(usize, usize) -> bool + Sync),
    start: Instant,
    last_tick: AtomicU64,
    done: AtomicUsize,
    total: AtomicUsize,
    late: AtomicBool,
    interrupted: AtomicBool,
}

impl<'a> Watch<'a> {
    pub(super) fn new(
        deadline: Option<Instant>,
        progress: &'a (dyn Fn(usize, usize) -> bool + Sync),
    ) -> Self {
        Self {
            deadline,
            progress,
            start: Instant::now(),
            last_tick: AtomicU64::new(0),
            done: AtomicUsize::new(0),
            total: AtomicUsize::new((EARLY_PASSES.len() + 1) * PASS_UNITS),
            late: AtomicBool::new(false),
            interrupted: AtomicBool::new(false),
        }
    }

    /// Whether work should end, for the time limit or for the user; reports progress now and then.
    pub(super) fn halted(&self) -> bool {
        if self.late.load(Ordering::Relaxed) || self.interrupted.load(Ordering::Relaxed) {
            return true;
        }
        let now = Instant::now();
        if self.deadline.is_some_and(|d| now >= d) {
            self.late.store(true, Ordering::Relaxed);
        }
        let elapsed = now.duration_since(self.start).as_nanos() as u64;
        let last = self.last_tick.load(Ordering::Relaxed);
        if elapsed >= last + TICK.as_nanos() as u64
            && self
                .last_tick
                .compare_exchange(last, elapsed, Ordering::Relaxed, Ordering::Relaxed)
                .is_ok()
        {
            let (done, total) =
                (self.done.load(Ordering::Relaxed), self.total.load(Ordering::Relaxed));
            if !(self.progress)(done.min(total), total) {
                self.interrupted.store(true, Ordering::Relaxed);
            }
        }
        self.late.load(Ordering::Relaxed) || self.interrupted.load(Ordering::Relaxed)
    }

    /// Whether the caller asked to stop.
    pub(super) fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}

/// What the search can say at its end.
pub(super) struct Outcome {
    /// The best set, ascending, with its condition; `None` when all sets found are singular.
    pub(super) best: Option<(f64, Vec<usize>)>,
    pub(super) proven: bool,
    pub(super) lower_bound: f64,
}

/// All sets within the tie tolerance of the best condition found.
struct Best {
    condition: f64,
    ties: Vec<(f64, Vec<usize>)>,
}

impl Best {
    fn limit(&self) -> f64 {
        (self.condition * (1.0 + tie_tolerance(self.condition))).min(SINGULAR)
    }

    fn offer(&mut self, condition: f64, mut set: Vec<usize>) {
        if condition > self.limit() {
            return;
        }
        set.sort_unstable();
        self.condition = self.condition.min(condition);
        let limit = self.limit();
        self.ties.push((condition, set));
        self.ties.retain(|(c, _)| *c <= limit);
    }

    fn smallest(self) -> Option<(f64, Vec<usize>)> {
        self.ties.into_iter().min_by(|a, b| a.1.cmp(&b.1))
    }
}

/// One pass over all sets: refuses what exceeds the limit, keeps what does not.
struct Pass<'a> {
    problem: &'a Problem,
    watch: &'a Watch<'a>,
    best: &'a Mutex<Best>,
    /// Bits of the f64 above which sets are refused; only falls.
    limit: AtomicU64,
}

/// Proves the best set, or as much of it as time allows.
pub(super) fn prove(problem: &Problem, first: (f64, Vec<usize>), watch: &Watch<'_>) -> Outcome {
    let best = Mutex::new(Best { condition: SINGULAR, ties: Vec::new() });
    lock(&best).offer(first.0, first.1);
    let start = lock(&best).condition;
    let mut lower_bound = 1.0_f64;
    let mut proven = false;
    for share in EARLY_PASSES.into_iter().chain([1.0]) {
        let last = share == 1.0;
        let limit = if last { f64::INFINITY } else { 1.0 + share * (start - 1.0) };
        if !last && lock(&best).condition <= limit {
            // An early pass found a better set: only the last pass is left to do.
            continue;
        }
        let limit = limit.min(lock(&best).limit());
        let pass = Pass { problem, watch, best: &best, limit: AtomicU64::new(limit.to_bits()) };
        pass.visit(&problem.forced, problem.free.clone(), 0);
        if watch.halted() {
            break;
        }
        lower_bound = limit.min(lock(&best).condition);
        proven = last;
    }
    let best = best.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    Outcome { best: best.smallest(), proven, lower_bound }
}

fn lock(best: &Mutex<Best>) -> std::sync::MutexGuard<'_, Best> {
    best.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl Pass<'_> {
    fn limit(&self) -> f64 {
        f64::from_bits(self.limit.load(Ordering::Relaxed))
    }

    /// Offers a complete set.
    fn leaf(&self, set: &[usize]) {
        if let Some(condition) = condition_within(&self.problem.kernel, set, self.limit()) {
            let mut best = lock(self.best);
            best.offer(condition, set.to_vec());
            let limit = best.limit().min(self.limit());
            // All writers hold the lock, and f64 bits of positive numbers sort as the numbers do.
            self.limit.store(limit.to_bits(), Ordering::Relaxed);
        }
    }

    /// Searches all completions of `chosen` from `candidates`.
    fn visit(&self, chosen: &[usize], candidates: Vec<usize>, depth: usize) {
        let missing = self.problem.keys - chosen.len();
        if candidates.len() < missing || self.watch.halted() {
            return;
        }
        if missing == 0 {
            self.leaf(chosen);
            return;
        }
        if missing == 1 {
            let mut set = chosen.to_vec();
            for f in candidates {
                set.push(f);
                self.leaf(&set);
                set.pop();
            }
            return;
        }
        let Some(node) = Node::reduced(self, chosen, candidates) else { return };
        let children = node.children(missing);
        let descend = |(f, rest): (usize, Vec<usize>)| {
            let mut set = chosen.to_vec();
            set.push(f);
            self.visit(&set, rest, depth + 1);
        };
        if depth < PARALLEL_DEPTH {
            children.into_par_iter().for_each(descend);
        } else {
            children.into_iter().for_each(descend);
        }
    }
}

/// The candidates of a partial set, those that cannot be part of a good completion removed, and
/// the graph of those that go together.
struct Node {
    candidates: Vec<usize>,
    graph: Graph,
    classes: Vec<Vec<usize>>,
}

impl Node {
    /// `None` when no completion can reach the limit.
    fn reduced(pass: &Pass<'_>, chosen: &[usize], mut candidates: Vec<usize>) -> Option<Self> {
        let problem = pass.problem;
        let missing = problem.keys - chosen.len();
        let mut lambda = 1.0_f64;
        if !chosen.is_empty() {
            lambda = lambda.max(rayleigh(&problem.kernel.submatrix(chosen), chosen.len()));
        }
        loop {
            let shift = lambda / pass.limit() - SHIFT_SLACK;
            let schur = Schur::new(problem, chosen, &mut candidates, shift)?;
            let mut graph = schur.graph(problem, &candidates);
            if graph.keep_core(missing - 1) < missing {
                return None;
            }
            let mut classes = graph.colour_classes();
            if classes.len() < missing {
                return None;
            }
            if missing > 2 {
                let energy = energy_bound(pass, chosen, &candidates, &mut graph, &classes);
                let sharper = energy / problem.keys as f64;
                if sharper.is_infinite() {
                    return None;
                }
                if sharper > lambda * WORTH_A_SECOND_LOOK {
                    lambda = sharper;
                    candidates = graph.vertices().into_iter().map(|v| candidates[v]).collect();
                    continue;
                }
                if graph.keep_core(missing - 1) < missing {
                    return None;
                }
                for class in &mut classes {
                    class.retain(|&v| graph.is_alive(v));
                }
                classes.retain(|c| !c.is_empty());
                if classes.len() < missing {
                    return None;
                }
            }
            return Some(Self { candidates, graph, classes });
        }
    }

    /// The branches: each a frame and the candidates that may follow it.
    fn children(mut self, missing: usize) -> Vec<(usize, Vec<usize>)> {
        // A set of `missing` frames holds at least one outside the largest missing − 1 classes.
        self.classes.sort_by_key(|c| std::cmp::Reverse(c.len()));
        let mut children = Vec::new();
        for class in &self.classes[missing - 1..] {
            for &v in class {
                let rest: Vec<usize> =
                    self.graph.neighbours(v).map(|u| self.candidates[u]).collect();
                children.push((self.candidates[v], rest));
                self.graph.remove(v);
            }
        }
        children
    }
}

/// Lower bound of the sum of entries of every completed matrix, infinite when there is none;
/// removes from the graph the candidates that are in no completion.
fn energy_bound(
    pass: &Pass<'_>,
    chosen: &[usize],
    candidates: &[usize],
    graph: &mut Graph,
    classes: &[Vec<usize>],
) -> f64 {
    let kernel = &pass.problem.kernel;
    let missing = pass.problem.keys - chosen.len();
    let own: f64 = chosen.iter().flat_map(|&i| chosen.iter().map(move |&j| kernel.row(i)[j])).sum();
    let mut class_of = vec![0; candidates.len()];
    for (c, class) in classes.iter().enumerate() {
        for &v in class {
            class_of[v] = c;
        }
    }
    let mut nearest = vec![f64::INFINITY; classes.len()];
    let mut best_of_class = vec![f64::INFINITY; classes.len()];
    let mut costs = vec![f64::INFINITY; candidates.len()];
    for v in graph.vertices() {
        let row = kernel.row(candidates[v]);
        nearest.fill(f64::INFINITY);
        for u in graph.neighbours(v) {
            let n = &mut nearest[class_of[u]];
            *n = n.min(row[candidates[u]]);
        }
        let with_chosen: f64 = chosen.iter().map(|&s| row[s]).sum();
        costs[v] = 1.0 + 2.0 * with_chosen + sum_of_smallest(&mut nearest, missing - 1);
        let b = &mut best_of_class[class_of[v]];
        *b = b.min(costs[v]);
    }
    // Candidates without neighbours in enough classes are in no clique.
    for v in graph.vertices() {
        if costs[v].is_infinite() {
            graph.remove(v);
        }
    }
    own + sum_of_smallest(&mut best_of_class, missing)
}

/// Sum of the `count` smallest values, infinite when there are fewer; reorders `values`.
fn sum_of_smallest(values: &mut [f64], count: usize) -> f64 {
    if count == 0 {
        return 0.0;
    }
    if values.len() < count {
        return f64::INFINITY;
    }
    values.select_nth_unstable_by(count - 1, f64::total_cmp);
    values[..count].iter().sum()
}

/// Schur complement of K − σI over the chosen frames, for all candidates.
struct Schur {
    n: usize,
    /// Row-major, lower triangle with diagonal.
    values: Vec<f64>,
}

impl Schur {
    /// Removes the candidates that cannot join; `None` when the chosen frames alone fail.
    fn new(
        problem: &Problem,
        chosen: &[usize],
        candidates: &mut Vec<usize>,
        shift: f64,
    ) -> Option<Self> {
        let k = chosen.len();
        let factor = cholesky(problem, chosen, shift)?;
        let mut solved: Vec<f64> = Vec::with_capacity(candidates.len() * k);
        let mut diagonal = Vec::with_capacity(candidates.len());
        let mut kept = Vec::with_capacity(candidates.len());
        for &f in candidates.iter() {
            let row = problem.kernel.row(f);
            let at = solved.len();
            let mut left = 1.0 - shift;
            for (i, &s) in chosen.iter().enumerate() {
                let mut y = row[s];
                for j in 0..i {
                    y -= factor[i * k + j] * solved[at + j];
                }
                y /= factor[i * k + i];
                left -= y * y;
                solved.push(y);
            }
            if left > 0.0 {
                kept.push(f);
                diagonal.push(left);
            } else {
                solved.truncate(at);
            }
        }
        *candidates = kept;
        let n = candidates.len();
        let mut values = vec![0.0; n * n];
        for i in 0..n {
            let row = problem.kernel.row(candidates[i]);
            let yi = &solved[i * k..(i + 1) * k];
            for j in 0..i {
                let yj = &solved[j * k..(j + 1) * k];
                let dot: f64 = yi.iter().zip(yj).map(|(a, b)| a * b).sum();
                values[i * n + j] = row[candidates[j]] - dot;
            }
            values[i * n + i] = diagonal[i];
        }
        Some(Self { n, values })
    }

    /// Joins the candidates that can both be added to the chosen frames.
    fn graph(&self, problem: &Problem, candidates: &[usize]) -> Graph {
        let n = self.n;
        let mut graph = Graph::new(n);
        for i in 0..n {
            let di = self.values[i * n + i];
            for j in 0..i {
                let x = self.values[i * n + j];
                if x * x < di * self.values[j * n + j]
                    && problem.apart(candidates[i], candidates[j])
                {
                    graph.add_edge(i, j);
                }
            }
        }
        graph
    }
}

/// Lower Cholesky factor of K_S − shift·I, row-major; `None` when it is not positive definite.
fn cholesky(problem: &Problem, chosen: &[usize], shift: f64) -> Option<Vec<f64>> {
    let k = chosen.len();
    let mut l = problem.kernel.submatrix(chosen);
    for i in 0..k {
        l[i * k + i] -= shift;
        for j in 0..=i {
            let mut sum = l[i * k + j];
            for c in 0..j {
                sum -= l[i * k + c] * l[j * k + c];
            }
            l[i * k + j] = if i == j {
                if sum <= 0.0 {
                    return None;
                }
                sum.sqrt()
            } else {
                sum / l[j * k + j]
            };
        }
    }
    Some(l)
}
