//! One node of the search: the candidates that may still join a partial set, and which of them go
//! together. The bounds are derived in the documentation of the search.

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
}

impl Node {
    /// `None` when no completion can reach the limit.
    pub(super) fn reduced(
        problem: &Problem,
        limit: &dyn Fn() -> f64,
        chosen: &[usize],
        mut candidates: Vec<usize>,
    ) -> Option<Self> {
        let missing = problem.keys - chosen.len();
        let mut lambda = 1.0_f64;
        if !chosen.is_empty() {
            lambda = lambda.max(rayleigh(&problem.kernel.submatrix(chosen), chosen.len()));
        }
        loop {
            let shift = lambda / limit() - SHIFT_SLACK;
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
                let energy = energy_bound(problem, chosen, &candidates, &mut graph, &classes);
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
