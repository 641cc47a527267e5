//! `.muybridge/drafts.json` and `.muybridge/drafts/`: what `segment` keeps for the next correction, so
//! that only the frames it can change are made again.

use std::path::PathBuf;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::record::STATE_FOLDER;
use super::{Shot, StageWriter};
use crate::error::{Error, Result};
use crate::mask::Mask;
use crate::motion::{CameraPath, CameraStep, Homography};
use crate::silhouette::{BaseDrafts, FrameReport};

/// What was made of one frame, and from what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptFrame {
    /// Hash of the corrections that the frame depends on.
    pub corrections: String,
    /// Hash of the mask file that was made.
    pub mask: String,
    /// What was known of the mask, before the frames were compared with each other.
    pub report: FrameReport,
}

/// What a finished `segment` knows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeptDrafts {
    /// Hash of all that the drafts without corrections depend on.
    pub basis: String,
    /// One entry a frame.
    pub frames: Vec<KeptFrame>,
    /// The drafts of each stretch, in order; `None` where there were none.
    pub stretches: Vec<Option<BaseDrafts>>,
}

#[derive(Serialize, Deserialize)]
struct Document {
    basis: String,
    frames: Vec<KeptFrame>,
    stretches: Vec<Option<StoredStretch>>,
}

/// A stretch's camera; its masks are pictures of their own.
#[derive(Serialize, Deserialize)]
struct StoredStretch {
    /// Hash over the pictures.
    pictures: String,
    /// For each frame the matrix from the frame before, row by row, the share of the background it
    /// explains, and what it leaves unexplained.
    steps: Vec<([f64; 9], f64, f64)>,
}

fn document_name() -> String {
    format!("{STATE_FOLDER}/drafts.json")
}

fn picture_name(frame: usize) -> String {
    format!("{STATE_FOLDER}/drafts/{frame:06}.png")
}

impl KeptDrafts {
    /// What the last run kept, if it worked on the same `basis` and nothing of it was touched since.
    #[must_use]
    pub fn load(shot: &Shot, basis: &str) -> Option<Self> {
        let text = std::fs::read(shot.path(&document_name())).ok()?;
        let document: Document = serde_json::from_slice(&text).ok()?;
        if document.basis != basis {
            return None;
        }
        let mut stretches = Vec::with_capacity(document.stretches.len());
        let mut first = 0;
        for stored in &document.stretches {
            let base = match stored {
                None => None,
                Some(stored) => {
                    let frames = first..first + stored.steps.len();
                    first = frames.end;
                    Some(stored.drafts(frames.map(|t| shot.path(&picture_name(t))).collect())?)
                }
            };
            stretches.push(base);
        }
        Some(Self { basis: document.basis, stretches, frames: document.frames })
    }

    /// Stages the files.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn put(&self, writer: &mut StageWriter) -> Result<()> {
        let mut stretches = Vec::with_capacity(self.stretches.len());
        let mut frame = 0;
        for base in &self.stretches {
            let Some(base) = base else {
                stretches.push(None);
                continue;
            };
            let mut hasher = blake3::Hasher::new();
            for mask in &base.masks {
                let bytes = mask.to_png()?;
                hasher.update(&bytes);
                writer.put(&picture_name(frame), &bytes)?;
                frame += 1;
            }
            let pictures = hasher.finalize().to_hex().to_string();
            let steps = base.path.steps().iter().map(stored_step).collect();
            stretches.push(Some(StoredStretch { pictures, steps }));
        }
        let document =
            Document { basis: self.basis.clone(), frames: self.frames.clone(), stretches };
        let text = serde_json::to_vec(&document)
            .map_err(|e| Error::Document { path: document_name().into(), what: e.to_string() })?;
        writer.put(&document_name(), &text)
    }
}

impl StoredStretch {
    fn drafts(&self, pictures: Vec<PathBuf>) -> Option<BaseDrafts> {
        let mut hasher = blake3::Hasher::new();
        let mut masks = Vec::with_capacity(pictures.len());
        for path in pictures {
            let bytes = std::fs::read(&path).ok()?;
            hasher.update(&bytes);
            masks.push(Mask::from_image_bytes(&path, &bytes).ok()?);
        }
        if hasher.finalize().to_hex().as_str() != self.pictures {
            return None;
        }
        let step = |&(matrix, inliers, residual): &([f64; 9], f64, f64)| {
            let from_previous = Homography::from_matrix(Matrix3::from_row_slice(&matrix))?;
            Some(CameraStep { from_previous, inliers, residual })
        };
        let steps: Option<Vec<CameraStep>> = self.steps.iter().map(step).collect();
        Some(BaseDrafts { path: CameraPath::from_steps(steps?), masks })
    }
}

fn stored_step(step: &CameraStep) -> ([f64; 9], f64, f64) {
    let rows = step.from_previous.matrix().transpose();
    (std::array::from_fn(|at| rows[at]), step.inliers, step.residual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shot::{Reads, Stage};
    use crate::silhouette::report_of_mask;

    #[test]
    fn what_is_kept_comes_back_bit_for_bit_unless_it_was_touched() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("shot");
        let shot = Shot::create(&folder, crate::shot::ShotFile::default(), false).unwrap();
        let mask = |t: usize| Mask::from_fn(70, 31, |x, y| (x * 7 + y * 3 + t) % 5 < 2);
        let step = |t: usize| CameraStep {
            from_previous: Homography::from_matrix(Matrix3::new(
                1.0 + 1e-3 / (t + 1) as f64,
                1e-5,
                0.1 * t as f64,
                -2e-5,
                0.999,
                1.0 / 3.0,
                1e-7,
                0.0,
                1.0,
            ))
            .unwrap(),
            inliers: 0.9,
            residual: 1.0 / 7.0,
        };
        let base = BaseDrafts {
            path: CameraPath::from_steps((0..4).map(step).collect()),
            masks: (0..4).map(mask).collect(),
        };
        let frames = (0..4).map(|t| KeptFrame {
            corrections: format!("c{t}"),
            mask: format!("m{t}"),
            report: report_of_mask(t, &mask(t)),
        });
        let kept = KeptDrafts {
            basis: "b".to_owned(),
            frames: frames.collect(),
            stretches: vec![Some(base), None],
        };
        let mut writer = shot.begin(Stage::Segment, Reads::new(), false).unwrap();
        kept.put(&mut writer).unwrap();
        writer.commit().unwrap();
        assert_eq!(KeptDrafts::load(&shot, "b"), Some(kept));
        assert_eq!(KeptDrafts::load(&shot, "other"), None);
        std::fs::write(shot.path(&picture_name(0)), mask(9).to_png().unwrap()).unwrap();
        assert_eq!(KeptDrafts::load(&shot, "b"), None);
    }
}
