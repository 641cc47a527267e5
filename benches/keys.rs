//! Time to the proven optimum of key choice on noisy rings (two components, 12.15 frames a turn).

use divan::Bencher;
use muybridge::keys::{KeySettings, choose_keys};
use muybridge::numeric::Coefficients;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn main() {
    divan::main();
}

fn ring(frames: usize) -> Coefficients {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut n = || -> f64 { 0.15 * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    let values = (0..frames)
        .flat_map(|t| {
            let a = std::f64::consts::TAU * t as f64 / 12.15;
            [2.0_f64.sqrt() * a.cos() + n(), 2.0_f64.sqrt() * a.sin() + n()]
        })
        .collect();
    Coefficients::from_rows(frames, 2, values).unwrap_or_else(|| unreachable!("two columns"))
}

#[divan::bench(sample_count = 3, args = [(100, 4), (137, 4), (137, 5), (1000, 4), (300, 6), (122, 7), (100, 8), (137, 8)])]
fn proven_optimum(bencher: Bencher<'_, '_>, (frames, keys): (usize, usize)) {
    let coefficients = ring(frames);
    let settings = KeySettings { keys, time_limit_s: f64::INFINITY, ..KeySettings::default() };
    bencher.bench(|| choose_keys(&coefficients, &settings, &|_, _| true));
}

/// The search cut off after 50 ms: how long the call takes, and, printed first, how far the set it
/// returns is from the proven optimum.
#[divan::bench(sample_count = 5, args = [(1000, 4), (300, 6), (100, 8), (137, 8)])]
#[allow(clippy::print_stderr, reason = "the distance from the optimum is a result too")]
fn after_50_ms(bencher: Bencher<'_, '_>, (frames, keys): (usize, usize)) {
    let coefficients = ring(frames);
    let choose = |time_limit_s: f64| {
        let settings = KeySettings { keys, time_limit_s, ..KeySettings::default() };
        choose_keys(&coefficients, &settings, &|_, _| true).map_or(f64::NAN, |c| c.condition)
    };
    let optimum = choose(f64::INFINITY);
    eprintln!(
        "{frames} frames, {keys} keys: after 50 ms {:.4} of the optimum",
        choose(0.05) / optimum
    );
    bencher.bench(|| choose(0.05));
}
