//! The page: complete, self-contained, and safe whatever a shot is called.

use muybridge::report::page::*;
use muybridge::report::plots::Band;
use muybridge::report::{Embedded, ScriptJson};

use super::clip::{self, CYCLE, FPS, FRAMES};
use super::{plots, sheets};

fn full() -> PageData {
    let rows = clip::keys()
        .iter()
        .map(|k| KeyRow {
            key: k.key,
            frame: k.frame,
            time_s: k.frame as f64 / FPS,
            partner_of: k.partner_of,
            pose: (k.key < 5).then(|| format!("KeyPoses, frame {}", k.key)),
        })
        .collect();
    let setting = |name: &str, value: &str, changed| Setting {
        name: name.to_owned(),
        value: value.to_owned(),
        changed,
    };
    let peak = FPS / CYCLE;
    PageData {
        shot: "meadow horse".to_owned(),
        folder: "shots/meadow_horse".to_owned(),
        made_by: "muybridge 0.1.0".to_owned(),
        footage: Some(Footage {
            source: "clips/meadow_horse.mp4".to_owned(),
            kind: "Video".to_owned(),
            frames: FRAMES,
            fps: FPS,
            width: 960,
            height: 540,
        }),
        verdict: Some(VerdictSummary {
            grade: Grade::Doubtful,
            reasons: vec![
                "The first component keeps r = 0.94 within the band, as a gait does.".to_owned(),
                "The second component keeps r = 0.47, below 0.60.".to_owned(),
            ],
            advice: vec!["Draw strokes on frames 30 to 32, where the animal was lost.".to_owned()],
            step_hz: Some(peak),
            stride_hz: Some(peak / 2.0),
        }),
        components: [(0.311, 0.94), (0.199, 0.47), (0.11, 0.04), (0.083, 0.01), (0.05, f64::NAN)]
            .iter()
            .enumerate()
            .map(|(i, &(variance_share, r))| ComponentRow {
                component: i + 1,
                variance_share,
                r: Some(r),
                peak_hz: (i < 3).then_some(peak * if i == 2 { 2.0 } else { 1.0 }),
            })
            .collect(),
        band: Some(Band {
            peak_hz: peak,
            half_hz: peak + 0.35,
            low_hz: peak - 1.05,
            high_hz: peak + 1.05,
        }),
        keys: Some(KeySummary {
            method: "Smallest condition number by branch and bound".to_owned(),
            condition: 1.734,
            proven_optimal: true,
            lower_bound: 1.734,
            rows,
        }),
        weights: Some(WeightSummary {
            weight: [-0.21, 1.08],
            sum: [0.82, 1.31],
            models: Some([4, 9]),
        }),
        animation: Some(AnimationSummary {
            files: vec!["animation.glb".to_owned(), "animation.bvh".to_owned()],
            name: "meadow horse".to_owned(),
            fps: FPS,
            frames: FRAMES,
            nodes: 36,
            largest_step_deg: 14.2,
            largest_step_frame: 31,
            looped: None,
            feet: None,
        }),
        findings: Some(vec![
            Finding {
                first_frame: 16,
                last_frame: 16,
                what: "The silhouette jumped by 61 pixels.".to_owned(),
                confidence: Some(0.81),
                excludes: false,
            },
            Finding {
                first_frame: 30,
                last_frame: 32,
                what: "The animal was lost: no part of the picture looked like it.".to_owned(),
                confidence: None,
                excludes: true,
            },
        ]),
        settings: vec![
            setting("source.frames", "0-59", false),
            setting("segment.foreground", "[412, 190, 260, 180]", true),
            setting("segment.opening_px", "2", false),
            setting("analyze.components", "10", false),
            setting("keys.count", "4", false),
            setting("keys.partners", "true", true),
        ],
        plots: Plots {
            trajectory: Some(plots::a_trajectory()),
            spectra: Some(plots::spectra_of("meadow horse")),
            scores: Some(plots::some_scores()),
            weights: Some(plots::some_weights()),
            silhouettes: Some(plots::some_measures()),
        },
        pictures: Pictures {
            contact_sheet: Some(Embedded::sheet(&sheets::contact(&clip::keys(), (960, 540), true))),
            eigen_sheet: Some(Embedded::sheet(&sheets::eigen())),
        },
        asked: vec![Asked { what: "Gait".to_owned(), value: "canter".to_owned() }],
        warnings: vec!["Mind the third leg.".to_owned()],
        strip: vec![
            StripFrame {
                frame: 7,
                time_s: 7.0 / FPS,
                picture: Some(Embedded::jpeg(&[0xff, 0xd8])),
                outline: "M1 2l3 4-5 6z".to_owned(),
                words: "the animal was lost".to_owned(),
                excludes: true,
            },
            StripFrame { frame: 8, outline: "M1 2l3 4z".to_owned(), ..StripFrame::default() },
        ],
        player: Some(Player {
            width: 320,
            height: 180,
            frames: FRAMES,
            has_rig: true,
            looped: false,
            notes: vec!["Textures are left out.".to_owned()],
            data: ScriptJson::of(&["frame"]).unwrap(),
        }),
        inputs: vec![FileHash { path: "clips/a.mp4".to_owned(), hash: "00ff".to_owned() }],
        files: vec![FileHash {
            path: "analysis/projections.csv".to_owned(),
            hash: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".to_owned(),
        }],
    }
}

#[test]
fn the_full_page_holds_everything_and_asks_for_nothing() {
    let html = page(&full()).unwrap();
    sheets::look("report.html", html.as_bytes());
    assert_eq!(html, page(&full()).unwrap());
    for part in [
        "? Doubtful",
        "KeyPoses, frame 3",
        "−0.21",
        "31.1 %",
        "30 to 32",
        "14.2°",
        "9f86d081",
        "<dt>Gait</dt><dd>canter</dd>",
        "Mind the third leg.",
        "frame 7 · 0.28 s<br>the animal was lost",
        "Textures are left out.",
        "00ff",
        "[\"frame\"]</script>",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert_eq!(html.matches("<figure>\n<svg ").count(), 5);
    assert_eq!(html.matches("<path class=\"outline\"").count(), 1);
    assert_eq!(html.matches("<path class=\"alone\"").count(), 1);
    assert_eq!(html.matches("src=\"data:image/").count(), 3);
    assert_eq!(html.matches("<img ").count(), html.matches(" alt=\"").count());
    assert!(!html.contains("not yet made") && !html.contains("<script src"));
    assert!(html.contains("default-src 'none'"));
    // The one address allowed is the name space of SVG, which is never fetched.
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    assert!(
        !outside.contains("http://") && !outside.contains("https://") && !outside.contains("url(")
    );
}

#[test]
fn what_is_missing_says_how_to_make_it() {
    let empty = PageData {
        shot: "new".to_owned(),
        folder: "shots/new".to_owned(),
        made_by: "muybridge".to_owned(),
        ..PageData::default()
    };
    // The template engine writes a slash as its code, which browsers show as a slash.
    let html = page(&empty).unwrap().replace("&#x2f;", "/");
    sheets::look("report_empty.html", html.as_bytes());
    for command in ["segment", "analyze", "keys", "animate"] {
        assert!(html.contains(&format!("<code>muybridge {command} shots/new</code>")), "{command}");
    }
    assert!(!html.contains("<img") && !html.contains("<svg ") && !html.contains("<script"));
}

#[test]
fn every_word_from_outside_is_escaped() {
    let evil = "<script>alert(1)</script>\"'&".to_owned();
    let mut data = full();
    data.shot = evil.clone();
    data.folder = evil.clone();
    data.made_by = evil.clone();
    data.footage.as_mut().unwrap().source = evil.clone();
    data.footage.as_mut().unwrap().kind = evil.clone();
    let verdict = data.verdict.as_mut().unwrap();
    verdict.reasons = vec![evil.clone()];
    verdict.advice = vec![evil.clone()];
    let keys = data.keys.as_mut().unwrap();
    keys.method = evil.clone();
    keys.rows[0].pose = Some(evil.clone());
    let animation = data.animation.as_mut().unwrap();
    animation.name = evil.clone();
    animation.files = vec![evil.clone()];
    data.findings.as_mut().unwrap()[0].what = evil.clone();
    data.settings[0] = Setting { name: evil.clone(), value: evil.clone(), changed: true };
    data.files[0] = FileHash { path: evil.clone(), hash: evil.clone() };
    data.plots.spectra = Some(plots::spectra_of(&evil));
    data.asked[0] = Asked { what: evil.clone(), value: evil.clone() };
    data.warnings = vec![evil.clone()];
    data.strip[0].words = evil.clone();
    data.inputs[0] = FileHash { path: evil.clone(), hash: evil.clone() };
    let player = data.player.as_mut().unwrap();
    player.notes = vec![evil.clone()];
    player.data = ScriptJson::of(&[&evil]).unwrap();
    let html = page(&data).unwrap();
    assert!(!html.contains("<script>alert") && !html.contains("alert(1)</"));
    // The page's own: the player's data and the player.
    assert_eq!(html.matches("<script").count(), 2);
    assert_eq!(html.matches("</script").count(), 2);
    assert!(html.matches("&lt;script&gt;").count() >= 22);
}
