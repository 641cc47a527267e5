//! The plots against stored files (`MUYBRIDGE_REGENERATE=1` writes them anew), and what must
//! hold of any of them.

use std::f64::consts::LN_2;
use std::fs;
use std::path::Path;

use muybridge::report::KeyMark;
use muybridge::report::plots::*;

use super::clip::{self, CYCLE, FPS, FRAMES};

fn matches_golden(name: &str, svg: &Svg) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/report").join(name);
    if std::env::var_os("MUYBRIDGE_REGENERATE").is_some() {
        fs::write(&file, svg.as_str()).unwrap();
    }
    let stored = fs::read_to_string(&file).unwrap().replace("\r\n", "\n");
    assert!(
        stored == svg.as_str(),
        "{name} is not as stored; look at it, and if it is right run with MUYBRIDGE_REGENERATE=1"
    );
}

pub(super) fn a_trajectory() -> Svg {
    let points: Vec<[f64; 2]> =
        clip::raw(0).into_iter().zip(clip::raw(1)).map(|(a, b)| [a, b]).collect();
    trajectory(&Trajectory {
        shot: "meadow horse",
        points: &points,
        keys: &clip::keys(),
        cycle_frames: Some(CYCLE),
    })
    .unwrap()
}

pub(super) fn spectra_of(shot: &str) -> Svg {
    let frequencies: Vec<f64> = (0..=30).map(|k| k as f64 * FPS / FRAMES as f64).collect();
    let peak = FPS / CYCLE;
    let bump = |f: f64, at: f64, wide: f64| 1.0 / (1.0 + ((f - at) / wide).powi(2));
    let amplitudes: Vec<Vec<f64>> = (0..5)
        .map(|c| {
            let at = [peak, peak, 2.0 * peak, 3.0 * peak, 0.3 * peak][c];
            let high = [1.0, 0.85, 0.3, 0.2, 0.25][c];
            frequencies
                .iter()
                .map(|&f| high * bump(f, at, 0.35) + 0.02 * (1.0 + (7.0 * f).sin()))
                .collect()
        })
        .collect();
    spectra(&Spectra {
        shot,
        frequencies_hz: &frequencies,
        amplitudes: &amplitudes,
        band: Some(Band {
            peak_hz: peak,
            half_hz: peak + 0.35,
            low_hz: peak - 1.05,
            high_hz: peak + 1.05,
        }),
        fps: Some(FPS),
    })
    .unwrap()
}

pub(super) fn some_scores() -> Svg {
    let raw: Vec<Vec<f64>> = (0..4).map(clip::raw).collect();
    let passed: Vec<Vec<f64>> =
        (0..4).map(|c| if c < 2 { clip::clean(c) } else { vec![0.0; FRAMES] }).collect();
    scores(&Scores {
        shot: "meadow horse",
        raw: &raw,
        band_passed: &passed,
        keys: &clip::keys(),
        fps: Some(FPS),
    })
    .unwrap()
}

/// Gaussian weights about each key's phase, which is near enough to the real ones to look at.
pub(super) fn some_weights() -> Svg {
    let keys = clip::keys();
    let curves: Vec<Vec<f64>> = keys
        .iter()
        .map(|k| {
            (0..FRAMES)
                .map(|t| {
                    let d = 2.0
                        * (std::f64::consts::PI * (t as f64 - k.frame as f64) / (2.0 * CYCLE))
                            .sin()
                        * 2.4;
                    1.15 * (-LN_2 * d * d).exp() - 0.08
                })
                .collect()
        })
        .collect();
    let sum: Vec<f64> = (0..FRAMES).map(|t| curves.iter().map(|c| c[t]).sum()).collect();
    let active: Vec<usize> = (0..FRAMES).map(|t| 1 + (t * 4 / 25) % 4).collect();
    let curves: Vec<WeightCurve> = keys
        .iter()
        .zip(&curves)
        .map(|(&mark, values)| WeightCurve { mark, mirrored: false, values })
        .collect();
    weights(&Weights {
        shot: "meadow horse",
        curves: &curves,
        sum: &sum,
        active_model: &active,
        fps: Some(FPS),
    })
    .unwrap()
}

pub(super) fn some_measures() -> Svg {
    let area: Vec<f64> = (0..FRAMES)
        .map(|t| if (30..33).contains(&t) { 0.0 } else { 5200.0 + 300.0 * clip::raw(0)[t] })
        .collect();
    let centre: Vec<[f64; 2]> = (0..FRAMES)
        .map(|t| {
            if (30..33).contains(&t) {
                [f64::NAN; 2]
            } else {
                [130.0 + 1.4 * t as f64, 78.0 + clip::raw(1)[t]]
            }
        })
        .collect();
    let confidence: Vec<f64> = (0..FRAMES)
        .map(|t| if (30..33).contains(&t) { 0.0 } else { 0.9 + 0.1 * clip::clean(0)[t] / 1.5 })
        .collect();
    silhouette_measures(&SilhouetteMeasures {
        shot: "meadow horse",
        area_px: &area,
        centre_px: &centre,
        confidence: &confidence,
        flagged: &[30, 31, 32],
        fps: Some(FPS),
    })
    .unwrap()
}

fn some_errors() -> Svg {
    let curve = |keys: usize, best: f64| ErrorCurve {
        keys,
        points: (1..=8)
            .map(|c| (c, best + if c == 1 { 3.0 } else { 0.35 * (c - 2) as f64 }))
            .collect(),
    };
    error_curves(&ErrorCurves {
        clip: "quaternius_horse.glb, Gallop",
        measure: "Mean angle between true and predicted joint rotations",
        curves: &[curve(2, 8.4), curve(3, 5.3), curve(4, 3.9), curve(5, 3.7)],
        levels: &[
            ReferenceLevel { name: "mean pose".to_owned(), error_deg: 12.2 },
            ReferenceLevel { name: "floor, 4 keys".to_owned(), error_deg: 3.0 },
        ],
    })
    .unwrap()
}

#[test]
fn plots_are_as_stored() {
    matches_golden("trajectory.svg", &a_trajectory());
    matches_golden("spectra.svg", &spectra_of("meadow horse"));
    matches_golden("scores.svg", &some_scores());
    matches_golden("weights.svg", &some_weights());
    matches_golden("silhouettes.svg", &some_measures());
    matches_golden("error_curves.svg", &some_errors());
}

#[test]
fn names_from_outside_are_escaped() {
    let svg = spectra_of("</svg><script>alert('&\"')</script>");
    assert!(!svg.as_str().contains("<script"));
    assert_eq!(svg.as_str().matches("</svg>").count(), 1);
    assert!(
        svg.as_str().contains("aria-label=\"Spectra of the first 5 components of &lt;/svg&gt;")
    );
}

/// Value of a numeric attribute in the `n`-th tag that holds `marker`.
fn attribute(svg: &str, marker: &str, n: usize, name: &str) -> f64 {
    let tag = svg.lines().filter(|l| l.contains(marker)).nth(n).unwrap();
    let start = tag.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
    tag[start..].split('"').next().unwrap().parse().unwrap()
}

#[test]
fn the_trajectory_has_one_scale_on_both_axes() {
    let points = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]];
    let svg = trajectory(&Trajectory { shot: "s", points: &points, keys: &[], cycle_frames: None })
        .unwrap();
    let at = |n: usize| {
        (attribute(svg.as_str(), "<circle", n, "cx"), attribute(svg.as_str(), "<circle", n, "cy"))
    };
    let (origin, right, up) = (at(0), at(1), at(2));
    let unit_x = (right.0 - origin.0) / 2.0;
    let unit_y = origin.1 - up.1;
    assert!(unit_x > 100.0 && (unit_x - unit_y).abs() <= 1.0, "{unit_x} {unit_y}");
    assert_eq!((right.1, up.0), (origin.1, origin.0));
}

#[test]
fn the_band_is_drawn_where_the_labels_say() {
    let svg = spectra_of("s");
    let svg = svg.as_str();
    let band_left = attribute(svg, "fill=\"#F6E3D3\"", 0, "x");
    let band_wide = attribute(svg, "fill=\"#F6E3D3\"", 0, "width");
    // Tick labels follow their own tags; the place of 2 Hz and of 4 Hz gives the scale.
    let lines: Vec<&str> = svg.lines().collect();
    let place = |label: &str| {
        let i = lines.iter().position(|l| *l == label).unwrap();
        attribute(lines[i - 1], "<text", 0, "x")
    };
    let hz = (place("4") - place("2")) / 2.0;
    let peak = FPS / CYCLE;
    assert!((band_wide - 2.1 * hz).abs() < 3.0);
    assert!((band_left - (place("2") + (peak - 1.05 - 2.0) * hz)).abs() < 3.0);
}

#[test]
fn degenerate_data_give_a_plot_all_the_same() {
    let nan = vec![f64::NAN; 3];
    let constant = vec![2.0; 5];
    let far = KeyMark { key: 1, frame: 99, partner_of: None };
    let all = [
        trajectory(&Trajectory {
            shot: "",
            points: &[],
            keys: &[far],
            cycle_frames: Some(f64::NAN),
        }),
        trajectory(&Trajectory {
            shot: "",
            points: &[[f64::NAN, 1.0]; 4],
            keys: &[far],
            cycle_frames: Some(0.0),
        }),
        spectra(&Spectra { shot: "", frequencies_hz: &[], amplitudes: &[], band: None, fps: None }),
        spectra(&Spectra {
            shot: "",
            frequencies_hz: &[0.0, 1.0, 2.0],
            amplitudes: std::slice::from_ref(&nan),
            band: None,
            fps: Some(0.0),
        }),
        scores(&Scores { shot: "", raw: &[], band_passed: &[], keys: &[far], fps: None }),
        scores(&Scores {
            shot: "",
            raw: &[constant],
            band_passed: &[],
            keys: &[far],
            fps: Some(25.0),
        }),
        weights(&Weights { shot: "", curves: &[], sum: &[], active_model: &[], fps: None }),
        error_curves(&ErrorCurves { clip: "", measure: "", curves: &[], levels: &[] }),
        silhouette_measures(&SilhouetteMeasures {
            shot: "",
            area_px: &nan,
            centre_px: &[],
            confidence: &[],
            flagged: &[7],
            fps: None,
        }),
    ];
    for svg in all {
        let svg = svg.unwrap();
        assert!(svg.as_str().starts_with("<svg ") && svg.as_str().ends_with("</svg>\n"));
        assert!(!svg.as_str().contains("NaN") && !svg.as_str().contains("2147483647"));
    }
}
