//! Segmentation against the true masks of real footage, where that footage is there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use muybridge::image::{Picture, Rectangle};
use muybridge::mask::Mask;
use muybridge::numeric::GridCut;
use muybridge::silhouette::{ClipSegmenter, FrameReport, Labels, Settings, least_sure};
use rayon::prelude::*;

use crate::data::data_folder;

/// Clip, and the mean overlap (Jaccard, frame 0 left out) it must reach: a little under what was
/// measured; then the same with three corrected frames.
const CLIPS: [(&str, f64, f64); 4] = [
    ("flamingo", 0.90, 0.89),
    ("camel", 0.87, 0.89),
    ("horsejump-low", 0.77, 0.83),
    ("rhino", 0.81, 0.86),
];

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

/// A clip of the data folder with its true masks.
struct Clip {
    pictures: Vec<Picture>,
    truth: Vec<Mask>,
    segmenter: ClipSegmenter,
}

impl Clip {
    fn observed(data: &Path, name: &str) -> Self {
        let davis = data.join("video/davis");
        let text = fs::read_to_string(davis.join("rectangles.json")).unwrap();
        let rectangles: serde_json::Value = serde_json::from_str(&text).unwrap();
        let both = &rectangles[name];
        let (f, b) = (rectangle(&both["foreground"]), rectangle(&both["background"]));
        let pictures: Vec<Picture> = files(&davis.join("frames").join(name))
            .iter()
            .map(|file| Picture::from_dynamic(&image::open(file).unwrap()))
            .collect();
        let truth = files(&davis.join("masks").join(name))
            .iter()
            .map(|mask| Mask::from_image_bytes(mask, &fs::read(mask).unwrap()).unwrap())
            .collect();
        let settings = Settings::default();
        let mut segmenter =
            ClipSegmenter::new(&pictures[0], f, b, 24.0, &settings, BTreeMap::new()).unwrap();
        segmenter.observe(&pictures);
        Self { pictures, truth, segmenter }
    }

    fn outlines(&mut self) -> Vec<(Mask, FrameReport)> {
        assert!(self.segmenter.draft(&|_, _| true));
        self.pictures
            .par_iter()
            .enumerate()
            .map_init(GridCut::new, |cut, (t, p)| self.segmenter.outline(t, p, cut))
            .collect()
    }

    /// Mean overlap of the whole and of the legs, frame 0 left out.
    fn measured(&self, found: &[(Mask, FrameReport)], frames: usize) -> (f64, f64) {
        let each: Vec<(f64, f64)> = found
            .iter()
            .zip(&self.truth)
            .skip(1)
            .take(frames)
            .filter_map(|((mask, _), truth)| overlaps(mask, truth))
            .collect();
        let n = each.len() as f64;
        (each.iter().map(|e| e.0).sum::<f64>() / n, each.iter().map(|e| e.1).sum::<f64>() / n)
    }
}

/// Two rectangles alone, then up to three frames corrected, each the one the segmenter is least sure
/// of.
#[test]
fn silhouettes_of_real_animals_overlap_the_true_ones() {
    let Some(data) = data_folder() else { return };
    for (name, floor, corrected_floor) in CLIPS {
        let mut clip = Clip::observed(&data, name);
        let mut found = clip.outlines();
        let all = found.len();
        let (whole, legs) = clip.measured(&found, all);
        eprintln!(
            "{name}: J {whole:.3}, legs {legs:.3}; frames 1 to 30 J {:.3}, legs {:.3}",
            clip.measured(&found, 30).0,
            clip.measured(&found, 30).1
        );
        assert!(whole >= floor, "{name}: {whole:.3}");
        let mut labels = BTreeMap::new();
        for _ in 0..3 {
            let reports: Vec<FrameReport> = found.iter().map(|f| f.1).collect();
            let Some(worst) = least_sure(&reports) else { break };
            labels.insert(worst, Labels::whole(&clip.truth[worst]));
            clip.segmenter.correct(labels.clone());
            found = clip.outlines();
            let (whole, legs) = clip.measured(&found, all);
            eprintln!("{name}: frame {worst} corrected: J {whole:.3}, legs {legs:.3}");
        }
        let (whole, _) = clip.measured(&found, all);
        assert!(whole >= corrected_floor, "{name}: {whole:.3}");
    }
}
