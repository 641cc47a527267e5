//! The error table of the default method over the rigs, beside the floor and the methods of the
//! paper: `cargo run --release --example phase_table -- DATA [--seed N] [--phase-only] [--yaws 0,20]
//! [--no-mirror]`, DATA the folder that holds `rigs/`. With `--unsteady` each cell is compared with its steady value instead, for footage
//! whose speed drifts by 12 %, whose strides vary by 10 % in duration, with 5 % of the masks broken, of 3.2 cycles
//! only, at 15 frames a second, and of all of these; whose strides vary by 10 % in size, and whose motion becomes
//! smaller by 30 %. `--no-amplitude`: sizes are not followed. The gait is named symmetric or asymmetric, nothing else is told.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use muybridge::shot::{Method, Mirroring};
use muybridge::spectrum::Gait;
use muybridge::validate::{Settings, Shooting, Validation, validate};

#[path = "common/mod.rs"]
mod common;

use common::{gaits_of_rigs, option, steady};

const POSES: [usize; 3] = [4, 6, 8];

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let data = arguments.first().map_or("../shared/data", String::as_str);
    let phase_only = arguments.iter().any(|a| a == "--phase-only");
    let seed: u64 = option(&arguments, "--seed").map_or(Ok(42), str::parse)?;
    let yaws_deg: Vec<f64> = option(&arguments, "--yaws")
        .unwrap_or("0,20")
        .split(',')
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let data = Path::new(data);
    if arguments.iter().any(|a| a == "--unsteady") {
        return unsteady_table(data, seed);
    }
    println!("| clip | yaw | poses | floor | phase | of the floor | expected | rbf | switching |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut of_floor = Vec::new();
    let (mut ours, mut theirs) = (0.0, 0.0);
    let mut of_theirs = Vec::new();
    let (mut clips, mut right_strides, mut usable) = (0, 0, 0);
    for known in gaits_of_rigs(data) {
        let name = &known.name;
        for &yaw_deg in &yaws_deg {
            let run = |method: Method, keys: &[usize], partners: bool| {
                table(&known, steady(seed, yaw_deg), method, keys, partners)
            };
            let phase = run(Method::Phase, &POSES, false)?;
            let stride = phase.measured.as_ref().map_or(f64::NAN, |m| m.cycle_frames);
            clips += 1;
            right_strides += usize::from((stride / phase.frames_per_cycle - 1.0).abs() < 0.03);
            usable += usize::from(phase.verdict == "usable");
            let rest = if phase_only {
                None
            } else {
                Some((run(Method::Rbf, &POSES, false)?, run(Method::Switching, &[2, 4], true)?))
            };
            for (at, poses) in POSES.into_iter().enumerate() {
                let floor = phase.rows[at].floor.map_or(f64::NAN, |f| f.mean_deg);
                let cell = &phase.rows[at].cells[0];
                let error = cell.error.mean_deg;
                of_floor.push(error / floor);
                let mut line = format!(
                    "| {name} | {yaw_deg} | {poses} | {floor:.2} | {error:.2} | {:.2} | {:.1} % |",
                    error / floor,
                    100.0 * cell.expected_error_share.unwrap_or(f64::NAN),
                );
                if let Some((rbf, switching)) = &rest {
                    let rbf = rbf.rows[at].cells[0].error.mean_deg;
                    let switched = switching.rows.iter().find(|r| r.poses == poses);
                    let switched = switched.map(|r| r.cells[0].error.mean_deg);
                    let better = switched.unwrap_or(f64::INFINITY).min(rbf);
                    ours += error;
                    theirs += better;
                    of_theirs.push(error / better);
                    let shown = switched.map(|s| format!("{s:.2}")).unwrap_or_default();
                    line.push_str(&format!(" {rbf:.2} | {shown} |"));
                }
                println!("{line}");
            }
        }
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let worst = of_floor.iter().copied().fold(0.0, f64::max);
    let over = of_floor.iter().filter(|r| **r > 1.08).count();
    println!(
        "\nOf the floor: mean {:.3}, worst {worst:.2}, {over} of {} cells over 1.08. The stride is right in {right_strides} of {clips} clips; usable: {usable}.",
        mean(&of_floor),
        of_floor.len()
    );
    if !phase_only {
        println!(
            "Mean error over all cells {:.3} of that of the better of rbf and switching (mean of the cells' own shares {:.2}).",
            ours / theirs,
            mean(&of_theirs)
        );
    }
    Ok(())
}

fn unsteady_table(data: &Path, seed: u64) -> anyhow::Result<()> {
    println!(
        "| clip | yaw | poses | steady | drift | strides | masks | short | 15 fps | all | sizes | smaller |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let (mut worst, mut sum, mut rows) = ([0.0_f64; 8], [0.0; 8], 0.0);
    for known in gaits_of_rigs(data) {
        let name = &known.name;
        for yaw_deg in [0.0_f64, 20.0] {
            let shootings = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|kind| unsteady(seed, yaw_deg, kind));
            let tables = shootings
                .into_iter()
                .map(|s| table(&known, s, Method::Phase, &POSES, false))
                .collect::<anyhow::Result<Vec<_>>>()?;
            for (at, poses) in POSES.into_iter().enumerate() {
                let errors: Vec<f64> =
                    tables.iter().map(|t| t.rows[at].cells[0].error.mean_deg).collect();
                let mut line = format!("| {name} | {yaw_deg} | {poses} | {:.2} |", errors[0]);
                for (kind, error) in errors[1..].iter().enumerate() {
                    let ratio = error / errors[0];
                    worst[kind] = worst[kind].max(ratio);
                    sum[kind] += ratio;
                    line.push_str(&format!(" {error:.2} ({ratio:.2}) |"));
                }
                rows += 1.0;
                println!("{line}");
            }
        }
    }
    let names = ["drift", "strides", "masks", "short", "15 fps", "all", "sizes", "smaller"];
    let list = |values: &[f64]| -> String {
        let all = names.iter().zip(values).map(|(name, value)| format!("{name} {value:.2}"));
        all.collect::<Vec<_>>().join(", ")
    };
    println!("\nWorst over its steady value: {}.", list(&worst));
    println!("Mean over its steady value: {}.", list(&sum.map(|s| s / rows)));
    Ok(())
}

/// 0 steady, 1 drift, 2 strides, 3 masks, 4 short, 5 slow, 6 all of them, 7 strides of unlike size, 8 ever smaller ones.
fn unsteady(seed: u64, yaw_deg: f64, kind: usize) -> Shooting {
    let mut shooting = steady(seed, yaw_deg);
    let all = kind == 6;
    if kind == 1 || all {
        shooting.unsteady.speed_drift = 0.12;
    }
    if kind == 2 || all {
        shooting.unsteady.stride_variation = 0.1;
    }
    if kind == 3 || all {
        shooting.unsteady.broken_masks = 0.05;
    }
    if kind == 5 || all {
        shooting.frames_per_cycle *= 15.0 / 25.0;
        shooting.frames = 60;
    }
    if kind == 7 {
        shooting.unsteady.amplitude_variation = 0.1;
    }
    if kind == 8 {
        shooting.unsteady.amplitude_drift = -0.3;
    }
    if kind == 4 || all {
        shooting.frames = (3.2 * shooting.frames_per_cycle).round() as usize;
    }
    shooting
}

fn table(
    known: &common::Known,
    shooting: Shooting,
    method: Method,
    keys: &[usize],
    partners: bool,
) -> anyhow::Result<Validation> {
    let settings = Settings {
        subject: known.subject.clone(),
        shooting,
        keys: keys.to_vec(),
        components: vec![2],
        partners,
        gait: if known.symmetric == Some(true) { Gait::Symmetric } else { Gait::Asymmetric },
        method,
        mirror: mirroring(),
        amplitude: !std::env::args().any(|a| a == "--no-amplitude"),
        band_pass: true,
        time_limit_s: 5.0,
    };
    Ok(validate(&settings, &|_, _| true)?)
}

/// Poses count twice where the gait is symmetric, unless `--no-mirror` says otherwise.
fn mirroring() -> Mirroring {
    if std::env::args().any(|a| a == "--no-mirror") { Mirroring::Off } else { Mirroring::Auto }
}
