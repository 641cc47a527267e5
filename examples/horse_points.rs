//! Real horses: how well the weights of eight key frames predict key points that a network found in
//! the other frames. `cargo run --release --example horse_points -- POINTS.csv [MASKS_DIR]`
//!
//! POINTS.csv has columns PART_x, PART_y, PART_likelihood (pixels); MASKS_DIR the masks of a shot.
//! Without masks the figure's lines between the points are drawn as strokes, as an artist would
//! sketch them. Weights see masks only. Points count with a likelihood of .9 or more, relative to
//! the withers, in units of the median distance from withers to hip; the error is the mean distance
//! over frames that are not keys and over the points of the legs.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use anyhow::{Context, bail};
use muybridge::keys::KeySettings;
use muybridge::mask::Mask;
use muybridge::pipeline::{Trends, analyse_masks, choose_by_phase, interpolation_weights};
use muybridge::shot::{Animation, Method, PhaseTable};
use muybridge::spectrum::{Gait, Settings};

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
    let phase = PhaseTable::of(gait);
    let wanted = KeySettings { keys: KEYS, ..KeySettings::default() };
    let chosen = choose_by_phase(&phase, &wanted, None)?.chosen;
    let animation = Animation { method: Method::Phase, ..Animation::default() };
    let coefficients = found.coefficients(true);
    let weights = interpolation_weights(
        coefficients,
        &chosen.frames,
        &[],
        found.spectral.rhythm.step_frames,
        Some(&phase.stride_cycles),
        &animation,
    )?;
    println!("keys {:?}", chosen.frames);
    let (mut error, mut mean_error, mut count) = (0.0, 0.0, 0_usize);
    for part in legs(&parts) {
        let relative = relative(part, &parts);
        let seen: Vec<[f64; 2]> = relative.iter().flatten().copied().collect();
        let mean = [0, 1].map(|c| seen.iter().map(|p| p[c]).sum::<f64>() / seen.len() as f64);
        for t in (0..frames).filter(|t| !chosen.frames.contains(t)) {
            let (Some(truth), Some(guess)) =
                (relative[t], predicted(&relative, &chosen.frames, weights.row(t)))
            else {
                continue;
            };
            error += distance(truth, guess);
            mean_error += distance(truth, mean);
            count += 1;
        }
    }
    println!(
        "leg points: {:.4} withers-hip lengths, mean pose {:.4}, ratio {:.2} ({count} points)",
        error / count as f64,
        mean_error / count as f64,
        error / mean_error
    );
    Ok(())
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

/// A part relative to the withers in withers-hip lengths, where both are sure.
fn relative(own: &Part, parts: &[Part]) -> Vec<Option<[f64; 2]>> {
    let (withers, hip) = (part(parts, "Withers"), part(parts, "Hip"));
    let sure = |p: &[f64; 3]| p[2] >= LEAST_LIKELIHOOD;
    let lengths: Vec<Option<f64>> = withers
        .at
        .iter()
        .zip(&hip.at)
        .map(|(w, h)| (sure(w) && sure(h)).then(|| distance([w[0], w[1]], [h[0], h[1]])))
        .collect();
    // The horse may shrink as it walks away: the length of the nearest frames that show it.
    let length = |t: usize| {
        let mut near: Vec<(usize, f64)> =
            lengths.iter().enumerate().filter_map(|(s, l)| Some((s.abs_diff(t), (*l)?))).collect();
        near.sort_by_key(|n| n.0);
        let mut nearest: Vec<f64> = near.iter().take(5).map(|n| n.1).collect();
        nearest.sort_by(f64::total_cmp);
        nearest.get(nearest.len() / 2).copied()
    };
    own.at
        .iter()
        .zip(&withers.at)
        .enumerate()
        .map(|(t, (p, w))| {
            let length = length(t)?;
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
