//! Keys, partners and weights together, blind, on a planted walk: the silhouette repeats every
//! step, the pose every two.

use std::f64::consts::TAU;

use muybridge::interpolate::{KernelSettings, Method, Switching, weights};
use muybridge::keys::{KeySettings, PartnerSettings, choose_keys, cycle_order, propose_partners};
use muybridge::numeric::Coefficients;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const STEP_FRAMES: f64 = 12.15;
const FRAMES: usize = 100;

fn silhouettes(noise: f64, direction: f64, seed: u64) -> Coefficients {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut n = || -> f64 { noise * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    let values = (0..FRAMES)
        .flat_map(|t| {
            let a = direction * step_phase(t);
            [2.0_f64.sqrt() * a.cos() + n(), 2.0_f64.sqrt() * a.sin() + n()]
        })
        .collect();
    Coefficients::from_rows(FRAMES, 2, values).unwrap()
}

fn step_phase(t: usize) -> f64 {
    TAU * t as f64 / STEP_FRAMES
}

/// What a leg and the back do at a frame.
fn pose(t: usize) -> [f64; 3] {
    let stride = step_phase(t) / 2.0;
    [stride.sin(), stride.cos() + 0.2 * (3.0 * stride).sin(), (2.0 * stride).sin()]
}

fn rms_error(c: &Coefficients, keys: usize, period: Option<f64>) -> f64 {
    let choice =
        choose_keys(c, &KeySettings { keys, ..KeySettings::default() }, &|_, _| true).unwrap();
    let settings =
        PartnerSettings { step_period_frames: Some(STEP_FRAMES), ..PartnerSettings::default() };
    let partners: Vec<usize> = propose_partners(c, &choice.frames, &settings, &[])
        .unwrap()
        .iter()
        .map(|p| p.frame)
        .collect();
    let poses: Vec<usize> = choice.frames.iter().chain(&partners).copied().collect();
    let method = Method::Switching(Switching {
        partners,
        step_period_frames: period,
        ..Switching::default()
    });
    let w = weights(c, &choice.frames, &method, &KernelSettings::default()).unwrap();
    assert!(w.phase_conflicts().is_empty());
    let error = |t: usize| -> f64 {
        let mut error = pose(t).map(|x| -x);
        for (weight, &frame) in w.row(t).iter().zip(&poses) {
            for (e, x) in error.iter_mut().zip(pose(frame)) {
                *e += weight * x;
            }
        }
        error.iter().map(|e| e * e).sum()
    };
    ((0..FRAMES).map(error).sum::<f64>() / FRAMES as f64).sqrt()
}

#[test]
fn a_planted_walk_comes_back() {
    // The pose itself has a root mean square of 1.24.
    for seed in 0..5 {
        for direction in [1.0, -1.0] {
            let c = silhouettes(0.1, direction, seed);
            for (keys, most) in [(4, 0.5), (6, 0.4)] {
                for period in [Some(STEP_FRAMES), None] {
                    let error = rms_error(&c, keys, period);
                    assert!(error < most, "{keys} keys, seed {seed}: {error}");
                }
            }
        }
    }
}

#[test]
fn the_cycle_order_is_that_of_the_planted_phase() {
    let c = silhouettes(0.1, -1.0, 4);
    let keys = choose_keys(&c, &KeySettings::default(), &|_, _| true).unwrap().frames;
    let order = cycle_order(&c, &keys).unwrap();
    let from_first = |i: usize| (step_phase(keys[i]) - step_phase(keys[0])).rem_euclid(TAU);
    assert!(order.windows(2).all(|w| from_first(w[0]) < from_first(w[1])));
}
