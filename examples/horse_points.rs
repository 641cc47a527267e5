//! Real horses: how well the weights of eight key frames predict key points that a network found in
//! the other frames. `cargo run --release --example horse_points -- POINTS.csv [MASKS_DIR [RIDGE]]`
//!
//! POINTS.csv has columns PART_x, PART_y, PART_likelihood (pixels); MASKS_DIR the masks of a shot.
//! Without masks the figure's lines between the points are drawn as strokes, as an artist would
//! sketch them. Weights see masks only. Points count with a likelihood of .9 or more, relative to
//! the withers, in units of the distance from withers to hip; the error is the mean distance
//! over frames that are not keys and over the points of the legs.
//!
//! Both ends of that distance are sure in a third to two thirds of the frames only, and it scatters by 4 to 13 % there, which would
//! move every leg point of a frame alike. The horse comes nearer or goes away steadily, so the distance is taken from the
//! straight line through the logarithms of all that are seen (Theil and Sen: medians). For comparison the errors are given with
//! the middle of the five nearest distances as well.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use anyhow::{Context, bail};
use muybridge::gait::{GaitPhase, Symmetry};
use muybridge::interpolate::weights_over_phase;
use muybridge::keys::KeySettings;
use muybridge::mask::Mask;
use muybridge::numeric::{Coefficients, Harmonics};
use muybridge::pipeline::{OverPhase, Trends, analyse_masks, keys_by_phase, phase_weights};
use muybridge::spectrum::{Gait, Settings};

#[path = "common/mod.rs"]
mod common;

use common::median;

const LEAST_LIKELIHOOD: f64 = 0.9;
const KEYS: usize = 8;
const FPS: f64 = 15.0;

/// Width of the sketch, pixels, and the radius of its strokes.
const SKETCH_WIDTH: f64 = 480.0;
const STROKE_PX: f64 = 5.0;

/// Lines of the sketched figure.
const LINES: [&[&str]; 5] = [
    &["Nostril", "Poll", "Withers", "Hip"],
    &["Withers", "RightKnee", "RightFrontFetlock", "RightFrontHoof"],
    &["Withers", "LeftKnee", "LeftFrontFetlock", "LeftFrontHoof"],
    &["Hip", "RightHock", "RightHindFetlock", "RightHindHoof"],
    &["Hip", "LeftHock", "LeftHindFetlock", "LeftHindHoof"],
];

/// One part over the frames: x, y, likelihood.
struct Part {
    name: String,
    at: Vec<[f64; 3]>,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let ridge = match arguments.get(2) {
        Some(ridge) => ridge.parse().context("the ridge is a number")?,
        None => 0.0,
    };
    let points = arguments.first().context("usage: horse_points POINTS.csv [MASKS_DIR]")?;
    let parts = read(Path::new(points))?;
    let frames = parts.first().map_or(0, |p| p.at.len());
    let masks = match arguments.get(1) {
        Some(folder) => (0..frames)
            .map(|t| {
                let path = Path::new(folder).join(format!("{t:06}.png"));
                Ok(Mask::from_image_bytes(&path, &std::fs::read(&path)?)?)
            })
            .collect::<anyhow::Result<Vec<_>>>()?,
        None => sketched(&parts, frames),
    };
    let settings = Settings { gait: Gait::Walk, ..Settings::default() };
    let found = analyse_masks(&masks, FPS, 5, Trends::default(), &settings)?;
    let Some(gait) = &found.gait else { bail!("no gait phase") };
    println!(
        "{frames} frames, stride {:.2} frames, {} (odd lines {:.3}, at most {:.3}), {:.0} % explained by the cycle, {} masks used",
        gait.stride_frames(),
        gait.stride.repeats.name(),
        gait.stride.odd_share,
        gait.stride.odd_share_at_most,
        100.0 * gait.explained_share,
        found.used.iter().filter(|u| **u).count()
    );
    let Some(phase) = found.phase_table() else { bail!("no gait phase") };
    let legs = Legs::of(&parts, Scale::Steady);
    let wanted = KeySettings { keys: KEYS, exclude: legs.unsure(), ..KeySettings::default() };
    let chosen = keys_by_phase(&phase, &wanted, false)?;
    let weights =
        phase_weights(&phase, &chosen.frames, OverPhase { ridge, ..OverPhase::default() })?;
    println!("the view drifts: {}", phase.drifts());
    println!("keys {:?}", chosen.frames);
    let mean = legs.mean_error();
    let report = |what: &str, error: f64| {
        println!(
            "{what}: {error:.4} withers-hip lengths, {:.2} of the mean pose's {mean:.4}",
            error / mean
        );
    };
    let rows: Vec<Vec<f64>> = (0..frames).map(|t| weights.row(t).to_vec()).collect();
    report("leg points from the keys", legs.error(&chosen.frames, &rows));
    let nearest = Legs::of(&parts, Scale::Nearest);
    let (error, of) = (nearest.error(&chosen.frames, &rows), nearest.mean_error());
    println!(
        "the same in units of the five nearest distances: {:.2} of the mean pose's {of:.4}",
        error / of
    );
    bounds(&legs, &phase.stride_cycles, gait.stride_frames(), &report)
}

/// What eight keys could do at best, told by the key points themselves.
fn bounds(
    legs: &Legs,
    seen_phase: &[f64],
    stride_frames: f64,
    report: &dyn Fn(&str, f64),
) -> anyhow::Result<()> {
    let points = legs.bridged();
    let shares = vec![1.0; points.components()];
    let used = vec![true; points.frames()];
    let own = GaitPhase::measure(
        &points,
        &shares,
        &used,
        Symmetry::Asymmetric,
        Some(1.0 / stride_frames),
    )?;
    println!(
        "stride by the points {:.2} frames; their own cycle explains {:.0} % of them",
        own.stride_frames(),
        100.0 * own.explained_share
    );
    let off: Vec<f64> = own.stride_cycles.iter().zip(seen_phase).map(|(a, b)| a - b).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    let rms = (off.iter().map(|o| (o - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt();
    println!("phase of the silhouettes against that of the points: {rms:.3} strides rms");
    report(
        "the points' own mean cycle (all frames, own phase)",
        legs.cycle_error(&own.stride_cycles)?,
    );
    report("the points' mean cycle over the silhouettes' phase", legs.cycle_error(seen_phase)?);
    let level = legs.level();
    report(
        "the points' own mean cycle and a straight line over the clip",
        level.cycle_error(&own.stride_cycles)?,
    );
    for (what, cycles) in [("own", &own.stride_cycles[..]), ("silhouettes'", seen_phase)] {
        let (best, _) = level.best_keys(cycles)?;
        report(&format!("the best keys, {what} phase, the line taken off by hand"), best);
    }
    for (what, cycles) in [("own", &own.stride_cycles[..]), ("silhouettes'", seen_phase)] {
        let (usual, (best, keys)) = (legs.usual_keys(cycles)?, legs.best_keys(cycles)?);
        report(&format!("evenly spaced keys, {what} phase, mean over 16 offsets"), usual);
        report(&format!("the best keys by the points, {what} phase ({keys:?})"), best);
    }
    Ok(())
}

/// The leg points, relative to the withers.
struct Legs {
    /// For each point its place in every frame in which it is sure.
    points: Vec<Vec<Option<[f64; 2]>>>,
    frames: usize,
}

impl Legs {
    fn of(parts: &[Part], scale: Scale) -> Self {
        let lengths = lengths_px(parts, scale);
        let points: Vec<_> = legs(parts).map(|part| relative(part, parts, &lengths)).collect();
        Self { frames: points.first().map_or(0, Vec::len), points }
    }

    /// The same without the straight line over the clip.
    fn level(&self) -> Self {
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
    fn unsure(&self) -> Vec<usize> {
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

    fn error(&self, keys: &[usize], weights: &[Vec<f64>]) -> f64 {
        self.mean_distance(keys, |point, t| predicted(point, keys, &weights[t]))
    }

    fn mean_error(&self) -> f64 {
        self.mean_distance(&[], |point, _| {
            let seen: Vec<[f64; 2]> = point.iter().flatten().copied().collect();
            Some([0, 1].map(|c| seen.iter().map(|p| p[c]).sum::<f64>() / seen.len() as f64))
        })
    }

    /// One row a frame, gaps bridged, the mean of each coordinate taken off.
    fn bridged(&self) -> Coefficients {
        let columns: Vec<Vec<f64>> = (self.points.iter())
            .flat_map(|point| [0, 1].map(|c| bridged_column(point, c)))
            .collect();
        Coefficients::from_columns(&columns).unwrap_or_else(|| unreachable!("equal lengths"))
    }

    /// Error of the least-squares Fourier series (five harmonics of the stride) of every point.
    fn cycle_error(&self, cycles: &[f64]) -> anyhow::Result<f64> {
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
        let weights = weights_over_phase(cycles, &[], keys)?;
        let rows: Vec<Vec<f64>> = (0..self.frames).map(|t| weights.row(t).to_vec()).collect();
        Ok(self.error(keys, &rows))
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

    fn usual_keys(&self, cycles: &[f64]) -> anyhow::Result<f64> {
        let errors = (0..16)
            .map(|offset| self.error_over(cycles, &Self::even_keys(cycles, offset)))
            .collect::<anyhow::Result<Vec<f64>>>()?;
        Ok(errors.iter().sum::<f64>() / errors.len() as f64)
    }

    /// The keys of the smallest error, by exchanging one at a time from evenly spaced ones: who chooses
    /// so has seen the answer.
    fn best_keys(&self, cycles: &[f64]) -> anyhow::Result<(f64, Vec<usize>)> {
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

fn read(path: &Path) -> anyhow::Result<Vec<Part>> {
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

fn part<'a>(parts: &'a [Part], name: &str) -> &'a Part {
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
enum Scale {
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

/// The figure's lines as masks; what is not sure is bridged in time.
fn sketched(parts: &[Part], frames: usize) -> Vec<Mask> {
    let all = parts.iter().flat_map(|p| &p.at);
    let (right, bottom) = all.fold((1.0_f64, 1.0_f64), |m, p| (m.0.max(p[0]), m.1.max(p[1])));
    let scale = SKETCH_WIDTH / right;
    let margin = 2.0 * STROKE_PX;
    let size = |v: f64| (v * scale + 2.0 * margin) as usize;
    (0..frames)
        .map(|t| {
            let mut mask = Mask::new(size(right), size(bottom));
            for line in LINES {
                let points: Vec<(f64, f64)> = line
                    .iter()
                    .filter_map(|name| bridged(part(parts, name), t))
                    .map(|p| (p[0] * scale + margin, p[1] * scale + margin))
                    .collect();
                mask.draw_stroke(&points, STROKE_PX);
            }
            mask
        })
        .collect()
}

fn bridged(part: &Part, t: usize) -> Option<[f64; 2]> {
    let sure = |s: &usize| part.at[*s][2] >= LEAST_LIKELIHOOD;
    let before = (0..=t).rev().find(sure);
    let after = (t..part.at.len()).find(sure);
    let (a, b) = (before.or(after)?, after.or(before)?);
    let share = if a == b { 0.0 } else { (t - a) as f64 / (b - a) as f64 };
    let along = |c: usize| part.at[a][c] + share * (part.at[b][c] - part.at[a][c]);
    Some([along(0), along(1)])
}
