//! What the page shows, as plain data.

use serde::Serialize;

use crate::report::plots::{Band, Svg};
use crate::report::{Embedded, ScriptJson};

/// Everything the page shows. What a stage has not made yet is `None` (or empty), and the page
/// says how to make it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PageData {
    /// Name of the shot.
    pub shot: String,
    /// The shot's folder as the user would type it, for the commands the page proposes.
    pub folder: String,
    /// Program and version, "muybridge 0.1.0".
    pub made_by: String,
    /// What the user asked for.
    pub asked: Vec<Asked>,
    /// What to be wary of, a sentence each.
    pub warnings: Vec<String>,
    /// Where the silhouettes came from.
    pub footage: Option<Footage>,
    /// What the analysis said.
    pub verdict: Option<VerdictSummary>,
    /// Components in order of falling variance.
    pub components: Vec<ComponentRow>,
    /// The pass band.
    pub band: Option<Band>,
    /// The key images.
    pub keys: Option<KeySummary>,
    /// Ranges of the weights.
    pub weights: Option<WeightSummary>,
    /// The animation that was written.
    pub animation: Option<AnimationSummary>,
    /// Frames with something to look at; `None` before there are silhouettes.
    pub findings: Option<Vec<Finding>>,
    /// Settings in the order of the shot's file.
    pub settings: Vec<Setting>,
    /// The plots.
    pub plots: Plots,
    /// The sheets.
    pub pictures: Pictures,
    /// Some frames with the outline of the silhouette, in order.
    pub strip: Vec<StripFrame>,
    /// The footage and the animation, side by side.
    pub player: Option<Player>,
    /// What the shot was made from, with hashes.
    pub inputs: Vec<FileHash>,
    /// Files of the shot with their hashes.
    pub files: Vec<FileHash>,
}

/// One thing the user asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Asked {
    /// What it is about: "Rig".
    pub what: String,
    /// What was asked.
    pub value: String,
}

/// One frame of the strip.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StripFrame {
    /// Frame of the footage, from 0.
    pub frame: usize,
    /// Its time, seconds.
    pub time_s: f64,
    /// The picture; `None` without footage.
    pub picture: Option<Embedded>,
    /// The outline as an SVG path, in pixels of the player's picture; empty for an empty mask.
    pub outline: String,
    /// What was noticed about the silhouette; empty for nothing.
    pub words: String,
    /// Whether the frame is left out of the analysis.
    pub excludes: bool,
}

/// The player of footage and animation.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Player {
    /// Width of the pictures and of the outlines' coordinates, pixels.
    pub width: u32,
    /// Height of the same.
    pub height: u32,
    /// Frames of the footage.
    pub frames: usize,
    /// Whether there is a rig to show.
    pub has_rig: bool,
    /// Whether the animation is a loop, which is not in step with the footage.
    pub looped: bool,
    /// What is left out, a sentence each.
    pub notes: Vec<String>,
    /// Pictures, outlines and the rig, for the page's script.
    pub data: ScriptJson,
}

/// Where the silhouettes came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Footage {
    /// As the user gave it.
    pub source: String,
    /// In words: "video", "image sequence", "mattes", "strokes", "synthetic".
    pub kind: String,
    /// Number of frames used.
    pub frames: usize,
    /// Frames a second.
    pub fps: f64,
    /// Width of a frame, pixels.
    pub width: usize,
    /// Height of a frame, pixels.
    pub height: usize,
}

/// The three grades of the verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// The clip carries a gait that the method can use.
    Usable,
    /// It may; the result needs a look.
    Doubtful,
    /// It does not.
    Unusable,
}

/// What the analysis said of the clip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerdictSummary {
    /// The grade.
    pub grade: Grade,
    /// Why, a sentence each.
    pub reasons: Vec<String>,
    /// What to try, a sentence each.
    pub advice: Vec<String>,
    /// Fundamental frequency of the silhouette, Hz.
    pub step_hz: Option<f64>,
    /// Frequency of the whole stride, Hz.
    pub stride_hz: Option<f64>,
}

/// One principal component.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ComponentRow {
    /// Number, from 1.
    pub component: usize,
    /// Share of the variance, from 0 to 1.
    pub variance_share: f64,
    /// Correlation of the component with itself after the band-pass.
    pub r: Option<f64>,
    /// Frequency of its largest amplitude, Hz.
    pub peak_hz: Option<f64>,
}

/// The key images.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct KeySummary {
    /// How they were found, in words.
    pub method: String,
    /// Condition number of the interpolation matrix; 0 for keys that were not chosen by it.
    pub condition: f64,
    /// Whether no other set can be better.
    pub proven_optimal: bool,
    /// Where not proven: no set has a condition number below this.
    pub lower_bound: f64,
    /// One row a key, partners behind their keys.
    pub rows: Vec<KeyRow>,
}

/// One key image.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct KeyRow {
    /// Number, from 1.
    pub key: usize,
    /// Frame of the footage, from 0.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// For a partner, the key it belongs to.
    pub partner_of: Option<usize>,
    /// Which pose of the rig belongs to it, in words; `None` while there is none.
    pub pose: Option<String>,
}

/// Ranges of the weights over all frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WeightSummary {
    /// Smallest and largest weight.
    pub weight: [f64; 2],
    /// Smallest and largest sum of a frame's weights.
    pub sum: [f64; 2],
    /// Number of models and how often the active one changes; `None` without switching.
    pub models: Option<[usize; 2]>,
}

/// The animation that was written.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AnimationSummary {
    /// The files, as paths within or beside the shot.
    pub files: Vec<String>,
    /// Name of the animation in the file.
    pub name: String,
    /// Frames a second.
    pub fps: f64,
    /// Number of frames.
    pub frames: usize,
    /// Number of nodes the animation moves.
    pub nodes: usize,
    /// Largest change of a node's rotation from frame to frame, degrees, and at which frame.
    pub largest_step_deg: f64,
    /// The frame that step leads to.
    pub largest_step_frame: usize,
    /// How a loop closes, in words.
    pub looped: Option<String>,
    /// Feet on the ground.
    pub feet: Option<FeetSummary>,
}

/// Feet on the ground.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FeetSummary {
    /// Name of the gait.
    pub gait: Option<String>,
    /// What to look at, sentences.
    pub warnings: Vec<String>,
    /// Rig units a second.
    pub ground_speed: f64,
    /// Seconds a stride.
    pub stride_s: Option<f64>,
    /// Rig units a stride.
    pub stride_length: Option<f64>,
    /// "in-place" or "travel".
    pub root: String,
    /// What planting did, in words.
    pub planting: Option<String>,
    /// One row a foot.
    pub rows: Vec<FootRow>,
}

/// One foot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FootRow {
    /// The rig's node.
    pub node: String,
    /// Which limb, in words.
    pub limb: String,
    /// Share of the stride on the ground.
    pub duty_factor: Option<f64>,
    /// Share of the stride after the reference foot.
    pub phase: Option<f64>,
    /// Times on the ground in seconds, "0.12–0.40".
    pub contacts: String,
}

/// Frames with something to look at.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Finding {
    /// First frame, from 0.
    pub first_frame: usize,
    /// Last frame, inclusive.
    pub last_frame: usize,
    /// What was found, a sentence.
    pub what: String,
    /// The least confidence of these frames, 0 to 1, where it is known.
    pub confidence: Option<f64>,
    /// Whether it speaks against using these frames.
    pub excludes: bool,
}

/// One setting.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Setting {
    /// Its name with the table's: "segment.opening_px".
    pub name: String,
    /// Its value as written in the file.
    pub value: String,
    /// Whether the user changed it from the default.
    pub changed: bool,
}

/// The plots, each once its data is there.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Plots {
    /// [`trajectory`](crate::report::plots::trajectory).
    pub trajectory: Option<Svg>,
    /// [`spectra`](crate::report::plots::spectra).
    pub spectra: Option<Svg>,
    /// [`scores`](crate::report::plots::scores).
    pub scores: Option<Svg>,
    /// [`weights`](crate::report::plots::weights).
    pub weights: Option<Svg>,
    /// [`silhouette_measures`](crate::report::plots::silhouette_measures).
    pub silhouettes: Option<Svg>,
}

/// The sheets, each once it is made.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Pictures {
    /// [`contact_sheet`](crate::report::sheets::contact_sheet).
    pub contact_sheet: Option<Embedded>,
    /// [`eigen_sheet`](crate::report::sheets::eigen_sheet).
    pub eigen_sheet: Option<Embedded>,
}

impl Pictures {
    /// Letters of the page that they take.
    #[must_use]
    pub fn size(&self) -> usize {
        [&self.contact_sheet, &self.eigen_sheet].into_iter().flatten().map(Embedded::size).sum()
    }
}

impl Plots {
    /// Letters of the page that they take.
    #[must_use]
    pub fn size(&self) -> usize {
        [&self.trajectory, &self.spectra, &self.scores, &self.weights, &self.silhouettes]
            .into_iter()
            .flatten()
            .map(|svg| svg.as_str().len())
            .sum()
    }
}

/// A file of the shot and the hash of its bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FileHash {
    /// Path within the shot.
    pub path: String,
    /// Hash, hexadecimal.
    pub hash: String,
}
