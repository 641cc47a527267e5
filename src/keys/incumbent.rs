//! A good first set: random starts, each improved by single exchanges.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::condition::{SHIFT_SLACK, condition, condition_within, rayleigh};
use super::factor::Factor;
use super::problem::{Problem, spread};
use super::watch::Watch;

/// The best set of `restarts` local searches (at least one), ascending, with its condition, which
/// is infinite when even the best is singular.
///
/// Start number i draws from stream i of the seeded generator, so the result does not depend on
/// threads; only a time limit that strikes here changes it.
pub(super) fn local_search(
    problem: &Problem,
    restarts: usize,
    seed: u64,
    watch: &Watch<'_>,
) -> (f64, Vec<usize>) {
    (0..restarts.max(1))
        .into_par_iter()
        .map(|i| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(i as u64);
            let start = random_set(problem, &mut rng);
            improve(problem, start, &mut rng, watch)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)))
        .unwrap_or_else(|| (f64::INFINITY, Vec::new()))
}

/// A random admissible set, forced frames first.
fn random_set(problem: &Problem, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let mut set = problem.forced.clone();
    let mut open = problem.free.clone();
    while set.len() < problem.keys && !open.is_empty() {
        let pick = open[rng.random_range(0..open.len())];
        let rest: Vec<usize> = open.iter().copied().filter(|&f| problem.apart(f, pick)).collect();
        if set.len() + 1 + spread(&rest, problem.spacing) >= problem.keys {
            set.push(pick);
            open = rest;
        } else {
            // Taking this one would leave too little room for the others.
            open.retain(|&f| f != pick);
        }
    }
    set
}

/// Exchanges one frame at a time, the first that helps, until none does.
fn improve(
    problem: &Problem,
    mut set: Vec<usize>,
    rng: &mut ChaCha8Rng,
    watch: &Watch<'_>,
) -> (f64, Vec<usize>) {
    let mut best = condition(&problem.kernel, &set);
    let mut order = problem.free.clone();
    loop {
        let before = best;
        for place in problem.forced.len()..set.len() {
            order.shuffle(rng);
            let mut others = set.clone();
            others.remove(place);
            // By interlacing most exchanges are refused without a look at the whole matrix: one
            // factor of the others, one triangular solution a frame.
            let rho = if others.is_empty() {
                1.0
            } else {
                rayleigh(&problem.kernel.submatrix(&others), others.len())
            };
            let factor = Factor::of(&problem.kernel, &others, rho / best - SHIFT_SLACK);
            let Some(factor) = factor else { continue };
            for &f in &order {
                if factor.joined_by(problem.kernel.row(f)).1 <= 0.0 {
                    continue;
                }
                let fits = |(i, &g): (usize, &usize)| i == place || problem.apart(f, g);
                if set.contains(&f) || !set.iter().enumerate().all(fits) {
                    continue;
                }
                let old = std::mem::replace(&mut set[place], f);
                match condition_within(&problem.kernel, &set, best) {
                    Some(better) if better < best => best = better,
                    _ => set[place] = old,
                }
            }
            if watch.halted() {
                break;
            }
        }
        if best >= before || watch.halted() {
            break;
        }
    }
    set.sort_unstable();
    (best, set)
}
