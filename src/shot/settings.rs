//! `shot.toml`: where the footage is and every setting, each with its default and a comment.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::frames::check_rate;
use crate::image::Rectangle;
use crate::silhouette::{self, TrendRemoval};
use crate::spectrum;

/// The whole file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShotFile {
    /// Where the frames come from.
    pub source: Source,
    /// Footage to masks.
    pub silhouette: silhouette::Settings,
    /// PCA, spectrum, verdict.
    pub analysis: Analysis,
    /// Key images.
    pub keys: Keys,
    /// Poses to animation.
    pub animation: Animation,
    /// Feet on the ground.
    pub feet: Feet,
    /// The rig with the key poses.
    pub poses: Poses,
    /// Which pose belongs to which key.
    #[serde(rename = "pose", skip_serializing_if = "Vec::is_empty")]
    pub pose_of_key: Vec<PoseOfKey>,
}

/// `[source]`: paths are relative to the shot folder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Source {
    /// Video, folder, pattern, or `synthetic:GAIT`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Ready mattes, one a frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mattes: Option<String>,
    /// The mattes are black where the animal is.
    pub invert_mattes: bool,
    /// Sketched strokes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strokes: Option<String>,
    /// Frames a second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// `A-B`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<String>,
    /// Left, top, width, height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foreground: Option<[usize; 4]>,
    /// Left, top, width, height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<[usize; 4]>,
}

impl Source {
    /// The rectangle inside the animal.
    #[must_use]
    pub fn foreground(&self) -> Option<Rectangle> {
        self.foreground.map(rectangle)
    }

    /// The rectangle clear of it.
    #[must_use]
    pub fn background(&self) -> Option<Rectangle> {
        self.background.map(rectangle)
    }
}

impl ShotFile {
    /// Checks what the types do not: frame rates and ranges that a hand can spoil.
    pub(super) fn check(&self, path: &Path) -> Result<()> {
        if let Some(fps) = self.source.fps {
            check_rate(fps)?;
        }
        let within = |name: &str, ok: bool, rule: &str| {
            let name = format!("{}: {name}", path.display());
            if ok { Ok(()) } else { Err(Error::Setting { name, rule: rule.to_owned() }) }
        };
        let (analysis, keys, animation) = (&self.analysis, &self.keys, &self.animation);
        within("analysis.components", (2..=16).contains(&analysis.components), "is 2 to 16")?;
        within("keys.count", (1..=24).contains(&keys.count), "is 1 to 24")?;
        within(
            "keys.components",
            (1..=analysis.components).contains(&keys.components),
            "is 1 to analysis.components",
        )?;
        within("keys.spacing", keys.spacing >= 1, "is 1 or more")?;
        within("keys.time_limit_s", keys.time_limit_s >= 0.0, "is 0 or more")?;
        let fps = animation.fps;
        within("animation.fps", fps.is_finite() && fps >= 0.0, "is 0 or a frame rate")?;
        let retime = animation.retime;
        within("animation.retime", (0.01..=100.0).contains(&retime), "is 0.01 to 100")?;
        within("animation.loop_strides", animation.loop_strides <= 1000, "is 0 to 1000")?;
        within("animation.start_model", animation.start_model <= 4, "is 0 to 4")?;
        let clean = &self.silhouette.clean;
        for (name, share, most) in [
            ("opening", clean.opening, 0.1),
            ("closing", clean.closing, 0.1),
            ("link", clean.link, 0.1),
            ("holes", clean.holes, 1.0),
        ] {
            let name = format!("silhouette.clean.{name}");
            within(&name, (0.0..=most).contains(&share), &format!("is 0 to {most}"))?;
        }
        let gate = &self.silhouette.gate;
        within("silhouette.gate.distance", gate.distance > 0.0, "is over 0")?;
        within("silhouette.gate.area_factor", gate.area_factor > 1.0, "is over 1")
    }
}

fn rectangle([x, y, width, height]: [usize; 4]) -> Rectangle {
    Rectangle { x, y, width, height }
}

/// `[analysis]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Analysis {
    /// Principal components that are kept.
    pub components: usize,
    /// What is known of the gait.
    pub gait: spectrum::Gait,
    /// Whether keys and interpolation use band-passed scores.
    pub band_pass: bool,
    /// What becomes of frames whose flags say that the outline is not the animal's.
    pub flagged_frames: FlaggedFrames,
    /// Whether slow changes of the silhouette's shape are removed before the PCA.
    pub shape_drift: TrendRemoval,
    /// Which stretch between stops, jumps and changes of gait is analysed and animated.
    pub segment: SegmentChoice,
}

impl Default for Analysis {
    fn default() -> Self {
        Self {
            components: 5,
            gait: spectrum::Gait::Unknown,
            band_pass: true,
            flagged_frames: FlaggedFrames::LeaveOut,
            shape_drift: TrendRemoval::Auto,
            segment: SegmentChoice::Auto,
        }
    }
}

/// Which stretch of a clip is analysed and animated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum SegmentChoice {
    /// The one with the best verdict, of equal ones the one that lasts longest.
    #[default]
    Auto,
    /// The whole clip, whatever happens in it.
    Whole,
    /// That of this number, from 1.
    Number(usize),
}

impl From<SegmentChoice> for String {
    fn from(choice: SegmentChoice) -> Self {
        match choice {
            SegmentChoice::Auto => "auto".to_owned(),
            SegmentChoice::Whole => "whole".to_owned(),
            SegmentChoice::Number(number) => number.to_string(),
        }
    }
}

impl TryFrom<String> for SegmentChoice {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        text.parse()
    }
}

impl std::str::FromStr for SegmentChoice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match (text, text.parse()) {
            ("auto", _) => Ok(Self::Auto),
            ("whole", _) => Ok(Self::Whole),
            (_, Ok(number)) if number > 0 => Ok(Self::Number(number)),
            _ => Err(format!("segment is auto, whole, or a number from 1, not «{text}»")),
        }
    }
}

/// What becomes of frames that carry an excluding flag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FlaggedFrames {
    /// They are left out of the PCA and bridged, unless most of the clip is flagged.
    #[default]
    LeaveOut,
    /// They are used as they are.
    Use,
}

/// `[keys]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Keys {
    /// Number of key images, m.
    pub count: usize,
    /// Components that distances are measured with.
    pub components: usize,
    /// Whether each key gets a partner.
    pub partners: bool,
    /// `[key, frame]`: partners chosen by the user.
    pub partner_of: Vec<[usize; 2]>,
    /// Frames that must not be keys.
    pub exclude: Vec<usize>,
    /// Frames that must be keys.
    pub include: Vec<usize>,
    /// Least distance of two keys, frames.
    pub spacing: usize,
    /// Seconds after which the best set so far is given without proof.
    pub time_limit_s: f64,
}

impl Default for Keys {
    fn default() -> Self {
        Self {
            count: 4,
            components: 2,
            partners: false,
            partner_of: Vec::new(),
            exclude: Vec::new(),
            include: Vec::new(),
            spacing: 1,
            time_limit_s: 30.0,
        }
    }
}

/// How poses are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Switching where the keys have partners, else over the gait phase where it could be
    /// measured, else one radial basis.
    #[default]
    Auto,
    /// A periodic cubic spline over the gait phase.
    Phase,
    /// One Gaussian radial basis over all keys.
    Rbf,
    /// Switching models.
    Switching,
}

/// Whether poses are used with left and right exchanged too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mirroring {
    /// Where the gait is symmetric, by name or as seen, and the rig has a left and a right.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// `[animation]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Animation {
    /// The animation's name in the rig's file; empty for the shot's name.
    pub name: String,
    /// Interpolation method.
    pub method: Method,
    /// Whether poses are used with left and right exchanged too, half a stride later.
    pub mirror: Mirroring,
    /// Whether poses grow and shrink as the strides are seen to, over the phase.
    pub amplitude: bool,
    /// Width of the Gaussian, equation 15.
    pub alpha: f64,
    /// Added to the diagonal of H.
    pub ridge: f64,
    /// Weights are kept within 0 and 1.
    pub clamp: bool,
    /// Weights of a frame sum to one.
    pub normalize: bool,
    /// Frames a second of the animation, which is resampled to it; 0 for the footage's rate.
    pub fps: f64,
    /// How many times as fast as the footage the animation plays.
    pub retime: f64,
    /// Strides of the seamless loop that is written instead of the whole clip; 0 for none.
    pub loop_strides: usize,
    /// Switching: the model of the first frame, from 1; 0 finds it from the keys.
    pub start_model: usize,
    /// Whether a BVH file is written too.
    pub bvh: bool,
}

impl Default for Animation {
    fn default() -> Self {
        Self {
            name: String::new(),
            method: Method::Auto,
            mirror: Mirroring::Auto,
            amplitude: true,
            alpha: std::f64::consts::LN_2,
            ridge: 0.0,
            clamp: false,
            normalize: false,
            fps: 0.0,
            retime: 1.0,
            loop_strides: 0,
            start_model: 0,
            bvh: true,
        }
    }
}

/// Whether the animated rig stays where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Root {
    /// The body stays and the ground passes below it.
    #[default]
    InPlace,
    /// The body goes where the feet push it.
    Travel,
}

impl Root {
    /// The word in settings and documents.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Root::InPlace => "in-place",
            Root::Travel => "travel",
        }
    }
}

/// What the ground's speed is taken from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpeedFrom {
    /// The footage where it is known and the feet agree, else the feet.
    #[default]
    Auto,
    /// The feet that are down.
    Feet,
    /// The silhouette's way against the background.
    Pan,
}

impl SpeedFrom {
    /// The word in settings and documents.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            SpeedFrom::Auto => "auto",
            SpeedFrom::Feet => "feet",
            SpeedFrom::Pan => "pan",
        }
    }
}

/// `[feet]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Feet {
    /// Names of the nodes that are feet; empty to find them.
    pub nodes: Vec<String>,
    /// Whether feet that are down are held in their place.
    pub plant: bool,
    /// Root motion.
    pub root: Root,
    /// Whether the ground goes at the feet's speed or the footage's.
    pub speed: SpeedFrom,
}

impl Default for Feet {
    fn default() -> Self {
        Self { nodes: Vec::new(), plant: true, root: Root::InPlace, speed: SpeedFrom::Auto }
    }
}

/// `[poses]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Poses {
    /// The rig's file, relative to the shot folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rig: Option<String>,
}

/// One `[[pose]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseOfKey {
    /// The key, from 1.
    pub key: usize,
    /// The clip that holds the pose.
    pub clip: String,
    /// The frame of the clip, at the shot's frame rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<u32>,
    /// Or the time in the clip, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
}

/// Tables of the file in order, with what they are for.
pub(super) const TABLES: &[(&str, &str)] = &[
    ("source", "Where the frames come from. Paths are relative to this folder."),
    ("silhouette", "Footage to masks."),
    ("silhouette.colour", "The two mixtures of colours."),
    ("silhouette.clean", "The clean-up of the masks; sizes are shares of the picture's diagonal."),
    (
        "silhouette.gate",
        "What the animal may do from one frame to the next; anything else is reported as lost.",
    ),
    ("analysis", "Image PCA, spectrum and verdict."),
    ("keys", "The frames worth posing."),
    ("animation", "Poses to animation."),
    ("feet", "Feet on the ground."),
    (
        "poses",
        "The rig with your key poses (glTF or GLB). Then one table for each key, like\n  [[pose]]\n  key = 1\n  clip = \"KeyPoses\"\n  frame = 1        # or: time = 0.04 (seconds)",
    ),
];

/// Comments of the keys: (table.key, what it does).
pub(super) const COMMENTS: &[(&str, &str)] = &[
    (
        "source.from",
        "A video, a folder of images, a pattern (dir/img_%04d.png, dir/*.png) or synthetic:gallop.",
    ),
    (
        "source.mattes",
        "Ready mattes instead of segmentation: alpha if there is one, else luminance over one half.",
    ),
    ("source.invert_mattes", "true when the mattes are black where the animal is."),
    (
        "source.strokes",
        "A folder of sketched strokes; without footage every frame, over footage any. Default: strokes/ here.",
    ),
    ("source.fps", "Frames a second. A video brings its own; image sequences have 25 unless said."),
    ("source.frames", "\"A-B\": only the frames from A to B, counted from 0, both included."),
    (
        "source.foreground",
        "A rectangle inside the animal on the first frame: [left, top, width, height], pixels.",
    ),
    ("source.background", "A rectangle clear of the animal on the first frame."),
    (
        "silhouette.method",
        "\"plate\": colour, background plate and place together; \"colour\": colour alone, frame by frame, as the seed does it (faster, worse on most footage).",
    ),
    (
        "silhouette.scale_trend",
        "Remove a slow change of size (an animal that walks away): auto, on, off.",
    ),
    (
        "silhouette.stroke_radius_px",
        "Radius by which sketched strokes are thickened, pixels; 0 takes 1 % of the diagonal.",
    ),
    (
        "silhouette.colour.components",
        "Gaussians a mixture, 1 to 8; 0 lets the Bayesian information criterion choose.",
    ),
    (
        "silhouette.colour.prior",
        "Probability of a pixel to be the animal before its colour is seen, between 0 and 1.",
    ),
    ("silhouette.colour.seed", "Seed of the mixtures' start."),
    (
        "silhouette.clean.opening",
        "Radius of the opening (removes specks), share of the diagonal, 0 to 0.1.",
    ),
    (
        "silhouette.clean.closing",
        "Radius of the closing (bridges gaps), share of the diagonal, 0 to 0.1.",
    ),
    (
        "silhouette.clean.link",
        "Pieces with at most this gap between them count as one animal, share of the diagonal, 0 to 0.1.",
    ),
    (
        "silhouette.clean.holes",
        "Largest hole that is filled, share of the silhouette's area, 0 to 1.",
    ),
    (
        "silhouette.gate.distance",
        "How far the centre of mass may be from where it is expected, in roots of the area.",
    ),
    ("silhouette.gate.area_factor", "By what factor the area may change, over 1."),
    ("analysis.components", "Principal components that are kept, 2 to 16."),
    (
        "analysis.gait",
        "unknown; symmetric or walk, trot, pace, amble (left and right half a stride apart); asymmetric or canter, gallop, bound.",
    ),
    (
        "analysis.band_pass",
        "Keys and interpolation use the scores after the band-pass (true) or the raw ones (false).",
    ),
    (
        "analysis.flagged_frames",
        "leave-out: frames whose silhouette is flagged are bridged; use: they count as they are.",
    ),
    (
        "analysis.shape_drift",
        "Remove slow changes of shape (an animal that turns, or passes the camera close by) before the PCA: auto, on, off.",
    ),
    (
        "analysis.segment",
        "A stop, a jump or a change of gait cuts the clip into segments (analysis/segments.csv): \"auto\" takes the best, \"2\" the second, \"whole\" the clip as it is.",
    ),
    ("keys.count", "Number of key images; keys.json says what error to expect with more or fewer."),
    (
        "keys.components",
        "Components that distances are measured with; 2 unless the verdict advises more.",
    ),
    (
        "keys.partners",
        "true gives each key a partner: the same silhouette in the other half of the stride.",
    ),
    ("keys.partner_of", "Partners of your own choice: [[key, frame], …]."),
    ("keys.exclude", "Frames that must not be keys."),
    ("keys.include", "Frames that must be keys."),
    ("keys.spacing", "Keys are at least this many frames apart."),
    ("keys.time_limit_s", "Seconds after which the best set found is given without proof."),
    ("animation.name", "Name of the animation in the rig's file; empty takes the shot's name."),
    (
        "animation.method",
        "auto (switching where keys have partners, else phase), phase, rbf, switching. phase and rbf choose different keys.",
    ),
    (
        "animation.mirror",
        "Use every pose with left and right exchanged too, half a stride later: auto (symmetric gaits, over the phase), on, off. Keys are chosen for it.",
    ),
    (
        "animation.amplitude",
        "Poses grow and shrink as the strides are seen to, over the phase (the column amplitude of analysis/phase.csv).",
    ),
    (
        "animation.alpha",
        "Width of the Gaussian exp(-alpha r^2); ln 2 makes it one half at one standard deviation.",
    ),
    (
        "animation.ridge",
        "Added to the diagonal of the kernel matrix; over 0 the keys are met only nearly.",
    ),
    ("animation.clamp", "Keep every weight within 0 and 1."),
    ("animation.normalize", "Make the weights of every frame sum to one."),
    (
        "animation.fps",
        "Frames a second of the animation, which is resampled to them; 0 takes the footage's.",
    ),
    (
        "animation.retime",
        "How many times as fast as the footage the animation plays; 4 undoes a slow motion of four times.",
    ),
    (
        "animation.loop_strides",
        "Write one seamless loop of so many strides instead of the whole clip; 0 writes the clip.",
    ),
    (
        "animation.start_model",
        "Switching: the model of the first frame, from 1; 0 finds it from the keys.",
    ),
    ("animation.bvh", "Write animation.bvh too."),
    (
        "feet.nodes",
        "Names of the rig's nodes that are feet; empty finds them by mesh, hierarchy and motion.",
    ),
    ("feet.plant", "Hold feet that are down in their place, by inverse kinematics of the legs."),
    (
        "feet.root",
        "in-place (the ground passes below the animal) or travel (the animal goes at the ground's speed).",
    ),
    (
        "feet.speed",
        "Where the ground's speed comes from: feet (those that are down), pan (the silhouette's way against the background), auto (the pan where the feet agree to 30 %).",
    ),
    ("poses.rig", "The rig's file."),
];
