//! The calibration of the verdict: gaits and other clips of five rigs and of the built-in horse, seen from
//! four sides, with noise, of one to five cycles, and spoilt in other ways; what the tool said beside the true error
//! with eight keys:
//! `cargo run --release --example verdict -- DATA [--part K/N] [--all]`.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use muybridge::shot::{Method, Mirroring};
use muybridge::spectrum::Gait;
use muybridge::validate::{Settings, Shooting, Validation, validate};

#[path = "common/mod.rs"]
mod common;

use common::{Known, median, part};

/// Shares of the mean pose's error, with eight keys, under which a clip is usable and doubtful.
const USABLE: f64 = 0.2;
const DOUBTFUL: f64 = 0.5;

const KEYS: usize = 8;

const NAMES: [&str; 3] = ["usable", "doubtful", "unusable"];

/// Thresholds of the explained share that are compared without the rig that is judged.
const THRESHOLDS: [f64; 7] = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];

struct Run {
    known: Known,
    shooting: Shooting,
    /// What was done to the clip.
    kind: String,
}

struct Judged {
    rig: String,
    name: String,
    kind: String,
    yaw_deg: f64,
    /// 0 usable, 1 doubtful, 2 unusable.
    said: usize,
    truth: usize,
    /// Error over that of the mean pose.
    share: f64,
    /// That of evenly spaced keys with the true phase.
    floor_share: f64,
    found: Validation,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let data = Path::new(arguments.first().map_or("../shared/data", String::as_str));
    let mut judged = Vec::new();
    for run in part(runs(data), &arguments) {
        judged.push(judge(run)?);
    }
    if arguments.iter().any(|a| a == "--all") {
        print_all(&judged);
    }
    println!("| said \\ true | usable | doubtful | unusable |\n|---|---|---|---|");
    confusion(&judged, |_, j| j.said);
    println!(
        "\nThe same with the threshold of the explained share that is best without the rig judged:\n"
    );
    println!("| said \\ true | usable | doubtful | unusable |\n|---|---|---|---|");
    confusion(&judged, |all, j| with_threshold(j, best_threshold(all, &j.rig)));
    println!(
        "\n| what | clips | said usable, doubtful, unusable | truly so | error over the floor, median | largest |"
    );
    println!("|---|---|---|---|---|---|");
    let mut kinds: Vec<&str> = judged.iter().map(|j| j.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    for kind in kinds {
        let own: Vec<&Judged> = judged.iter().filter(|j| j.kind == kind).collect();
        let count = |class: &dyn Fn(&Judged) -> usize| {
            let counts = [0, 1, 2].map(|c| own.iter().filter(|j| class(j) == c).count());
            counts.map(|c| c.to_string()).join(", ")
        };
        let over: Vec<f64> = own.iter().map(|j| j.share - j.floor_share).collect();
        println!(
            "| {kind} | {} | {} | {} | {:.3} | {:.3} |",
            own.len(),
            count(&|j| j.said),
            count(&|j| j.truth),
            median(&over),
            over.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        );
    }
    println!("\nWhere they differ:\n");
    for j in judged.iter().filter(|j| j.said != j.truth) {
        println!(
            "- {}, {}, yaw {}: said {}, error {:.2} of the motion ({}); {}",
            j.name,
            j.kind,
            j.yaw_deg,
            NAMES[j.said],
            j.share,
            NAMES[j.truth],
            j.found.reasons.first().map_or("", String::as_str)
        );
    }
    Ok(())
}

fn print_all(judged: &[Judged]) {
    for j in judged {
        let measured = j.found.measured.as_ref();
        println!(
            "{}, {}, yaw {}: {} ({}), error {:.3}, floor {:.3}, explained {:.2}, sweep {:.3}, cycles {:.2}, phase error {:.4}",
            j.name,
            j.kind,
            j.yaw_deg,
            NAMES[j.said],
            NAMES[j.truth],
            j.share,
            j.floor_share,
            measured.map_or(f64::NAN, |m| m.explained_share),
            measured.map_or(f64::NAN, |m| m.sweep),
            measured.map_or(f64::NAN, |m| m.cycles),
            measured.map_or(f64::NAN, |m| m.phase_error_cycles),
        );
    }
    println!();
}

fn confusion(judged: &[Judged], rule: impl Fn(&[Judged], &Judged) -> usize) {
    let mut counts = [[0; 3]; 3];
    for j in judged {
        counts[rule(judged, j)][j.truth] += 1;
    }
    for (name, row) in NAMES.iter().zip(counts) {
        println!("| {name} | {} | {} | {} |", row[0], row[1], row[2]);
    }
    let right: usize = (0..3).map(|c| counts[c][c]).sum();
    println!("\n{right} of {} right.", judged.len());
}

/// The verdict as it would be with another threshold of the explained share: above it a cycle seen
/// often enough, at a rate that shows it, is usable, and nothing else is changed.
fn with_threshold(j: &Judged, threshold: f64) -> usize {
    let Some(m) = &j.found.measured else { return j.said };
    let plain = m.explained_share >= threshold
        && m.cycles >= 1.4
        && m.sweep >= 0.035
        && j.found.step_frames >= 6.0;
    if plain {
        0
    } else if j.said == 0 {
        1
    } else {
        j.said
    }
}

fn best_threshold(all: &[Judged], rig: &str) -> f64 {
    let right = |threshold: f64| {
        let others = all.iter().filter(|j| j.rig != rig);
        others.filter(|j| with_threshold(j, threshold) == j.truth).count()
    };
    // Of equals the strictest.
    THRESHOLDS.into_iter().max_by_key(|t| (right(*t), (100.0 * t) as usize)).unwrap_or(0.5)
}

fn judge(run: Run) -> anyhow::Result<Judged> {
    let gait = match run.known.symmetric {
        Some(true) => Gait::Symmetric,
        Some(false) => Gait::Asymmetric,
        None => Gait::Unknown,
    };
    let settings = Settings {
        subject: run.known.subject.clone(),
        shooting: run.shooting,
        keys: vec![KEYS],
        components: vec![2],
        partners: false,
        gait,
        method: Method::Auto,
        mirror: Mirroring::Auto,
        amplitude: true,
        band_pass: true,
        time_limit_s: 5.0,
    };
    let found = validate(&settings, &|_, _| true)?;
    let mean_pose = found.mean_pose.mean_deg.max(f64::MIN_POSITIVE);
    let row = &found.rows[0];
    let share = row.cells[0].error.mean_deg / mean_pose;
    let truth = usize::from(share >= USABLE) + usize::from(share >= DOUBTFUL);
    Ok(Judged {
        rig: run.known.rig,
        name: run.known.name,
        kind: run.kind,
        yaw_deg: found.yaw_deg.round(),
        said: NAMES.iter().position(|n| *n == found.verdict).unwrap_or(2),
        truth,
        share,
        floor_share: row.floor.map_or(f64::NAN, |f| f.mean_deg) / mean_pose,
        found,
    })
}

fn runs(data: &Path) -> Vec<Run> {
    let mut runs = Vec::new();
    for known in common::gaits_of_rigs(data).into_iter().chain(common::built_in_gaits()) {
        for yaw_deg in [0.0, 20.0, 40.0, 60.0] {
            for (kind, shooting) in spoilt(&common::steady(42, yaw_deg)) {
                runs.push(Run { known: known.clone(), shooting, kind });
            }
        }
    }
    for known in common::no_gaits(data) {
        for yaw_deg in [0.0, 40.0] {
            let steady = common::steady(42, yaw_deg);
            // 100 frames of a clip that lasts as long, twice as long, or a quarter of it.
            for (kind, frames_per_cycle) in
                [("no gait, once", 100.0), ("no gait, half", 200.0), ("no gait, looped", 24.3)]
            {
                let known = known.clone();
                let shooting = Shooting { frames_per_cycle, ..steady.clone() };
                let still = known.name.contains("Idle") || known.name.contains("Survey");
                let kind =
                    if still { kind.replace("no gait", "standing") } else { kind.to_owned() };
                runs.push(Run { known, shooting, kind });
            }
        }
    }
    runs
}

/// What is done to a gait.
fn spoilt(steady: &Shooting) -> Vec<(String, Shooting)> {
    let mut list = Vec::new();
    for noise in [0.15, 0.5] {
        for cycles in [1.0, 1.5, 2.0, 3.0, 5.0] {
            let frames = (cycles * steady.frames_per_cycle).round() as usize;
            let kind = format!("gait, {cycles} strides, noise {noise}");
            list.push((kind, Shooting { noise, frames, ..steady.clone() }));
        }
    }
    let changed = |change: &dyn Fn(&mut Shooting)| {
        let mut shooting = steady.clone();
        change(&mut shooting);
        shooting
    };
    let mut push = |kind: &str, shooting| list.push((format!("gait, {kind}"), shooting));
    push("30 % of masks broken", changed(&|s| s.unsteady.broken_masks = 0.3));
    push("strides vary by 30 %", changed(&|s| s.unsteady.stride_variation = 0.3));
    push("speed drifts by 80 %", changed(&|s| s.unsteady.speed_drift = 0.8));
    push("6.3 frames a stride", changed(&|s| s.frames_per_cycle = 6.3));
    push("3.4 frames a stride", changed(&|s| s.frames_per_cycle = 3.4));
    push("64 × 48 pixels, noise 0.5", changed(&|s| (s.size_px, s.noise) = ((64, 48), 0.5)));
    list
}
