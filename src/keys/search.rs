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
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::condition::{SINGULAR, condition_within, tie_tolerance};
use super::node::Node;
use super::problem::Problem;
use super::watch::Watch;

/// Depth of the search tree down to which children run in parallel; deeper they are too short.
const PARALLEL_DEPTH: usize = 2;

/// Passes before the last, as shares of the way from 1 to the best condition known. On noisy rings
/// (8 of 137) the two together took a sixth of the time of the last; one at .9 takes a half of it.
const EARLY_PASSES: [f64; 2] = [0.5, 0.75];

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
        pass.visit(&problem.forced, problem.free.clone(), 1.0, 0);
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

    /// Searches all completions of `chosen` from `candidates`, whose λ_max is at least `lambda`.
    fn visit(&self, chosen: &[usize], candidates: Vec<usize>, lambda: f64, depth: usize) {
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
        self.watch.worked((candidates.len() as u64).pow(2));
        let limit = || self.limit();
        let Some(node) =
            Node::reduced(self.problem, self.watch, &limit, chosen, candidates, lambda)
        else {
            return;
        };
        let lambda = node.lambda;
        let children = node.children(missing);
        let descend = |(f, rest): (usize, Vec<usize>)| {
            let mut set = chosen.to_vec();
            set.push(f);
            self.visit(&set, rest, lambda, depth + 1);
        };
        if depth < PARALLEL_DEPTH {
            children.into_par_iter().for_each(descend);
        } else {
            children.into_iter().for_each(descend);
        }
    }
}
