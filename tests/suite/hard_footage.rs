//! Silhouettes of planted footage with what makes them hard to find, against the true masks: every
//! frame is good or flagged, with the default settings and two rectangles a clip.

use std::fs;
use std::path::Path;

use muybridge::frames::{self, FrameSource, SourceSpec};
use muybridge::image::Picture;
use muybridge::mask::Mask;
use muybridge::synthetic::{HardFootage, Hardship};
use rayon::prelude::*;

use crate::davis::{Clip, Found, Overlap};
use crate::shot_folder::Desk;

const SEED: u64 = 7;

/// A frame without an excluding flag overlaps the whole animal by at least this (Jaccard), also
/// where something hides a part of it.
const GOOD: f64 = 0.75;

/// What is held of one kind of footage, a little under what was measured.
struct Bounds {
    hardship: Hardship,
    frames: usize,
    /// Mean overlap of the frames without an excluding flag, whole and in the lower third.
    mean: Overlap,
    /// Most of the frames in which the animal is whole, alone and inside that may be flagged.
    flagged_for_nothing: usize,
}

const fn bounds(hardship: Hardship, frames: usize, whole: f64, legs: f64) -> Bounds {
    Bounds { hardship, frames, mean: Overlap { whole, legs }, flagged_for_nothing: 5 }
}

/// The footage with its pictures drawn.
struct Planted {
    footage: HardFootage,
    pictures: Vec<Picture>,
}

impl Planted {
    fn new(hardship: Hardship, pans: bool, frames: usize) -> Self {
        let footage = HardFootage::new(hardship, pans, frames, SEED);
        let pictures = (0..frames).into_par_iter().map(|t| footage.picture(t)).collect();
        Self { footage, pictures }
    }

    fn truth(&self) -> Vec<Mask> {
        (0..self.pictures.len()).map(|t| self.footage.true_mask(t)).collect()
    }

    /// Masks and reports of the pictures, or of others of the same frames.
    fn found(&self, pictures: Vec<Picture>) -> (Clip, Found) {
        let (foreground, background) = self.footage.rectangles();
        let mut clip = Clip::new(pictures, self.truth(), foreground, background);
        let found = clip.outlined();
        (clip, found)
    }

    /// Frames in which nothing is wrong with the animal: whole, inside the picture and alone.
    fn plain(&self) -> Vec<usize> {
        (0..self.pictures.len()).filter(|&t| self.footage.is_plain(t)).collect()
    }
}

/// Checks one kind of footage and gives what was found.
fn check(
    planted: &Planted,
    pictures: Vec<Picture>,
    bounds: &Bounds,
    faults: &mut Vec<String>,
) -> Found {
    let what = format!("{:?}, {}", bounds.hardship, planted.footage.camera_moves());
    let (clip, found) = planted.found(pictures);
    let overlaps = clip.overlaps(&found);
    let used: Vec<&(usize, Overlap)> =
        overlaps.iter().filter(|(t, _)| !found.reports[*t].is_excluded()).collect();
    let mean = Overlap::mean(used.iter().map(|o| &o.1));
    let worst = used.iter().map(|o| o.1.whole).fold(1.0, f64::min);
    let plain = planted.plain();
    let for_nothing = plain.iter().filter(|t| found.reports[**t].is_excluded()).count();
    let sure = used.iter().map(|o| found.reports[o.0].confidence).sum::<f64>() / used.len() as f64;
    eprintln!(
        "{what}: J {:.3} (worst {worst:.2}), legs {:.3}, confidence {sure:.2}, {} of {} used, {for_nothing} of {} plain \
         frames flagged",
        mean.whole,
        mean.legs,
        used.len(),
        overlaps.len(),
        plain.len()
    );
    if worst < GOOD {
        let bad: Vec<usize> = used.iter().filter(|o| o.1.whole < GOOD).map(|o| o.0).collect();
        faults.push(format!("{what}: bad and not flagged {bad:?}"));
    }
    if mean.whole < bounds.mean.whole || mean.legs < bounds.mean.legs {
        faults.push(format!("{what}: {mean:?}"));
    }
    if for_nothing > bounds.flagged_for_nothing {
        faults.push(format!("{what}: {for_nothing} plain frames flagged"));
    }
    // A frame in which nothing is to be seen has no silhouette.
    for t in (0..planted.pictures.len()).filter(|&t| planted.footage.visible_mask(t).is_empty()) {
        if !found.reports[t].is_excluded() {
            faults.push(format!("{what}: something seen in frame {t}"));
        }
    }
    found
}

fn check_all(all: &[Bounds]) {
    let mut faults = Vec::new();
    for bounds in all {
        for pans in [false, true] {
            // A camera that pans along keeps the animal inside.
            if pans && bounds.hardship == Hardship::Passage {
                continue;
            }
            let planted = Planted::new(bounds.hardship, pans, bounds.frames);
            check(&planted, planted.pictures.clone(), bounds, &mut faults);
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn an_animal_is_found_again_behind_what_hides_it() {
    check_all(&[bounds(Hardship::Trunk, 100, 0.86, 0.73), bounds(Hardship::Post, 60, 0.86, 0.74)]);
}

#[test]
fn a_second_animal_of_the_same_colour_does_not_take_over() {
    check_all(&[
        bounds(Hardship::Neighbour, 60, 0.89, 0.76),
        bounds(Hardship::Crossing, 100, 0.88, 0.74),
    ]);
}

#[test]
fn a_cast_shadow_is_left_out() {
    check_all(&[bounds(Hardship::Shadow, 60, 0.85, 0.75)]);
}

#[test]
fn one_that_shrinks_or_crosses_the_border_is_followed() {
    check_all(&[
        bounds(Hardship::None, 60, 0.88, 0.75),
        bounds(Hardship::Retreat, 60, 0.84, 0.66),
        bounds(Hardship::Passage, 100, 0.88, 0.76),
    ]);
}

#[test]
fn noise_and_changing_light_cost_little() {
    check_all(&[bounds(Hardship::Noise, 60, 0.88, 0.79), bounds(Hardship::Light, 60, 0.90, 0.80)]);
}

/// Pictures as PNG files.
fn write(pictures: &[Picture], folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    pictures.par_iter().enumerate().for_each(|(t, picture)| {
        let (w, h) = (picture.width() as u32, picture.height() as u32);
        let file = image::RgbImage::from_raw(w, h, picture.rgb().to_vec()).unwrap();
        file.save(folder.join(format!("{t:04}.png"))).unwrap();
    });
}

fn read(folder: &Path) -> (Vec<Picture>, Vec<String>) {
    let mut source = frames::open(&SourceSpec::new(folder)).unwrap();
    let findings = FrameSource::findings(&source);
    let mut pictures = Vec::new();
    while let Some(picture) = source.next_frame().unwrap() {
        pictures.push(picture);
    }
    (pictures, findings)
}

#[test]
fn stills_of_interlaced_video_are_read_without_combs() {
    let desk = Desk::new();
    let mut faults = Vec::new();
    for pans in [false, true] {
        let planted = Planted::new(Hardship::Fields, pans, 60);
        write(&planted.pictures, &desk.path(&format!("fields-{pans}")));
        let (pictures, findings) = read(&desk.path(&format!("fields-{pans}")));
        assert!(findings.iter().any(|f| f.contains("interlaced")), "{findings:?}");
        check(&planted, pictures, &bounds(Hardship::Fields, 60, 0.87, 0.73), &mut faults);
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // Noise and plain footage have no combs, and nothing is done to them.
    for hardship in [Hardship::None, Hardship::Noise] {
        let planted = Planted::new(hardship, false, 6);
        let folder = desk.path(&format!("{hardship:?}"));
        write(&planted.pictures, &folder);
        let (pictures, findings) = read(&folder);
        assert_eq!((pictures, findings), (planted.pictures, Vec::new()));
    }
}

/// Numbers of a column of a table.
fn column(table: &str, name: &str) -> Vec<f64> {
    let at = table.lines().next().unwrap().split(',').position(|c| c == name).unwrap();
    let cell = |line: &str| line.split(',').nth(at).unwrap().parse().unwrap();
    table.lines().skip(1).map(cell).collect()
}

#[test]
fn what_was_hidden_stays_out_of_the_analysis_and_is_bridged_in_the_animation() {
    let desk = Desk::new();
    let frames = 120;
    let planted = Planted::new(Hardship::Post, true, frames);
    write(&planted.pictures, &desk.path("stills"));
    let (foreground, background) = planted.footage.rectangles();
    let corners =
        |r: muybridge::image::Rectangle| format!("{},{},{},{}", r.x, r.y, r.width, r.height);
    desk.run(&format!(
        "-q new shot --from stills --fps 25 --foreground {} --background {}",
        corners(foreground),
        corners(background)
    ))
    .success();
    desk.run("-q segment shot").success();
    let diagnosis = desk.json("analyze shot");
    let bad: Vec<usize> = diagnosis["bad_frames"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f.as_u64().unwrap() as usize)
        .collect();
    // Behind the post is where less than .86 of the animal is seen.
    let hidden = |t: &usize| {
        let (whole, seen) = (planted.footage.true_mask(*t), planted.footage.visible_mask(*t));
        (seen.area() as f64) < 0.86 * whole.area() as f64
    };
    let hidden: Vec<usize> = (0..frames).filter(hidden).collect();
    assert!(hidden.len() > 4 && hidden.iter().all(|t| bad.contains(t)), "{hidden:?} {bad:?}");
    assert!(bad.len() < frames / 2, "{bad:?}");
    // The step and not half of it, whatever is taken for slow beside the gap.
    let step_frames = diagnosis["step_frames"].as_f64().unwrap();
    let planted_step = HardFootage::STEP_FRAMES;
    assert!((step_frames / planted_step - 1.0).abs() < 0.02, "{step_frames} for {planted_step}");

    let table = fs::read_to_string(desk.path("shot/analysis/projections.csv")).unwrap();
    let (used, pc1) = (column(&table, "used"), column(&table, "pc1"));
    assert_eq!(diagnosis["segments"].as_array().unwrap().len(), 1, "it goes on behind the post");
    for (t, used) in used.iter().enumerate() {
        assert_eq!(*used == 0.0, bad.contains(&t), "{t}");
    }
    // From one seen frame to the next the scores go straight.
    for t in 1..used.len() - 1 {
        if used[t - 1..=t + 1] == [0.0; 3] {
            assert!((pc1[t - 1] - 2.0 * pc1[t] + pc1[t + 1]).abs() < 1e-9, "{t}");
        }
    }

    let keys = desk.json("keys shot -m 4");
    let chosen: Vec<usize> = keys["keys"]
        .as_array()
        .unwrap()
        .iter()
        .map(|k| k["frame"].as_u64().unwrap() as usize)
        .collect();
    assert!(chosen.iter().all(|t| !bad.contains(t)), "{chosen:?}");
    desk.run("samples --out samples").success();
    let poses: String = (1..=4).map(|key| format!(" --pose {key}=Walk@0.{}", 2 * key)).collect();
    let animation = desk.json(&format!("animate shot --rig samples/poses/horse.glb{poses}"));
    assert_eq!(animation["frames"], used.len());
    let weights = fs::read_to_string(desk.path("shot/keys/weights.csv")).unwrap();
    let of_key = column(&weights, "key_1");
    assert_eq!(of_key.len(), used.len());
    let step = |t: usize| (of_key[t] - of_key[t - 1]).abs();
    let largest = |bridged: bool| {
        let there = |t: &usize| (used[*t] == 0.0) == bridged;
        (1..used.len()).filter(there).map(step).fold(0.0, f64::max)
    };
    assert!(largest(true) <= 1.5 * largest(false), "no jump: {} {}", largest(true), largest(false));
}
