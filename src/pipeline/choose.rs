//! Keys and weights, in memory.

use crate::error::{Error, Result};
use crate::interpolate::{self, KernelSettings, Switching, Weights};
use crate::keys::{
    BudgetLine, ExpectedDegrees, KeyChoice, KeySettings, Partner, PartnerSettings,
    PhaseKeySettings, PhaseKeys, PhasedFrames, choose_keys, choose_keys_on_drift,
    choose_keys_on_mirror, choose_keys_on_phase, pose_budget, pose_budget_on_mirror,
    propose_partners,
};
use crate::numeric::Coefficients;
use crate::shot;

/// What keys are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyRequest {
    /// How the keys are chosen.
    pub keys: KeySettings,
    /// Whether each gets a partner.
    pub partners: bool,
    /// Partners named by the user: (position of the key, frame).
    pub partner_of: Vec<(usize, usize)>,
    /// Frames from one repeat of the silhouette to the next.
    pub step_frames: f64,
}

/// The keys of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// The choice with its proof.
    pub choice: KeyChoice,
    /// One partner a key, in the order of the keys; empty without partners.
    pub partners: Vec<Partner>,
}

impl Chosen {
    /// Frames of the partners.
    #[must_use]
    pub fn partner_frames(&self) -> Vec<usize> {
        self.partners.iter().map(|p| p.frame).collect()
    }
}

/// A clip in which the silhouette repeats less often than this has no period that partners could be
/// placed by: the other half of the stride may not be in it at all.
const LEAST_REPEATS: f64 = 1.5;

/// The step period as keys and switching take it: above 2 frames and seen to repeat, else unknown.
fn known_period(step_frames: f64, frames: usize) -> Option<f64> {
    let seen = step_frames.is_finite() && LEAST_REPEATS * step_frames <= frames as f64;
    Some(step_frames).filter(|s| seen && *s > 2.0)
}

/// Chooses keys and partners.
///
/// # Errors
/// As [`choose_keys`] and [`propose_partners`].
pub fn choose(
    coefficients: &Coefficients,
    request: &KeyRequest,
    progress: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<Chosen> {
    let choice = choose_keys(coefficients, &request.keys, progress)?;
    let partners = if request.partners {
        let settings = PartnerSettings {
            step_period_frames: known_period(request.step_frames, coefficients.frames()),
            // A partner is posed as a key is: what must not be a key must not be its partner.
            exclude: request.keys.exclude.clone(),
            ..PartnerSettings::default()
        };
        propose_partners(coefficients, &choice.frames, &settings, &request.partner_of)?
    } else {
        Vec::new()
    };
    Ok(Chosen { choice, partners })
}

/// What a method comes to, given what there is: `auto` switches where there are partners, goes by
/// the gait phase where there is one, and is one radial basis else. Never `auto`.
///
/// # Errors
/// [`Error::Setting`] when the phase is asked for where there is none, or with partners.
pub fn resolved_method(
    method: shot::Method,
    partners: bool,
    has_phase: bool,
) -> Result<shot::Method> {
    match method {
        shot::Method::Auto if partners => Ok(shot::Method::Switching),
        shot::Method::Auto if has_phase => Ok(shot::Method::Phase),
        shot::Method::Auto => Ok(shot::Method::Rbf),
        shot::Method::Phase if !has_phase => Err(Error::setting(
            "animation.method",
            "is not «phase» for a clip in which the silhouette does not repeat (rbf works)",
        )),
        method => Ok(method),
    }
}

/// Keys for the interpolation over the gait phase; `mirrored` as [`halves_alike`](super::halves_alike) says.
///
/// # Errors
/// As [`choose_keys_on_phase`].
pub fn keys_by_phase(
    phase: &shot::PhaseTable,
    wanted: &KeySettings,
    mirrored: bool,
) -> Result<PhaseKeys> {
    keys_over(phase, &phase_settings(wanted), mirrored)
}

/// Keys over the phase, and beside it over the drift of the view where there is one.
fn keys_over(
    phase: &shot::PhaseTable,
    settings: &PhaseKeySettings,
    mirrored: bool,
) -> Result<PhaseKeys> {
    let frames = phased_frames(phase);
    if mirrored {
        choose_keys_on_mirror(frames, settings)
    } else if phase.drifts() {
        choose_keys_on_drift(frames, &phase.drift, settings)
    } else {
        choose_keys_on_phase(frames, settings)
    }
}

fn phased_frames(phase: &shot::PhaseTable) -> PhasedFrames<'_> {
    PhasedFrames {
        cycles: &phase.stride_cycles,
        deviation_cycles: &phase.deviation_cycles,
        trust: &phase.trust,
        silhouette: &phase.cycle,
    }
}

fn phase_settings(wanted: &KeySettings) -> PhaseKeySettings {
    PhaseKeySettings {
        keys: wanted.keys,
        exclude: wanted.exclude.clone(),
        force: wanted.force.clone(),
        min_spacing_frames: wanted.min_spacing_frames,
    }
}

/// Keys for the interpolation over the gait phase, and what to expect of them.
#[derive(Clone, Debug, PartialEq)]
pub struct KeysOnPhase {
    /// The keys.
    pub chosen: PhaseKeys,
    /// The mean error to expect, degrees.
    pub expected_error_deg: Option<ExpectedDegrees>,
    /// The same for other numbers of keys.
    pub budget: Vec<BudgetLine>,
    /// The frame that one more key beside these would take.
    pub next_frame: Option<usize>,
}

/// Keys for the interpolation over the gait phase, with the errors to expect of 2 to 12 keys and
/// the frame that one more key beside these would take. `mirrored` as in [`keys_by_phase`]. `sweep` is [`MaskAnalysis::sweep`](super::MaskAnalysis::sweep); errors
/// are given in degrees where it is known.
///
/// # Errors
/// As [`choose_keys_on_phase`].
pub fn choose_by_phase(
    phase: &shot::PhaseTable,
    wanted: &KeySettings,
    sweep: Option<f64>,
    mirrored: bool,
) -> Result<KeysOnPhase> {
    let (frames, settings) = (phased_frames(phase), phase_settings(wanted));
    let chosen = keys_over(phase, &settings, mirrored)?;
    let degrees = |share| sweep.map(|s| ExpectedDegrees::of(share, s));
    let budget = if mirrored {
        pose_budget_on_mirror(frames, &settings, BUDGET, sweep)?
    } else if phase.drifts() {
        let line = |keys| {
            let wanted = PhaseKeySettings { keys, ..settings.clone() };
            let found = keys_over(phase, &wanted, false).ok()?;
            let expected_error_share = found.expected_error_share;
            let expected_error_deg = degrees(expected_error_share);
            Some(BudgetLine { keys, expected_error_share, expected_error_deg })
        };
        BUDGET.filter_map(line).collect()
    } else {
        pose_budget(frames, &settings, BUDGET, sweep)?
    };
    let one_more =
        PhaseKeySettings { keys: wanted.keys + 1, force: chosen.frames.clone(), ..settings };
    let next = keys_over(phase, &one_more, mirrored)
        .ok()
        .and_then(|keys| keys.frames.into_iter().find(|f| !chosen.frames.contains(f)));
    let expected_error_deg = degrees(chosen.expected_error_share);
    Ok(KeysOnPhase { chosen, expected_error_deg, budget, next_frame: next })
}

/// Numbers of keys in the pose budget.
const BUDGET: std::ops::RangeInclusive<usize> = 2..=12;

/// The weights of poses at the given frames over the gait phase, and over the drift of the view where there is one. The
/// drift's are those of the ridge, the phase's alone do without, and are larger and smaller as the strides are.
///
/// # Errors
/// As [`interpolate::weights_over_phase`].
pub fn phase_weights(phase: &shot::PhaseTable, poses: &[usize], how: OverPhase) -> Result<Weights> {
    let amplitude = if how.amplitude { &phase.amplitude[..] } else { &[] };
    if how.mirrored {
        interpolate::weights_over_mirrored(&phase.stride_cycles, amplitude, poses)
    } else if phase.drifts() {
        interpolate::weights_over_drift(&phase.stride_cycles, &phase.drift, poses, how.ridge)
    } else {
        interpolate::weights_over_phase(&phase.stride_cycles, amplitude, poses)
    }
}

/// How poses are weighted over the gait phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OverPhase {
    /// How much the poses are doubted where the view drifts, as a share of the motion's variance.
    pub ridge: f64,
    /// Weights of the poses and then of the same with left and right exchanged.
    pub mirrored: bool,
    /// Poses grow and shrink as the strides are seen to.
    pub amplitude: bool,
}

/// The weights of all poses: of the keys, or with switching of keys and partners. The method
/// `auto` switches where there are partners. Over the gait phase they are [`phase_weights`].
///
/// # Errors
/// [`Error::Setting`] when switching is asked for without partners; as [`interpolate::weights`].
pub fn interpolation_weights(
    coefficients: &Coefficients,
    keys: &[usize],
    partners: &[usize],
    step_frames: f64,
    settings: &shot::Animation,
) -> Result<Weights> {
    let method = resolved_method(settings.method, !partners.is_empty(), false)?;
    let kernel = KernelSettings {
        alpha: settings.alpha,
        ridge: settings.ridge,
        clamp: settings.clamp,
        normalise: settings.normalize,
    };
    let switching = match method {
        shot::Method::Switching if partners.is_empty() => {
            return Err(Error::setting(
                "animation.method",
                "is not «switching» while the keys have no partners (keys --partners)",
            ));
        }
        shot::Method::Switching => true,
        _ => false,
    };
    let method = if switching {
        interpolate::Method::Switching(Switching {
            partners: partners.to_vec(),
            step_period_frames: known_period(step_frames, coefficients.frames()),
            start_model: settings.start_model.checked_sub(1),
            ..Switching::default()
        })
    } else {
        interpolate::Method::Rbf
    };
    interpolate::weights(coefficients, keys, &method, &kernel)
}

/// Times of frames, seconds.
#[must_use]
pub fn time_order(frames: &[usize], fps: f64) -> Vec<(usize, f64)> {
    frames.iter().map(|&f| (f, f as f64 / fps)).collect()
}
