//! The cycle and the phase that runs through it, fitted in turns.

use std::f64::consts::TAU;

use super::Clip;
use super::carrier::Carrier;
use crate::numeric::{Harmonics, SpeedPrior, likeliest_prior, mean, median, smooth_path};

/// Most harmonics of the period that the series holds. The lines of the rigs' strides fall under
/// the noise after the sixth to the tenth.
const MOST_HARMONICS: usize = 12;

/// Highest frequency of a harmonic, cycles a frame; the Nyquist frequency is one half.
const HIGHEST_FREQUENCY: f64 = 0.45;

/// Frames wanted for each unknown of a component's series.
const FRAMES_PER_TERM: usize = 3;

/// The same while the phase is sought: a series with a term for every three frames has learnt a third of their noise, of the phase
/// it was fitted to, and so confirms that phase. (Of four real horses the one with most noise is .034 strides off instead of .053.)
const FRAMES_PER_TERM_SOUGHT: usize = 6;

/// Harmonics that even a short clip is given then, if its frames bear them at all: the first two of the step are the second and
/// fourth of the stride.
const LEAST_HARMONICS_SOUGHT: usize = 4;

/// The first phase is smoothed over this many periods of the cycle that is fitted: a warp within
/// a few periods would be taken over by the series and hardly be seen again, since a series fitted to a wrong phase
/// confirms it. Over two periods, a real horse's phase that slips where its line fades stays wrong; over eight, the
/// phase of the rigs' steady clips is three times as good as over two, and one that drifts by an eighth is found as well.
const START_PERIODS: f64 = 8.0;

/// An animal whose speed doubles within the clip is found from a start that follows it so closely; that one is taken
/// where its series misses the clip by this share or less of what the other's misses it by: .06 to .66 in such clips,
/// .95 and more with the real horses.
const START_PERIODS_FOLLOWING: f64 = 2.0;
const FOLLOWING_GAIN: f64 = 0.7;

/// Share of the seen frames by which the two are compared.
const MISFIT_SHARE: f64 = 0.9;

/// In this many periods the speed of the first phase returns to its mean, where nothing is seen.
const START_MEMORY_PERIODS: f64 = 4.0;

/// Rounds of the fit; the phase moves by less than a thousandth of a cycle after the fourth.
const ROUNDS: usize = 8;

/// Rounds in which the speed's prior is chosen anew; then it is kept, so that the fit settles.
const PRIOR_ROUNDS: usize = 4;

/// The most that the speed wanders about its mean, standard deviation as a share of it, and how often that is halved
/// for less. With half as much, strides that vary by a tenth (one deviation) are followed half as well; with twice as much the phase
/// of the rigs' unsteady clips is worse throughout, since what the frames of one step have wrong in common counts as often as there are frames.
const MOST_WANDER: f64 = 1.0 / 16.0;
const WANDERS: u32 = 11;

/// Periods in which the speed forgets that it was different: strides of unlike length, a drift over the clip, and between.
const MEMORIES_PERIODS: [f64; 3] = [1.0, 4.0, 16.0];

/// Largest correction of a phase in one round, cycles: further out the slope says nothing.
const LARGEST_STEP: f64 = 0.06;

/// A frame whose squared misfit is this many times the median counts less, and from the second
/// number on not at all.
const DOUBTED: f64 = 3.0;
const DROPPED: f64 = 12.0;

/// Residual variance of a component is at least this share of the clip's variance: a noiseless clip
/// has no noise to weigh by.
const LEAST_NOISE: f64 = 1e-5;

/// A cycle with the phase of every frame.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    /// Cycles, unwrapped.
    pub(super) phase: Vec<f64>,
    /// Standard deviation of each, cycles.
    pub(super) deviation: Vec<f64>,
    /// 0…1.
    pub(super) trust: Vec<f64>,
    /// The curve.
    pub(super) series: Harmonics,
    /// Variance that the series does not explain, over the trusted frames.
    pub(super) residual_power: f64,
    /// The same over most of the seen frames, trusted or not.
    misfit: f64,
}

/// Number of harmonics that a clip can tell at this phase, with so many frames for each unknown.
fn order(clip: &Clip, phase: &[f64], frames_per_term: usize) -> usize {
    let by_rate = (HIGHEST_FREQUENCY / clip.speed(phase)) as usize;
    let by_frames = (clip.seen() / frames_per_term).saturating_sub(1) / 2;
    MOST_HARMONICS.min(by_rate).min(by_frames).max(1)
}

/// The carrier's phase with all that happens within so many periods taken out.
fn steadied(clip: &Clip, first: &Carrier, periods: f64) -> Vec<f64> {
    let period = 1.0 / clip.speed(&first.phase);
    // Second differences with stiffness s let a wave of w radians a frame through by 1/(1 + s w⁴).
    let stiffness = (periods * period / TAU).powi(4);
    let prior = SpeedPrior::of_stiffness(stiffness, START_MEMORY_PERIODS * period);
    smooth_path(&first.phase, &first.precision, prior).values
}

/// Refines a first phase; `None` when the frames do not determine the series. Of an `even_speed` large changes are not
/// followed.
pub(super) fn fit(clip: &Clip, first: &Carrier, even_speed: bool) -> Option<Fitted> {
    let steady = fit_from(clip, first, START_PERIODS);
    if even_speed {
        return steady;
    }
    let following = fit_from(clip, first, START_PERIODS_FOLLOWING);
    match (steady, following) {
        (Some(steady), Some(following)) => {
            let gained = following.misfit <= FOLLOWING_GAIN * steady.misfit;
            Some(if gained { following } else { steady })
        }
        (steady, following) => steady.or(following),
    }
}

fn fit_from(clip: &Clip, first: &Carrier, start_periods: f64) -> Option<Fitted> {
    let most = order(clip, &first.phase, FRAMES_PER_TERM);
    let sought =
        order(clip, &first.phase, FRAMES_PER_TERM_SOUGHT).max(LEAST_HARMONICS_SOUGHT).min(most);
    let mut whole = clip.clone();
    let mut phase = steadied(clip, first, start_periods);
    let mut trust = clip.seen.clone();
    let mut deviation = vec![0.0; phase.len()];
    let mut prior = None;
    let priors = priors(clip.speed(&phase));
    for round in 0..ROUNDS {
        let (series, noise) = series(&whole, &phase, &trust, sought)?;
        whole = clip.restored(&phase, &series);
        trust = trusts(&whole, &phase, &series, &noise);
        let (measured, precision) = measurements(&whole, &phase, &series, &noise, &trust);
        if round < PRIOR_ROUNDS {
            prior = likeliest_prior(&measured, &precision, &priors);
        }
        let path = smooth_path(&measured, &precision, prior?);
        phase = path.values;
        deviation = path.deviations;
    }
    let order = order(clip, &phase, FRAMES_PER_TERM);
    let (series, _) = self::series(&whole, &phase, &trust, order)?;
    let residual_power = misfit_power(&whole, &phase, &series, &trust);
    let misfit = most_misfit(&whole, &phase, &series);
    Some(Fitted { phase, deviation, trust, series, residual_power, misfit })
}

/// How the speed, cycles a frame, may wander: by a sixteenth of itself down to a sixteen-thousandth, over one period to sixteen.
fn priors(speed: f64) -> Vec<SpeedPrior> {
    let wanders = (0..WANDERS).map(|halvings| MOST_WANDER / f64::from(1_u32 << halvings));
    wanders
        .flat_map(|share| MEMORIES_PERIODS.map(|periods| (share, periods)))
        .map(|(share, periods)| SpeedPrior {
            deviation: share * speed,
            memory_steps: periods / speed,
        })
        .collect()
}

/// The series of the trusted frames, every harmonic drawn towards zero by the share of its power
/// that noise would give, and the noise variance of each component.
fn series(
    clip: &Clip,
    phase: &[f64],
    trust: &[f64],
    order: usize,
) -> Option<(Harmonics, Vec<f64>)> {
    let mut series = Harmonics::fit(phase, &clip.values, clip.components, trust, order)?;
    let total: f64 = trust.iter().sum();
    let free = (total - (1 + 2 * order) as f64).max(1.0);
    let mut noise = vec![LEAST_NOISE * clip.power(); clip.components];
    for (t, &weight) in trust.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        let (value, _) = series.at(phase[t]);
        for (c, v) in clip.row(t).iter().enumerate() {
            noise[c] += weight * (v - value[c]).powi(2) / free;
        }
    }
    let by_chance = 2.0 * noise.iter().sum::<f64>() / total.max(1.0);
    for harmonic in 1..=order {
        let power = series.power(harmonic);
        series.scale(harmonic, if power > by_chance { 1.0 - by_chance / power } else { 0.0 });
    }
    Some((series, noise))
}

/// The trust in each frame, from its misfit against the median misfit.
fn trusts(clip: &Clip, phase: &[f64], series: &Harmonics, noise: &[f64]) -> Vec<f64> {
    let misfits: Vec<f64> = (0..clip.frames())
        .map(|t| {
            let (value, _) = series.at(phase[t]);
            clip.row(t)
                .iter()
                .zip(value.iter().zip(noise))
                .map(|(x, (v, n))| (x - v).powi(2) / n)
                .sum()
        })
        .collect();
    let seen: Vec<f64> =
        misfits.iter().zip(&clip.seen).filter(|(_, s)| **s > 0.0).map(|(m, _)| *m).collect();
    let typical = median(&seen).max(f64::MIN_POSITIVE);
    misfits
        .iter()
        .zip(&clip.seen)
        .map(|(misfit, seen)| {
            let ratio = misfit / typical;
            let trust = if ratio <= DOUBTED {
                1.0
            } else if ratio >= DROPPED {
                0.0
            } else {
                DOUBTED / ratio
            };
            seen * trust
        })
        .collect()
}

/// What each frame says its phase is, and the inverse variance of that: one Gauss-Newton step on
/// the misfit of all components.
fn measurements(
    clip: &Clip,
    phase: &[f64],
    series: &Harmonics,
    noise: &[f64],
    trust: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    (0..clip.frames())
        .map(|t| {
            let (value, slope) = series.at(phase[t]);
            let (mut gradient, mut information) = (0.0, 0.0);
            for (c, x) in clip.row(t).iter().enumerate() {
                gradient += (x - value[c]) * slope[c] / noise[c];
                information += slope[c] * slope[c] / noise[c];
            }
            let step = if information > 0.0 { gradient / information } else { 0.0 };
            (phase[t] + step.clamp(-LARGEST_STEP, LARGEST_STEP), trust[t] * information)
        })
        .unzip()
}

fn misfit_power(clip: &Clip, phase: &[f64], series: &Harmonics, trust: &[f64]) -> f64 {
    let total: f64 = trust.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let sum: f64 = (0..clip.frames()).map(|t| trust[t] * misfit(clip, t, phase, series)).sum();
    sum / total
}

/// Mean misfit of the seen frames but for the worst of them, which may be broken.
fn most_misfit(clip: &Clip, phase: &[f64], series: &Harmonics) -> f64 {
    let seen = (0..clip.frames()).filter(|t| clip.seen[*t] > 0.0);
    let mut all: Vec<f64> = seen.map(|t| misfit(clip, t, phase, series)).collect();
    all.sort_by(f64::total_cmp);
    all.truncate((MISFIT_SHARE * all.len() as f64).ceil() as usize);
    mean(&all)
}

/// Squared distance of a frame from the series, summed over the components.
fn misfit(clip: &Clip, t: usize, phase: &[f64], series: &Harmonics) -> f64 {
    let (value, _) = series.at(phase[t]);
    clip.row(t).iter().zip(value.iter()).map(|(x, v)| (x - v).powi(2)).sum()
}
