//! The JSON documents of a shot (`docs/formats.md` describes them), and reading them back.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::store::read;
use super::{Projections, Shot, paths};
use crate::error::{Error, Result};
use crate::feet::Limb;
use crate::interpolate::Seam;
pub use crate::keys::{BudgetLine, ExpectedDegrees};

/// `analysis/diagnosis.json`, which is also what `analyze --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredDiagnosis {
    /// "usable", "doubtful" or "unusable".
    pub verdict: String,
    /// Why, in words, worst first.
    pub reasons: Vec<String>,
    /// What to try, in words.
    pub advice: Vec<String>,
    /// Number of frames.
    pub frames: usize,
    /// Frames a second.
    pub fps: f64,
    /// Repeats of the silhouette in the clip.
    pub cycles: f64,
    /// Repeat frequency of the silhouette, f0: the step frequency of a symmetric gait.
    pub step_hz: f64,
    /// Frames a step.
    pub step_frames: f64,
    /// Stride frequency; null when it cannot be told.
    pub stride_hz: Option<f64>,
    /// Frames a stride; null when it cannot be told.
    pub stride_frames: Option<f64>,
    /// "given", "subharmonic_seen", "two_steps_seen" or "unknown".
    pub stride_basis: String,
    /// What speaks for steps or strides; null when no phase could be measured.
    pub stride: Option<StoredStride>,
    /// What the stride can be: half of the step frequency (symmetric gaits) or the same.
    pub stride_candidates_hz: [f64; 2],
    /// The frequency nearest to the peak with half of its amplitude.
    pub half_amplitude_hz: f64,
    /// Amplitude of PC1 at the peak.
    pub peak_amplitude: f64,
    /// Lower and upper end of the band.
    pub band_hz: [f64; 2],
    /// Phase of PC2 relative to PC1 at the peak, degrees.
    pub quadrature_deg: Option<f64>,
    /// One entry a component.
    pub components: Vec<StoredComponent>,
    /// Width and height of the window the masks were cut to, pixels.
    pub window_px: [usize; 2],
    /// The slow trend of scale; null when too few silhouettes are whole.
    pub scale_trend: Option<StoredTrend>,
    /// The slow change of shape; null when it was not looked for.
    #[serde(default)]
    pub shape_drift: Option<StoredDrift>,
    /// Frames left out of the PCA and bridged: their mask is empty or flagged.
    pub bad_frames: Vec<usize>,
    /// The stretches between stops, jumps and changes of gait; all the rest is of the chosen one.
    #[serde(default)]
    pub segments: Vec<StoredSegment>,
}

impl StoredDiagnosis {
    /// The frames that were analysed, which are the ones that are animated.
    #[must_use]
    pub fn animated_frames(&self) -> std::ops::Range<usize> {
        let chosen = self.segments.iter().find(|s| s.chosen);
        chosen.map_or(0..self.frames, |s| s.first_frame..(s.last_frame + 1).min(self.frames))
    }
}

/// One segment in `diagnosis.json` and `segments.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredSegment {
    /// Its number, from 1.
    pub segment: usize,
    /// Its first frame.
    pub first_frame: usize,
    /// Its last frame.
    pub last_frame: usize,
    /// Whether the analysis, keys and animation are of this one.
    pub chosen: bool,
    /// "usable", "doubtful" or "unusable"; null where no gait repeats.
    pub verdict: Option<String>,
    /// Repeats of the silhouette.
    pub cycles: Option<f64>,
    /// Frames from one repeat to the next.
    pub step_frames: Option<f64>,
    /// Frames a stride; null when it cannot be told.
    pub stride_frames: Option<f64>,
    /// Share of the variance that one stride, repeated, explains.
    pub explained_share: Option<f64>,
}

/// The slow change of shape in `diagnosis.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredDrift {
    /// Share of the silhouettes' variance that is slower than the gait, 0…1.
    pub share: f64,
    /// It is made of the cosines of up to so many half cycles over the seen frames.
    pub half_cycles: usize,
    /// Whether it was removed before the PCA.
    pub removed: bool,
}

/// One component in `diagnosis.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredComponent {
    /// Share of the total variance, 0…1.
    pub variance_share: f64,
    /// Correlation with itself after the band-pass.
    pub r: f64,
    /// Frequency of its own largest amplitude.
    pub peak_hz: f64,
}

/// Steps or strides in `diagnosis.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredStride {
    /// "every_stride", "every_step" or "unknown": how often the silhouette repeats.
    pub repeats: String,
    /// Power at odd multiples of half the silhouette's frequency over that of the even ones.
    pub odd_share: f64,
    /// The same over what noise would give.
    pub odd_over_noise: f64,
    /// Whether this contradicts the gait that was named.
    pub contradicts_gait: bool,
    /// Share of the variance that one stride, repeated, explains.
    pub explained_share: f64,
    /// Variance of the pixels that it explains over the animal's area: how far the outline moves.
    #[serde(default)]
    pub sweep: Option<f64>,
    /// Least and greatest size of the motion about a frame over the mean; both 1 of strides that are alike as far
    /// as can be seen.
    #[serde(default = "alike")]
    pub amplitude_range: [f64; 2],
}

fn alike() -> [f64; 2] {
    [1.0; 2]
}

/// The trend of scale in `diagnosis.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredTrend {
    /// Scale of the last frame over that of the first.
    pub change: f64,
    /// Whether it was removed.
    pub removed: bool,
}

/// `keys/keys.json`, which is also what `keys --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredKeys {
    /// How the keys were chosen: "phase" or "condition-number".
    pub method: String,
    /// The keys, partners after them.
    pub keys: Vec<KeyImage>,
    /// Components that distances were measured with.
    pub components: usize,
    /// By phase: whether each pose is meant to count half a stride later too, with left and right exchanged.
    #[serde(default)]
    pub mirrored: bool,
    /// By phase: the error expected of the interpolation, as a share of the motion's deviation from
    /// its mean pose.
    #[serde(default)]
    pub expected_error_share: Option<f64>,
    /// By phase: the same in degrees, mean over frames and joints; null where no cycle was measured.
    #[serde(default)]
    pub expected_error_deg: Option<ExpectedDegrees>,
    /// By phase: the same for other numbers of keys.
    #[serde(default)]
    pub budget: Vec<BudgetLine>,
    /// By phase: the frame to pose next, were there one more key beside these.
    #[serde(default)]
    pub next_frame: Option<usize>,
    /// By condition number: that of H.
    pub condition: Option<f64>,
    /// Whether no other set is better.
    pub proven_optimal: bool,
    /// By condition number: no set has a smaller one than this.
    pub lower_bound: Option<f64>,
}

/// One key in `keys.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyImage {
    /// Its number, from 1.
    pub key: usize,
    /// The frame, from 0.
    pub frame: usize,
    /// The frame's time, seconds.
    pub time_s: f64,
    /// The key whose silhouette it repeats in the other half of the stride; null for a key.
    pub partner_of: Option<usize>,
}

impl StoredKeys {
    /// Frames of the keys proper, in order.
    #[must_use]
    pub fn key_frames(&self) -> Vec<usize> {
        self.keys.iter().filter(|k| k.partner_of.is_none()).map(|k| k.frame).collect()
    }

    /// Frames of the partners, in the order of the keys they belong to; empty when not every key
    /// has one.
    #[must_use]
    pub fn partner_frames(&self) -> Vec<usize> {
        let partners: Vec<usize> = self
            .keys
            .iter()
            .filter(|k| k.partner_of.is_none())
            .filter_map(|k| self.keys.iter().find(|p| p.partner_of == Some(k.key)))
            .map(|p| p.frame)
            .collect();
        if partners.len() == self.key_frames().len() { partners } else { Vec::new() }
    }

    /// Reads the keys of a clip of `frames` frames; `path` is used in messages.
    ///
    /// # Errors
    /// When they cannot be understood or make no sense.
    pub fn from_json(path: &Path, bytes: &[u8], frames: usize) -> Result<Self> {
        let keys: Self = parsed(path, bytes)?;
        keys.check(path, frames)?;
        Ok(keys)
    }

    /// Checks what a hand may have edited: numbers 1, 2, 3… in order, keys before partners, frames
    /// of the clip.
    fn check(&self, path: &Path, frames: usize) -> Result<()> {
        let fail = |what: String| Error::Document { path: path.to_owned(), what };
        let mut partners = false;
        for (at, key) in self.keys.iter().enumerate() {
            if key.key != at + 1 {
                return Err(fail(format!(
                    "key {} stands where key {} is expected",
                    key.key,
                    at + 1
                )));
            }
            if key.frame >= frames {
                return Err(fail(format!(
                    "key {} is frame {} of a clip of {frames}",
                    key.key, key.frame
                )));
            }
            match key.partner_of {
                None if partners => return Err(fail("partners stand after the keys".to_owned())),
                None => {}
                Some(of) => {
                    partners = true;
                    if !self.keys.iter().any(|k| k.key == of && k.partner_of.is_none()) {
                        return Err(fail(format!("key {} is a partner of no key ({of})", key.key)));
                    }
                }
            }
        }
        if self.key_frames().is_empty() {
            return Err(fail("there is no key".to_owned()));
        }
        Ok(())
    }
}

/// `animation.json`, which is also what `animate --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredAnimation {
    /// The animated rig, relative to the shot (or as given by `--out`).
    pub path: String,
    /// The animation's name in it.
    pub animation: String,
    /// Frames a second of its time axis.
    pub fps: f64,
    /// Number of frames.
    pub frames: usize,
    /// The frame of the footage that the first one belongs to.
    #[serde(default)]
    pub first_frame: usize,
    /// "phase", "rbf" or "switching".
    pub method: String,
    /// Number of poses that were used with left and right exchanged too.
    #[serde(default)]
    pub mirrored_poses: usize,
    /// Keys whose pose fits the others far better with left and right exchanged: probably posed the wrong way round.
    #[serde(default)]
    pub exchanged_sides: Vec<usize>,
    /// Smallest and largest weight of any pose.
    pub weight_range: [f64; 2],
    /// Smallest and largest sum of a frame's weights.
    pub sum_range: [f64; 2],
    /// The largest turn of a joint from one frame to the next, degrees.
    pub largest_step_deg: f64,
    /// The frame it leads to.
    pub largest_step_frame: usize,
    /// Number of nodes that move.
    pub moved_nodes: usize,
    /// How many times as fast as the footage it plays.
    pub retime: f64,
    /// The loop; null when the whole clip was written.
    #[serde(rename = "loop")]
    pub looped: Option<StoredLoop>,
    /// Feet, contacts, ground and gait; null when no feet on the ground were found.
    pub feet: Option<StoredFeet>,
}

/// Feet on the ground in `animation.json`. Lengths are in the rig's unit; frames are the animation's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredFeet {
    /// The gait's name; null when it has none.
    pub gait: Option<String>,
    /// Why the order of the feet or the planting should be looked at, in words.
    pub warnings: Vec<String>,
    /// Speed over the ground, rig units a second.
    pub ground_speed: f64,
    /// "feet" or "pan": where it was taken from.
    #[serde(default = "by_feet")]
    pub ground_speed_from: String,
    /// What the feet alone say, rig units a second.
    #[serde(default)]
    pub feet_speed: f64,
    /// What the footage says; null without a camera, or for a rig that cannot be drawn.
    #[serde(default)]
    pub pan: Option<StoredPan>,
    /// The same in mean leg lengths a second.
    pub ground_speed_leg_lengths: f64,
    /// Where the animal goes: a horizontal unit vector.
    pub forward: [f64; 3],
    /// Duration of a stride, seconds; null when no foot comes down twice.
    pub stride_s: Option<f64>,
    /// Way of a stride.
    pub stride_length: Option<f64>,
    /// "in-place" or "travel".
    pub root: String,
    /// The node that travels; null in place.
    pub root_node: Option<String>,
    /// What planting did; null when feet were not planted.
    pub planted: Option<StoredPlanting>,
    /// The feet.
    pub feet: Vec<StoredFoot>,
}

fn by_feet() -> String {
    crate::shot::SpeedFrom::Feet.name().to_owned()
}

/// The animal's way against the background in `animation.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredPan {
    /// Speed over the ground, rig units a second of the animation.
    pub ground_speed: f64,
    /// The same in lengths of the silhouette a second.
    pub body_lengths_a_second: f64,
    /// Pixels a second of the footage, positive to the right.
    pub px_a_second: f64,
    /// Pixels a unit of the rig: the silhouettes' mean height over that of the animated rig.
    pub px_a_unit: f64,
    /// From how many pairs of frames.
    pub steps: usize,
    /// Robust standard deviation of the ways from frame to frame over their median: of a camera that was followed
    /// well what the animal's middle swings within a stride, .05 to .2.
    pub unevenness: f64,
}

/// One foot in `animation.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredFoot {
    /// The node that carries the sole.
    pub node: String,
    /// Which limb it is.
    pub limb: Limb,
    /// Place of the sole's contact point in the node's space.
    pub sole: [f64; 3],
    /// Length of the leg.
    pub leg_length: f64,
    /// Share of the stride that the foot is down.
    pub duty_factor: Option<f64>,
    /// When it comes down: share of the stride after the left hind (or left, or first) foot.
    pub phase: Option<f64>,
    /// The times on the ground.
    pub contacts: Vec<StoredContact>,
}

/// One time on the ground in `animation.json`. In a loop the end may lie behind the last frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredContact {
    /// First frame on the ground.
    pub first_frame: usize,
    /// Last frame on the ground.
    pub last_frame: usize,
    /// When the foot comes down, seconds.
    pub down_s: f64,
    /// When it leaves the ground, seconds.
    pub up_s: f64,
}

/// What planting did, in `animation.json`; pairs are before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredPlanting {
    /// Largest way of a sole over the ground within a contact, in leg lengths.
    pub slide_leg_lengths: [f64; 2],
    /// Largest angular acceleration of a leg's joint, degrees a second squared.
    pub peak_acceleration_deg_s2: [f64; 2],
    /// Root mean square of it over joints and frames.
    pub rms_acceleration_deg_s2: [f64; 2],
    /// Largest way a foot was moved, in leg lengths.
    pub largest_shift_leg_lengths: f64,
}

/// The loop in `animation.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredLoop {
    /// Strides of the loop.
    pub strides: usize,
    /// Strides of the clip that it is averaged over.
    pub strides_seen: f64,
    /// Duration of the loop, seconds.
    pub duration_s: f64,
    /// By what factor the loop is longer than the strides it was taken from, because it has a whole
    /// number of frames.
    pub stretch: f64,
    /// How well it closes.
    pub seam: Seam,
}

impl Shot {
    /// The verdict, as stored.
    ///
    /// # Errors
    /// When it is missing or cannot be understood.
    pub fn diagnosis(&self) -> Result<StoredDiagnosis> {
        document(&self.path(paths::DIAGNOSIS))
    }

    /// The coefficients, as stored.
    ///
    /// # Errors
    /// When they are missing or cannot be understood.
    pub fn projections(&self) -> Result<Projections> {
        let path = self.path(paths::PROJECTIONS);
        Projections::from_csv(&path, &read(&path)?, self.fps())
    }

    /// The keys, as stored or edited; `frames` is the length of the clip.
    ///
    /// # Errors
    /// When they are missing, cannot be understood, or make no sense.
    pub fn keys(&self, frames: usize) -> Result<StoredKeys> {
        let path = self.path(paths::KEYS);
        StoredKeys::from_json(&path, &read(&path)?, frames)
    }

    /// What `animate` made, as stored.
    ///
    /// # Errors
    /// When it is missing or cannot be understood.
    pub fn animation(&self) -> Result<StoredAnimation> {
        document(&self.path(paths::ANIMATION))
    }
}

fn document<T: DeserializeOwned>(path: &Path) -> Result<T> {
    parsed(path, &read(path)?)
}

fn parsed<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T> {
    serde_json::from_slice(bytes)
        .map_err(|e| Error::Document { path: path.to_owned(), what: e.to_string() })
}
