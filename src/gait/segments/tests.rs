use std::f64::consts::TAU;

use super::super::tests::noise_source;
use super::*;

/// A cycle in six components: four harmonics, of a gait that `kind` tells from others.
fn cycle(kind: u32, phase: f64) -> [f64; 6] {
    std::array::from_fn(|c| {
        (1..=4_u32)
            .map(|h| {
                let turn = f64::from((7 * kind + 3 * h + 5 * c as u32 + h * c as u32) % 17) / 17.0;
                let size = 1.0 / f64::from(h) / (1.0 + 0.4 * c as f64);
                size * (TAU * (f64::from(h) * phase + turn)).cos()
            })
            .sum()
    })
}

/// Rows of a clip under way.
struct Clip {
    rows: Vec<[f64; 6]>,
}

impl Clip {
    fn new() -> Self {
        Self { rows: Vec::new() }
    }

    fn gait(mut self, kind: u32, frames: usize, phase: impl Fn(f64) -> f64) -> Self {
        self.rows.extend((0..frames).map(|t| cycle(kind, phase(t as f64))));
        self
    }

    fn hold(mut self, frames: usize) -> Self {
        let last = self.rows[self.rows.len() - 1];
        self.rows.extend(std::iter::repeat_n(last, frames));
        self
    }

    /// A way through the space that comes back to none of its places.
    fn once(mut self, frames: usize) -> Self {
        self.rows.extend((0..frames).map(|t| {
            let u = t as f64 / frames as f64;
            std::array::from_fn(|c| {
                let way = [1.6, -1.2, 1.1, 0.9, -0.8, 0.7][c];
                way * (TAU * (u * (0.6 + 0.1 * c as f64) + 0.2 * c as f64)).sin()
            })
        }));
        self
    }

    /// The stretches as `first..end`, with an x where no gait is seen.
    fn cut(&self, noise: f64, seed: u64, used: impl Fn(usize) -> bool) -> String {
        let mut draw = noise_source(seed);
        let values = self.rows.iter().flatten().map(|v| v + noise * draw()).collect();
        let scores = Coefficients::from_rows(self.rows.len(), 6, values).unwrap();
        let used: Vec<bool> = (0..self.rows.len()).map(used).collect();
        let found = stretches(&scores, &[1.0; 6], &used);
        let word = |s: &Stretch| {
            format!("{}..{}{}", s.frames.start, s.frames.end, if s.steady { "" } else { "x" })
        };
        found.iter().map(word).collect::<Vec<_>>().join(" ")
    }

    fn ends(&self, noise: f64, seed: u64) -> Vec<(usize, bool)> {
        let text = self.cut(noise, seed, |_| true);
        text.split(' ')
            .map(|part| {
                let (_, end) = part.split_once("..").unwrap();
                (end.trim_end_matches('x').parse().unwrap(), !end.ends_with('x'))
            })
            .collect()
    }
}

/// Whether the ends of stretches are where they were planted, to `slack` frames.
fn near(found: &[(usize, bool)], planted: &[(usize, bool)], slack: usize) -> bool {
    found.len() == planted.len()
        && found.iter().zip(planted).all(|(f, p)| f.1 == p.1 && f.0.abs_diff(p.0) <= slack)
}

#[test]
fn a_steady_gait_is_one_stretch_however_it_wavers() {
    for seed in 0..4 {
        let noise = [0.05, 0.4][seed as usize % 2];
        let steady = Clip::new().gait(1, 100, |t| t / 12.15);
        assert_eq!(steady.cut(noise, seed, |_| true), "0..100");
        let drifting = Clip::new().gait(1, 110, |t| t / 24.3 * (0.9 + 0.2 * t / 110.0));
        assert_eq!(drifting.cut(noise, seed, |_| true), "0..110");
        let uneven = Clip::new().gait(2, 100, |t| t / 14.0 + 0.12 * (t / 23.0).sin());
        assert_eq!(uneven.cut(noise, seed, |_| true), "0..100");
        // One frame in twenty is nonsense, five are not seen.
        let mut broken = Clip::new().gait(3, 100, |t| t / 12.0);
        (7..100).step_by(20).for_each(|t| broken.rows[t] = [3.0, -3.0, 2.0, 2.0, -2.0, 2.0]);
        assert_eq!(broken.cut(noise, seed, |t| !(50..55).contains(&t)), "0..100");
        // A third of the clip is not seen at all, as of an animal that comes into the picture.
        assert_eq!(steady.cut(noise, seed, |t| t >= 34), "0..100");
        // The shape drifts by more than the gait moves it.
        let mut passing = Clip::new().gait(1, 60, |t| t / 9.0);
        for (t, row) in passing.rows.iter_mut().enumerate() {
            row[0] += 4.0 * (t as f64 / 40.0).cos();
        }
        assert_eq!(passing.cut(noise, seed, |_| true), "0..60");
    }
}

#[test]
fn a_stop_a_jump_and_a_change_of_gait_are_cut_where_they_are() {
    for seed in 0..4 {
        let noise = [0.05, 0.3][seed as usize % 2];
        let stop = Clip::new().gait(1, 60, |t| t / 12.0).hold(30).gait(1, 60, |t| t / 12.0);
        let found = stop.ends(noise, seed);
        assert!(near(&found, &[(60, true), (90, false), (150, true)], 4), "{found:?}");
        let jump = Clip::new().gait(2, 56, |t| t / 14.0).once(35).gait(2, 56, |t| t / 14.0);
        let found = jump.ends(noise, seed);
        assert!(near(&found, &[(56, true), (91, false), (147, true)], 4), "{found:?}");
        let change = Clip::new().gait(1, 75, |t| t / 12.15).gait(5, 60, |t| t / 14.0);
        let found = change.ends(noise, seed);
        assert!(near(&found, &[(75, true), (135, true)], 5), "{found:?}");
    }
}

#[test]
fn a_stop_that_is_shorter_than_the_windows_is_cut_out_where_the_gait_goes_on_as_it_was() {
    for seed in 0..4 {
        for (period, stop) in [(12.0, 8), (12.0, 15), (24.0, 14), (24.0, 24), (24.0, 36)] {
            // Which place in the cycle it stops at is another one each time.
            let halt = 84 + 3 * seed as usize;
            let (from, until) = (halt as f64, halt + stop);
            let clip = Clip::new().gait(2, halt, |t| t / period).hold(stop);
            let clip = clip.gait(2, 84, |t| (from + t) / period);
            let found = clip.ends([0.02, 0.15][seed as usize % 2], seed);
            let planted = [(halt, true), (until, false), (until + 84, true)];
            let slack = (0.35_f64 * period).ceil() as usize;
            assert!(near(&found, &planted, slack), "{period} {stop}: {found:?} for {planted:?}");
        }
        // What is shorter than half of a period is left to the phase.
        let pause = Clip::new().gait(2, 66, |t| t / 24.0).hold(7);
        let pause = pause.gait(2, 66, |t| (66.0 + t) / 24.0);
        assert_eq!(pause.cut(0.05, seed, |_| true), "0..139");
        // An animal that stands, goes and stands again.
        let walk = Clip { rows: vec![cycle(1, 0.0); 18] }.gait(1, 60, |t| t / 12.0).hold(18);
        let found = walk.ends(0.05, seed);
        assert!(near(&found, &[(18, false), (78, true), (96, false)], 5), "{found:?}");
    }
}

#[test]
fn what_is_about_to_be_hidden_does_not_stop() {
    for seed in 0..4 {
        // Behind a post for two periods; on either side of it only a third of the motion is to be seen.
        let mut walk = Clip::new().gait(1, 120, |t| t / 12.15);
        let mean = |c: usize| walk.rows.iter().map(|row| row[c]).sum::<f64>() / 120.0;
        let means: [f64; 6] = std::array::from_fn(mean);
        for t in (40..51).chain(75..84) {
            let row = &mut walk.rows[t];
            row.iter_mut().zip(means).for_each(|(v, mean)| *v = mean + 0.33 * (*v - mean));
        }
        assert_eq!(walk.cut(0.05, seed, |t| !(51..75).contains(&t)), "0..120");
    }
}

#[test]
fn what_has_no_gait_is_one_stretch_without() {
    let still = Clip::new().gait(1, 1, |_| 0.0).hold(59);
    assert_eq!(still.cut(0.3, 1, |_| true).split(' ').count(), 1);
    let short = Clip::new().gait(1, 12, |t| t / 12.0);
    assert_eq!(short.cut(0.0, 1, |_| true), "0..12x");
    let flat = Clip { rows: vec![[0.0; 6]; 50] };
    assert_eq!(flat.cut(0.0, 1, |_| true), "0..50x");
    assert_eq!(flat.cut(0.0, 1, |_| false), "0..50x");
}

#[test]
fn the_programme_finds_the_runs_that_add_up_to_most() {
    // All subsets of runs of ten frames, by brute force.
    let mut draw = noise_source(9);
    for _ in 0..200 {
        let gains: Vec<f64> = (0..10).map(|_| draw()).collect();
        let change = draw().abs();
        let value = |bits: u32| -> f64 {
            let on = |t: usize| bits >> t & 1 == 1;
            let changes = (1..10).filter(|&t| on(t) != on(t - 1)).count() as f64;
            let sum: f64 = (0..10).map(|t| if on(t) { gains[t] } else { -gains[t] }).sum();
            sum - change * changes
        };
        let best = (0..1024).map(value).fold(f64::MIN, f64::max);
        let runs = chosen(&gains, change);
        let bits = runs.iter().flat_map(|r| r.clone()).map(|t| 1 << t).sum();
        assert!((value(bits) - best).abs() < 1e-12, "{gains:?} {change} {runs:?}");
    }
}
