//! Clips with true masks, and how far found silhouettes are from them. Also used by
//! `examples/silhouettes.rs`, which prints what the test only bounds.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use muybridge::image::{Picture, Rectangle};
use muybridge::mask::Mask;
use muybridge::numeric::GridCut;
use muybridge::silhouette::{
    ClipSegmenter, FrameReport, Labels, Settings, flag_area_jumps, flag_companions,
    flag_occlusions, least_sure,
};
use rayon::prelude::*;

/// The clips, all shot at 24 frames a second.
pub(crate) const CLIPS: [&str; 4] = ["flamingo", "camel", "horsejump-low", "rhino"];
const FPS: f64 = 24.0;

/// Overlap (Jaccard) with a true mask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Overlap {
    /// Of the whole masks.
    pub(crate) whole: f64,
    /// Inside the lower third of the true mask's box, where the legs are.
    pub(crate) legs: f64,
}

impl Overlap {
    fn of(found: &Mask, truth: &Mask) -> Option<Self> {
        let b = truth.bounds()?;
        let top = b.top + 2 * b.height() / 3;
        let lower = Mask::from_fn(truth.width(), truth.height(), |x, y| {
            (top..=b.bottom).contains(&y) && (b.left..=b.right).contains(&x)
        });
        let legs = found.and(&lower).jaccard(&truth.and(&lower));
        Some(Self { whole: found.jaccard(truth), legs })
    }

    /// The mean of some; of none, not a number.
    pub(crate) fn mean<'a>(all: impl Iterator<Item = &'a Self>) -> Self {
        let (mut whole, mut legs, mut n) = (0.0, 0.0, 0.0);
        for overlap in all {
            (whole, legs, n) = (whole + overlap.whole, legs + overlap.legs, n + 1.0);
        }
        Self { whole: whole / n, legs: legs / n }
    }
}

/// A clip of the data folder with its true masks.
pub(crate) struct Clip {
    pictures: Vec<Picture>,
    pub(crate) truth: Vec<Mask>,
    segmenter: ClipSegmenter,
    labels: BTreeMap<usize, Labels>,
}

/// Silhouettes and reports of all frames, flagged as the program flags them.
pub(crate) struct Found {
    pub(crate) masks: Vec<Mask>,
    pub(crate) reports: Vec<FrameReport>,
}

impl Clip {
    /// Read from the data folder and seen by a segmenter with the default settings.
    pub(crate) fn observed(data: &Path, name: &str) -> Self {
        let davis = data.join("video/davis");
        let text = fs::read_to_string(davis.join("rectangles.json")).unwrap();
        let rectangles: serde_json::Value = serde_json::from_str(&text).unwrap();
        let both = &rectangles[name];
        let (pictures, truth) = read(&davis, name);
        Self::new(pictures, truth, rectangle(&both["foreground"]), rectangle(&both["background"]))
    }

    /// Of pictures, their true masks and two rectangles on the first.
    pub(crate) fn new(
        pictures: Vec<Picture>,
        truth: Vec<Mask>,
        foreground: Rectangle,
        background: Rectangle,
    ) -> Self {
        let settings = Settings::default();
        let labels = BTreeMap::new();
        let mut segmenter = ClipSegmenter::new(
            &pictures[0],
            foreground,
            background,
            FPS,
            &settings,
            labels.clone(),
        )
        .unwrap();
        segmenter.observe(&pictures);
        Self { pictures, truth, segmenter, labels }
    }

    /// Works the clip through with the corrections made so far.
    pub(crate) fn outlined(&mut self) -> Found {
        assert!(self.segmenter.draft(&|_, _| true));
        let found: Vec<(Mask, FrameReport)> = self
            .pictures
            .par_iter()
            .enumerate()
            .map_init(GridCut::new, |cut, (t, p)| self.segmenter.outline(t, p, cut))
            .collect();
        let (masks, mut reports): (Vec<Mask>, Vec<FrameReport>) = found.into_iter().unzip();
        flag_occlusions(&mut reports);
        flag_companions(&mut reports);
        flag_area_jumps(&mut reports);
        Found { masks, reports }
    }

    /// Gives the true mask of the frame that the program asks for; `None` when it asks for none.
    pub(crate) fn correct_least_sure(&mut self, found: &Found) -> Option<usize> {
        let frame = least_sure(&found.reports)?;
        self.labels.insert(frame, Labels::whole(&self.truth[frame]));
        self.segmenter.correct(self.labels.clone());
        Some(frame)
    }

    /// The overlap of every frame whose true mask is not empty; frame 0, which the rectangles are
    /// drawn on, is left out.
    pub(crate) fn overlaps(&self, found: &Found) -> Vec<(usize, Overlap)> {
        (found.masks.iter().zip(&self.truth).enumerate().skip(1))
            .filter_map(|(t, (mask, truth))| Some((t, Overlap::of(mask, truth)?)))
            .collect()
    }
}

/// The pictures and true masks of a clip.
pub(crate) fn read(davis: &Path, name: &str) -> (Vec<Picture>, Vec<Mask>) {
    let picture = |file: &PathBuf| Picture::from_dynamic(&image::open(file).unwrap());
    let mask = |file: &PathBuf| Mask::from_image_bytes(file, &fs::read(file).unwrap()).unwrap();
    (
        files(&davis.join("frames").join(name)).par_iter().map(picture).collect(),
        files(&davis.join("masks").join(name)).par_iter().map(mask).collect(),
    )
}

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
