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

#[test]
fn measure() {
    for m in [4, 6, 8] {
        for noise in [0.0, 0.1, 0.2, 0.3] {
            let mut line = format!("m {m} noise {noise}: ");
            for at in [SwitchAt::LastSilhouette, SwitchAt::Middle] {
                for fade in [0.0, 0.25, 0.5] {
                    let (mut sum, mut count, mut wrong, mut conflicts) = (0.0, 0, 0, 0);
                    let mut worst_step = 0.0_f64;
                    for seed in 0..20 {
                        for direction in [1.0, -1.0] {
                            let p = Planted::new(100, noise, direction, 0.1, seed);
                            let (keys, partners) = p.keys(m, seed as usize);
                            let switching = Switching {
                                partners: partners.clone(),
                                step_period_frames: Some(PERIOD),
                                switch_at: at,
                                cross_fade_slots: fade,
                                ..Switching::default()
                            };
                            let w = weights(
                                &p.coefficients,
                                &keys,
                                &Method::Switching(switching),
                                &KernelSettings::default(),
                            )
                            .unwrap();
                            conflicts += w.phase_conflicts().len();
                            let poses: Vec<usize> = keys.iter().chain(&partners).copied().collect();
                            let mut last = [0.0; 4];
                            for t in 0..100 {
                                let mut got = [0.0; 4];
                                for (k, &f) in poses.iter().enumerate() {
                                    for (g, x) in got.iter_mut().zip(p.pose(f)) {
                                        *g += w.row(t)[k] * x;
                                    }
                                }
                                let e: f64 = got
                                    .iter()
                                    .zip(p.pose(t))
                                    .map(|(a, b)| (a - b).powi(2))
                                    .sum::<f64>();
                                sum += e;
                                count += 1;
                                if e.sqrt() > 1.5 {
                                    wrong += 1;
                                }
                                if t > 0 {
                                    worst_step += got
                                        .iter()
                                        .zip(last)
                                        .map(|(a, b)| (a - b).powi(2))
                                        .sum::<f64>();
                                }
                                last = got;
                            }
                        }
                    }
                    line += &format!(
                        "{:.3}/{:.2} w{wrong} c{conflicts} | ",
                        (sum / count as f64).sqrt(),
                        (worst_step / count as f64).sqrt()
                    );
                }
            }
            eprintln!("{line}");
        }
    }
}
