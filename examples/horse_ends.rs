//! How near the edge the phase of a real horse is: the same clip with fewer frames, and with masks that differ a little
//! or are broken in a few frames. `cargo run --release --example horse_ends -- [--draws N] [--each] POINTS.csv MASKS_DIR …`
//! (any number of pairs, as for `horse_points`; `--each` prints every clip). Seeded: the same clips every time.
//!
//! For each kind of clip: root mean square difference of the masks' phase from that of the key points (of the whole clip),
//! and the error of the leg points as a share of the mean pose's, mean and worst.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::ops::Range;
use std::path::Path;

use anyhow::Context;
use muybridge::mask::Mask;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[path = "common/mod.rs"]
mod common;
use common::option;

#[path = "support/horse.rs"]
mod horse;
use horse::{Legs, Part, Scale, analysed, keyed, phase_rms, read, read_masks};

/// Most frames that are left away at an end.
const MOST_CUT: usize = 12;

/// Blobs put on or taken off a silhouette whose outline is otherwise found, and their radii, pixels.
const BLOBS: usize = 24;
const BLOB_PX: Range<f64> = 3.0..9.0;

/// Radius of what a silhouette lacks that is wrong in one place, pixels.
const BITE_PX: Range<f64> = 60.0..140.0;

/// Frames with such a place.
const BITTEN: usize = 4;

/// Frames next to an end of what is seen (a silhouette that the picture's border cuts is not used) in which some are
/// broken, and how many.
const END_FRAMES: usize = 10;
const BROKEN_AT_END: usize = 3;

/// Share of the height that a broken silhouette loses from below: its legs.
const LOST_HEIGHT: f64 = 0.4;

/// How the masks are changed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    AsTheyAre,
    Earlier,
    Later,
    Rough,
    Bitten,
    BrokenFirst,
    BrokenLast,
}

impl Kind {
    const ALL: [Kind; 7] = [
        Kind::AsTheyAre,
        Kind::Earlier,
        Kind::Later,
        Kind::Rough,
        Kind::Bitten,
        Kind::BrokenFirst,
        Kind::BrokenLast,
    ];

    fn name(self) -> &'static str {
        match self {
            Kind::AsTheyAre => "as they are",
            Kind::Earlier => "ends 1–12 frames earlier",
            Kind::Later => "begins 1–12 frames later",
            Kind::Rough => "rough outline",
            Kind::Bitten => "rough, 4 frames bitten",
            Kind::BrokenFirst => "3 of the first 10 seen without legs",
            Kind::BrokenLast => "3 of the last 10 seen without legs",
        }
    }

    fn count(self, draws: usize) -> usize {
        match self {
            Kind::AsTheyAre => 1,
            Kind::Earlier | Kind::Later => MOST_CUT,
            _ => draws,
        }
    }

    /// Frames of the clip that are left, and their masks; `seen` are the frames that were used of the whole clip.
    fn apply(self, masks: &[Mask], seen: &[usize], draw: usize) -> (Range<usize>, Vec<Mask>) {
        let n = masks.len();
        let mut random = ChaCha8Rng::seed_from_u64(draw as u64 ^ (7 * 0x9E37_79B9));
        let frames = match self {
            Kind::Earlier => 0..n - 1 - draw,
            Kind::Later => draw + 1..n,
            _ => 0..n,
        };
        let mut masks = masks[frames.clone()].to_vec();
        if matches!(self, Kind::Rough | Kind::Bitten) {
            for mask in &mut masks {
                for _ in 0..BLOBS {
                    let radius_px = random.random_range(BLOB_PX);
                    let adds = random.random::<bool>();
                    blob(mask, radius_px, adds, &mut random);
                }
            }
        }
        let last = &seen[seen.len() - END_FRAMES..];
        let broken = match self {
            Kind::Bitten => chosen(seen, BITTEN, &mut random),
            Kind::BrokenFirst => chosen(&seen[..END_FRAMES], BROKEN_AT_END, &mut random),
            Kind::BrokenLast => chosen(last, BROKEN_AT_END, &mut random),
            _ => Vec::new(),
        };
        for t in broken {
            if self == Kind::Bitten {
                let radius_px = random.random_range(BITE_PX);
                blob(&mut masks[t], radius_px, false, &mut random);
            } else {
                lose_legs(&mut masks[t]);
            }
        }
        (frames, masks)
    }
}

/// So many different ones.
fn chosen(of: &[usize], count: usize, random: &mut impl Rng) -> Vec<usize> {
    let mut all = of.to_vec();
    (0..count.min(all.len())).map(|_| all.swap_remove(random.random_range(0..all.len()))).collect()
}

/// A disk about a pixel of the outline, set or cleared.
fn blob(mask: &mut Mask, radius_px: f64, adds: bool, random: &mut impl Rng) {
    let Some(bounds) = mask.bounds() else { return };
    // From a random place in the bounds along its row to the first pixel that changes.
    let (width, height) = (mask.width(), mask.height());
    let y = random.random_range(bounds.top..=bounds.bottom);
    let start = random.random_range(bounds.left..=bounds.right);
    let inside = mask.get(start, y);
    let Some(x) = (start..width).find(|x| mask.get(*x, y) != inside) else { return };
    let reach = radius_px.ceil() as usize;
    for v in y.saturating_sub(reach)..(y + reach + 1).min(height) {
        for u in x.saturating_sub(reach)..(x + reach + 1).min(width) {
            if (u as f64 - x as f64).hypot(v as f64 - y as f64) <= radius_px {
                mask.set(u, v, adds);
            }
        }
    }
}

fn lose_legs(mask: &mut Mask) {
    let Some(bounds) = mask.bounds() else { return };
    let lost = (LOST_HEIGHT * (bounds.bottom + 1 - bounds.top) as f64) as usize;
    for y in bounds.bottom + 1 - lost..=bounds.bottom {
        for x in bounds.left..=bounds.right {
            mask.set(x, y, false);
        }
    }
}

/// What is measured of one clip: phase, strides rms, and error of the leg points, share.
struct Figures {
    phase_rms: f64,
    error_share: f64,
}

fn measure(
    parts: &[Part],
    frames: Range<usize>,
    masks: &[Mask],
    truth: &[f64],
) -> anyhow::Result<Option<Figures>> {
    let Some(phase) = analysed(masks)?.phase_table() else { return Ok(None) };
    let cut: Vec<Part> = parts
        .iter()
        .map(|p| Part { name: p.name.clone(), at: p.at[frames.clone()].to_vec() })
        .collect();
    let legs = Legs::of(&cut, Scale::Steady);
    let (keys, weights) = keyed(&phase, &legs, 0.0)?;
    Ok(Some(Figures {
        phase_rms: phase_rms(&truth[frames], &phase.stride_cycles),
        error_share: legs.error(&keys, &weights) / legs.mean_error(),
    }))
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let draws: usize = option(&arguments, "--draws").map_or(Ok(20), str::parse)?;
    let each = arguments.iter().any(|a| a == "--each");
    let first = arguments.iter().position(|a| a.ends_with(".csv"));
    let pairs = &arguments[first.context("usage: horse_ends POINTS.csv MASKS_DIR …")?..];
    println!("| horse | masks | clips | no phase | phase, mean | worst | error, mean | worst |");
    println!("|---|---|---|---|---|---|---|---|");
    for pair in pairs.chunks_exact(2) {
        let parts = read(Path::new(&pair[0]))?;
        let masks = read_masks(Path::new(&pair[1]), parts.first().map_or(0, |p| p.at.len()))?;
        let whole = analysed(&masks)?;
        let gait = whole.gait.context("no gait phase")?;
        let seen: Vec<usize> = (0..masks.len()).filter(|t| whole.used[*t]).collect();
        let truth = Legs::of(&parts, Scale::Steady).own_phase(gait.stride_frames())?.stride_cycles;
        let horse = pair[0].trim_end_matches(".csv").rsplit('/').next().unwrap_or_default();
        for kind in Kind::ALL {
            let mut all = Vec::new();
            for draw in 0..kind.count(draws) {
                let (frames, masks) = kind.apply(&masks, &seen, draw);
                let Some(figures) = measure(&parts, frames, &masks, &truth)? else { continue };
                if each {
                    println!(
                        "  {horse}, {}, {draw}: {:.3} {:.2}",
                        kind.name(),
                        figures.phase_rms,
                        figures.error_share
                    );
                }
                all.push(figures);
            }
            let phase = summary(all.iter().map(|f| f.phase_rms));
            let error = summary(all.iter().map(|f| f.error_share));
            println!(
                "| {horse} | {} | {} | {} | {:.3} | {:.3} | {:.2} | {:.2} |",
                kind.name(),
                kind.count(draws),
                kind.count(draws) - all.len(),
                phase.0,
                phase.1,
                error.0,
                error.1
            );
        }
    }
    Ok(())
}

/// Mean and worst.
fn summary(values: impl ExactSizeIterator<Item = f64> + Clone) -> (f64, f64) {
    (values.clone().sum::<f64>() / values.len() as f64, values.fold(0.0, f64::max))
}
