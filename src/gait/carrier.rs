//! The phase of the strongest line, by local least squares.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Matrix4, Vector4};

use super::Clip;
use crate::numeric::{amplitude_spectrum, wrapped};

/// Standard deviation of the Gaussian window, periods: 1.2 cycles from flank to flank.
const WINDOW_PERIODS: f64 = 0.6;

/// The window ends this many standard deviations from its centre.
const WINDOW_REACH: f64 = 3.0;

/// Rounds in which the window's sinusoid takes over the speed found by the last. The phase of a
/// clip whose speed drifts by an eighth has settled after two.
const ROUNDS: usize = 4;

/// Points a bin at which the spectrum is searched.
const ZERO_PADDING: usize = 8;

/// Below this many cycles in the clip lies drift (as for the verdict's spectrum).
const LEAST_CYCLES: f64 = 0.75;

/// The phase of the strongest line.
#[derive(Clone, Debug)]
pub(super) struct Carrier {
    /// Of each frame, periods, unwrapped. Frames that are not seen go on as the one before.
    pub(super) phase: Vec<f64>,
    /// The line's power about each frame over its mean, 0 where the frame is not seen: the inverse variance of a
    /// phase goes with the power. Where the line fades the phase is anybody's.
    pub(super) precision: Vec<f64>,
}

impl Carrier {
    /// The same in periods twice as long.
    pub(super) fn halved(&self) -> Self {
        let phase = self.phase.iter().map(|p| p / 2.0).collect();
        Self { phase, precision: self.precision.clone() }
    }
}

/// The line at the given frequency, cycles a frame, or at the clip's strongest one.
pub(super) fn track(clip: &Clip, frequency: Option<f64>) -> Carrier {
    let frequency = frequency.unwrap_or_else(|| strongest_frequency(clip));
    let phase = (0..clip.frames()).map(|t| frequency * t as f64).collect();
    let mut carrier = Carrier { phase, precision: clip.seen.clone() };
    for _ in 0..ROUNDS {
        carrier = corrected(clip, &carrier.phase, frequency);
    }
    carrier
}

/// The frequency at which all components together have the largest amplitude, cycles a frame.
/// A straight line is taken out first: a drift is no rhythm.
fn strongest_frequency(clip: &Clip) -> f64 {
    let n = clip.frames();
    let mut power = vec![0.0; n * ZERO_PADDING / 2 + 1];
    for c in 0..clip.components {
        let column: Vec<f64> = (0..n).map(|t| clip.row(t)[c]).collect();
        for (sum, a) in power.iter_mut().zip(amplitude_spectrum(&detrended(column), ZERO_PADDING)) {
            *sum += a * a;
        }
    }
    let first = (LEAST_CYCLES * ZERO_PADDING as f64).ceil() as usize;
    let peak = (first..power.len().saturating_sub(1))
        .max_by(|&a, &b| power[a].total_cmp(&power[b]).then(b.cmp(&a)))
        .unwrap_or(first);
    let at = |k: usize| power.get(k).copied().unwrap_or(0.0);
    let curvature = at(peak - 1) - 2.0 * at(peak) + at(peak + 1);
    let shift = if curvature < 0.0 { 0.5 * (at(peak - 1) - at(peak + 1)) / curvature } else { 0.0 };
    (peak as f64 + shift.clamp(-0.5, 0.5)) / (n * ZERO_PADDING) as f64
}

fn detrended(mut column: Vec<f64>) -> Vec<f64> {
    let n = column.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let (mut moment, mut inertia) = (0.0, 0.0);
    let mean = column.iter().sum::<f64>() / n;
    for (t, v) in column.iter().enumerate() {
        moment += (t as f64 - middle) * v;
        inertia += (t as f64 - middle).powi(2);
    }
    let slope = if inertia > 0.0 { moment / inertia } else { 0.0 };
    for (t, v) in column.iter_mut().enumerate() {
        *v -= mean + slope * (t as f64 - middle);
    }
    column
}

/// `phase` plus what the components, combined coherently, say it is off.
fn corrected(clip: &Clip, phase: &[f64], frequency: f64) -> Carrier {
    let amplitudes: Vec<Vec<[f64; 2]>> =
        (0..clip.frames()).map(|t| local_amplitudes(clip, phase, t, frequency)).collect();
    let direction = leading_direction(&amplitudes, &clip.seen, clip.components);
    let mut last = 0.0;
    let (phase, power): (Vec<f64>, Vec<f64>) = (phase.iter().zip(&clip.seen).zip(&amplitudes))
        .map(|((p, seen), z)| {
            // The sum of conj(direction) · z.
            let (mut re, mut im) = (0.0, 0.0);
            for (d, z) in direction.iter().zip(z) {
                re += d[0] * z[0] + d[1] * z[1];
                im += d[0] * z[1] - d[1] * z[0];
            }
            if *seen > 0.0 {
                last += wrapped(im.atan2(re) - TAU * p - last);
            }
            (p + last / TAU, seen * (re * re + im * im))
        })
        .unzip();
    let mean = power.iter().sum::<f64>() / clip.seen.iter().sum::<f64>().max(1.0);
    let precision = power.iter().map(|p| p / mean.max(f64::MIN_POSITIVE)).collect();
    Carrier { phase, precision }
}

/// The complex amplitude of every component about frame `t`: near t the component is
/// Re(z exp(i(carrier − carrier at t))), so the argument of z is the component's own phase at t.
fn local_amplitudes(clip: &Clip, phase: &[f64], t: usize, frequency: f64) -> Vec<[f64; 2]> {
    let deviation = WINDOW_PERIODS / frequency;
    let reach = (WINDOW_REACH * deviation).ceil() as usize;
    let mut normal = Matrix4::<f64>::zeros();
    let mut right = vec![Vector4::<f64>::zeros(); clip.components];
    for s in t.saturating_sub(reach)..(t + reach + 1).min(clip.frames()) {
        let away = (s as f64 - t as f64) / deviation;
        let weight = clip.seen[s] * (-0.5 * away * away).exp();
        let (sin, cos) = (TAU * (phase[s] - phase[t])).sin_cos();
        let basis = Vector4::new(1.0, away, cos, sin);
        normal += weight * basis * basis.transpose();
        for (sum, value) in right.iter_mut().zip(clip.row(s)) {
            *sum += weight * value * basis;
        }
    }
    // A window of lost frames has no say; a trace of the identity keeps it from failing.
    normal += Matrix4::identity() * (1e-9 * normal.trace().max(1e-12));
    let Some(factor) = normal.cholesky() else { return vec![[0.0; 2]; clip.components] };
    right
        .iter()
        .map(|r| {
            let x = factor.solve(r);
            [x[2], -x[3]]
        })
        .collect()
}

/// The leading eigenvector of the Hermitian sum of z zᴴ over the seen frames, by way of the real
/// symmetric matrix of twice the size.
fn leading_direction(
    amplitudes: &[Vec<[f64; 2]>],
    seen: &[f64],
    components: usize,
) -> Vec<[f64; 2]> {
    let n = components;
    let mut real = DMatrix::<f64>::zeros(2 * n, 2 * n);
    for (z, _) in amplitudes.iter().zip(seen).filter(|(_, seen)| **seen > 0.0) {
        for i in 0..n {
            for j in 0..n {
                let re = z[i][0] * z[j][0] + z[i][1] * z[j][1];
                let im = z[i][1] * z[j][0] - z[i][0] * z[j][1];
                real[(i, j)] += re;
                real[(n + i, n + j)] += re;
                real[(n + i, j)] += im;
                real[(i, n + j)] -= im;
            }
        }
    }
    let eigen = real.symmetric_eigen();
    let top = eigen.eigenvalues.imax();
    (0..n).map(|i| [eigen.eigenvectors[(i, top)], eigen.eigenvectors[(n + i, top)]]).collect()
}
