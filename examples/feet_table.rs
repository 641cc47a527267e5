//! Feet and loops on every rig's own walk, gallop or run:
//! `cargo run --release --example feet_table -- [DATA]`, DATA the folder that holds `rigs/`.
//!
//! The first table is of the rig's own cycle at 24 frames: the gait by its contacts, the middles of the
//! stances by the contacts and by the height of the feet alone (share of the stride after the left hind foot's), slide and
//! angular acceleration before and after planting. The second is of loops made from silhouettes and eight poses, as
//! `animate --loop` makes them: what is left at the seam.

#![allow(clippy::print_stdout, reason = "the tables are what the program is for")]

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use anyhow::Context;
use muybridge::feet::{
    FootTrack, Footfalls, Limb, find_feet, foot_tracks, footfalls, gait_report, plant,
};
use muybridge::interpolate::{Seam, blend, evened, loop_frames, seamless, smoothest_start};
use muybridge::keys::KeySettings;
use muybridge::pipeline::{OverPhase, Trends, analyse_masks, keys_by_phase, phase_weights};
use muybridge::rig::{Clip, File, Pose};
use muybridge::spectrum::{Gait, Settings};
use muybridge::validate::{Shooting, Subject, Truth, Unsteady};

/// File, clip, what its name says.
const CLIPS: [(&str, &str, Gait); 10] = [
    ("quaternius_horse.glb", "AnimalArmature|Walk", Gait::Walk),
    ("quaternius_horse.glb", "AnimalArmature|Gallop", Gait::Gallop),
    ("quaternius_husky.glb", "AnimalArmature|Walk", Gait::Walk),
    ("quaternius_husky.glb", "AnimalArmature|Gallop", Gait::Gallop),
    ("quaternius_alpaca.glb", "AnimalArmature|Walk", Gait::Walk),
    ("quaternius_alpaca.glb", "AnimalArmature|Gallop", Gait::Gallop),
    ("khronos_fox.glb", "Walk", Gait::Walk),
    ("khronos_fox.glb", "Run", Gait::Gallop),
    ("quaternius_triceratops.glb", "Armature|Triceratops_Walk", Gait::Walk),
    ("quaternius_triceratops.glb", "Armature|Triceratops_Run", Gait::Gallop),
];

const FRAMES: usize = 24;

fn main() -> anyhow::Result<()> {
    let data = std::env::args().nth(1).unwrap_or_else(|| "../shared/data".to_owned());
    let rigs = PathBuf::from(data).join("rigs");
    println!(
        "| rig, clip | gait found | stances by contacts | by height | slide before | after | rms before | after | peak before | after |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (file, clip, _) in CLIPS {
        println!("{}", planted(&rigs.join(file), clip)?);
    }
    println!(
        "\n| rig, clip | seam, degrees | seam, units | jump of turns | median jump | median turn | jump of ways | median way |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (file, clip, gait) in CLIPS {
        for strides in [1, 3] {
            println!("{}", looped(&rigs.join(file), clip, gait, strides)?);
        }
    }
    Ok(())
}

fn name(file: &Path, clip: &str) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let rig = stem.rsplit('_').next().unwrap_or_default().to_owned();
    let clip = clip.rsplit(['|', '_']).next().unwrap_or_default();
    format!("{rig} {clip}")
}

fn planted(path: &Path, name_of_clip: &str) -> anyhow::Result<String> {
    let file = File::read(path)?;
    let model = file.model()?;
    let animation = file.animation(name_of_clip)?;
    let length = animation.duration_s();
    let pose =
        |i: usize| animation.sample(file.skeleton(), (i % FRAMES) as f64 / FRAMES as f64 * length);
    let poses: Vec<Pose> = (0..=FRAMES).map(pose).collect();
    let driven = animation.driven(file.skeleton());
    let fps = FRAMES as f64 / length;
    let mut clip = Clip { name: "planted".to_owned(), fps, poses, driven };
    let feet = find_feet(&model, &clip.poses, &[]);
    let tracks = foot_tracks(file.skeleton(), &clip.poses, &feet);
    let falls = footfalls(&tracks, fps, true).context("no footfalls")?;
    let gait = gait_report(&tracks, &falls).context("no gait")?;
    let limbs: Vec<Limb> = gait.limbs.iter().map(|l| l.limb).collect();
    let contacts = phases(&limbs, |foot| stance_middle(&falls, foot));
    let heights = phases(&limbs, |foot| low_middle(&tracks[foot]));
    let done = plant(file.skeleton(), &mut clip, &feet, &falls);
    Ok(format!(
        "| {} ({} feet) | {}{} | {contacts} | {heights} | {:.3} | {:.4} | {:.0} | {:.0} | {:.0} | {:.0} |",
        name(path, name_of_clip),
        feet.len(),
        gait.name.as_deref().unwrap_or("none"),
        gait.warning.map(|w| format!(" ({w})")).unwrap_or_default(),
        done.slide[0],
        done.slide[1],
        done.rms_acceleration_deg_s2[0],
        done.rms_acceleration_deg_s2[1],
        done.acceleration_deg_s2[0],
        done.acceleration_deg_s2[1],
    ))
}

/// Phases of the feet in the order left hind, left fore, right hind, right fore, after the first.
fn phases(limbs: &[Limb], of: impl Fn(usize) -> f64) -> String {
    let order = [Limb::LeftHind, Limb::LeftFore, Limb::RightHind, Limb::RightFore];
    let found: Vec<f64> =
        order.iter().filter_map(|l| limbs.iter().position(|m| m == l)).map(of).collect();
    let after = |p: &f64| format!("{:.2}", (p - found[0] + 0.02).rem_euclid(1.0) - 0.02);
    found.iter().map(after).collect::<Vec<_>>().join(" ")
}

/// The middle of a foot's (longest) stance, share of the cycle.
fn stance_middle(falls: &Footfalls, foot: usize) -> f64 {
    let longest = falls.contacts[foot]
        .iter()
        .max_by(|a, b| (a.up_frame - a.down_frame).total_cmp(&(b.up_frame - b.down_frame)));
    longest.map_or(f64::NAN, |c| (c.up_frame + c.down_frame) / 2.0 / falls.frames as f64)
}

/// The middle of the time in which a foot is in the lowest quarter of its range of height.
fn low_middle(track: &FootTrack) -> f64 {
    let heights = &track.heights[..FRAMES];
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (mut cos, mut sin) = (0.0, 0.0);
    for (t, h) in heights.iter().enumerate().filter(|(_, h)| **h < low + 0.25 * (high - low)) {
        let weight = low + 0.25 * (high - low) - h;
        cos += weight * (TAU * t as f64 / FRAMES as f64).cos();
        sin += weight * (TAU * t as f64 / FRAMES as f64).sin();
    }
    sin.atan2(cos) / TAU
}

fn looped(path: &Path, clip: &str, gait: Gait, strides: usize) -> anyhow::Result<String> {
    let subject = Subject::Rig { file: path.to_owned(), clip: clip.to_owned() };
    let shooting = Shooting {
        frames: 100,
        frames_per_cycle: 24.3,
        yaw_rad: 0.0,
        noise: 0.15,
        seed: 42,
        size_px: (320, 240),
        unsteady: Unsteady::default(),
    };
    let truth = Truth::of(&subject, &shooting)?;
    let settings = Settings { gait, ..Settings::default() };
    let found = analyse_masks(&truth.masks(&shooting), 25.0, 5, Trends::default(), &settings)?;
    let phase = found.phase_table().context("no phase")?;
    let wanted = KeySettings { keys: 8, ..KeySettings::default() };
    let keys = keys_by_phase(&phase, &wanted, false)?;
    let weights = phase_weights(&phase, &keys.frames, OverPhase::default())?;
    let clock = evened(&phase.stride_cycles);
    let frames = loop_frames(&clock, strides).context("too short")?.round().max(2.0);
    let values = weights.values();
    let made = seamless(values, weights.poses(), &clock, strides, frames as usize)?;
    let poses = truth.key_poses(&keys.frames);
    let mut clip_made = blend("loop", 25.0, &truth.model.skeleton, &poses, &made.values)?;
    // What the turns change by at every frame of the loop, were the seam there.
    let mut jumps: Vec<f64> = (0..clip_made.poses.len() - 1)
        .map(|start| Seam::of(&begun_at(&clip_made, start)).angle_jump_deg)
        .collect();
    jumps.sort_by(f64::total_cmp);
    clip_made = begun_at(&clip_made, smoothest_start(&clip_made));
    let seam = Seam::of(&clip_made);
    Ok(format!(
        "| {}, {strides} | {:.1e} | {:.1e} | {:.2} | {:.2} | {:.2} | {:.5} | {:.5} |",
        name(path, clip),
        seam.angle_deg,
        seam.distance,
        seam.angle_jump_deg,
        jumps[jumps.len() / 2],
        seam.median_turn_deg,
        seam.distance_jump,
        seam.median_way,
    ))
}

/// A loop that begins with another of its poses.
fn begun_at(clip: &Clip, start: usize) -> Clip {
    let mut turned = clip.clone();
    turned.poses.pop();
    turned.poses.rotate_left(start);
    turned.poses.extend(turned.poses.first().cloned());
    turned
}
