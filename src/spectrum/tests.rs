use std::f64::consts::TAU;

use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::numeric::standardized;

/// A gait as the seed describes it: PC1 and PC2 in quadrature at the fundamental, PC3 and PC4 at
/// twice that, all with some noise.
fn gait(frames: usize, frames_per_cycle: f64, noise: f64, seed: u64) -> Coefficients {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut value =
        |f: f64| f + noise * (uniform(&mut rng) + uniform(&mut rng) + uniform(&mut rng));
    let columns: Vec<Vec<f64>> = [(1.0, 0.0), (1.0, 0.25), (2.0, 0.1), (2.0, 0.35)]
        .iter()
        .map(|&(harmonic, shift)| {
            let series: Vec<f64> = (0..frames)
                .map(|t| value((TAU * (harmonic * t as f64 / frames_per_cycle + shift)).sin()))
                .collect();
            standardized(&series)
        })
        .collect();
    Coefficients::from_columns(&columns).unwrap()
}

fn uniform(rng: &mut impl Rng) -> f64 {
    rng.random_range(-1.0..1.0)
}

const NOTHING: KnownRhythm = KnownRhythm { repeats_hz: None, stride_hz: None };

const SHARES: [f64; 4] = [0.31, 0.2, 0.11, 0.08];

fn run(scores: &Coefficients, fps: f64) -> SpectralAnalysis {
    let masks = MaskCounts { frames: scores.frames(), ..MaskCounts::default() };
    analyse(scores, &SHARES, fps, masks, &Settings::default(), NOTHING).unwrap()
}

#[test]
fn a_clean_gait_is_usable_and_its_harmonics_are_not_in_the_band() {
    let found = run(&gait(100, 24.3, 0.1, 1), 25.0);
    assert!((found.peak.f0_hz - 25.0 / 24.3).abs() < 0.02, "{:?}", found.peak);
    assert!(found.components[0].r > 0.9 && found.components[1].r > 0.9);
    assert!(found.components[2].r < 0.35 && found.components[3].r < 0.35);
    assert_eq!(found.diagnosis.verdict, Verdict::Usable, "{:?}", found.diagnosis);
    assert!(found.diagnosis.advice.is_empty());
    assert!((found.quadrature_deg.unwrap().abs() - 90.0).abs() < 5.0);
    assert!((found.rhythm.step_frames - 24.3).abs() < 0.5);
}

#[test]
fn short_clips_are_doubted_with_the_remedy() {
    let short = run(&gait(32, 24.0, 0.05, 2), 24.0);
    assert_eq!(short.diagnosis.verdict, Verdict::Doubtful);
    assert!(short.diagnosis.reasons.iter().any(|r| matches!(r, Reason::FewCycles { .. })));
    assert!(short.diagnosis.advice.contains(&Advice::MoreFrames));
    let three = run(&gait(60, 60.0 / 3.2, 0.1, 3), 15.0);
    assert_eq!(three.diagnosis.verdict, Verdict::Usable, "{:?}", three.diagnosis);
}

#[test]
fn noise_alone_is_not_usable() {
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let columns: Vec<Vec<f64>> = (0..4)
            .map(|_| standardized(&(0..100).map(|_| uniform(&mut rng)).collect::<Vec<_>>()))
            .collect();
        let scores = Coefficients::from_columns(&columns).unwrap();
        assert_ne!(run(&scores, 25.0).diagnosis.verdict, Verdict::Usable, "seed {seed}");
    }
}

#[test]
fn two_components_in_phase_are_no_circle() {
    let wave: Vec<f64> = (0..100).map(|t| (TAU * f64::from(t) / 20.0).sin()).collect();
    let scores = Coefficients::from_columns(&[standardized(&wave), standardized(&wave)]).unwrap();
    let found = run(&scores, 25.0);
    assert!(found.diagnosis.reasons.iter().any(|r| matches!(r, Reason::NotInQuadrature { .. })));
    assert_eq!(found.diagnosis.verdict, Verdict::Doubtful);
}

#[test]
fn bad_masks_and_constant_components_are_said() {
    let scores = gait(100, 24.3, 0.1, 1);
    let masks = MaskCounts { frames: 100, bad: 60, ..MaskCounts::default() };
    let found = analyse(&scores, &SHARES, 25.0, masks, &Settings::default(), NOTHING).unwrap();
    assert_eq!(found.diagnosis.verdict, Verdict::Unusable);
    let flat = Coefficients::from_columns(&[scores.column(0), vec![0.0; 100]]).unwrap();
    let found = run(&flat, 25.0);
    assert!(matches!(found.diagnosis.reasons[0], Reason::ConstantComponent { component: 2 }));
    assert_eq!(found.band_passed.column(1), vec![0.0; 100]);
}

#[test]
fn a_clip_of_flagged_masks_is_judged_by_what_they_are_flagged_for() {
    let scores = gait(100, 24.3, 0.1, 1);
    let verdict = |flagged: usize, uncertain: usize| {
        let masks = MaskCounts { frames: 100, bad: 0, flagged, uncertain };
        let found = analyse(&scores, &SHARES, 25.0, masks, &Settings::default(), NOTHING).unwrap();
        let said = found.diagnosis.reasons.iter().any(|r| r.to_string().contains("are flagged"));
        (found.diagnosis.verdict, said, found.diagnosis.advice.is_empty())
    };
    assert_eq!(verdict(0, 0), (Verdict::Usable, false, true));
    // A close shot: every silhouette is cut alike.
    assert_eq!(verdict(90, 0), (Verdict::Usable, true, true));
    assert_eq!(verdict(90, 60), (Verdict::Doubtful, true, false));
}

#[test]
fn frame_rates_that_are_none_are_refused() {
    let scores = gait(30, 10.0, 0.0, 1);
    for fps in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let found =
            analyse(&scores, &SHARES, fps, MaskCounts::default(), &Settings::default(), NOTHING);
        assert!(matches!(found, Err(Error::BadFrameRate { .. })));
    }
    let three = gait(3, 10.0, 0.0, 1);
    let found =
        analyse(&three, &SHARES, 25.0, MaskCounts::default(), &Settings::default(), NOTHING);
    assert!(matches!(found, Err(Error::TooFewMasks { frames: 3 })));
}

proptest! {
    #[test]
    fn a_planted_rhythm_is_found_whatever_the_speed(
        frames in 50_usize..200, cycles in 2.5..9.0_f64, seed in any::<u64>()
    ) {
        let per_cycle = frames as f64 / cycles;
        prop_assume!(per_cycle > 8.0);
        let found = run(&gait(frames, per_cycle, 0.15, seed), 30.0);
        prop_assert!((found.peak.f0_hz - 30.0 / per_cycle).abs() < 0.3 * 30.0 / frames as f64);
        prop_assert!(found.components[0].r > 0.8);
        prop_assert!(found.components[2].r < 0.6);
    }
}

#[test]
fn where_the_stride_shows_more_than_the_step_both_are_in_the_band() {
    // PC1 and PC2 follow the stride of 40 frames, PC3 and PC4 its steps.
    let scores = gait(240, 40.0, 0.05, 5);
    let analysed = |stride_hz| {
        let rhythm = KnownRhythm { repeats_hz: Some(25.0 / 20.0), stride_hz };
        let masks = MaskCounts { frames: 240, ..MaskCounts::default() };
        analyse(&scores, &SHARES, 25.0, masks, &Settings::default(), rhythm).unwrap()
    };
    let (steps, both) = (analysed(None), analysed(Some(25.0 / 40.0)));
    assert!(steps.components[0].r < 0.3 && steps.components[2].r > 0.9);
    assert_eq!(steps.diagnosis.verdict, Verdict::Unusable);
    assert!(both.components.iter().all(|c| c.r > 0.9), "{:?}", both.components);
    assert_eq!((both.peak.f0_hz, both.rhythm.step_frames), (1.25, 20.0));
    assert!(both.peak.band_hz.0 < 25.0 / 40.0 && both.peak.band_hz.1 == steps.peak.band_hz.1);
}
