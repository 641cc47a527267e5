use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::interpolate::{Method, weights};

/// A clip whose silhouettes go once round a ring in `PERIOD` frames and whose pose goes round in
/// twice that.
struct Planted {
    coefficients: Coefficients,
    /// True silhouette phase, radians, unwrapped; the pose's is half of it.
    phase: Vec<f64>,
}

const PERIOD: f64 = 12.15;

impl Planted {
    fn new(frames: usize, noise: f64, direction: f64, drift: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut phase = Vec::with_capacity(frames);
        let mut at = 0.3;
        for t in 0..frames {
            phase.push(at);
            // The speed swings by ±drift over the clip.
            let swing = (TAU * t as f64 / frames as f64).sin();
            at += TAU / PERIOD * (1.0 + drift * swing);
        }
        let values = phase
            .iter()
            .flat_map(|a| {
                let mut n =
                    || -> f64 { noise * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
                let a = direction * a;
                [2.0_f64.sqrt() * a.cos() + n(), 2.0_f64.sqrt() * a.sin() + n()]
            })
            .collect();
        Self { coefficients: Coefficients::from_rows(frames, 2, values).unwrap(), phase }
    }

    /// Keys evenly round the ring but scattered over the clip's cycles and halves, each with its
    /// partner in the other half of a stride.
    fn keys(&self, m: usize, shift: usize) -> (Vec<usize>, Vec<usize>) {
        let mut keys = Vec::new();
        let mut partners = Vec::new();
        let nearest = |target: f64, taken: &[usize]| {
            (0..self.phase.len())
                .filter(|t| !taken.contains(t))
                .min_by(|&a, &b| {
                    (self.phase[a] - target).abs().total_cmp(&(self.phase[b] - target).abs())
                })
                .unwrap()
        };
        for i in 0..m {
            let turn = 1 + (i * 3 + shift) % 5;
            let target = TAU * (turn as f64 + i as f64 / m as f64);
            let key = nearest(target, &[]);
            keys.push(key);
            partners.push(nearest(self.phase[key] + TAU, &[]));
        }
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by_key(|&i| keys[i]);
        (order.iter().map(|&i| keys[i]).collect(), order.iter().map(|&i| partners[i]).collect())
    }

    /// The pose's curves at a frame: what joints do over a stride.
    fn pose(&self, t: usize) -> [f64; 4] {
        let psi = self.phase[t] / 2.0;
        [
            psi.sin(),
            psi.cos(),
            (2.0 * psi).sin() * 0.5 + 0.8 * psi.sin(),
            (psi + 1.0).sin() + 0.3 * (3.0 * psi).cos(),
        ]
    }
}

/// What a clip's weights make of the planted pose.
struct Outcome {
    /// Root mean square over frames of the error of the pose's four curves together (their own
    /// root mean square is about 1.6).
    rms: f64,
    /// Largest change of the error from one frame to the next: the pop at a switch.
    pop: f64,
    /// Frames whose model does not hold the true place on the cycle.
    wrong_half: Vec<usize>,
    conflicts: usize,
}

impl Planted {
    fn run(&self, m: usize, shift: usize, settings: Switching) -> Outcome {
        let (keys, partners) = self.keys(m, shift);
        let method = Method::Switching(Switching { partners: partners.clone(), ..settings });
        let w = weights(&self.coefficients, &keys, &method, &KernelSettings::default()).unwrap();
        let poses: Vec<usize> = keys.iter().chain(&partners).copied().collect();
        let mut errors = Vec::new();
        let mut wrong_half = Vec::new();
        for t in 0..self.phase.len() {
            let mut error = self.pose(t).map(|x| -x);
            for (&weight, &frame) in w.row(t).iter().zip(&poses) {
                for (e, x) in error.iter_mut().zip(self.pose(frame)) {
                    *e += weight * x;
                }
            }
            errors.push(error);
            if !self.model_holds(t, m, &poses, w.active_model(t).unwrap()) {
                wrong_half.push(t);
            }
        }
        let square = |e: &[f64; 4]| e.iter().map(|x| x * x).sum::<f64>();
        let jump = |w: &[[f64; 4]]| square(&[0, 1, 2, 3].map(|i| w[1][i] - w[0][i])).sqrt();
        Outcome {
            rms: (errors.iter().map(square).sum::<f64>() / errors.len() as f64).sqrt(),
            pop: errors.windows(2).map(jump).fold(0.0, f64::max),
            wrong_half,
            conflicts: w.phase_conflicts().len(),
        }
    }

    /// Whether the true place of frame `t` on the cycle of 2m silhouettes lies within a model's m,
    /// or less than half a slot outside. Model 0 begins with the pose of the earliest key.
    fn model_holds(&self, t: usize, m: usize, poses: &[usize], model: usize) -> bool {
        let earliest = poses[..m].iter().min().copied().unwrap();
        let slot_width = TAU / m as f64;
        let place = (self.phase[t] - self.phase[earliest]) / slot_width - (model * m / 2) as f64;
        (place + 0.5).rem_euclid(2.0 * m as f64) < m as f64
    }
}

fn known_period() -> Switching {
    Switching { step_period_frames: Some(PERIOD), ..Switching::default() }
}

/// The switch rule and cross-fade of the paper.
fn papers() -> Switching {
    Switching { switch_at: SwitchAt::LastSilhouette, cross_fade_slots: 0.0, ..known_period() }
}

#[test]
fn the_half_of_the_stride_is_right_at_every_frame() {
    for m in [4, 6, 8] {
        for noise in [0.0, 0.1, 0.2, 0.3] {
            for seed in 0..10 {
                for direction in [1.0, -1.0] {
                    let p = Planted::new(100, noise, direction, 0.1, seed);
                    for settings in [known_period(), Switching::default()] {
                        let o = p.run(m, seed as usize, settings);
                        assert_eq!(o.wrong_half, [0; 0], "m {m} noise {noise} seed {seed}");
                        assert_eq!(o.conflicts, 0);
                    }
                }
            }
        }
    }
}

#[test]
fn the_halves_do_not_slip_over_eighty_cycles() {
    for seed in 0..10 {
        let p = Planted::new(1000, 0.3, 1.0, 0.1, seed);
        let o = p.run(4, seed as usize, known_period());
        assert_eq!(o.wrong_half, [0; 0], "seed {seed}");
    }
}

#[test]
fn frames_lost_at_the_centre_or_far_off_cost_no_half() {
    for seed in 0..10 {
        let mut p = Planted::new(200, 0.1, -1.0, 0.1, seed);
        let mut values: Vec<f64> =
            (0..200).flat_map(|t| p.coefficients.point(t).to_vec()).collect();
        for t in (70..76).chain([100, 130, 131, 150]) {
            // The silhouette of a lost animal: near the mean, on the wrong side.
            values[2 * t] *= -0.1;
            values[2 * t + 1] *= -0.1;
        }
        p.coefficients = Coefficients::from_rows(200, 2, values).unwrap();
        let wrong = p.run(4, seed as usize, known_period()).wrong_half;
        let away = |t: &usize| !(69..78).contains(t);
        assert_eq!(wrong.into_iter().filter(away).collect::<Vec<_>>(), [0; 0], "seed {seed}");
    }
}

#[test]
fn the_defaults_are_no_worse_than_the_papers_rule_and_smoother() {
    let mean = |m: usize, settings: &Switching| {
        let outcomes: Vec<Outcome> = (0..10)
            .map(|seed| {
                Planted::new(100, 0.1, 1.0, 0.1, seed).run(m, seed as usize, settings.clone())
            })
            .collect();
        let n = outcomes.len() as f64;
        let rms = outcomes.iter().map(|o| o.rms).sum::<f64>() / n;
        (rms, outcomes.iter().map(|o| o.pop).sum::<f64>() / n)
    };
    for (m, rms_share, pop_share) in [(4, 1.02, 1.05), (6, 0.85, 0.7), (8, 0.65, 0.5)] {
        let (paper, ours) = (mean(m, &papers()), mean(m, &known_period()));
        assert!(ours.0 < rms_share * paper.0, "m {m}: {ours:?} {paper:?}");
        assert!(ours.1 < pop_share * paper.1, "m {m}: {ours:?} {paper:?}");
    }
}

#[test]
fn without_switching_the_pose_is_lost() {
    // The reason for all this: one model cannot tell the halves apart.
    let p = Planted::new(100, 0.05, 1.0, 0.1, 3);
    let (keys, _) = p.keys(4, 0);
    let w = weights(&p.coefficients, &keys, &Method::Rbf, &KernelSettings::default()).unwrap();
    let error = |t: usize| -> f64 {
        (0..4)
            .map(|c| {
                let got: f64 = (0..4).map(|k| w.row(t)[k] * p.pose(keys[k])[c]).sum();
                (got - p.pose(t)[c]).powi(2)
            })
            .sum()
    };
    let rms = ((0..100).map(error).sum::<f64>() / 100.0).sqrt();
    assert!(rms > 3.0 * p.run(4, 0, known_period()).rms, "{rms}");
}

#[test]
fn every_key_and_partner_frame_has_its_own_pose() {
    for m in [2, 4, 6, 8, 10] {
        for settings in [papers(), known_period(), Switching::default()] {
            for seed in 0..5 {
                let p = Planted::new(100, 0.1, 1.0, 0.1, seed);
                let (keys, partners) = p.keys(m, seed as usize);
                let method =
                    Method::Switching(Switching { partners: partners.clone(), ..settings.clone() });
                let w =
                    weights(&p.coefficients, &keys, &method, &KernelSettings::default()).unwrap();
                for (k, &t) in keys.iter().chain(&partners).enumerate() {
                    for (i, &x) in w.row(t).iter().enumerate() {
                        let expected = if i == k { 1.0 } else { 0.0 };
                        assert!((x - expected).abs() < 1e-6, "m {m} frame {t} pose {i}: {x}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_hard_switch_leaves_weights_on_one_model_only_and_models_follow_in_order() {
    let p = Planted::new(100, 0.1, 1.0, 0.1, 1);
    let (keys, partners) = p.keys(4, 1);
    let method = Method::Switching(Switching { partners, ..papers() });
    let w = weights(&p.coefficients, &keys, &method, &KernelSettings::default()).unwrap();
    for t in 0..100 {
        assert!(w.row(t).iter().filter(|x| **x != 0.0).count() <= 4);
        if t > 0 {
            let (a, b) = (w.active_model(t - 1).unwrap(), w.active_model(t).unwrap());
            assert!(b == a || b == (a + 1) % 4, "{a} then {b}");
        }
    }
    let visited: std::collections::BTreeSet<_> = (0..100).map(|t| w.active_model(t)).collect();
    assert_eq!(visited.len(), 4);
}

#[test]
fn a_partner_of_the_same_half_is_reported_and_still_exact() {
    let p = Planted::new(100, 0.05, 1.0, 0.0, 1);
    let (keys, mut partners) = p.keys(4, 0);
    // Two steps away instead of one: the same pose as the key's own.
    let key = keys[2];
    partners[2] = if key > 40 { key - 24 } else { key + 24 };
    let method = Method::Switching(Switching { partners: partners.clone(), ..known_period() });
    let w = weights(&p.coefficients, &keys, &method, &KernelSettings::default()).unwrap();
    assert_eq!(w.phase_conflicts(), [partners[2]]);
    assert!((w.row(partners[2])[4 + 2] - 1.0).abs() < 1e-6);
    // The phase is believed again half a step away.
    let good = Method::Switching(Switching { partners: p.keys(4, 0).1, ..known_period() });
    let good = weights(&p.coefficients, &keys, &good, &KernelSettings::default()).unwrap();
    for t in (0..100_usize).filter(|t| t.abs_diff(partners[2]) > 9) {
        // The knots moved a little, so a switch may be made a frame earlier or later.
        let apart = (w.active_model(t).unwrap() + 4 - good.active_model(t).unwrap()) % 4;
        assert_ne!(apart, 2, "frame {t} is in the wrong half");
    }
    assert!((w.row(key)[2] - 1.0).abs() < 1e-6);
}

#[test]
fn the_start_model_can_swap_the_halves() {
    let p = Planted::new(100, 0.0, 1.0, 0.0, 1);
    let (keys, partners) = p.keys(4, 0);
    let run = |start_model| {
        let partners = partners.clone();
        let method = Method::Switching(Switching { partners, start_model, ..known_period() });
        weights(&p.coefficients, &keys, &method, &KernelSettings::default()).unwrap()
    };
    let natural = run(None);
    let first = natural.active_model(0).unwrap();
    assert_eq!(run(Some(first)), natural);
    let swapped = run(Some((first + 2) % 4));
    for t in 0..100 {
        assert_eq!(swapped.active_model(t), natural.active_model(t).map(|m| (m + 2) % 4));
    }
}

#[test]
fn unfit_requests_are_refused() {
    let p = Planted::new(100, 0.0, 1.0, 0.0, 1);
    let (keys, partners) = p.keys(4, 0);
    let refuse = |keys: &[usize], settings: Switching| {
        let method = Method::Switching(settings);
        weights(&p.coefficients, keys, &method, &KernelSettings::default()).unwrap_err()
    };
    let good = Switching { partners: partners.clone(), ..Switching::default() };
    let fewer = Switching { partners: partners[..3].to_vec(), ..good.clone() };
    assert!(matches!(refuse(&keys, fewer.clone()), Error::PartnerCount { keys: 4, partners: 3 }));
    assert!(matches!(refuse(&keys[..3], fewer), Error::OddKeysForSwitching { keys: 3 }));
    assert!(matches!(refuse(&[], Switching::default()), Error::NoKeys));
    let twice = Switching { partners: vec![keys[0]; 4], ..good.clone() };
    assert!(matches!(refuse(&keys, twice), Error::KeyListedTwice { .. }));
    for bad in [
        Switching { step_period_frames: Some(1.0), ..good.clone() },
        Switching { start_model: Some(4), ..good.clone() },
        Switching { cross_fade_slots: 0.6, ..good.clone() },
    ] {
        assert!(matches!(refuse(&keys, bad), Error::KernelSetting { .. }));
    }
    let beyond = Switching { partners: vec![97, 98, 99, 100], ..good };
    assert!(matches!(refuse(&[1, 2, 3, 4], beyond), Error::KeyFrameOutOfRange { frame: 100, .. }));
}
