//! How well the pose budget foretells the error: the error expected from silhouettes alone against the
//! true one, 2 to 12 keys, 14 gaits of six animals, four views:
//! `cargo run --release --example budget -- DATA`.
//!
//! The scale of the degrees is fitted anew without the animal that is predicted.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::Path;

use muybridge::shot::{Method, Mirroring};
use muybridge::spectrum::Gait;
use muybridge::validate::{Settings, validate};

#[path = "common/mod.rs"]
mod common;

use common::{median, rank_correlation};

const YAWS_DEG: [f64; 4] = [0.0, 20.0, 45.0, -20.0];

const KEYS: std::ops::RangeInclusive<usize> = 2..=12;

struct Point {
    rig: String,
    /// Clip and view.
    place: usize,
    keys: usize,
    share: f64,
    expected_deg: f64,
    true_deg: f64,
    mean_pose_deg: f64,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let data = Path::new(arguments.first().map_or("../shared/data", String::as_str));
    let points = points(data)?;
    let rigs: Vec<&str> = points.iter().map(|p| p.rig.as_str()).collect();
    // Expected degrees with the scale of the other animals.
    let blind: Vec<f64> = points
        .iter()
        .map(|p| {
            let others: Vec<f64> = points
                .iter()
                .filter(|q| q.rig != p.rig)
                .map(|q| (q.true_deg / q.expected_deg).ln())
                .collect();
            p.expected_deg * (others.iter().sum::<f64>() / others.len() as f64).exp()
        })
        .collect();
    println!(
        "| keys | expected share | true share | expected degrees | true degrees | rank correlation |"
    );
    println!("|---|---|---|---|---|---|");
    for keys in KEYS {
        let own: Vec<usize> = (0..points.len()).filter(|&i| points[i].keys == keys).collect();
        let of = |f: &dyn Fn(usize) -> f64| own.iter().map(|&i| f(i)).collect::<Vec<f64>>();
        println!(
            "| {keys} | {:.1} % | {:.1} % | {:.2} | {:.2} | {:.2} |",
            100.0 * median(&of(&|i| points[i].share)),
            100.0 * median(&of(&|i| points[i].true_deg / points[i].mean_pose_deg)),
            median(&of(&|i| points[i].expected_deg)),
            median(&of(&|i| points[i].true_deg)),
            rank_correlation(&of(&|i| points[i].expected_deg), &of(&|i| points[i].true_deg)),
        );
    }
    let all = |f: &dyn Fn(&Point) -> f64| points.iter().map(f).collect::<Vec<f64>>();
    let truth = all(&|p| p.true_deg);
    println!(
        "\nrank correlation over {} points: share {:.3}, degrees {:.3}, degrees without the animal itself {:.3}",
        points.len(),
        rank_correlation(&all(&|p| p.share), &truth),
        rank_correlation(&all(&|p| p.expected_deg), &truth),
        rank_correlation(&blind, &truth),
    );
    let places = points.iter().map(|p| p.place).max().unwrap_or(0);
    let within: Vec<f64> = (0..=places)
        .map(|place| {
            let own: Vec<&Point> = points.iter().filter(|p| p.place == place).collect();
            let of = |f: &dyn Fn(&Point) -> f64| own.iter().map(|p| f(p)).collect::<Vec<f64>>();
            rank_correlation(&of(&|p| p.share), &of(&|p| p.true_deg))
        })
        .collect();
    println!(
        "within a clip and view: mean {:.3}, least {:.3}",
        within.iter().sum::<f64>() / within.len() as f64,
        within.iter().copied().fold(f64::INFINITY, f64::min)
    );
    let off: Vec<f64> = truth.iter().zip(&blind).map(|(t, b)| (t / b).ln()).collect();
    let rms = (off.iter().map(|o| o * o).sum::<f64>() / off.len() as f64).sqrt();
    let within = |factor: f64| {
        100.0 * off.iter().filter(|o| o.abs() < factor.ln()).count() as f64 / off.len() as f64
    };
    println!(
        "without the animal itself: off by a factor of {:.2} (root mean square of the logarithm), {:.0} % within 1.5, {:.0} % within 2",
        rms.exp(),
        within(1.5),
        within(2.0)
    );
    let mut names = rigs.clone();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let own: Vec<f64> =
            off.iter().zip(&rigs).filter(|(_, r)| **r == name).map(|(o, _)| *o).collect();
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        println!("{name}: true over expected {:.2}", mean.exp());
    }
    Ok(())
}

fn points(data: &Path) -> anyhow::Result<Vec<Point>> {
    let mut points = Vec::new();
    let mut place = 0;
    for known in common::gaits_of_rigs(data).into_iter().chain(common::built_in_gaits()) {
        for yaw_deg in YAWS_DEG {
            let gait =
                if known.symmetric == Some(true) { Gait::Symmetric } else { Gait::Asymmetric };
            let settings = Settings {
                subject: known.subject.clone(),
                shooting: common::steady(42, yaw_deg),
                keys: KEYS.collect(),
                components: vec![2],
                partners: false,
                gait,
                method: Method::Phase,
                mirror: Mirroring::Auto,
                amplitude: true,
                band_pass: true,
                time_limit_s: 5.0,
            };
            let found = validate(&settings, &|_, _| true)?;
            for row in &found.rows {
                let cell = &row.cells[0];
                points.push(Point {
                    rig: known.rig.clone(),
                    place,
                    keys: row.keys,
                    share: cell.expected_error_share.unwrap_or(f64::NAN),
                    expected_deg: cell.expected_error_deg.unwrap_or(f64::NAN),
                    true_deg: cell.error.mean_deg,
                    mean_pose_deg: found.mean_pose.mean_deg,
                });
            }
            place += 1;
        }
    }
    Ok(points)
}
