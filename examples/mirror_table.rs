//! What a pose gains by counting twice, half a stride later with left and right exchanged:
//! `cargo run --release --example mirror_table -- DATA`, DATA the folder that holds `rigs/`. True phases, keys evenly over
//! the stride (the poses once) and evenly over the step with the halves in turns or over the stride (twice), mean
//! over eight offsets of the mean error over one stride, degrees.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use anyhow::anyhow;
use muybridge::interpolate::{Weights, blend, weights_over_mirrored, weights_over_phase};
use muybridge::rig::Mirror;
use muybridge::validate::{Shooting, Truth, geodesic_error, rotating_joints};

#[path = "common/mod.rs"]
mod common;

/// Frames of the stride.
const FRAMES: usize = 96;
const OFFSETS: usize = 8;

fn main() -> anyhow::Result<()> {
    let data = std::env::args().nth(1).unwrap_or_else(|| "../shared/data".to_owned());
    println!("| walk of | keys | once | twice, over the step | twice, over the stride |");
    println!("|---|---|---|---|---|");
    for known in common::gaits_of_rigs(Path::new(&data)) {
        if known.symmetric != Some(true) {
            continue;
        }
        let shooting =
            Shooting { frames: FRAMES, frames_per_cycle: FRAMES as f64, ..common::steady(42, 0.0) };
        let truth = Truth::of(&known.subject, &shooting)?;
        let mirror = Mirror::of(&truth.model.skeleton, &truth.model.skins)
            .map_err(|why| anyhow!("{}: {why}", known.name))?;
        for keys in 2..=8 {
            let once = mean(&truth, None, |offset| even(keys, offset))?;
            let step = mean(&truth, Some(&mirror), |offset| over_step(keys, offset))?;
            let stride = mean(&truth, Some(&mirror), |offset| even(keys, offset))?;
            println!("| {} | {keys} | {once:.2} | {step:.2} | {stride:.2} |", known.name);
        }
    }
    Ok(())
}

/// Mean error over the offsets, degrees.
fn mean(
    truth: &Truth,
    mirror: Option<&Mirror>,
    keys: impl Fn(f64) -> Vec<usize>,
) -> anyhow::Result<f64> {
    let joints = rotating_joints(&truth.driven);
    let mut sum = 0.0;
    for offset in 0..OFFSETS {
        let keys = keys(offset as f64 / OFFSETS as f64);
        let weights: Weights = match mirror {
            Some(_) => weights_over_mirrored(&truth.phases_cycles, &[], &keys)?,
            None => weights_over_phase(&truth.phases_cycles, &[], &keys)?,
        };
        let mut poses = truth.key_poses(&keys);
        if let Some(mirror) = mirror {
            poses.add_mirrored(mirror);
        }
        let made = blend("made", 25.0, &truth.model.skeleton, &poses, weights.values())?;
        sum += geodesic_error(&truth.poses, &made.poses, &joints).mean_deg;
    }
    Ok(sum / OFFSETS as f64)
}

/// Keys evenly over the stride, shifted by a share of their spacing.
fn even(keys: usize, offset: f64) -> Vec<usize> {
    (0..keys).map(|k| frame((k as f64 + offset) / keys as f64)).collect()
}

/// Keys evenly over the step, the halves of the stride in turns.
fn over_step(keys: usize, offset: f64) -> Vec<usize> {
    let place = |k: usize| (k as f64 + 2.0 * offset) / (2 * keys) as f64;
    (0..keys).map(|k| frame(place(k) + 0.5 * (k % 2) as f64)).collect()
}

fn frame(phase: f64) -> usize {
    (phase * FRAMES as f64).round() as usize % FRAMES
}
