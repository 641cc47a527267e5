use nalgebra::DMatrix;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::numeric::gaussian;

fn ring(frames: usize, noise: f64, seed: u64) -> Coefficients {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut n = || -> f64 { noise * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    let values = (0..frames)
        .flat_map(|t| {
            let a = std::f64::consts::TAU * t as f64 / 12.15;
            [2.0_f64.sqrt() * a.cos() + n(), 2.0_f64.sqrt() * a.sin() + n()]
        })
        .collect();
    Coefficients::from_rows(frames, 2, values).unwrap()
}

fn choose(coefficients: &Coefficients, settings: &KeySettings) -> Result<KeyChoice> {
    choose_keys(coefficients, settings, &|_, _| true)
}

fn asking_for(keys: usize) -> KeySettings {
    KeySettings { keys, ..KeySettings::default() }
}

/// cond(H) by nalgebra.
fn condition_by_nalgebra(c: &Coefficients, set: &[usize], alpha: f64) -> f64 {
    let h = DMatrix::from_fn(set.len(), set.len(), |i, j| {
        gaussian(c.point(set[i]), c.point(set[j]), alpha)
    });
    let e = h.symmetric_eigenvalues();
    if e.min() <= 0.0 { f64::INFINITY } else { e.max() / e.min() }
}

/// The slow twin: all admissible sets, in lexicographic order.
fn exhaustive(c: &Coefficients, s: &KeySettings) -> Option<(f64, Vec<usize>)> {
    let admissible = |set: &[usize]| {
        set.windows(2).all(|w| w[1] - w[0] >= s.min_spacing_frames.max(1))
            && s.force.iter().all(|f| set.contains(f))
            && s.exclude.iter().all(|f| !set.contains(f))
    };
    let mut found: Vec<(f64, Vec<usize>)> = (0_u32..1 << c.frames())
        .filter(|bits| bits.count_ones() as usize == s.keys)
        .map(|bits| (0..c.frames()).filter(|f| bits >> f & 1 == 1).collect::<Vec<usize>>())
        .filter(|set| admissible(set))
        .map(|set| (condition_by_nalgebra(c, &set, s.alpha), set))
        .filter(|(condition, _)| *condition < 1e11)
        .collect();
    let best = found.iter().map(|f| f.0).min_by(f64::total_cmp)?;
    found.retain(|f| f.0 <= best * (1.0 + 1e-9));
    found.into_iter().min_by(|a, b| a.1.cmp(&b.1))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn the_choice_is_the_exhaustive_one(
        frames in 1_usize..=14,
        keys in 1_usize..=5,
        dimensions in 1_usize..=3,
        raw in prop::collection::vec(-2.0..2.0_f64, 42),
        grid in any::<bool>(),
        exclude in prop::collection::vec(0_usize..14, 0..3),
        force in prop::collection::vec(0_usize..14, 0..2),
        min_spacing_frames in 0_usize..4,
        alpha in prop::sample::select(vec![0.2, DEFAULT_ALPHA, 3.0]),
    ) {
        // On a grid many frames coincide and many sets tie.
        let values =
            raw[..frames * dimensions].iter().map(|x| if grid { x.round() } else { *x }).collect();
        let c = Coefficients::from_rows(frames, dimensions, values).unwrap();
        let s = KeySettings {
            keys,
            alpha,
            exclude: exclude.into_iter().filter(|f| *f < frames).collect(),
            force: force.into_iter().filter(|f| *f < frames).collect(),
            min_spacing_frames,
            ..KeySettings::default()
        };
        match (choose(&c, &s), exhaustive(&c, &s)) {
            (Ok(choice), Some((condition, set))) => {
                prop_assert!(choice.proven_optimal);
                prop_assert!((choice.condition / condition - 1.0).abs() < 1e-9 + 1e-13 * condition);
                prop_assert_eq!(choice.lower_bound, choice.condition);
                // With a large condition even the slow twin cannot tell equal sets apart.
                if condition < 1e4 {
                    prop_assert_eq!(choice.frames, set);
                }
            }
            (Err(_), None) => {}
            // Between 1e11 and 1e12 the two need not agree on what is singular.
            (Ok(choice), None) => prop_assert!(choice.condition > 0.9e11),
            (a, b) => prop_assert!(false, "{a:?} {b:?}"),
        }
    }

    #[test]
    fn the_condition_agrees_with_nalgebra(
        keys in 1_usize..=8, raw in prop::collection::vec(-3.0..3.0_f64, 16)
    ) {
        let c = Coefficients::from_rows(8, 2, raw).unwrap();
        let set: Vec<usize> = (0..keys).rev().collect();
        let ours = condition::condition(&crate::numeric::KernelMatrix::of(&c, 0.7), &set);
        let theirs = condition_by_nalgebra(&c, &set, 0.7);
        prop_assume!(theirs < 1e10);
        prop_assert!((ours / theirs - 1.0).abs() < 1e-12 + 1e-14 * theirs);
    }
}

#[test]
fn four_points_of_a_ring_form_a_square() {
    let values = (0..32)
        .flat_map(|t| {
            let a = std::f64::consts::TAU * f64::from(t) / 32.0;
            [a.cos() * 1.4, a.sin() * 1.4]
        })
        .collect();
    let c = Coefficients::from_rows(32, 2, values).unwrap();
    let choice = choose(&c, &asking_for(4)).unwrap();
    // All eight squares tie; the first is chosen.
    assert_eq!(choice.frames, [0, 8, 16, 24]);
    assert!(choice.proven_optimal);
    assert!((choice.condition_squared - choice.condition.powi(2)).abs() < 1e-12);
}

#[test]
fn the_required_sizes_are_proven() {
    for (frames, keys) in [(137, 4), (137, 5), (1000, 4), (100, 7)] {
        let choice = choose(&ring(frames, 0.15, 7), &asking_for(keys)).unwrap();
        assert!(choice.proven_optimal, "{keys} of {frames}");
    }
}

#[test]
fn threads_do_not_change_a_proven_choice() {
    // Exactly periodic: every silhouette comes ten times, so that there are many optima.
    let one = ring(12, 0.15, 3);
    let values = (0..120).flat_map(|t| one.point(t % 12).to_vec()).collect();
    let periodic = Coefficients::from_rows(120, 2, values).unwrap();
    for (c, spacing) in [(&periodic, 1), (&periodic, 5), (&ring(100, 0.1, 5), 1)] {
        let settings = KeySettings { min_spacing_frames: spacing, ..asking_for(5) };
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| choose(c, &settings).unwrap())
        };
        let single = run(1);
        assert!(single.proven_optimal);
        assert_eq!(single, run(2));
        assert_eq!(single, run(5));
    }
}

#[test]
fn out_of_time_the_bound_is_below_the_optimum() {
    let c = ring(100, 0.15, 1);
    let optimum = choose(&c, &asking_for(7)).unwrap();
    assert!(optimum.proven_optimal);
    for (keys, time_limit_s) in [(7, 0.0), (7, 0.01), (7, 0.03)] {
        let hurried = choose(&c, &KeySettings { time_limit_s, ..asking_for(keys) }).unwrap();
        assert!(!hurried.proven_optimal || time_limit_s > 0.0);
        assert!(hurried.lower_bound >= 1.0 && hurried.lower_bound <= optimum.condition);
        assert!(hurried.condition >= optimum.condition);
        assert_eq!(hurried.frames.len(), keys);
    }
    // Far too many sets for a tenth of a second.
    let settings = KeySettings { time_limit_s: 0.1, ..asking_for(12) };
    let start = Instant::now();
    let hurried = choose(&ring(400, 0.15, 1), &settings).unwrap();
    assert!(!hurried.proven_optimal && hurried.lower_bound < hurried.condition);
    assert!(start.elapsed() < Duration::from_secs(5));
}

#[test]
fn a_limit_of_work_ends_the_proof_at_the_same_place_on_any_number_of_threads() {
    let c = ring(100, 0.15, 1);
    let optimum = choose(&c, &asking_for(7)).unwrap();
    let mut bounds = vec![1.0];
    for pair_limit in [1, 100_000, 1_500_000, 30_000_000_000] {
        let settings = KeySettings { pair_limit, time_limit_s: 1e6, ..asking_for(7) };
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| choose(&c, &settings).unwrap())
        };
        let found = on(1);
        assert_eq!(found, on(3));
        assert_eq!(found.proven_optimal, pair_limit > 1_000_000_000);
        assert!(found.lower_bound <= optimum.condition && found.condition >= optimum.condition);
        bounds.push(found.lower_bound);
    }
    // More work never gives a weaker bound.
    assert!(bounds.is_sorted() && bounds[3] > 1.0, "{bounds:?}");
}

#[test]
fn the_caller_can_stop_it() {
    let settings = KeySettings { time_limit_s: f64::INFINITY, ..asking_for(16) };
    let stopped = choose_keys(&ring(400, 0.15, 1), &settings, &|done, total| {
        assert!(done > 0 && total == 0);
        false
    });
    assert!(matches!(stopped, Err(Error::Interrupted)));
}

#[test]
fn a_still_clip_has_one_key_at_most() {
    let still = Coefficients::from_rows(10, 2, vec![0.5; 20]).unwrap();
    assert_eq!(choose(&still, &asking_for(1)).unwrap().frames, [0]);
    let error = choose(&still, &asking_for(2)).unwrap_err();
    assert!(matches!(error, Error::TooFewFramesForKeys { keys: 2, possible: 1 }));
    let spaced = KeySettings { min_spacing_frames: 2, ..asking_for(2) };
    assert!(matches!(choose(&still, &spaced), Err(Error::NoRegularKeys { keys: 2 })));
}

#[test]
fn contradictions_are_named() {
    let c = ring(20, 0.1, 1);
    let refuse = |change: fn(&mut KeySettings)| {
        let mut settings = asking_for(3);
        change(&mut settings);
        choose(&c, &settings).unwrap_err()
    };
    assert!(matches!(refuse(|s| s.keys = 0), Error::KeyCountOutOfRange { keys: 0, .. }));
    assert!(matches!(refuse(|s| s.keys = 25), Error::KeyCountOutOfRange { keys: 25, .. }));
    assert!(matches!(refuse(|s| s.alpha = -1.0), Error::KernelSetting { name: "alpha", .. }));
    assert!(matches!(refuse(|s| s.time_limit_s = f64::NAN), Error::KernelSetting { .. }));
    assert!(matches!(
        refuse(|s| s.exclude = vec![20]),
        Error::KeyFrameOutOfRange { frame: 20, .. }
    ));
    assert!(matches!(refuse(|s| s.force = vec![20]), Error::KeyFrameOutOfRange { frame: 20, .. }));
    assert!(matches!(refuse(|s| s.force = vec![1, 2, 3, 4]), Error::TooManyForcedKeys { .. }));
    let both = refuse(|s| (s.force, s.exclude) = (vec![4], vec![4]));
    assert!(matches!(both, Error::ForcedKeyExcluded { frame: 4 }));
    let close = refuse(|s| (s.force, s.min_spacing_frames) = (vec![9, 4], 6));
    assert!(matches!(close, Error::ForcedKeysTooClose { first: 4, second: 9, spacing: 6 }));
    let cramped = refuse(|s| s.min_spacing_frames = 12);
    assert!(matches!(cramped, Error::TooFewFramesForKeys { keys: 3, possible: 2 }));
    let broken = Coefficients::from_rows(2, 1, vec![0.0, f64::NAN]).unwrap();
    let error = choose(&broken, &asking_for(1)).unwrap_err();
    assert!(matches!(error, Error::CoefficientNotFinite { frame: 1, component: 0 }));
}
