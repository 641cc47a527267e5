//! What the method measured on the rendered masks, beside the truth it never saw.

use serde::Serialize;

use crate::gait::GaitPhase;
use crate::pipeline::MaskAnalysis;

/// The gait as it was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// "every_stride", "every_step" or "unknown".
    pub repeats: &'static str,
    /// Whether the evidence contradicts the gait that was named.
    pub contradicts_gait: bool,
    /// Frames a cycle of the measured phase; while it is unknown whether the silhouette repeats once
    /// or twice a stride, from one repeat to the next.
    pub cycle_frames: f64,
    /// Cycles of the measured phase in the clip.
    pub cycles: f64,
    /// Share of the leading components' variance that one cycle, repeated, explains, 0…1.
    pub explained_share: f64,
    /// Power at odd multiples of half the silhouette's frequency over that of the even ones.
    pub odd_share: f64,
    /// The same over what noise would give.
    pub odd_over_noise: f64,
    /// Standard deviation of the phase as the method believes it, cycles: root mean square over the
    /// frames.
    pub phase_deviation_cycles: f64,
    /// What it is: root mean square of the measured less the true phase, a constant taken out, over
    /// the frames that were seen, strides.
    pub phase_error_cycles: f64,
    /// Power of each harmonic of the cycle, share of the variance of all pixels.
    pub harmonic_shares: Vec<f64>,
    /// How far the outline moves: [`MaskAnalysis::sweep`].
    pub sweep: f64,
}

impl Measured {
    /// `true_cycles[t]`: the phase at which frame t was rendered.
    pub(super) fn of(analysis: &MaskAnalysis, true_cycles: &[f64]) -> Option<Self> {
        let gait = analysis.gait.as_ref()?;
        let n = gait.stride_cycles.len();
        Some(Self {
            repeats: gait.stride.repeats.name(),
            contradicts_gait: gait.stride.contradicts_gait,
            cycle_frames: gait.stride_frames(),
            cycles: n as f64 / gait.stride_frames(),
            explained_share: gait.explained_share,
            odd_share: gait.stride.odd_share,
            odd_over_noise: gait.stride.odd_over_noise,
            phase_deviation_cycles: root_mean_square(&gait.deviation_cycles),
            phase_error_cycles: phase_error(gait, &analysis.used, true_cycles),
            harmonic_shares: (1..=gait.cycle.order()).map(|h| gait.cycle.power(h)).collect(),
            sweep: analysis.sweep()?,
        })
    }
}

fn phase_error(gait: &GaitPhase, used: &[bool], true_cycles: &[f64]) -> f64 {
    let off: Vec<f64> = gait
        .stride_cycles
        .iter()
        .zip(true_cycles)
        .zip(used)
        .filter(|(_, used)| **used)
        .map(|((found, truth), _)| found - truth)
        .collect();
    let mean = off.iter().sum::<f64>() / off.len().max(1) as f64;
    root_mean_square(&off.iter().map(|o| o - mean).collect::<Vec<_>>())
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
