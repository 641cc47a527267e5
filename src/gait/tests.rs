use std::f64::consts::TAU;

use super::*;

/// A deterministic stand-in for Gaussian noise: the sum of uniform numbers, unit deviation.
pub(super) fn noise_source(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    move || {
        let sum: f64 = (0..12)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 33) as f64 / f64::from(1_u32 << 31)
            })
            .sum();
        sum - 6.0
    }
}

/// Six components of a planted stride: even lines 2, 4, 6 and odd lines 1, 3, 5 scaled by `odd`,
/// component 1 constant in the even lines (so the plane is not that of components 1 and 2).
pub(super) fn planted(phases: &[f64], odd: f64, noise: f64, seed: u64) -> Coefficients {
    let mut draw = noise_source(seed);
    let rows: Vec<f64> = phases
        .iter()
        .flat_map(|p| {
            let line = |h: f64, a: f64, shift: f64| a * (TAU * (h * p + shift)).cos();
            [
                line(2.0, 1.0, 0.0) + line(4.0, 0.3, 0.1),
                line(6.0, 0.3, 0.3) + odd * line(3.0, 0.5, 0.2),
                line(2.0, 0.8, 0.24) + line(4.0, 0.2, 0.7),
                odd * line(1.0, 1.0, 0.4),
                odd * (line(1.0, 0.7, 0.2) + line(5.0, 0.3, 0.0)),
            ]
        })
        .map(|v| v + noise * draw())
        .collect();
    Coefficients::from_rows(phases.len(), 5, rows).unwrap()
}

/// Root mean square of the difference of two phases, up to a constant, over one unit of phase.
pub(super) fn phase_error(found: &[f64], truth: &[f64]) -> f64 {
    let off: Vec<f64> = found.iter().zip(truth).map(|(a, b)| a - b).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    (off.iter().map(|o| (o - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
}

pub(super) fn steady(frames: usize, stride_frames: f64) -> Vec<f64> {
    (0..frames).map(|t| t as f64 / stride_frames).collect()
}

const SHARES: [f64; 5] = [1.0; 5];

#[test]
fn a_steady_stride_is_measured_to_a_degree_of_phase() {
    let truth = steady(100, 24.3);
    let scores = planted(&truth, 0.3, 0.15, 1);
    let found =
        GaitPhase::measure(&scores, &SHARES, &[true; 100], Symmetry::Symmetric, None).unwrap();
    assert_eq!(found.stride.repeats, Repeats::EveryStep);
    assert!((found.stride_frames() - 24.3).abs() < 0.05, "{}", found.stride_frames());
    let error = phase_error(&found.stride_cycles, &truth);
    assert!(error < 1.0 / 360.0, "{error}");
}

#[test]
fn drift_lost_frames_and_broken_ones_are_survived() {
    // Speed up by a fifth over the clip; frames 30 to 33 not seen, frames 60 and 77 nonsense.
    let truth: Vec<f64> =
        (0..110).map(|t| f64::from(t) / 24.3 * (0.9 + 0.1 * f64::from(t) / 110.0)).collect();
    let mut rows: Vec<f64> = Vec::new();
    let scores = planted(&truth, 0.3, 0.15, 2);
    for t in 0..110 {
        let broken = if t == 60 || t == 77 { 4.0 } else { 0.0 };
        rows.extend(scores.point(t).iter().map(|v| v + broken));
    }
    let scores = Coefficients::from_rows(110, 5, rows).unwrap();
    let mut used = [true; 110];
    used[30..34].fill(false);
    let found = GaitPhase::measure(&scores, &SHARES, &used, Symmetry::Symmetric, None).unwrap();
    assert_eq!(found.stride.repeats, Repeats::EveryStep);
    let error = phase_error(&found.stride_cycles, &truth);
    assert!(error < 0.004, "{error}");
    assert!(found.trust[60] < 0.1 && found.trust[77] < 0.1 && found.trust[31] == 0.0);
    let trusted = found.trust.iter().filter(|t| **t > 0.9).count();
    assert!(trusted > 95, "{trusted}");
}

#[test]
fn half_the_frequency_is_seen_only_where_it_is() {
    let truth = steady(100, 24.3);
    for seed in 0..8 {
        let measure = |odd: f64, symmetry: Symmetry| {
            let scores = planted(&truth, odd, 0.3, seed);
            GaitPhase::measure(&scores, &SHARES, &[true; 100], symmetry, None).unwrap().stride
        };
        assert_eq!(measure(0.4, Symmetry::Unknown).repeats, Repeats::EveryStep);
        assert_eq!(measure(0.0, Symmetry::Unknown).repeats, Repeats::Unknown);
        assert_eq!(measure(0.0, Symmetry::Asymmetric).repeats, Repeats::EveryStride);
        assert!(measure(0.4, Symmetry::Asymmetric).contradicts_gait);
        assert!(!measure(0.0, Symmetry::Asymmetric).contradicts_gait);
    }
}

/// The back over a stride, at three places: its middle goes up and down `once` pixels once a stride and `twice` twice, on a
/// slope; its ends rock about the middle by `rocks` once a stride.
#[derive(Clone, Copy)]
struct Back {
    once: f64,
    twice: f64,
    rocks: f64,
    noise: f64,
}

impl Back {
    fn planted(self, phases: &[f64], seed: u64) -> Coefficients {
        let mut draw = noise_source(seed);
        let height = |p: f64, place: f64| {
            let first = self.once * (TAU * p).cos() + self.rocks * place * (TAU * p + 1.0).cos();
            80.0 + 3.0 * p + first + self.twice * (2.0 * TAU * p + 0.3).cos()
        };
        let rows: Vec<f64> = (phases.iter())
            .flat_map(|p| [-1.0, 0.0, 1.0].map(|place| height(*p, place)))
            .map(|v| v + self.noise * draw())
            .collect();
        Coefficients::from_rows(phases.len(), 3, rows).unwrap()
    }
}

#[test]
fn a_back_that_bobs_twice_in_the_period_tells_the_stride_from_the_step() {
    // Near and far look so unlike that one line a stride outshines the rest: the even lines alone
    // at twice the rate, so that nothing lies at half the silhouette's frequency.
    let truth = steady(100, 24.3);
    let halved: Vec<f64> = truth.iter().map(|p| p / 2.0).collect();
    for seed in 0..8 {
        let scores = planted(&halved, 0.0, 0.1, seed);
        let measure = |symmetry: Symmetry, back: Back| {
            let back = back.planted(&truth, seed + 100);
            let known = Known { symmetry, back: Some(&back), ..Known::default() };
            GaitPhase::measure_knowing(&scores, &SHARES, &[true; 100], &known).unwrap()
        };
        let twice = Back { once: 1.0, twice: 2.0, rocks: 0.0, noise: 0.3 };
        let found = measure(Symmetry::Unknown, twice);
        assert_eq!(found.stride.repeats, Repeats::EveryStride);
        assert!((found.stride_frames() - 24.3).abs() < 0.05, "{}", found.stride_frames());
        let repeats = |symmetry: Symmetry, back: Back| measure(symmetry, back).stride.repeats;
        // The trunk rocks more than it bobs: in each column but the middle one the first line is the greater by far.
        let rocking = Back { once: 0.4, twice: 1.0, rocks: 4.0, noise: 0.3 };
        assert_eq!(repeats(Symmetry::Unknown, rocking), Repeats::EveryStride);
        assert_eq!(repeats(Symmetry::Symmetric, rocking), Repeats::EveryStride);
        let only_rocking = Back { once: 2.0, twice: 0.4, ..rocking };
        assert_eq!(repeats(Symmetry::Unknown, only_rocking), Repeats::Unknown);
        // It bobs once: a gallop's stride, or the step of a walk. The name says which.
        let once = Back { once: 2.0, twice: 0.5, ..twice };
        assert_eq!(repeats(Symmetry::Unknown, once), Repeats::Unknown);
        assert_eq!(repeats(Symmetry::Symmetric, once), Repeats::EveryStep);
        assert_eq!(repeats(Symmetry::Asymmetric, once), Repeats::EveryStride);
        // In between it says nothing, and in noise neither.
        let between = Back { once: 2.0, twice: 1.0, ..twice };
        assert_eq!(repeats(Symmetry::Unknown, between), Repeats::Unknown);
        assert_eq!(repeats(Symmetry::Symmetric, between), Repeats::EveryStride);
        let drowned = Back { once: 0.0, twice: 0.3, rocks: 0.0, noise: 2.6 };
        assert_eq!(repeats(Symmetry::Unknown, drowned), Repeats::Unknown);
        let nothing = Back { twice: 0.0, ..drowned };
        assert_eq!(repeats(Symmetry::Symmetric, nothing), Repeats::EveryStride);
    }
}

#[test]
fn what_is_not_a_clip_is_refused() {
    let flat = Coefficients::from_rows(20, 1, vec![0.0; 20]).unwrap();
    assert!(GaitPhase::measure(&flat, &[1.0], &[true; 20], Symmetry::Unknown, None).is_err());
    let short = planted(&steady(5, 3.0), 0.0, 0.0, 1);
    assert!(GaitPhase::measure(&short, &SHARES, &[true; 5], Symmetry::Unknown, None).is_err());
    let nan = Coefficients::from_rows(20, 1, vec![f64::NAN; 20]).unwrap();
    assert!(GaitPhase::measure(&nan, &[1.0], &[true; 20], Symmetry::Unknown, None).is_err());
}

#[test]
fn the_phase_of_a_rough_clip_does_not_run_away_at_its_ends() {
    // 3½ strides in noise as large as the motion, the first and last frames not seen.
    let truth = steady(84, 18.0);
    let used: Vec<bool> = (0..84).map(|t| (9..74).contains(&t)).collect();
    let errors: Vec<f64> = (0..10)
        .map(|seed| {
            let scores = planted(&truth, 0.3, 1.0, seed);
            let found =
                GaitPhase::measure(&scores, &SHARES, &used, Symmetry::Symmetric, None).unwrap();
            phase_error(&found.stride_cycles, &truth)
        })
        .collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    assert!(worst < 0.03, "{errors:?}");
}

#[test]
fn what_the_drifts_removal_took_of_the_gait_is_given_back() {
    // As for horses that walk past: the stride is hardly faster than the fastest cosine that was taken out.
    const HALF_CYCLES: usize = 5;
    let truth = steady(65, 18.0);
    let times: Vec<usize> = (0..65).collect();
    let basis = slow_basis(&times, 65, HALF_CYCLES);
    // Power of the stride's first line, summed over clips: with nothing removed, and removed but not, or, told of.
    let (mut whole, mut untold, mut told) = (0.0, 0.0, 0.0);
    for seed in 0..10 {
        let scores = planted(&truth, 0.6, 0.3, seed);
        let level = |c: usize| {
            let mut column = scores.column(c);
            for b in &basis {
                let along: f64 = b.iter().zip(&column).map(|(b, v)| b * v).sum();
                column.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
            }
            column
        };
        let left = Coefficients::from_columns(&(0..5).map(level).collect::<Vec<_>>()).unwrap();
        let first_line = |scores: &Coefficients, slow_half_cycles: Option<usize>| {
            let known = Known {
                symmetry: Symmetry::Symmetric,
                repeats_a_frame: Some(1.0 / 9.0),
                slow_half_cycles,
                ..Known::default()
            };
            let found = GaitPhase::measure_knowing(scores, &SHARES, &[true; 65], &known).unwrap();
            found.cycle.power(1)
        };
        whole += first_line(&scores, None);
        untold += first_line(&left, None);
        told += first_line(&left, Some(HALF_CYCLES));
    }
    assert!((told / whole - 1.0).abs() < 0.03, "{told} {whole}");
    assert!(untold < 0.93 * whole, "{untold} {whole}");
}
