//! Renders a clip whose motion is known, runs the method on the masks alone, and compares (seed,
//! section 4, figure 6).

mod floor;
mod measure;
mod measured;
mod subject;
mod tables;
mod unsteady;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

pub use floor::floor_error;
pub use measure::{AngleError, geodesic_error, in_plane_error, rotating_joints};
pub use measured::Measured;
pub use subject::{Shooting, Subject, Truth, in_plane_angles};
pub use unsteady::Unsteady;

use crate::error::{Error, Result};
use crate::interpolate::blend;
use crate::keys::{ExpectedDegrees, KeySettings};
use crate::numeric::Coefficients;
use crate::pipeline::{
    KeyRequest, OverPhase, Trends, analyse_masks, choose, halves_alike, interpolation_weights,
    keys_by_phase, phase_weights, resolved_method,
};
use crate::rig::{Mirror, NodePose, Pose, mean_rotation};
use crate::shot::{Animation, Method, Mirroring, PhaseTable};
use crate::spectrum;

/// The frame rate names the frames' times; nothing depends on it.
const FPS: f64 = 25.0;

/// Pairs of frames that the proof of one cell may look at, a second or so: the same on every machine.
/// On the walk of a rigged horse it is enough for eight keys of 100 frames in two components
/// and more; seven and eight keys on a single component take 10 and 100 times as much. The frames
/// chosen were the same with and without the limit.
const PROOF_PAIRS: u64 = 100_000_000;

/// What is validated.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What is rendered.
    pub subject: Subject,
    /// How.
    pub shooting: Shooting,
    /// Numbers of key images: rows of the error table.
    pub keys: Vec<usize>,
    /// Numbers of components: columns.
    pub components: Vec<usize>,
    /// Whether every key gets a partner, so that a row of m keys has 2m poses.
    pub partners: bool,
    /// What the user says of the gait.
    pub gait: spectrum::Gait,
    /// Interpolation method; `Auto` switches with partners, and goes by the gait phase else.
    pub method: Method,
    /// Whether poses are used with left and right exchanged too; it takes a rig that has a left and a right.
    pub mirror: Mirroring,
    /// Whether poses grow and shrink as the strides are seen to.
    pub amplitude: bool,
    /// Band-passed scores, or raw ones.
    pub band_pass: bool,
    /// Seconds the proof of a key set may take.
    pub time_limit_s: f64,
}

/// One cell of the error table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Number of components.
    pub components: usize,
    /// Geodesic error over frames and animated joints.
    pub error: AngleError,
    /// The seed's measure, for the built-in horse.
    pub in_plane: Option<AngleError>,
    /// With partners: the error of as many poses on key images of their own, without switching.
    pub without_switching: Option<AngleError>,
    /// The frames that were posed, partners after keys.
    pub posed_frames: Vec<usize>,
    /// Condition number of H, of keys chosen by it.
    pub condition: Option<f64>,
    /// Expected error as a share of the motion, of keys chosen by phase.
    pub expected_error_share: Option<f64>,
    /// The same in degrees, the middle of what can be expected.
    pub expected_error_deg: Option<f64>,
    /// Whether no better set of keys exists.
    pub proven_optimal: bool,
}

/// One row of the error table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Number of key images.
    pub keys: usize,
    /// Number of poses: the same, or twice as many with partners.
    pub poses: usize,
    /// What as many poses would give if the phase were known.
    pub floor: Option<AngleError>,
    /// One cell a number of components.
    pub cells: Vec<Cell>,
}

/// The seed's tables for one subject.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validation {
    /// What was rendered.
    pub subject: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames a cycle of the clip.
    pub frames_per_cycle: f64,
    /// Camera yaw, degrees.
    pub yaw_deg: f64,
    /// Share of edge pixels flipped.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// "phase", "rbf" or "switching".
    pub method: &'static str,
    /// Whether poses were used with left and right exchanged too.
    pub mirrored: bool,
    /// Share of variance of each component.
    pub variance_shares: Vec<f64>,
    /// r of each component.
    pub r: Vec<f64>,
    /// The verdict the user would have seen.
    pub verdict: String,
    /// Its reasons.
    pub reasons: Vec<String>,
    /// Frames from one repeat of the silhouette to the next, as measured.
    pub step_frames: f64,
    /// The gait as measured, beside the truth; `None` where no phase could be.
    pub measured: Option<Measured>,
    /// Number of joints compared.
    pub joints: usize,
    /// Error of the mean pose.
    pub mean_pose: AngleError,
    /// The same by the seed's measure, for the built-in horse.
    pub mean_pose_in_plane: Option<AngleError>,
    /// The error table.
    pub rows: Vec<Row>,
}

/// Renders, analyses, and fills the table. `progress(done, total)` counts cells.
///
/// # Errors
/// When the rig cannot be read, the settings are out of range, or a stage of the method fails.
pub fn validate(
    settings: &Settings,
    progress: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<Validation> {
    check(settings)?;
    let truth = Truth::of(&settings.subject, &settings.shooting)?;
    let masks = truth.masks(&settings.shooting);
    let most = settings.components.iter().copied().max().unwrap_or(1).max(5);
    let analysing = spectrum::Settings { gait: settings.gait, ..spectrum::Settings::default() };
    let analysis = analyse_masks(&masks, FPS, most, Trends::default(), &analysing)?;
    let phase = analysis.gait.as_ref().map(PhaseTable::of);
    let method = resolved_method(settings.method, settings.partners, phase.is_some())?;
    let mirror = analysis.gait.as_ref().filter(|gait| {
        let repeats = gait.stride.repeats;
        method == Method::Phase
            && !settings.partners
            && halves_alike(settings.mirror, settings.gait, repeats, false)
    });
    let mirror = mirror.and_then(|_| Mirror::of(&truth.model.skeleton, &truth.model.skins).ok());
    let joints = rotating_joints(&truth.driven);
    let step_frames = analysis.spectral.rhythm.step_frames;
    let coefficients = analysis.coefficients(settings.band_pass);
    // Over the phase all numbers of components give the same.
    let columns = if method == Method::Phase { 1 } else { settings.components.len() };
    let columns = &settings.components[..columns];
    let tasks: Vec<(usize, usize)> = settings
        .keys
        .iter()
        .flat_map(|&keys| columns.iter().map(move |&components| (keys, components)))
        .collect();
    let done = AtomicUsize::new(0);
    // Cells are independent of one another; the slowest proofs are of the most keys, the last.
    let mut cells: Vec<Cell> = tasks
        .par_iter()
        .rev()
        .map(|&(keys, components)| {
            if !progress(done.load(Ordering::Relaxed), tasks.len()) {
                return Err(Error::Interrupted);
            }
            let leading = coefficients.leading(components);
            let scene = Scene {
                truth: &truth,
                coefficients: &leading,
                phase: phase.as_ref(),
                mirror: mirror.as_ref(),
                sweep: analysis.sweep(),
                joints: &joints,
                step_frames,
            };
            let cell = scene.cell(settings, method, keys)?;
            done.fetch_add(1, Ordering::Relaxed);
            Ok(cell)
        })
        .collect::<Result<_>>()?;
    let row = |&keys: &usize| {
        let poses = if settings.partners { 2 * keys } else { keys };
        let floor = floor_error(&truth.poses, &truth.phases_cycles, &joints, poses);
        // Computed from the last to the first.
        let cells = (0..columns.len()).filter_map(|_| cells.pop()).collect();
        Row { keys, poses, floor, cells }
    };
    let rows = settings.keys.iter().map(row).collect();
    let mean = mean_motion(&truth);
    let diagnosis = &analysis.spectral.diagnosis;
    Ok(Validation {
        subject: match &settings.subject {
            Subject::Horse(gait) => format!("built-in horse, {gait}"),
            Subject::Rig { file, clip } => format!("{}, {clip}", file.display()),
        },
        frames: settings.shooting.frames,
        frames_per_cycle: settings.shooting.frames_per_cycle,
        yaw_deg: settings.shooting.yaw_rad.to_degrees(),
        noise: settings.shooting.noise,
        seed: settings.shooting.seed,
        method: match method {
            Method::Phase => "phase",
            Method::Switching => "switching",
            _ => "rbf",
        },
        mirrored: mirror.is_some(),
        variance_shares: analysis.pca.variance_shares(),
        r: analysis.spectral.components.iter().map(|c| c.r).collect(),
        verdict: diagnosis.verdict.to_string(),
        reasons: diagnosis.reasons.iter().map(ToString::to_string).collect(),
        step_frames,
        measured: Measured::of(&analysis, &truth.phases_cycles),
        joints: joints.len(),
        mean_pose: geodesic_error(&truth.poses, &mean, &joints),
        mean_pose_in_plane: truth
            .in_plane_rad
            .as_ref()
            .map(|angles| in_plane_error(angles, &in_plane_angles(&mean))),
        rows,
    })
}

fn check(settings: &Settings) -> Result<()> {
    let within = |name: &str, ok: bool, rule: &str| {
        if ok { Ok(()) } else { Err(Error::setting(name, rule)) }
    };
    let shooting = &settings.shooting;
    within("--frames", (4..=100_000).contains(&shooting.frames), "is 4 to 100000")?;
    let cycle = shooting.frames_per_cycle;
    within("--frames-per-cycle", cycle.is_finite() && cycle >= 2.0, "is 2 or more")?;
    within("--noise", (0.0..=1.0).contains(&shooting.noise), "is 0 to 1")?;
    let unsteady = &shooting.unsteady;
    within("--speed-drift", unsteady.speed_drift.abs() <= 1.0, "is -1 to 1")?;
    within("--stride-variation", (0.0..=0.3).contains(&unsteady.stride_variation), "is 0 to 0.3")?;
    let varies = unsteady.amplitude_variation;
    within("--amplitude-variation", (0.0..=0.3).contains(&varies), "is 0 to 0.3")?;
    within("--amplitude-drift", unsteady.amplitude_drift.abs() <= 1.0, "is -1 to 1")?;
    within("--broken-masks", (0.0..=1.0).contains(&unsteady.broken_masks), "is 0 to 1")?;
    within("--yaw", shooting.yaw_rad.is_finite(), "is an angle in degrees")?;
    let counts = |list: &[usize], most: usize| {
        !list.is_empty() && list.iter().all(|n| (1..=most).contains(n))
    };
    within("--keys", counts(&settings.keys, 16), "is 1 to 16")?;
    within("--components", counts(&settings.components, 16), "is 1 to 16")
}

/// What a cell of the table is made of. The method sees coefficients and phase, made from masks, and
/// the poses of the frames it chose.
struct Scene<'a> {
    truth: &'a Truth,
    coefficients: &'a Coefficients,
    phase: Option<&'a PhaseTable>,
    mirror: Option<&'a Mirror>,
    sweep: Option<f64>,
    joints: &'a [usize],
    step_frames: f64,
}

/// One run: what was chosen, and what came of it.
struct Run {
    posed: Vec<usize>,
    condition: Option<f64>,
    expected_error_share: Option<f64>,
    expected_error_deg: Option<f64>,
    proven_optimal: bool,
    poses: Vec<Pose>,
}

impl Scene<'_> {
    fn cell(&self, settings: &Settings, method: Method, keys: usize) -> Result<Cell> {
        let found = self.run(settings, keys, settings.partners, method)?;
        let without_switching = if method == Method::Switching {
            let plain = self.run(settings, 2 * keys, false, Method::Rbf)?;
            Some(geodesic_error(&self.truth.poses, &plain.poses, self.joints))
        } else {
            None
        };
        Ok(Cell {
            components: self.coefficients.components(),
            error: geodesic_error(&self.truth.poses, &found.poses, self.joints),
            in_plane: self
                .truth
                .in_plane_rad
                .as_ref()
                .map(|angles| in_plane_error(angles, &in_plane_angles(&found.poses))),
            without_switching,
            posed_frames: found.posed,
            condition: found.condition,
            expected_error_share: found.expected_error_share,
            expected_error_deg: found.expected_error_deg,
            proven_optimal: found.proven_optimal,
        })
    }

    fn run(&self, settings: &Settings, keys: usize, partners: bool, method: Method) -> Result<Run> {
        let wanted = KeySettings {
            keys,
            time_limit_s: settings.time_limit_s,
            pair_limit: PROOF_PAIRS,
            ..KeySettings::default()
        };
        let mut run = match (method, self.phase) {
            (Method::Phase, Some(phase)) => {
                let chosen = keys_by_phase(phase, &wanted, self.mirror.is_some())?;
                let share = chosen.expected_error_share;
                Run {
                    posed: chosen.frames,
                    condition: None,
                    expected_error_share: Some(share),
                    expected_error_deg: self.sweep.map(|s| ExpectedDegrees::of(share, s).likely),
                    proven_optimal: self.mirror.is_none() && !phase.drifts(),
                    poses: Vec::new(),
                }
            }
            _ => {
                let request = KeyRequest {
                    keys: wanted,
                    partners,
                    partner_of: Vec::new(),
                    step_frames: self.step_frames,
                };
                let chosen = choose(self.coefficients, &request, &|_, _| true)?;
                let mut posed = chosen.choice.frames.clone();
                posed.extend(chosen.partner_frames());
                Run {
                    posed,
                    condition: Some(chosen.choice.condition),
                    expected_error_share: None,
                    expected_error_deg: None,
                    proven_optimal: chosen.choice.proven_optimal,
                    poses: Vec::new(),
                }
            }
        };
        let (own, others) = run.posed.split_at(keys.min(run.posed.len()));
        let animation = Animation { method, ..Animation::default() };
        let weights = match (method, self.phase) {
            (Method::Phase, Some(phase)) => {
                let how = OverPhase {
                    ridge: animation.ridge,
                    mirrored: self.mirror.is_some(),
                    amplitude: settings.amplitude,
                };
                phase_weights(phase, &run.posed, how)?
            }
            _ => {
                interpolation_weights(self.coefficients, own, others, self.step_frames, &animation)?
            }
        };
        let posed = weights.poses() - weights.mirrored();
        let mut poses = self.truth.key_poses(&run.posed[..posed]);
        if let Some(mirror) = self.mirror {
            poses.add_mirrored(mirror);
        }
        let skeleton = &self.truth.model.skeleton;
        run.poses = blend("predicted", FPS, skeleton, &poses, weights.values())?.poses;
        Ok(run)
    }
}

/// Every frame in the mean pose of the clip.
fn mean_motion(truth: &Truth) -> Vec<Pose> {
    let mut mean = truth.model.skeleton.rest_pose();
    for (node, pose) in mean.nodes.iter_mut().enumerate() {
        let rotations: Vec<_> = truth.poses.iter().map(|p| p.nodes[node].rotation).collect();
        *pose = NodePose { rotation: mean_rotation(&rotations), ..*pose };
    }
    vec![mean; truth.poses.len()]
}
