//! Key frames for the interpolation over the gait phase: the m frames with the smallest expected
//! error of the periodic cubic spline through them, found exactly by dynamic programming on the
//! circle.
//!
//! # What is expected
//! The poses are unknown when keys are chosen. Two things are known of them: they are smooth, and
//! they move when the silhouette does. So the expected square error is that of a random motion
//! whose harmonics fall as h⁻⁴ in power with phases unknown ([`STATIONARY_SHARE`] parts), plus
//! that of the silhouette's own cycle, its harmonics drawn down by h⁻² in amplitude, since an
//! outline has sharper turns than the joints that make it (one part). Both are shares of the
//! motion's variance. The error of the phase of a key frame adds to it.
//!
//! The error between two neighbouring keys is taken as that of the cubic spline on an endless
//! even grid of that spacing. It is exact for evenly spaced keys; it depends on the two keys only,
//! which makes the sum over the gaps of a circle a shortest path, and its minimum exact.
//!
//! Measured with the true phases of ten clips of five rigs, yaw 0 and 20, against the mean over all
//! offsets of evenly spaced keys: .94 of its error with 4 keys, .965 with 6, .98 with 8; the best
//! offset, which nobody can know, has .90.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use crate::numeric::Harmonics;
use crate::{Error, Result};

/// Parts of the motion without known phases for one part that follows the silhouette. Between 1 and
/// 10 the errors above change by less than half a percent.
const STATIONARY_SHARE: f64 = 3.0;

/// Power of the harmonics of that motion: h to minus this. The cubic spline is the best linear
/// interpolation of such a motion.
const STATIONARY_FALL: i32 = 4;
const STATIONARY_HARMONICS: usize = 12;

/// Amplitude of the silhouette's harmonics, as a joint's are expected: times h to minus this, and
/// none above the last.
const SILHOUETTE_FALL: i32 = 2;
const SILHOUETTE_HARMONICS: usize = 8;

/// Places within a gap at which the error is evaluated.
const PLACES: usize = 8;

/// Frames that are considered; of a longer clip the most trusted one in each of as many equal
/// parts of the cycle.
const MOST_CANDIDATES: usize = 360;

/// A frame trusted less than this is no key unless the user names it.
const LEAST_TRUST: f64 = 0.5;

/// What is known of the frames.
#[derive(Clone, Copy, Debug)]
pub struct PhasedFrames<'a> {
    /// Phase of each frame, cycles of the interpolation (strides).
    pub cycles: &'a [f64],
    /// Standard deviation of each phase, cycles.
    pub deviation_cycles: &'a [f64],
    /// How well each frame fits the cycle, 0…1.
    pub trust: &'a [f64],
    /// The silhouette's scores over the cycle.
    pub silhouette: &'a Harmonics,
}

/// Which keys are wanted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PhaseKeySettings {
    /// Number of keys, 1 to [`MAX_KEYS`](super::MAX_KEYS).
    pub keys: usize,
    /// Frames never chosen.
    pub exclude: Vec<usize>,
    /// Frames always chosen.
    pub force: Vec<usize>,
    /// Least distance in time of two neighbours on the cycle, frames.
    pub min_spacing_frames: usize,
}

/// The chosen frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseKeys {
    /// The key frames, ascending.
    pub frames: Vec<usize>,
    /// Expected error, as a share of the motion's deviation from its mean pose (root mean square).
    pub expected_error_share: f64,
}

/// Chooses the keys: no other admissible set of the candidates has a smaller expected error.
///
/// # Errors
/// Numbers out of range, frames out of the clip,
/// contradicting or unsatisfiable constraints.
pub fn choose_keys_on_phase(
    frames: PhasedFrames<'_>,
    settings: &PhaseKeySettings,
) -> Result<PhaseKeys> {
    let problem = Circle::new(frames, settings)?;
    let found = problem.shortest(settings.keys);
    let (cost, chosen) = found.ok_or(Error::NoRegularKeys { keys: settings.keys })?;
    let mut chosen: Vec<usize> = chosen.into_iter().map(|i| problem.frames[i]).collect();
    chosen.sort_unstable();
    Ok(PhaseKeys { frames: chosen, expected_error_share: cost.max(0.0).sqrt() })
}

/// The candidates in the order of their phase, and the cost of every gap between two of them.
pub(super) struct Circle {
    frames: Vec<usize>,
    phases: Vec<f64>,
    forced: Vec<bool>,
    /// `costs[a * n + b]`: from candidate a forward to candidate b (a full turn for b = a);
    /// infinite where a forced candidate lies between or the two are too near in time.
    costs: Vec<f64>,
}

impl Circle {
    pub(super) fn new(frames: PhasedFrames<'_>, settings: &PhaseKeySettings) -> Result<Self> {
        let n = frames.cycles.len();
        if settings.keys == 0
            || settings.keys > super::MAX_KEYS
            || settings.force.len() > settings.keys
        {
            return Err(Error::setting(
                "keys.count",
                "is 1 to 24, and no fewer than the frames that must be keys",
            ));
        }
        if let Some(&frame) = settings.force.iter().chain(&settings.exclude).find(|f| **f >= n) {
            return Err(Error::KeyFrameOutOfRange { frame, frames: n });
        }
        if settings.force.iter().any(|f| settings.exclude.contains(f)) {
            return Err(Error::setting("keys.include", "names no frame that keys.exclude names"));
        }
        let mut chosen = candidates(&frames, settings);
        let place = |t: usize| frames.cycles[t].rem_euclid(1.0);
        chosen.sort_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        let mut circle = Self {
            phases: chosen.iter().map(|&t| place(t)).collect(),
            forced: chosen.iter().map(|t| settings.force.contains(t)).collect(),
            frames: chosen,
            costs: Vec::new(),
        };
        circle.costs = circle.all_costs(&frames, settings.min_spacing_frames);
        Ok(circle)
    }

    fn all_costs(&self, frames: &PhasedFrames<'_>, spacing: usize) -> Vec<f64> {
        let n = self.frames.len();
        let motion = Motion::new(frames.silhouette);
        let mut costs = vec![f64::INFINITY; n * n];
        for a in 0..n {
            for step in 1..=n {
                let b = (a + step) % n;
                let near = self.frames[a].abs_diff(self.frames[b]) < spacing && step < n;
                if !near {
                    let gap = self.gap(a, step);
                    let phase_error = [a, b]
                        .iter()
                        .map(|&i| frames.deviation_cycles[self.frames[i]].powi(2))
                        .sum::<f64>()
                        / 2.0;
                    costs[a * n + b] =
                        motion.gap_error(self.phases[a], gap) + gap * motion.speed_sq * phase_error;
                }
                if self.forced[b] {
                    break;
                }
            }
        }
        costs
    }

    /// Phase from candidate `a` forward by `step` candidates.
    fn gap(&self, a: usize, step: usize) -> f64 {
        let n = self.frames.len();
        if step == n {
            return 1.0;
        }
        (self.phases[(a + step) % n] - self.phases[a]).rem_euclid(1.0)
    }

    /// The cheapest round trip over `keys` candidates, with its cost. Every trip passes each forced
    /// candidate; without any, every candidate is tried as the first, as far as the second of the
    /// largest possible gaps goes.
    pub(super) fn shortest(&self, keys: usize) -> Option<(f64, Vec<usize>)> {
        let n = self.frames.len();
        if n < keys || keys == 0 || keys < self.forced.iter().filter(|f| **f).count() {
            return None;
        }
        let starts = match self.forced.iter().position(|f| *f) {
            Some(first) => first..first + 1,
            None => 0..n,
        };
        let mut best: Option<(f64, Vec<usize>)> = None;
        for start in starts {
            // A trip is found from any of its keys; its lowest one will do, which lies in the
            // first of the n / keys parts only if gaps were even, so all are tried.
            let limit = best.as_ref().map_or(f64::INFINITY, |b| b.0);
            if let Some(found) = self.trip(start, keys, limit) {
                best = Some(found);
            }
        }
        best
    }

    /// The cheapest trip from `start` round to itself, if it costs less than `limit`. Candidates
    /// before `start` were starts themselves, so the trip need not pass them unless one is forced.
    fn trip(&self, start: usize, keys: usize, limit: f64) -> Option<(f64, Vec<usize>)> {
        let n = self.frames.len();
        let last = if self.forced.iter().any(|f| *f) { n } else { n - start };
        // reached[k][i]: cost of being at the i-th candidate after the start with k + 1 keys.
        let mut reached = vec![vec![f64::INFINITY; last]; keys];
        let mut from = vec![vec![0_usize; last]; keys];
        reached[0][0] = 0.0;
        for k in 1..keys {
            for i in k..last {
                let at = (start + i) % n;
                for j in (k - 1)..i {
                    let before = reached[k - 1][j];
                    if before >= limit {
                        continue;
                    }
                    let cost = before + self.costs[(start + j) % n * n + at];
                    if cost < reached[k][i] {
                        reached[k][i] = cost;
                        from[k][i] = j;
                    }
                }
            }
        }
        let close = |i: usize| reached[keys - 1][i] + self.costs[(start + i) % n * n + start];
        let end = (keys - 1..last).min_by(|&a, &b| close(a).total_cmp(&close(b)))?;
        let total = close(end);
        if !(total < limit && total.is_finite()) {
            return None;
        }
        let mut path = vec![end];
        for k in (1..keys).rev() {
            path.push(from[k][path[path.len() - 1]]);
        }
        Some((total, path.into_iter().map(|i| (start + i) % n).collect()))
    }
}

/// Frames that may be keys: trusted and not excluded, or forced.
fn candidates(frames: &PhasedFrames<'_>, settings: &PhaseKeySettings) -> Vec<usize> {
    let all = 0..frames.cycles.len();
    let forced = |t: &usize| settings.force.contains(t);
    let allowed: Vec<usize> = all
        .filter(|t| forced(t) || (frames.trust[*t] >= LEAST_TRUST && !settings.exclude.contains(t)))
        .collect();
    if allowed.len() <= MOST_CANDIDATES {
        return allowed;
    }
    let mut best: Vec<Option<usize>> = vec![None; MOST_CANDIDATES];
    let better = |a: usize, b: usize| {
        let rank = |t: usize| (frames.deviation_cycles[t] / frames.trust[t], t);
        rank(a) < rank(b)
    };
    for &t in allowed.iter().filter(|t| !forced(t)) {
        let part = (frames.cycles[t].rem_euclid(1.0) * MOST_CANDIDATES as f64) as usize;
        let slot = &mut best[part.min(MOST_CANDIDATES - 1)];
        if slot.is_none_or(|b| better(t, b)) {
            *slot = Some(t);
        }
    }
    let mut kept: Vec<usize> = best.into_iter().flatten().chain(settings.force.clone()).collect();
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// The expected motion: sums over the components of products of the silhouette's harmonics.
struct Motion {
    /// Σ u_h conj(u_k) and Σ u_h u_k over the components, u the drawn-down complex amplitudes.
    conjugate: Vec<Vec<Complex<f64>>>,
    plain: Vec<Vec<Complex<f64>>>,
    /// Mean square of a derivative by the phase, per unit of variance.
    speed_sq: f64,
}

impl Motion {
    fn new(silhouette: &Harmonics) -> Self {
        let order = silhouette.order().min(SILHOUETTE_HARMONICS);
        let amplitude = |h: usize, c: usize| {
            let (cos, sin) = silhouette.of(h + 1, c);
            Complex::new(cos, -sin) / ((h + 1) as f64).powi(SILHOUETTE_FALL)
        };
        let components = silhouette.components();
        let variance: f64 = (0..order)
            .flat_map(|h| (0..components).map(move |c| (h, c)))
            .map(|(h, c)| amplitude(h, c).norm_sqr() / 2.0)
            .sum();
        // One part of the whole is the silhouette's.
        let scale = 1.0 / (variance.max(f64::MIN_POSITIVE) * (1.0 + STATIONARY_SHARE));
        let sums = |conjugate: bool| -> Vec<Vec<Complex<f64>>> {
            (0..order)
                .map(|h| {
                    (0..order)
                        .map(|k| {
                            let sum: Complex<f64> = (0..components)
                                .map(|c| {
                                    let other = amplitude(k, c);
                                    let other = if conjugate { other.conj() } else { other };
                                    amplitude(h, c) * other
                                })
                                .sum();
                            sum * scale
                        })
                        .collect()
                })
                .collect()
        };
        let speed_sq = (1..=STATIONARY_HARMONICS)
            .map(|h| (TAU * h as f64).powi(2) * stationary_power(h))
            .sum();
        Self { conjugate: sums(true), plain: sums(false), speed_sq }
    }

    /// Expected square error within the gap from `phase` on, times the gap's length.
    fn gap_error(&self, phase: f64, gap: f64) -> f64 {
        let order = self.conjugate.len();
        let mut silhouette = 0.0;
        let mut stationary = 0.0;
        for place in 0..PLACES {
            let share = (place as f64 + 0.5) / PLACES as f64;
            let missed: Vec<Complex<f64>> = (1..=STATIONARY_HARMONICS)
                .map(|h| missed_by_spline(h as f64 * gap, share))
                .collect();
            stationary += missed
                .iter()
                .enumerate()
                .map(|(at, e)| stationary_power(at + 1) * e.norm_sqr())
                .sum::<f64>();
            let turned: Vec<Complex<f64>> = (0..order)
                .map(|h| missed[h] * Complex::from_polar(1.0, TAU * (h + 1) as f64 * phase))
                .collect();
            for h in 0..order {
                for k in 0..order {
                    silhouette += (turned[h] * turned[k].conj() * self.conjugate[h][k]
                        + turned[h] * turned[k] * self.plain[h][k])
                        .re
                        / 2.0;
                }
            }
        }
        let share = STATIONARY_SHARE / (1.0 + STATIONARY_SHARE);
        gap * (silhouette + share * stationary) / PLACES as f64
    }
}

/// Share of harmonic `h` in the variance of the motion without known phases.
fn stationary_power(h: usize) -> f64 {
    let power = |h: usize| (h as f64).powi(-STATIONARY_FALL);
    power(h) / (1..=STATIONARY_HARMONICS).map(power).sum::<f64>()
}

/// exp(2πi·f·x) minus the cubic spline through it at all whole x, at x = `share` of the first gap;
/// `frequency` f in cycles a gap. The spline's second derivatives at the knots are those of the
/// wave times 6(2 cos w − 2)/(4 + 2 cos w), w = 2πf.
fn missed_by_spline(frequency: f64, share: f64) -> Complex<f64> {
    let w = TAU * frequency;
    let bend = 6.0 * (2.0 * w.cos() - 2.0) / (4.0 + 2.0 * w.cos());
    let (a, b) = (1.0 - share, share);
    let end = Complex::from_polar(1.0, w);
    let spline = end * (b + bend * (b.powi(3) - b) / 6.0) + a + bend * (a.powi(3) - a) / 6.0;
    Complex::from_polar(1.0, 2.0 * PI * frequency * share) - spline
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::PeriodicCubic;

    fn silhouette() -> Harmonics {
        let harmonics: Vec<(Vec<f64>, Vec<f64>)> = (1..=5)
            .map(|h| {
                let a = 1.0 / f64::from(h);
                (vec![a, 0.3 * a], vec![-0.2 * a, 0.9 * a])
            })
            .collect();
        Harmonics::from_parts(&[0.0, 0.0], &harmonics).unwrap()
    }

    fn spread(n: usize) -> Vec<f64> {
        (0..n).map(|t| t as f64 * 0.0731 + 0.004 * (t as f64 * 1.7).sin()).collect()
    }

    fn chosen(n: usize, settings: &PhaseKeySettings) -> PhaseKeys {
        let (cycles, deviation, trust) = (spread(n), vec![0.002; n], vec![1.0; n]);
        let silhouette = silhouette();
        let frames = PhasedFrames {
            cycles: &cycles,
            deviation_cycles: &deviation,
            trust: &trust,
            silhouette: &silhouette,
        };
        choose_keys_on_phase(frames, settings).unwrap()
    }

    #[test]
    fn the_error_of_a_wave_is_that_of_the_periodic_spline() {
        for keys in [4_usize, 6, 9] {
            let knots: Vec<f64> = (0..keys).map(|k| k as f64 / keys as f64).collect();
            let spline = PeriodicCubic::new(&knots).unwrap();
            for h in [1.0, 2.0, 3.0] {
                let share = 0.37;
                let phase = (1.0 + share) / keys as f64;
                let weights = spline.weights(phase);
                let value: Complex<f64> = weights
                    .iter()
                    .zip(&knots)
                    .map(|(w, k)| Complex::from_polar(*w, TAU * h * k))
                    .sum();
                let missed = Complex::from_polar(1.0, TAU * h * phase) - value;
                let found = missed_by_spline(h / keys as f64, share);
                assert!((missed.norm() - found.norm()).abs() < 1e-9, "{missed} {found}");
            }
        }
    }

    #[test]
    fn no_set_is_better_than_the_chosen_one() {
        let n = 14;
        let (cycles, deviation, trust) = (spread(n), vec![0.002; n], vec![1.0; n]);
        let silhouette = silhouette();
        let frames = PhasedFrames {
            cycles: &cycles,
            deviation_cycles: &deviation,
            trust: &trust,
            silhouette: &silhouette,
        };
        for force in [vec![], vec![3], vec![2, 9]] {
            let settings = PhaseKeySettings {
                keys: 4,
                force: force.clone(),
                min_spacing_frames: 1,
                exclude: vec![5],
            };
            let found = choose_keys_on_phase(frames, &settings).unwrap();
            let circle = Circle::new(frames, &settings).unwrap();
            let mut best = f64::INFINITY;
            let m = circle.frames.len();
            for set in 0_u32..1 << m {
                let members: Vec<usize> = (0..m).filter(|i| set >> i & 1 == 1).collect();
                if members.len() == 4 {
                    let cost: f64 =
                        (0..4).map(|k| circle.costs[members[k] * m + members[(k + 1) % 4]]).sum();
                    best = best.min(cost);
                }
            }
            assert!((found.expected_error_share - best.sqrt()).abs() < 1e-12);
            assert!(force.iter().all(|f| found.frames.contains(f)) && !found.frames.contains(&5));
        }
    }

    #[test]
    fn keys_are_spread_and_more_of_them_promise_less_error() {
        let settings =
            |keys| PhaseKeySettings { keys, min_spacing_frames: 1, ..Default::default() };
        let cycles = spread(100);
        let mut last = f64::INFINITY;
        for keys in [1, 2, 4, 6, 8, 12] {
            let found = chosen(100, &settings(keys));
            let mut phases: Vec<f64> =
                found.frames.iter().map(|&f| cycles[f].rem_euclid(1.0)).collect();
            phases.sort_by(f64::total_cmp);
            let even = 1.0 / keys as f64;
            for k in 0..keys.max(2) - 1 {
                let gap = phases.get(k + 1).map_or(even, |p| p - phases[k]);
                assert!(gap > 0.6 * even && gap < 1.5 * even, "{keys}: {phases:?}");
            }
            assert!(found.expected_error_share < last);
            last = found.expected_error_share;
        }
    }

    #[test]
    fn distrusted_frames_are_not_chosen_and_nonsense_is_refused() {
        let (cycles, deviation) = (spread(60), vec![0.002; 60]);
        let trust: Vec<f64> = (0..60).map(|t| if t < 30 { 0.2 } else { 1.0 }).collect();
        let silhouette = silhouette();
        let frames = PhasedFrames {
            cycles: &cycles,
            deviation_cycles: &deviation,
            trust: &trust,
            silhouette: &silhouette,
        };
        let settings = PhaseKeySettings { keys: 5, min_spacing_frames: 1, ..Default::default() };
        let found = choose_keys_on_phase(frames, &settings).unwrap();
        assert!(found.frames.iter().all(|f| *f >= 30));
        for wrong in [
            PhaseKeySettings { keys: 0, ..settings.clone() },
            PhaseKeySettings { force: vec![60], ..settings.clone() },
            PhaseKeySettings { force: vec![40], exclude: vec![40], ..settings.clone() },
            PhaseKeySettings { exclude: (30..58).collect(), ..settings.clone() },
        ] {
            assert!(choose_keys_on_phase(frames, &wrong).is_err());
        }
        let budget = super::super::pose_budget(frames, &settings, 2..=12, Some(0.2)).unwrap();
        assert_eq!(budget.len(), 11);
        assert!(budget.windows(2).all(|w| w[1].expected_error_share <= w[0].expected_error_share));
    }
}
