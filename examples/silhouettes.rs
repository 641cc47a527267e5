//! Silhouettes against true masks: the figures of `docs/limits.md`.
//! `cargo run --release --example silhouettes [-- [--reversed] [--from FRAME] [--corrections N] [CLIP …]]`
//!
//! For each clip, first from two rectangles and then with up to three corrected frames, each the one
//! the program asks for: the mean overlap (Jaccard, frame 0 left out) of the whole and of the legs
//! (the lower third of the true mask's box), and the rank correlation of confidence and overlap over
//! the frames that are not corrected. Of each correction: how bad the frame was before (1 is the
//! worst of all), how many other frames lost more than .01 by it, and the most that one lost.
//!
//! `--reversed` plays the clips backwards and `--from` cuts their beginning off; rectangles are then
//! derived from the true mask of the new first frame as those of the data folder were, so these are
//! further clips, of a kind. `--corrections` is 3 unless told.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]
#![allow(clippy::unwrap_used, reason = "a measurement that fails may panic")]
#![allow(dead_code, reason = "the test's module, used in part")]

#[path = "../tests/suite/davis.rs"]
mod davis;

use std::path::PathBuf;

use davis::{CLIPS, Clip, Found, Overlap};
use muybridge::image::Rectangle;
use muybridge::mask::Mask;
use muybridge::silhouette::Flag;

/// A frame that loses more than this was made worse by a correction.
const LOST: f64 = 0.01;

fn main() {
    let mut names = Vec::new();
    let (mut reversed, mut from, mut corrections) = (false, 0, 3);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--reversed" => reversed = true,
            "--corrections" => corrections = arguments.next().unwrap().parse().unwrap(),
            "--from" => from = arguments.next().unwrap().parse().unwrap(),
            name => names.push(name.to_owned()),
        }
    }
    if names.is_empty() {
        names = CLIPS.map(str::to_owned).to_vec();
    }
    let data = std::env::var_os("MUYBRIDGE_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let mut sums = Vec::new();
    for name in &names {
        let clip = if reversed || from > 0 {
            let (mut pictures, mut truth) = davis::read(&data.join("video/davis"), name);
            if reversed {
                pictures.reverse();
                truth.reverse();
            }
            pictures.drain(..from);
            truth.drain(..from);
            let (foreground, background) = rectangles(&truth[0]);
            Clip::new(pictures, truth, foreground, background)
        } else {
            Clip::observed(&data, name)
        };
        sums.push(measured(name, clip, corrections));
    }
    let cases = sums.iter().map(Vec::len).min().unwrap_or(0);
    for case in 0..cases {
        let mean = Overlap::mean(sums.iter().map(|clip| &clip[case]));
        println!("mean with {case} corrected: J {:.3}, legs {:.3}", mean.whole, mean.legs);
    }
}

/// Prints the figures of a clip; its mean overlaps with no, one, two and three corrected frames.
fn measured(name: &str, mut clip: Clip, corrections: usize) -> Vec<Overlap> {
    let mut found = clip.outlined();
    let mut overlaps = clip.overlaps(&found);
    let mut means = vec![print(name, "two rectangles", &overlaps, &found)];
    if name == "camel" {
        let first = Overlap::mean(overlaps.iter().take(30).map(|o| &o.1));
        println!("{name:14} frames 1 to 30: J {:.3}, legs {:.3}", first.whole, first.legs);
    }
    for _ in 0..corrections {
        let Some(frame) = clip.correct_least_sure(&found) else { break };
        let own = overlaps.iter().find(|o| o.0 == frame).map_or(1.0, |o| o.1.whole);
        let rank = overlaps.iter().filter(|o| o.1.whole < own).count() + 1;
        found = clip.outlined();
        let after = clip.overlaps(&found);
        let losses: Vec<f64> =
            overlaps.iter().zip(&after).map(|(a, b)| a.1.whole - b.1.whole).collect();
        let lost = losses.iter().filter(|l| **l > LOST).count();
        let most = losses.iter().copied().fold(0.0, f64::max);
        overlaps = after;
        let what = format!(
            "frame {frame} ({own:.3}, {rank} of {}) corrected, {lost} lost, {most:.3} at most",
            overlaps.len()
        );
        means.push(print(name, &what, &overlaps, &found));
    }
    means
}

fn print(name: &str, what: &str, overlaps: &[(usize, Overlap)], found: &Found) -> Overlap {
    let mean = Overlap::mean(overlaps.iter().map(|o| &o.1));
    let worst = overlaps.iter().map(|o| o.1.whole).fold(1.0, f64::min);
    let pairs: Vec<(f64, f64)> = overlaps
        .iter()
        .filter(|(t, _)| !found.reports[*t].flags.contains(Flag::Corrected))
        .map(|(t, o)| (found.reports[*t].confidence, o.whole))
        .collect();
    println!(
        "{name:14} J {:.3} (worst {worst:.3}), legs {:.3}, rank correlation {:.2}: {what}",
        mean.whole,
        mean.legs,
        rank_correlation(&pairs)
    );
    mean
}

/// Spearman's, ties by order.
fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let ranks = |value: fn(&(f64, f64)) -> f64| {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by(|a, b| value(&pairs[*a]).total_cmp(&value(&pairs[*b])));
        let mut ranks = vec![0.0; pairs.len()];
        order.into_iter().enumerate().for_each(|(rank, at)| ranks[at] = rank as f64);
        ranks
    };
    let (a, b) = (ranks(|p| p.0), ranks(|p| p.1));
    let n = pairs.len() as f64;
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    1.0 - 6.0 * squares / (n * (n * n - 1.0))
}

/// The largest rectangle inside the animal, and the largest that is 15 pixels clear of it: as those
/// of the data folder were made.
fn rectangles(truth: &Mask) -> (Rectangle, Rectangle) {
    let (w, h) = (truth.width(), truth.height());
    let near = truth.dilated(15);
    (
        largest_rectangle(w, h, |x, y| truth.get(x, y)),
        largest_rectangle(w, h, |x, y| !near.get(x, y)),
    )
}

/// The largest rectangle of pixels that are all inside, the topmost and then the leftmost of equals:
/// for each row taken as the bottom, the widest that each column's height allows.
fn largest_rectangle(w: usize, h: usize, inside: impl Fn(usize, usize) -> bool) -> Rectangle {
    let mut best = Rectangle { x: 0, y: 0, width: 0, height: 0 };
    let mut heights = vec![0; w];
    for y in 0..h {
        for (x, height) in heights.iter_mut().enumerate() {
            *height = if inside(x, y) { *height + 1 } else { 0 };
        }
        for x in 0..w {
            let mut height = heights[x];
            for (right, beside) in heights.iter().enumerate().skip(x) {
                height = height.min(*beside);
                let width = right + 1 - x;
                if width * height > best.width * best.height {
                    best = Rectangle { x, y: y + 1 - height, width, height };
                }
                if height == 0 {
                    break;
                }
            }
        }
    }
    best
}
