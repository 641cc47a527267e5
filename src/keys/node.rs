//! One node of the search: the candidates that may still join a partial set, and which of them go
//! together. The bounds are derived in the documentation of the search.

use super::MAX_KEYS;
use super::condition::{SHIFT_SLACK, rayleigh};
use super::factor::Factor;
use super::graph::Graph;
use super::problem::Problem;
use super::watch::Watch;
use crate::numeric::{InstructionSet, Kernel};

/// A second look with the sharper λ pays when it rose by this factor.
const WORTH_A_SECOND_LOOK: f64 = 1.02;

/// The candidates of a partial set, those that cannot be part of a good completion removed, and
/// the graph of those that go together.
pub(super) struct Node {
    candidates: Vec<usize>,
    graph: Graph,
    classes: Vec<Vec<usize>>,
    /// A lower bound of λ_max of all completions, of this set and of its children's.
    pub(super) lambda: f64,
}

impl Node {
    /// `None` when no completion can reach the limit, or when `watch` says that work should end.
    /// `lambda`: a lower bound of λ_max of all
    /// completions that is already known, that of the parent.
    pub(super) fn reduced(
        problem: &Problem,
        watch: &Watch<'_>,
        limit: &dyn Fn() -> f64,
        chosen: &[usize],
        mut candidates: Vec<usize>,
        mut lambda: f64,
    ) -> Option<Self> {
        let missing = problem.keys - chosen.len();
        if !chosen.is_empty() {
            lambda = lambda.max(rayleigh(&problem.kernel.submatrix(chosen), chosen.len()));
        }
        loop {
            let shift = lambda / limit() - SHIFT_SLACK;
            let mut graph = joinable(problem, watch, chosen, &mut candidates, shift)?;
            if graph.keep_core(missing - 1) < missing {
                return None;
            }
            let mut classes = graph.colour_classes();
            if classes.len() < missing {
                return None;
            }
            if missing > 2 {
                let energy =
                    energy_bound(problem, watch, chosen, &candidates, &mut graph, &classes);
                let sharper = energy / problem.keys as f64;
                if sharper.is_infinite() {
                    return None;
                }
                let worth_it = sharper > lambda * WORTH_A_SECOND_LOOK;
                lambda = lambda.max(sharper);
                if worth_it {
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
            return Some(Self { candidates, graph, classes, lambda });
        }
    }

    /// The branches: each a frame and the candidates that may follow it.
    pub(super) fn children(mut self, missing: usize) -> Vec<(usize, Vec<usize>)> {
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
/// removes from the graph the candidates that are in no completion. Infinite too when work should
/// end.
fn energy_bound(
    problem: &Problem,
    watch: &Watch<'_>,
    chosen: &[usize],
    candidates: &[usize],
    graph: &mut Graph,
    classes: &[Vec<usize>],
) -> f64 {
    let kernel = &problem.kernel;
    let missing = problem.keys - chosen.len();
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
    for (at, v) in graph.vertices().into_iter().enumerate() {
        if at % ROWS_BETWEEN_LOOKS == ROWS_BETWEEN_LOOKS - 1 && watch.halted() {
            return f64::INFINITY;
        }
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

/// Rows of a node's matrices between two looks at the clock: of a thousand candidates one takes some
/// microseconds.
const ROWS_BETWEEN_LOOKS: usize = 64;

/// Candidates worked on together, in vector registers.
const LANES: usize = 8;

/// The graph of the candidates that can both be added to the chosen frames, from the Schur
/// complement M of K − σI over these; removes the candidates that cannot join at all. `None` when
/// the chosen frames alone fail, too few candidates are left, or work should end.
///
/// M is not kept: M_ij = K_ij − y_i·y_j with L·y_j the column of j, for eight j at a time.
fn joinable(
    problem: &Problem,
    watch: &Watch<'_>,
    chosen: &[usize],
    candidates: &mut Vec<usize>,
    shift: f64,
) -> Option<Graph> {
    let k = chosen.len();
    let factor = Factor::of(&problem.kernel, chosen, shift)?;
    // For each eight candidates k rows of eight y, then a row of eight diagonal entries of M.
    let mut solved = vec![[0.0; LANES]; candidates.len().div_ceil(LANES) * (k + 1)];
    let mut n = 0;
    candidates.retain(|&f| {
        let (y, left) = factor.joined_by(problem.kernel.row(f));
        if left <= 0.0 {
            return false;
        }
        let rows = &mut solved[n / LANES * (k + 1)..][..=k];
        for (row, y) in rows.iter_mut().zip(&y[..k]) {
            row[n % LANES] = *y;
        }
        rows[k][n % LANES] = left;
        n += 1;
        true
    });
    if candidates.len() + k < problem.keys {
        return None;
    }
    let mut graph = Graph::new(n);
    let instructions = InstructionSet::best();
    for i in 0..n {
        if i % ROWS_BETWEEN_LOOKS == ROWS_BETWEEN_LOOKS - 1 && watch.halted() {
            return None;
        }
        let row = problem.kernel.row(candidates[i]);
        let (candidates, graph) = (&*candidates, &mut graph);
        instructions.run(Joining { row, candidates, solved: &solved, chosen: k, i, graph });
        if problem.spacing > 1 {
            graph.retain_neighbours(i, |j| problem.apart(candidates[i], candidates[j]));
        }
    }
    Some(graph)
}

/// Candidate `i`, to be joined to those it goes together with.
struct Joining<'a> {
    /// Its row of the kernel matrix.
    row: &'a [f64],
    candidates: &'a [usize],
    /// The y of all candidates and the diagonal of M.
    solved: &'a [[f64; LANES]],
    /// Number of chosen frames.
    chosen: usize,
    i: usize,
    graph: &'a mut Graph,
}

impl Kernel for Joining<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let (k, i) = (self.chosen, self.i);
        let own = &self.solved[i / LANES * (k + 1)..][..=k];
        let own_y: [f64; MAX_KEYS] =
            std::array::from_fn(|c| if c < k { own[c][i % LANES] } else { 0.0 });
        let di = own[k][i % LANES];
        let eights = self.candidates.chunks(LANES).zip(self.solved.chunks_exact(k + 1));
        for (eight, (frames, rows)) in eights.enumerate() {
            let mut entries = [0.0; LANES];
            for (entry, &f) in entries.iter_mut().zip(frames) {
                *entry = self.row[f];
            }
            for (yi, y) in own_y.iter().zip(&rows[..k]) {
                for (entry, yj) in entries.iter_mut().zip(y) {
                    *entry -= yi * yj;
                }
            }
            let mut joined = 0_u8;
            for (lane, (x, dj)) in entries.iter().zip(&rows[k]).enumerate() {
                joined |= u8::from(x * x < di * dj) << lane;
            }
            self.graph.join_eight(i, eight, joined);
        }
    }
}
