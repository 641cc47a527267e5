//! One node of the search: the candidates that may still join a partial set, and which of them go
//! together. The bounds are derived in the documentation of the search.

use super::MAX_KEYS;
use super::condition::{SHIFT_SLACK, rayleigh};
use super::graph::Graph;
use super::problem::Problem;

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
    /// `None` when no completion can reach the limit. `lambda`: a lower bound of λ_max of all
    /// completions that is already known, that of the parent.
    pub(super) fn reduced(
        problem: &Problem,
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
            let mut graph = joinable(problem, chosen, &mut candidates, shift)?;
            if graph.keep_core(missing - 1) < missing {
                return None;
            }
            let mut classes = graph.colour_classes();
            if classes.len() < missing {
                return None;
            }
            if missing > 2 {
                let energy = energy_bound(problem, chosen, &candidates, &mut graph, &classes);
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
/// removes from the graph the candidates that are in no completion.
fn energy_bound(
    problem: &Problem,
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

/// The graph of the candidates that can both be added to the chosen frames, from the Schur
/// complement M of K − σI over these; removes the candidates that cannot join at all. `None` when
/// the chosen frames alone fail.
///
/// M is not kept: row by row, M_ij = K_ij − y_i·y_j with L·y_j the column of j, in loops over
/// contiguous numbers that the compiler turns into vector instructions.
fn joinable(
    problem: &Problem,
    chosen: &[usize],
    candidates: &mut Vec<usize>,
    shift: f64,
) -> Option<Graph> {
    let k = chosen.len();
    let factor = cholesky(problem, chosen, shift)?;
    let most = candidates.len();
    // One row a chosen frame, one column a candidate.
    let mut solved = vec![0.0; k * most];
    let mut diagonal = Vec::with_capacity(most);
    candidates.retain(|&f| {
        let row = problem.kernel.row(f);
        let mut y = [0.0; MAX_KEYS];
        let mut left = 1.0 - shift;
        for (i, &s) in chosen.iter().enumerate() {
            let mut sum = row[s];
            for j in 0..i {
                sum -= factor[i * MAX_KEYS + j] * y[j];
            }
            y[i] = sum / factor[i * MAX_KEYS + i];
            left -= y[i] * y[i];
        }
        let fits = left > 0.0;
        if fits {
            for (i, y) in y[..k].iter().enumerate() {
                solved[i * most + diagonal.len()] = *y;
            }
            diagonal.push(left);
        }
        fits
    });
    let n = candidates.len();
    let mut graph = Graph::new(n);
    let mut entries = vec![0.0; n];
    for i in 0..n {
        let row = problem.kernel.row(candidates[i]);
        for (entry, &f) in entries.iter_mut().zip(candidates.iter()) {
            *entry = row[f];
        }
        for y in solved.chunks(most.max(1)) {
            let yi = y[i];
            for (entry, yj) in entries.iter_mut().zip(y) {
                *entry -= yi * yj;
            }
        }
        let di = diagonal[i];
        graph.set_row(i, entries.iter().zip(&diagonal).map(|(x, dj)| x * x < di * dj));
        if problem.spacing > 1 {
            graph.retain_neighbours(i, |j| problem.apart(candidates[i], candidates[j]));
        }
    }
    Some(graph)
}

/// Lower Cholesky factor of K_S − shift·I, rows of [`MAX_KEYS`] entries; `None` when it is not
/// positive definite.
fn cholesky(problem: &Problem, chosen: &[usize], shift: f64) -> Option<[f64; MAX_KEYS * MAX_KEYS]> {
    let mut l = [0.0; MAX_KEYS * MAX_KEYS];
    for (i, &f) in chosen.iter().enumerate() {
        let row = problem.kernel.row(f);
        for (j, &g) in chosen[..=i].iter().enumerate() {
            let mut sum = row[g] - if i == j { shift } else { 0.0 };
            for c in 0..j {
                sum -= l[i * MAX_KEYS + c] * l[j * MAX_KEYS + c];
            }
            l[i * MAX_KEYS + j] = if i == j {
                if sum <= 0.0 {
                    return None;
                }
                sum.sqrt()
            } else {
                sum / l[j * MAX_KEYS + j]
            };
        }
    }
    Some(l)
}
