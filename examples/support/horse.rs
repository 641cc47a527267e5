//! Key points that a network found on a filmed horse, and how well weights of key frames predict them.

#![allow(dead_code, reason = "each example uses a part")]

use std::path::Path;

use anyhow::Context;
use muybridge::gait::{GaitPhase, Symmetry};
use muybridge::interpolate::{Weights, weights_over_phase};
use muybridge::keys::KeySettings;
use muybridge::mask::Mask;
use muybridge::numeric::{Coefficients, Harmonics};
use muybridge::pipeline::{
    MaskAnalysis, OverPhase, Trends, analyse_masks, keys_by_phase, phase_weights,
};
use muybridge::shot::PhaseTable;
use muybridge::spectrum::{Gait, Settings};

use crate::common::median;

/// Points count from this likelihood on.
pub(crate) const LEAST_LIKELIHOOD: f64 = 0.9;

/// Keys that a horse is given.
pub(crate) const KEYS: usize = 8;

/// Frames a second of the videos.
pub(crate) const FPS: f64 = 15.0;

/// One part over the frames: x, y, likelihood.
pub(crate) struct Part {
    pub(crate) name: String,
    pub(crate) at: Vec<[f64; 3]>,
}

/// The masks of a shot's first frames.
pub(crate) fn read_masks(folder: &Path, frames: usize) -> anyhow::Result<Vec<Mask>> {
    (0..frames)
        .map(|t| {
            let path = folder.join(format!("{t:06}.png"));
            Ok(Mask::from_image_bytes(&path, &std::fs::read(&path)?)?)
        })
        .collect()
}

/// What the masks say of a horse that is known to walk.
pub(crate) fn analysed(masks: &[Mask]) -> anyhow::Result<MaskAnalysis> {
    let settings = Settings { gait: Gait::Walk, ..Settings::default() };
    Ok(analyse_masks(masks, FPS, 5, Trends::default(), &settings)?)
}

/// The keys that the tool chooses among the frames whose pose can be told, and their weights.
pub(crate) fn keyed(
    phase: &PhaseTable,
    legs: &Legs,
    ridge: f64,
) -> anyhow::Result<(Vec<usize>, Weights)> {
    let wanted = KeySettings { keys: KEYS, exclude: legs.unsure(), ..KeySettings::default() };
    let keys = keys_by_phase(phase, &wanted, false)?.frames;
    let weights = phase_weights(phase, &keys, OverPhase { ridge, ..OverPhase::default() })?;
    Ok((keys, weights))
}

/// The leg points, relative to the withers.
pub(crate) struct Legs {
    /// For each point its place in every frame in which it is sure.
    points: Vec<Vec<Option<[f64; 2]>>>,
    frames: usize,
}

impl Legs {
    pub(crate) fn of(parts: &[Part], scale: Scale) -> Self {
        let lengths = lengths_px(parts, scale);
        let points: Vec<_> = legs(parts).map(|part| relative(part, parts, &lengths)).collect();
        Self { frames: points.first().map_or(0, Vec::len), points }
    }

    /// The phase that the points themselves tell, of a stride of about so many frames.
    pub(crate) fn own_phase(&self, stride_frames: f64) -> anyhow::Result<GaitPhase> {
        let points = self.bridged();
        let shares = vec![1.0; points.components()];
        let used = vec![true; points.frames()];
        let frequency = Some(1.0 / stride_frames);
        Ok(GaitPhase::measure(&points, &shares, &used, Symmetry::Asymmetric, frequency)?)
    }

    /// The same without the straight line over the clip.
    pub(crate) fn level(&self) -> Self {
        let level = |point: &Vec<Option<[f64; 2]>>| -> Vec<Option<[f64; 2]>> {
            let sure: Vec<(f64, [f64; 2])> =
                point.iter().enumerate().filter_map(|(t, p)| Some((t as f64, (*p)?))).collect();
            let count = sure.len() as f64;
            let middle = sure.iter().map(|s| s.0).sum::<f64>() / count;
            let spread: f64 = sure.iter().map(|s| (s.0 - middle).powi(2)).sum();
            let slope =
                [0, 1].map(|c| sure.iter().map(|s| (s.0 - middle) * s.1[c]).sum::<f64>() / spread);
            let off = |t: usize, p: [f64; 2]| [0, 1].map(|c| p[c] - slope[c] * (t as f64 - middle));
            point.iter().enumerate().map(|(t, p)| p.map(|p| off(t, p))).collect()
        };
        Self { points: self.points.iter().map(level).collect(), frames: self.frames }
    }

    /// Frames in which a tenth of the points or more are not sure: nobody could tell their pose.
    pub(crate) fn unsure(&self) -> Vec<usize> {
        let missing = |t: &usize| self.points.iter().filter(|p| p[*t].is_none()).count();
        (0..self.frames).filter(|t| 10 * missing(t) >= self.points.len()).collect()
    }

    /// Mean distance from truth of a guess, over the frames that are not keys.
    fn mean_distance(
        &self,
        keys: &[usize],
        guess: impl Fn(&[Option<[f64; 2]>], usize) -> Option<[f64; 2]>,
    ) -> f64 {
        let (mut sum, mut count) = (0.0, 0_usize);
        for point in &self.points {
            for t in (0..self.frames).filter(|t| !keys.contains(t)) {
                if let (Some(truth), Some(guess)) = (point[t], guess(point, t)) {
                    sum += distance(truth, guess);
                    count += 1;
                }
            }
        }
        sum / count as f64
    }

    pub(crate) fn error(&self, keys: &[usize], weights: &Weights) -> f64 {
        self.mean_distance(keys, |point, t| predicted(point, keys, weights.row(t)))
    }

    pub(crate) fn mean_error(&self) -> f64 {
        self.mean_distance(&[], |point, _| {
            let seen: Vec<[f64; 2]> = point.iter().flatten().copied().collect();
            Some([0, 1].map(|c| seen.iter().map(|p| p[c]).sum::<f64>() / seen.len() as f64))
        })
    }

    /// One row a frame, gaps bridged, the mean of each coordinate taken off.
    pub(crate) fn bridged(&self) -> Coefficients {
        let columns: Vec<Vec<f64>> = (self.points.iter())
            .flat_map(|point| [0, 1].map(|c| bridged_column(point, c)))
            .collect();
        Coefficients::from_columns(&columns).unwrap_or_else(|| unreachable!("equal lengths"))
    }

    /// Error of the least-squares Fourier series (five harmonics of the stride) of every point.
    pub(crate) fn cycle_error(&self, cycles: &[f64]) -> anyhow::Result<f64> {
        let series: Vec<Harmonics> = (self.points.iter())
            .map(|point| {
                let values: Vec<f64> = point.iter().flat_map(|p| p.unwrap_or_default()).collect();
                let sure: Vec<f64> =
                    point.iter().map(|p| f64::from(u8::from(p.is_some()))).collect();
                Harmonics::fit(cycles, &values, 2, &sure, 5).context("too few points")
            })
            .collect::<anyhow::Result<_>>()?;
        let (mut sum, mut count) = (0.0, 0_usize);
        for (point, series) in self.points.iter().zip(&series) {
            for (t, truth) in point.iter().enumerate() {
                let Some(truth) = truth else { continue };
                let (value, _) = series.at(cycles[t]);
                sum += distance(*truth, [value[0], value[1]]);
                count += 1;
            }
        }
        Ok(sum / count as f64)
    }

    fn error_over(&self, cycles: &[f64], keys: &[usize]) -> anyhow::Result<f64> {
        Ok(self.error(keys, &weights_over_phase(cycles, &[], keys)?))
    }

    /// Frames nearest to evenly spaced phases, from the given offset of sixteen.
    fn even_keys(cycles: &[f64], offset: usize) -> Vec<usize> {
        let mut keys: Vec<usize> = Vec::new();
        for k in 0..KEYS {
            let wanted = (k as f64 + offset as f64 / 16.0) / KEYS as f64;
            let away = |t: usize| ((cycles[t] - wanted + 0.5).rem_euclid(1.0) - 0.5).abs();
            let nearest = (0..cycles.len())
                .filter(|t| !keys.contains(t))
                .min_by(|&a, &b| away(a).total_cmp(&away(b)));
            keys.extend(nearest);
        }
        keys
    }

    pub(crate) fn usual_keys(&self, cycles: &[f64]) -> anyhow::Result<f64> {
        let errors = (0..16)
            .map(|offset| self.error_over(cycles, &Self::even_keys(cycles, offset)))
            .collect::<anyhow::Result<Vec<f64>>>()?;
        Ok(errors.iter().sum::<f64>() / errors.len() as f64)
    }

    /// The keys of the smallest error, by exchanging one at a time from evenly spaced ones: who chooses
    /// so has seen the answer.
    pub(crate) fn best_keys(&self, cycles: &[f64]) -> anyhow::Result<(f64, Vec<usize>)> {
        let mut best = (f64::INFINITY, Vec::new());
        for offset in (0..16).step_by(4) {
            let mut keys = Self::even_keys(cycles, offset);
            let mut error = self.error_over(cycles, &keys)?;
            loop {
                let before = error;
                for k in 0..keys.len() {
                    for t in 0..self.frames {
                        if keys.contains(&t) {
                            continue;
                        }
                        let old = std::mem::replace(&mut keys[k], t);
                        let tried = self.error_over(cycles, &keys)?;
                        if tried < error {
                            error = tried;
                        } else {
                            keys[k] = old;
                        }
                    }
                }
                if error >= before {
                    break;
                }
            }
            if error < best.0 {
                best = (error, keys);
            }
        }
        best.1.sort_unstable();
        Ok(best)
    }
}

fn bridged_column(point: &[Option<[f64; 2]>], c: usize) -> Vec<f64> {
    let sure: Vec<(usize, f64)> =
        point.iter().enumerate().filter_map(|(t, p)| Some((t, (*p)?[c]))).collect();
    let mean = sure.iter().map(|s| s.1).sum::<f64>() / sure.len().max(1) as f64;
    (0..point.len())
        .map(|t| {
            let after = sure.partition_point(|s| s.0 < t);
            let (Some(b), Some(a)) = (
                sure.get(after).or(sure.last()),
                after.checked_sub(1).and_then(|k| sure.get(k)).or(sure.first()),
            ) else {
                return 0.0;
            };
            let gap = b.0.saturating_sub(a.0) as f64;
            let share =
                if gap > 0.0 { ((t as f64 - a.0 as f64) / gap).clamp(0.0, 1.0) } else { 0.0 };
            a.1 + share * (b.1 - a.1) - mean
        })
        .collect()
}

/// The table of key points.
pub(crate) fn read(path: &Path) -> anyhow::Result<Vec<Part>> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().context("empty table")?.split(',').collect();
    let mut parts: Vec<Part> = header[1..]
        .chunks_exact(3)
        .map(|c| Part { name: c[0].trim_end_matches("_x").to_owned(), at: Vec::new() })
        .collect();
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(0.0)).collect();
        for (part, cell) in parts.iter_mut().zip(cells[1..].chunks_exact(3)) {
            part.at.push([cell[0], cell[1], cell[2]]);
        }
    }
    Ok(parts)
}

pub(crate) fn part<'a>(parts: &'a [Part], name: &str) -> &'a Part {
    parts.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("no part {name}"))
}

fn legs(parts: &[Part]) -> impl Iterator<Item = &Part> {
    parts
        .iter()
        .filter(|p| ["Knee", "Fetlock", "Hoof", "Hock"].iter().any(|joint| p.name.ends_with(joint)))
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// How the distance from withers to hip of a frame is told.
#[derive(Clone, Copy)]
pub(crate) enum Scale {
    /// The straight line through the logarithms of all distances seen.
    Steady,
    /// The middle of the five nearest distances seen.
    Nearest,
}

/// Distance from withers to hip in each frame, pixels.
fn lengths_px(parts: &[Part], scale: Scale) -> Vec<f64> {
    let (withers, hip) = (part(parts, "Withers"), part(parts, "Hip"));
    let seen: Vec<(f64, f64)> = (withers.at.iter().zip(&hip.at).enumerate())
        .filter(|(_, (w, h))| w[2].min(h[2]) >= LEAST_LIKELIHOOD)
        .map(|(t, (w, h))| (t as f64, distance([w[0], w[1]], [h[0], h[1]]).ln()))
        .collect();
    let frames = (0..withers.at.len()).map(|t| t as f64);
    match scale {
        Scale::Steady => {
            let pairs = seen
                .iter()
                .enumerate()
                .flat_map(|(k, a)| seen[k + 1..].iter().map(move |b| (b.1 - a.1) / (b.0 - a.0)));
            let slope = median(&pairs.collect::<Vec<_>>());
            let start = median(&seen.iter().map(|s| s.1 - slope * s.0).collect::<Vec<_>>());
            frames.map(|t| (start + slope * t).exp()).collect()
        }
        Scale::Nearest => frames
            .map(|t| {
                let mut near = seen.clone();
                near.sort_by(|a, b| (a.0 - t).abs().total_cmp(&(b.0 - t).abs()));
                median(&near.iter().take(5).map(|s| s.1).collect::<Vec<_>>()).exp()
            })
            .collect(),
    }
}

/// A part relative to the withers in withers-hip lengths, where both are sure.
fn relative(own: &Part, parts: &[Part], lengths_px: &[f64]) -> Vec<Option<[f64; 2]>> {
    let sure = |p: &[f64; 3]| p[2] >= LEAST_LIKELIHOOD;
    (own.at.iter().zip(&part(parts, "Withers").at).zip(lengths_px))
        .map(|((p, w), length)| {
            (sure(p) && sure(w)).then(|| [(p[0] - w[0]) / length, (p[1] - w[1]) / length])
        })
        .collect()
}

/// The weighted sum of the keys in which the point is seen, about their mean.
fn predicted(points: &[Option<[f64; 2]>], keys: &[usize], weights: &[f64]) -> Option<[f64; 2]> {
    let known: Vec<([f64; 2], f64)> =
        keys.iter().zip(weights).filter_map(|(&k, w)| Some((points[k]?, *w))).collect();
    if known.len() < 2 {
        return None;
    }
    let mean = [0, 1].map(|c| known.iter().map(|k| k.0[c]).sum::<f64>() / known.len() as f64);
    Some([0, 1].map(|c| mean[c] + known.iter().map(|k| k.1 * (k.0[c] - mean[c])).sum::<f64>()))
}

/// Root mean square of the difference of two phases, whichever their zeros.
pub(crate) fn phase_rms(a: &[f64], b: &[f64]) -> f64 {
    let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    (off.iter().map(|o| (o - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
}
