//! Real horses filmed from the side, from two rectangles to a verdict, against the key points that a
//! network found on the same videos.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use muybridge::mask::{Connectivity, Mask, components};
use serde_json::Value;

use crate::data::data_folder;
use crate::shot_folder::Desk;

/// Key points of less likelihood are not believed.
const LEAST_LIKELIHOOD: f64 = 0.9;

const HOOVES: [&str; 4] = ["RightFrontHoof", "LeftFrontHoof", "RightHindHoof", "LeftHindHoof"];

/// What is held of each clip, a little under what was measured: the share of frames whose hooves lie on
/// the silhouette, the correlations of components 1 and 2 with their band-passed selves, the most
/// that the second difference of ln area may be, and how far the step's frequency may be from that of
/// the key points, as a share. What is aimed at is .9, .6, .6, .15 and .03 for all. Seen from a side
/// that changes, the steps of the third seem shorter than they are.
const CLIPS: [(&str, f64, [f64; 2], f64, f64); 4] = [
    ("cento", 0.9, [0.75, 0.75], 0.15, 0.03),
    ("belle", 0.95, [0.85, 0.8], 0.15, 0.03),
    ("smarty", 0.9, [0.9, 0.9], 0.15, 0.04),
    ("annie", 0.9, [0.85, 0.85], 0.15, 0.03),
];

/// A key point in one frame, pixels; `None` where the network was not sure.
type Track = Vec<Option<(f64, f64)>>;

fn key_points(file: &Path) -> HashMap<String, Track> {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut tracks: HashMap<String, Track> = HashMap::new();
    for line in lines {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap_or(f64::NAN)).collect();
        for (at, name) in header.iter().enumerate() {
            let Some(part) = name.strip_suffix("_x") else { continue };
            let sure = values[at + 2] >= LEAST_LIKELIHOOD;
            let point = sure.then_some((values[at], values[at + 1]));
            tracks.entry(part.to_owned()).or_default().push(point);
        }
    }
    tracks
}

/// Frames a stride by the key points: the period whose sinusoid, with a linear trend, explains best how far
/// the left hoof is before the right one, of both pairs. Two hooves are seen together two to three times as
/// often as a hoof with withers and hip.
fn stride_frames(points: &HashMap<String, Track>) -> f64 {
    let apart = |pair: &[&str]| -> Vec<(f64, f64)> {
        let both = points[pair[0]].iter().zip(&points[pair[1]]).enumerate();
        both.filter_map(|(t, (right, left))| Some((t as f64, (*left)?.0 - (*right)?.0))).collect()
    };
    let series: Vec<Vec<(f64, f64)>> = HOOVES.chunks(2).map(apart).collect();
    let left_over = |period: f64| -> f64 {
        series.iter().map(|points| residual(points, std::f64::consts::TAU / period)).sum()
    };
    (240..800)
        .map(|step| f64::from(step) * 0.05)
        .min_by(|a, b| left_over(*a).total_cmp(&left_over(*b)))
        .unwrap()
}

/// Sum of squares left of a series by least squares with 1, t, cos and sin.
fn residual(points: &[(f64, f64)], rate_rad: f64) -> f64 {
    use nalgebra::{DMatrix, DVector};
    let rows = points.len();
    let basis = DMatrix::from_fn(rows, 4, |row, column| {
        let t = points[row].0;
        match column {
            0 => 1.0,
            1 => t / 100.0,
            2 => (rate_rad * t).cos(),
            _ => (rate_rad * t).sin(),
        }
    });
    let values = DVector::from_fn(rows, |row, _| points[row].1);
    let solved = basis.clone().svd(true, true).solve(&values, 1e-9).unwrap();
    (values - basis * solved).norm_squared()
}

fn masks(folder: &Path) -> Vec<Mask> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
        .iter()
        .filter(|file| file.extension().is_some_and(|e| e == "png"))
        .map(|file| Mask::from_image_bytes(file, &fs::read(file).unwrap()).unwrap())
        .collect()
}

/// Whether a point lies within `reach` pixels of the mask, on a grid of every other pixel.
fn near(mask: &Mask, (x, y): (f64, f64), reach: f64) -> bool {
    let span = |at: f64, size: usize| {
        let low = (at - reach).max(0.0) as usize;
        low..((at + reach).max(0.0) as usize + 1).min(size)
    };
    span(y, mask.height()).any(|py| {
        span(x, mask.width())
            .any(|px| (px as f64 - x).hypot(py as f64 - y) <= reach && mask.get(px, py))
    })
}

fn rectangle(value: &Value) -> String {
    let n: Vec<String> = value.as_array().unwrap().iter().map(Value::to_string).collect();
    n.join(",")
}

#[test]
fn two_rectangles_give_whole_horses_at_a_walk() {
    let Some(data) = data_folder() else { return };
    let folder = data.join("video/horse_walk");
    let text = fs::read_to_string(folder.join("rectangles.json")).unwrap();
    let rectangles: serde_json::Map<String, Value> = serde_json::from_str(&text).unwrap();
    let mut faults = Vec::new();
    for (name, both) in &rectangles {
        let points = key_points(&folder.join(format!("{name}.dlc.csv")));
        let desk = Desk::new();
        let video = folder.join(format!("{name}.avi"));
        desk.run(&format!(
            "-q new shot --from {} --foreground {} --background {}",
            video.display(),
            rectangle(&both["foreground"]),
            rectangle(&both["background"])
        ))
        .success();
        let segmented = desk.json("segment shot");
        let diagnosis = desk.json("analyze shot");
        let masks = masks(&desk.path("shot/masks"));
        let (_, hooves, least_r, smooth, step_slack) =
            CLIPS.into_iter().find(|clip| name.contains(clip.0)).unwrap();
        let mut fault = |what: String| faults.push(format!("{name}: {what}"));

        let lines = segmented["silhouettes"].as_array().unwrap();
        let flagged: Vec<bool> = lines.iter().map(is_doubted).collect();
        let pieces: Vec<usize> =
            masks.iter().map(|m| components(m, Connectivity::Eight).len()).collect();
        if pieces.iter().any(|&n| n != 1) {
            fault(format!("components a frame {pieces:?}"));
        }
        let log_area: Vec<f64> = masks.iter().map(|m| (m.area() as f64).ln()).collect();
        let roughest = (1..masks.len() - 1)
            .filter(|&t| !flagged[t - 1] && !flagged[t] && !flagged[t + 1])
            .map(|t| (log_area[t - 1] - 2.0 * log_area[t] + log_area[t + 1]).abs())
            .fold(0.0, f64::max);
        if roughest >= smooth {
            fault(format!("second difference of ln area {roughest:.2}"));
        }
        let (met, asked) = hooves_near(&masks, &points);
        if (met as f64) < hooves * asked as f64 {
            fault(format!("hooves on the silhouette in {met} of {asked} frames"));
        }
        let r = |pc: usize| diagnosis["components"][pc]["r"].as_f64().unwrap();
        if r(0) < least_r[0] || r(1) < least_r[1] {
            fault(format!("r {:.2} {:.2}", r(0), r(1)));
        }
        let step = diagnosis["step_frames"].as_f64().unwrap();
        let expected = stride_frames(&points) / 2.0;
        if (expected / step - 1.0).abs() > step_slack {
            fault(format!("step {step:.2} frames, by the key points {expected:.2}"));
        }
        eprintln!(
            "{name}: {} of {} frames flagged, ln area {roughest:.3}, hooves {met} of {asked}, r {:.2} \
             {:.2}, step {step:.2} frames ({expected:.2} by the key points)",
            flagged.iter().filter(|f| **f).count(),
            masks.len(),
            r(0),
            r(1)
        );
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a frame is flagged in a way that keeps it out of the analysis.
fn is_doubted(line: &Value) -> bool {
    line["flags"]
        .as_array()
        .unwrap()
        .iter()
        .any(|flag| !matches!(flag.as_str(), Some("corrected" | "several_pieces")))
}

/// Frames in which all hooves that the network is sure of lie within 3 % of the body's length of the
/// silhouette, and frames with such hooves. The body's length is taken as twice that from withers to
/// hip.
fn hooves_near(masks: &[Mask], points: &HashMap<String, Track>) -> (usize, usize) {
    let (mut met, mut asked) = (0, 0);
    for (t, mask) in masks.iter().enumerate() {
        let (Some(withers), Some(hip)) = (points["Withers"][t], points["Hip"][t]) else { continue };
        let body = 2.0 * (withers.0 - hip.0).hypot(withers.1 - hip.1);
        let sure: Vec<(f64, f64)> = HOOVES.iter().filter_map(|hoof| points[*hoof][t]).collect();
        if sure.is_empty() {
            continue;
        }
        asked += 1;
        met += usize::from(sure.iter().all(|&hoof| near(mask, hoof, 0.03 * body)));
    }
    (met, asked)
}
