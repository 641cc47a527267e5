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
use muybridge::mask::Mask;

#[path = "common/mod.rs"]
mod common;

#[path = "support/horse.rs"]
mod horse;
use horse::{
    LEAST_LIKELIHOOD, Legs, Part, Scale, analysed, keyed, part, phase_rms, read, read_masks,
};

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
        Some(folder) => read_masks(Path::new(folder), frames)?,
        None => sketched(&parts, frames),
    };
    let found = analysed(&masks)?;
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
    let (keys, weights) = keyed(&phase, &legs, ridge)?;
    println!("the view drifts: {}", phase.drifts());
    println!("keys {keys:?}");
    let mean = legs.mean_error();
    let report = |what: &str, error: f64| {
        println!(
            "{what}: {error:.4} withers-hip lengths, {:.2} of the mean pose's {mean:.4}",
            error / mean
        );
    };
    report("leg points from the keys", legs.error(&keys, &weights));
    let nearest = Legs::of(&parts, Scale::Nearest);
    let (error, of) = (nearest.error(&keys, &weights), nearest.mean_error());
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
    let own = legs.own_phase(stride_frames)?;
    println!(
        "stride by the points {:.2} frames; their own cycle explains {:.0} % of them",
        own.stride_frames(),
        100.0 * own.explained_share
    );
    let rms = phase_rms(&own.stride_cycles, seen_phase);
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
