//! The shot folder: where every file of a shot is, and how it is loaded and saved. No algorithm.

mod camera;
mod drafts;
mod lock;
mod phase_table;
mod record;
mod relative;
mod settings;
mod silhouettes;
mod source;
mod store;
mod stored;
mod tables;
mod template;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

pub use camera::CameraTable;
pub use drafts::{KeptDrafts, KeptFrame};
pub use lock::Lock;
pub use phase_table::PhaseTable;
pub use record::{Freshness, Reads, StageWriter, Written};
pub use relative::relative_to;
pub use settings::{
    Analysis, Animation, Feet, FlaggedFrames, Keys, Method, Mirroring, PoseOfKey, Poses, Root,
    SegmentChoice, ShotFile, Source, SpeedFrom,
};
pub use silhouettes::SilhouetteTable;
pub use source::{DEFAULT_FPS, Input, SYNTHETIC_PREFIX};
pub use store::{hash_file, hash_files, hash_value, read, write_atomically};
pub use stored::{
    BudgetLine, ExpectedDegrees, KeyImage, StoredAnimation, StoredComponent, StoredContact,
    StoredDiagnosis, StoredDrift, StoredFeet, StoredFoot, StoredKeys, StoredLoop, StoredPan,
    StoredPlanting, StoredSegment, StoredStride, StoredTrend,
};
pub use tables::{Projections, WeightTable, number, table};

use crate::error::{Error, Result};
use crate::synthetic::SyntheticFootage;

/// The stages of a shot, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Footage, mattes or strokes to masks.
    Segment,
    /// Masks to coefficients, spectrum and verdict.
    Analyze,
    /// Coefficients to key frames.
    Keys,
    /// Key frames to the weight of each pose in each frame.
    Weights,
    /// Poses and weights to the animated rig.
    Animate,
    /// The outlines over the footage.
    Overlay,
    /// The key images and contact sheet.
    Sheets,
    /// The page and its plots.
    Report,
}

impl Stage {
    /// The name used in records and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Stage::Segment => "segment",
            Stage::Analyze => "analyze",
            Stage::Keys => "keys",
            Stage::Weights => "weights",
            Stage::Animate => "animate",
            Stage::Overlay => "overlay",
            Stage::Sheets => "sheets",
            Stage::Report => "report",
        }
    }
}

/// Paths inside a shot, relative to its folder.
pub mod paths {
    /// The settings.
    pub const SETTINGS: &str = "shot.toml";
    /// Per-frame report of the segmentation.
    pub const SILHOUETTES: &str = "analysis/silhouettes.csv";
    /// How the camera moved.
    pub const CAMERA: &str = "analysis/camera.csv";
    /// The outlines over the footage, flagged frames among them.
    pub const OVERLAY: &str = "analysis/overlay.png";
    /// Coefficients.
    pub const PROJECTIONS: &str = "analysis/projections.csv";
    /// The gait phase of each frame.
    pub const PHASE: &str = "analysis/phase.csv";
    /// The scores over a stride.
    pub const CYCLE: &str = "analysis/cycle.csv";
    /// The stretches between stops, jumps and changes of gait.
    pub const SEGMENTS: &str = "analysis/segments.csv";
    /// Spectra.
    pub const SPECTRUM: &str = "analysis/spectrum.csv";
    /// The verdict.
    pub const DIAGNOSIS: &str = "analysis/diagnosis.json";
    /// The chosen keys.
    pub const KEYS: &str = "keys/keys.json";
    /// The weights.
    pub const WEIGHTS: &str = "keys/weights.csv";
    /// The contact sheet of the keys.
    pub const CONTACT_SHEET: &str = "keys/contact-sheet.png";
    /// What `animate` made.
    pub const ANIMATION: &str = "animation.json";
    /// The same motion as BVH.
    pub const BVH: &str = "animation.bvh";
    /// The page.
    pub const REPORT: &str = "report.html";
    /// Footage and animation side by side.
    pub const MOVIE: &str = "animation.mp4";

    /// The mask of a frame.
    #[must_use]
    pub fn mask(frame: usize) -> String {
        format!("masks/{frame:06}.png")
    }
}

/// A shot folder with its settings.
#[derive(Clone, Debug)]
pub struct Shot {
    folder: PathBuf,
    /// What `shot.toml` says.
    pub settings: ShotFile,
    /// The synthetic footage that was asked for last; clones of the shot share it.
    synthetic: Arc<Mutex<Option<SyntheticFootage>>>,
}

impl Shot {
    /// Opens a shot folder.
    ///
    /// # Errors
    /// [`Error::NoShot`] when there is no `shot.toml`, [`Error::ShotFile`] with the line when it
    /// cannot be understood.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(paths::SETTINGS);
        if !path.is_file() {
            return Err(Error::NoShot { folder: folder.to_owned() });
        }
        let text = String::from_utf8_lossy(&read(&path)?).into_owned();
        let settings: ShotFile = toml::from_str(&text)
            .map_err(|e| Error::ShotFile { path: path.clone(), what: e.to_string() })?;
        settings.check(&path)?;
        Ok(Self::of(folder, settings))
    }

    /// A shot of which nothing is written: to look at a source before the folder is made.
    ///
    /// # Errors
    /// When a setting is out of its range.
    pub fn unsaved(folder: &Path, settings: ShotFile) -> Result<Self> {
        settings.check(&folder.join(paths::SETTINGS))?;
        Ok(Self::of(folder, settings))
    }

    fn of(folder: &Path, settings: ShotFile) -> Self {
        Self { folder: folder.to_owned(), settings, synthetic: Arc::default() }
    }

    /// Makes a shot folder with a fully commented `shot.toml`.
    ///
    /// # Errors
    /// [`Error::ShotExists`] when there is one already and `force` is not set.
    pub fn create(folder: &Path, settings: ShotFile, force: bool) -> Result<Self> {
        let path = folder.join(paths::SETTINGS);
        if path.exists() && !force {
            return Err(Error::ShotExists { folder: folder.to_owned() });
        }
        settings.check(&path)?;
        let shot = Self::of(folder, settings);
        write_atomically(&path, template::text(&shot.settings, &shot.name()).as_bytes())?;
        Ok(shot)
    }

    /// Writes changed settings into `shot.toml`; comments, order and everything else the user wrote
    /// stay.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save_settings(&self) -> Result<()> {
        let path = self.folder.join(paths::SETTINGS);
        self.settings.check(&path)?;
        let text = String::from_utf8_lossy(&read(&path)?).into_owned();
        match template::updated(&text, &self.settings) {
            Some(updated) if updated == text => Ok(()),
            Some(updated) => write_atomically(&path, updated.as_bytes()),
            None => {
                write_atomically(&path, template::text(&self.settings, &self.name()).as_bytes())
            }
        }
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A path inside the folder, or relative to it. `..` is resolved by name, so that a source can
    /// be found before the folder exists.
    #[must_use]
    pub fn path(&self, inside: &str) -> PathBuf {
        relative::joined(&self.folder, inside)
    }

    /// The folder's name.
    #[must_use]
    pub fn name(&self) -> String {
        let absolute = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        absolute.file_name().map_or_else(|| "shot".to_owned(), |n| n.to_string_lossy().into_owned())
    }

    /// Frames a second: what the settings say, or 25.
    #[must_use]
    pub fn fps(&self) -> f64 {
        self.settings.source.fps.unwrap_or(DEFAULT_FPS)
    }

    /// Keeps other processes out until the lock is dropped.
    ///
    /// # Errors
    /// [`Error::ShotBusy`].
    pub fn lock(&self) -> Result<Lock> {
        lock::lock(&self.folder)
    }

    /// Whether a stage has to run, given what it would read.
    #[must_use]
    pub fn freshness(&self, stage: Stage, reads: &Reads) -> Freshness {
        record::freshness(&self.folder, stage, reads)
    }

    /// The files a stage made when it last ran, sorted; none when it never ran.
    #[must_use]
    pub fn made_files(&self, stage: Stage) -> Vec<String> {
        record::made_files(&self.folder, stage)
    }

    /// What a stage read when it last ran.
    #[must_use]
    pub fn recorded_reads(&self, stage: Stage) -> Reads {
        record::recorded_reads(&self.folder, stage)
    }

    /// Begins to write a stage's files.
    ///
    /// # Errors
    /// When the staging folder cannot be made.
    pub fn begin(&self, stage: Stage, reads: Reads, force: bool) -> Result<StageWriter> {
        StageWriter::new(&self.folder, stage, reads, force)
    }

    /// Files of a stage that were edited by hand.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn edited_files(&self, stage: Stage) -> Result<Vec<String>> {
        record::edited_files(&self.folder, stage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shot_is_made_opened_and_changed() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("cheetah");
        let mut settings = ShotFile::default();
        settings.source.from = Some("../clip.mp4".to_owned());
        let mut shot = Shot::create(&folder, settings.clone(), false).unwrap();
        assert!(matches!(Shot::create(&folder, settings, false), Err(Error::ShotExists { .. })));
        assert_eq!(shot.name(), "cheetah");
        shot.settings.keys.count = 7;
        shot.save_settings().unwrap();
        assert_eq!(Shot::open(&folder).unwrap().settings, shot.settings);
    }

    #[test]
    fn a_missing_or_broken_shot_file_is_said_with_its_line() {
        let dir = tempfile::tempdir().unwrap();
        assert!(matches!(Shot::open(dir.path()), Err(Error::NoShot { .. })));
        std::fs::write(dir.path().join("shot.toml"), "[keys]\ncount = 4\ncuont = 5\n").unwrap();
        let error = Shot::open(dir.path()).unwrap_err();
        assert!(matches!(error, Error::ShotFile { .. }));
        assert!(error.to_string().contains("line 3"), "{error}");
        std::fs::write(dir.path().join("shot.toml"), "[source]\nfps = nan\n").unwrap();
        assert!(matches!(Shot::open(dir.path()), Err(Error::BadFrameRate { .. })));
    }
}
