//! The clips that the examples measure on.

#![allow(dead_code, reason = "each example uses a part")]

use std::path::Path;

use muybridge::synthetic::Gait;
use muybridge::validate::{Shooting, Subject, Unsteady};

/// A clip whose motion is known.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    /// "horse Walk", "built-in trot".
    pub(crate) name: String,
    /// The rig, "horse" and "built-in" apart: what is left out together.
    pub(crate) rig: String,
    /// What is rendered.
    pub(crate) subject: Subject,
    /// Whether left and right do the same half a stride apart; `None` for what is no gait.
    pub(crate) symmetric: Option<bool>,
}

/// File, prefix of its clips' names, name.
const RIGS: [(&str, &str, &str); 5] = [
    ("quaternius_horse.glb", "AnimalArmature|", "horse"),
    ("quaternius_alpaca.glb", "AnimalArmature|", "alpaca"),
    ("quaternius_husky.glb", "AnimalArmature|", "husky"),
    ("khronos_fox.glb", "", "fox"),
    ("quaternius_triceratops.glb", "Armature|Triceratops_", "triceratops"),
];

fn on_rig(data: &Path, rig: usize, clip: &str, symmetric: Option<bool>) -> Known {
    let (file, prefix, name) = RIGS[rig];
    Known {
        name: format!("{name} {clip}"),
        rig: name.to_owned(),
        subject: Subject::Rig {
            file: data.join("rigs").join(file),
            clip: format!("{prefix}{clip}"),
        },
        symmetric,
    }
}

/// The five rigs' walks, then their gallops and runs.
pub(crate) fn gaits_of_rigs(data: &Path) -> Vec<Known> {
    let walks = (0..5).map(|rig| on_rig(data, rig, "Walk", Some(true)));
    let runs =
        (0..5).map(|rig| on_rig(data, rig, if rig < 3 { "Gallop" } else { "Run" }, Some(false)));
    walks.chain(runs).collect()
}

/// The built-in horse's gaits.
pub(crate) fn built_in_gaits() -> Vec<Known> {
    Gait::ALL
        .into_iter()
        .map(|gait| Known {
            name: format!("built-in {gait}"),
            rig: "built-in".to_owned(),
            subject: Subject::Horse(gait),
            symmetric: Some(matches!(gait, Gait::Walk | Gait::Trot)),
        })
        .collect()
}

/// Clips of the rigs that are no gaits.
pub(crate) fn no_gaits(data: &Path) -> Vec<Known> {
    let clips: [(usize, &[&str]); 5] = [
        (0, &["Idle", "Eating", "Death", "Gallop_Jump", "Attack_Kick"]),
        (1, &["Idle_2", "Eating", "Death", "Jump_toIdle", "Attack_Headbutt"]),
        (2, &["Idle", "Eating", "Death", "Gallop_Jump", "Attack"]),
        (3, &["Survey"]),
        (4, &["Idle", "Death", "Jump", "Attack"]),
    ];
    let all = clips.into_iter().flat_map(|(rig, names)| names.iter().map(move |n| (rig, *n)));
    all.map(|(rig, name)| on_rig(data, rig, name, None)).collect()
}

/// 100 frames, 24.3 a cycle, 15 % of the edge pixels flipped.
pub(crate) fn steady(seed: u64, yaw_deg: f64) -> Shooting {
    Shooting {
        frames: 100,
        frames_per_cycle: 24.3,
        yaw_rad: yaw_deg.to_radians(),
        noise: 0.15,
        seed,
        size_px: (320, 240),
        unsteady: Unsteady::default(),
    }
}

/// The value after a flag.
pub(crate) fn option<'a>(arguments: &'a [String], flag: &str) -> Option<&'a str> {
    let at = arguments.iter().position(|a| a == flag)?;
    arguments.get(at + 1).map(String::as_str)
}

/// The part of a list that `--part 2/5` asks for (all without it): every fifth from the second on.
pub(crate) fn part<T>(list: Vec<T>, arguments: &[String]) -> Vec<T> {
    let wanted = option(arguments, "--part").and_then(|p| p.split_once('/'));
    let numbers =
        wanted.and_then(|(k, n)| Some((k.parse::<usize>().ok()?, n.parse::<usize>().ok()?)));
    match numbers {
        Some((k, n)) if n > 0 => {
            list.into_iter().enumerate().filter(|(at, _)| at % n + 1 == k).map(|(_, x)| x).collect()
        }
        _ => list,
    }
}

/// The middle value; NaN of nothing.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Spearman's rank correlation; equal values share their mean rank.
pub(crate) fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (ranks(a), ranks(b));
    let middle = (a.len() as f64 - 1.0) / 2.0;
    let product = |x: &[f64], y: &[f64]| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - middle) * (y - middle)).sum()
    };
    product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt()
}

fn ranks(values: &[f64]) -> Vec<f64> {
    values
        .iter()
        .map(|v| {
            let below = values.iter().filter(|w| *w < v).count() as f64;
            let same = values.iter().filter(|w| *w == v).count() as f64;
            below + (same - 1.0) / 2.0
        })
        .collect()
}
