//! Does the tool tell steps from strides? Walks and trots of the rigs and of the built-in horse, the
//! left side's motion made weaker or later by a graded share, seen at yaw 0 to 30, with 15 % of the
//! edge pixels flipped; and gallops, which have no steps:
//! `cargo run --release --example left_right -- DATA [--all] [--clips "fox,built-in trot"] [--yaws 0,30]`.
//!
//! What is above the noise is settled by the renderings alone, before the method sees them: frames
//! half a stride apart differ in more pixels (without noise) than two noisy pictures of one pose do.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use muybridge::mask::Mask;
use muybridge::pipeline::{MaskAnalysis, Trends, analyse_masks};
use muybridge::rig::{NodePose, Pose, mean_rotation, rotation_from_vector, rotation_vector};
use muybridge::spectrum::{self, Gait};
use muybridge::validate::{Shooting, Truth};

#[path = "common/mod.rs"]
mod common;

use common::{Known, option};

/// Poses of one stride that the frames are taken from.
const STRIDE_POSES: usize = 1000;

/// A period within this share of the true stride is the stride.
const PERIOD_SLACK: f64 = 0.03;

/// A node this share of the rig's width away from the middle belongs to a side.
const SIDE_SHARE: f64 = 0.05;

const YAWS_DEG: [f64; 4] = [0.0, 10.0, 20.0, 30.0];

/// How the left side differs from the right one.
#[derive(Clone, Copy, PartialEq)]
enum Lame {
    /// It moves by so much less.
    Weaker(f64),
    /// It moves later by this share of the stride.
    Later(f64),
}

impl Lame {
    fn all() -> Vec<Self> {
        let shares = [0.02, 0.05, 0.1, 0.2];
        std::iter::once(Lame::Weaker(0.0))
            .chain(shares.map(Lame::Weaker))
            .chain(shares.map(Lame::Later))
            .collect()
    }

    fn name(self) -> String {
        match self {
            Lame::Weaker(0.0) => "none".to_owned(),
            Lame::Weaker(share) => format!("weaker by {:.0} %", 100.0 * share),
            Lame::Later(share) => format!("later by {:.0} %", 100.0 * share),
        }
    }
}

/// What was said.
#[derive(Clone, Copy, PartialEq)]
enum Answer {
    Right,
    Wrong,
    CannotTell,
}

impl Answer {
    fn name(self) -> &'static str {
        match self {
            Answer::Right => "right",
            Answer::Wrong => "WRONG",
            Answer::CannotTell => "cannot tell",
        }
    }
}

/// One clip, view and asymmetry.
struct Case {
    name: String,
    symmetric: bool,
    yaw_deg: f64,
    lame: Lame,
    /// Pixels in which frames half a stride apart differ, without noise; mean over the frames.
    halves_px: f64,
    /// Pixels in which two noisy pictures of one pose differ.
    noise_px: f64,
    unnamed: Answer,
    /// Whether what the tool takes for a stride while it cannot tell is one.
    taken_rightly: bool,
    named: Answer,
    /// The other kind of gait was named: whether the evidence objects.
    objects: bool,
}

impl Case {
    fn above_noise(&self) -> bool {
        self.halves_px > self.noise_px
    }
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let data = Path::new(arguments.first().map_or("../shared/data", String::as_str));
    let mut cases = Vec::new();
    let yaws_deg: Vec<f64> = match option(&arguments, "--yaws") {
        Some(list) => list.split(',').map(str::parse).collect::<Result<_, _>>()?,
        None => YAWS_DEG.to_vec(),
    };
    let wanted: Vec<&str> = option(&arguments, "--clips").unwrap_or("").split(',').collect();
    let mut clips = common::gaits_of_rigs(data);
    clips.extend(common::built_in_gaits());
    clips.retain(|known| wanted.iter().any(|part| known.name.contains(part)));
    for known in &clips {
        let lames =
            if known.symmetric == Some(true) { Lame::all() } else { vec![Lame::Weaker(0.0)] };
        for &yaw_deg in &yaws_deg {
            for &lame in &lames {
                cases.push(case(known, yaw_deg, lame)?);
            }
        }
    }
    if arguments.iter().any(|a| a == "--all") {
        print_all(&cases);
    }
    let walks = |c: &&Case| c.symmetric;
    println!(
        "| walks and trots | cases | above the noise | unnamed: right | cannot tell | wrong | named: right | wrong |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for &yaw_deg in &yaws_deg {
        let own: Vec<&Case> = cases.iter().filter(walks).filter(|c| c.yaw_deg == yaw_deg).collect();
        summary(&format!("yaw {yaw_deg}"), &own);
    }
    for known in clips.iter().filter(|known| known.symmetric == Some(true)) {
        let own: Vec<&Case> = cases.iter().filter(|c| c.name == known.name).collect();
        summary(&known.name, &own);
    }
    for lame in Lame::all() {
        let own: Vec<&Case> = cases.iter().filter(walks).filter(|c| c.lame == lame).collect();
        summary(&format!("asymmetry {}", lame.name()), &own);
    }
    summary("all", &cases.iter().filter(walks).collect::<Vec<_>>());
    let gallops: Vec<&Case> = cases.iter().filter(|c| !c.symmetric).collect();
    summary("gallops, canter and runs", &gallops);
    let unknown: Vec<&Case> =
        cases.iter().filter(|c| c.symmetric && c.unnamed == Answer::CannotTell).collect();
    println!(
        "\nWalks and trots of which it cannot be told: {}; in {} of them the period that is taken for the stride is the stride.",
        unknown.len(),
        unknown.iter().filter(|c| c.taken_rightly).count()
    );
    let objected = |symmetric: bool| {
        let own = cases.iter().filter(move |c| c.symmetric == symmetric);
        (own.clone().filter(|c| c.objects).count(), own.count())
    };
    let ((walks, of_walks), (gallops, of_gallops)) = (objected(true), objected(false));
    println!(
        "Named wrongly, the evidence objects to {walks} of {of_walks} walks named asymmetric and {gallops} of {of_gallops} gallops named symmetric."
    );
    Ok(())
}

fn summary(name: &str, cases: &[&Case]) {
    let above: Vec<&&Case> = cases.iter().filter(|c| c.above_noise()).collect();
    let count = |answer: Answer| above.iter().filter(|c| c.unnamed == answer).count();
    let named = |answer: Answer| above.iter().filter(|c| c.named == answer).count();
    println!(
        "| {name} | {} | {} | {} | {} | {} | {} | {} |",
        cases.len(),
        above.len(),
        count(Answer::Right),
        count(Answer::CannotTell),
        count(Answer::Wrong),
        named(Answer::Right),
        named(Answer::Wrong),
    );
}

fn print_all(cases: &[Case]) {
    println!(
        "| clip | yaw | asymmetry | halves differ, px | noise, px | unnamed | named | other named |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for c in cases {
        println!(
            "| {} | {} | {} | {:.0} | {:.0} | {} | {} | {} |",
            c.name,
            c.yaw_deg,
            c.lame.name(),
            c.halves_px,
            c.noise_px,
            c.unnamed.name(),
            c.named.name(),
            if c.objects { "objects" } else { "silent" }
        );
    }
    println!();
}

fn case(known: &Known, yaw_deg: f64, lame: Lame) -> anyhow::Result<Case> {
    let shooting = common::steady(42, yaw_deg);
    let (clean, noisy) = masks(known, &shooting, lame)?;
    let n = noisy.len();
    let mean_difference = |a: &[Mask], b: &[Mask]| {
        a.iter().zip(b).map(|(a, b)| differing(a, b) as f64).sum::<f64>() / n as f64
    };
    let symmetric = known.symmetric == Some(true);
    let (right, other) = if symmetric {
        (Gait::Symmetric, Gait::Asymmetric)
    } else {
        (Gait::Asymmetric, Gait::Symmetric)
    };
    let unnamed = analysed(&noisy, Gait::Unknown)?;
    let stride = shooting.frames_per_cycle;
    Ok(Case {
        name: known.name.clone(),
        symmetric,
        yaw_deg,
        lame,
        halves_px: mean_difference(&clean[..n], &clean[n..]),
        noise_px: 2.0 * mean_difference(&clean[..n], &noisy),
        unnamed: answer(&unnamed, stride),
        taken_rightly: unnamed.gait.is_some_and(|g| is_stride(g.stride_frames(), stride)),
        named: answer(&analysed(&noisy, right)?, stride),
        objects: analysed(&noisy, other)?.gait.is_some_and(|g| g.stride.contradicts_gait),
    })
}

/// Clean masks of all frames and of the same half a stride later, and the noisy ones of all frames.
fn masks(known: &Known, shooting: &Shooting, lame: Lame) -> anyhow::Result<(Vec<Mask>, Vec<Mask>)> {
    let one = Shooting {
        frames: STRIDE_POSES,
        frames_per_cycle: STRIDE_POSES as f64,
        ..shooting.clone()
    };
    let mut truth = Truth::of(&known.subject, &one)?;
    let stride = lamed(&truth, lame);
    let at = |phase: f64| {
        let place = (phase.rem_euclid(1.0) * STRIDE_POSES as f64).round() as usize;
        stride[place % STRIDE_POSES].clone()
    };
    let phases = (0..shooting.frames).map(|t| t as f64 / shooting.frames_per_cycle);
    truth.poses = phases.clone().map(at).chain(phases.map(|p| at(p + 0.5))).collect();
    let clean = truth.masks(&Shooting { noise: 0.0, ..shooting.clone() });
    let mut noisy = truth.masks(shooting);
    noisy.truncate(shooting.frames);
    Ok((clean, noisy))
}

/// One stride with the left side changed.
fn lamed(truth: &Truth, lame: Lame) -> Vec<Pose> {
    let skeleton = &truth.model.skeleton;
    let rest = skeleton.world_matrices(&skeleton.rest_pose());
    let widest = rest.iter().map(|m| m[(0, 3)].abs()).fold(0.0, f64::max);
    let mut poses = truth.poses.clone();
    for (node, world) in rest.iter().enumerate() {
        if world[(0, 3)] <= SIDE_SHARE * widest {
            continue;
        }
        let own: Vec<NodePose> = truth.poses.iter().map(|p| p.nodes[node]).collect();
        let rotations: Vec<_> = own.iter().map(|n| n.rotation).collect();
        let mean = mean_rotation(&rotations);
        let n = own.len();
        let place = own.iter().map(|p| p.translation).sum::<nalgebra::Vector3<f64>>() / n as f64;
        for (t, pose) in poses.iter_mut().enumerate() {
            pose.nodes[node] = match lame {
                Lame::Later(share) => own[(t + n - (share * n as f64) as usize) % n],
                Lame::Weaker(share) => NodePose {
                    rotation: mean
                        * rotation_from_vector(
                            &(rotation_vector(&(mean.inverse() * own[t].rotation)) * (1.0 - share)),
                        ),
                    translation: place + (own[t].translation - place) * (1.0 - share),
                    ..own[t]
                },
            };
        }
    }
    poses
}

fn differing(a: &Mask, b: &Mask) -> usize {
    (0..a.height()).map(|y| (0..a.width()).filter(|&x| a.get(x, y) != b.get(x, y)).count()).sum()
}

fn analysed(masks: &[Mask], gait: Gait) -> anyhow::Result<MaskAnalysis> {
    let settings = spectrum::Settings { gait, ..spectrum::Settings::default() };
    Ok(analyse_masks(masks, 25.0, 5, Trends::default(), &settings)?)
}

fn is_stride(frames: f64, stride_frames: f64) -> bool {
    (frames / stride_frames - 1.0).abs() < PERIOD_SLACK
}

/// What is said of the stride, beside the stride that was rendered.
fn answer(found: &MaskAnalysis, stride_frames: f64) -> Answer {
    let Some(said) = found.spectral.rhythm.stride_frames else { return Answer::CannotTell };
    let phase = found.gait.as_ref().is_some_and(|g| is_stride(g.stride_frames(), stride_frames));
    if is_stride(said, stride_frames) && phase { Answer::Right } else { Answer::Wrong }
}
