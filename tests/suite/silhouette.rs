//! Segmentation against the true masks of real footage, where that footage is there.

use std::fs;
use std::path::{Path, PathBuf};

use muybridge::image::{Picture, Rectangle};
use muybridge::mask::Mask;
use muybridge::silhouette::{Segmenter, Settings};

use crate::data::data_folder;

/// Clip, and the mean overlap (Jaccard, frame 0 left out) it must reach: a little under what was
/// measured.
const CLIPS: [(&str, f64); 4] =
    [("flamingo", 0.59), ("camel", 0.58), ("horsejump-low", 0.63), ("rhino", 0.74)];

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

fn rectangle(value: &serde_json::Value) -> Rectangle {
    let n: Vec<usize> =
        value.as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as usize).collect();
    Rectangle { x: n[0], y: n[1], width: n[2], height: n[3] }
}

/// Overlap of the whole masks and inside the lower third of the true mask's box, where the legs
/// are.
fn overlaps(found: &Mask, truth: &Mask) -> Option<(f64, f64)> {
    let b = truth.bounds()?;
    let legs = b.top + 2 * b.height() / 3;
    let lower = Mask::from_fn(truth.width(), truth.height(), |x, y| {
        (legs..=b.bottom).contains(&y) && (b.left..=b.right).contains(&x)
    });
    Some((found.jaccard(truth), found.and(&lower).jaccard(&truth.and(&lower))))
}

#[test]
fn silhouettes_of_real_animals_overlap_the_true_ones() {
    let Some(data) = data_folder() else { return };
    let davis = data.join("video/davis");
    let text = fs::read_to_string(davis.join("rectangles.json")).unwrap();
    let rectangles: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (clip, floor) in CLIPS {
        let frames = files(&davis.join("frames").join(clip));
        let masks = files(&davis.join("masks").join(clip));
        let both = &rectangles[clip];
        let mut segmenter: Option<Segmenter> = None;
        let (mut whole, mut legs, mut lost) = (Vec::new(), Vec::new(), 0);
        for (frame, mask) in frames.iter().zip(&masks) {
            let picture = Picture::from_dynamic(&image::open(frame).unwrap());
            let segmenter = segmenter.get_or_insert_with(|| {
                let (f, b) = (rectangle(&both["foreground"]), rectangle(&both["background"]));
                Segmenter::new(&picture, f, b, &Settings::default()).unwrap()
            });
            let (found, report) = segmenter.push(&picture, None);
            let truth = Mask::from_image_bytes(mask, &fs::read(mask).unwrap()).unwrap();
            lost += usize::from(report.centre_px.is_none());
            if let Some((w, l)) = overlaps(&found, &truth) {
                whole.push(w);
                legs.push(l);
            }
        }
        let mean = |v: &[f64]| v[1..].iter().sum::<f64>() / (v.len() - 1) as f64;
        eprintln!(
            "{clip}: J {:.3}, legs {:.3}, lost {lost} of {}",
            mean(&whole),
            mean(&legs),
            frames.len()
        );
        assert!(mean(&whole) >= floor, "{clip}: {:.3}", mean(&whole));
    }
}
