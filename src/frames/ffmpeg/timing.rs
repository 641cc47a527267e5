//! Is the frame rate constant, and what is it?
//!
//! - Frames count as evenly spaced when each lies within half a frame of its place on the even
//!   grid from the first frame to the last. Then resampling would take every frame exactly once,
//!   so every frame is given once and the rate is the mean rate.
//! - Otherwise the rate is that of the median distance between frames, the rate at which the
//!   camera ran between dropped or held frames, and ffmpeg's `fps` filter resamples to it: each
//!   frame moves to the nearest time `k / fps`, places left empty repeat the frame before, and of
//!   frames that fall on one place the last stays.
//!
//! Time stamps are rounded to ticks (a millisecond in Matroska). Where a standard rate, a whole
//! number or one of NTSC's `n · 1000/1001`, explains the span to within one tick, it is taken in
//! place of the measured one.

/// How the frames of a video follow each other.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Timing {
    /// Frames a second to read at.
    pub(super) fps: f64,
    /// Whether frames must be resampled to come at that rate.
    pub(super) variable: bool,
    /// Frames that will come, as far as the times tell.
    pub(super) frames: Option<usize>,
}

/// Whole rates below this are tried as standard rates, frames a second: high-speed cameras beyond
/// it state their own.
const HIGHEST_STANDARD_RATE: u32 = 1000;

/// Judges presentation times, ascending, in ticks of `tick_s` seconds. `nominal_fps` is what the
/// header states, used when there are fewer than two times. `None` when neither tells a rate.
pub(super) fn judge(times: &[i64], tick_s: f64, nominal_fps: Option<f64>) -> Option<Timing> {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
        return nominal_fps.map(|fps| Timing { fps, variable: false, frames: None });
    };
    let steps = times.len() - 1;
    let span = last.saturating_sub(first) as f64;
    if steps == 0 || span <= 0.0 || tick_s <= 0.0 {
        return nominal_fps.map(|fps| Timing { fps, variable: false, frames: Some(times.len()) });
    }
    let mean = span / steps as f64;
    let even = times
        .iter()
        .enumerate()
        .all(|(i, &t)| ((t - first) as f64 - i as f64 * mean).abs() <= 0.5 * mean);
    if even {
        let fps = standard_rate(span * tick_s, steps as f64, tick_s);
        return Some(Timing { fps, variable: false, frames: Some(times.len()) });
    }
    let step = median_step(times) as f64 * tick_s;
    let fps = nominal_fps
        .filter(|nominal| (1.0 / nominal - step).abs() <= tick_s)
        .unwrap_or_else(|| standard_rate(step, 1.0, tick_s));
    let frames = (span * tick_s * fps).round() as usize + 1;
    Some(Timing { fps, variable: true, frames: Some(frames) })
}

fn median_step(times: &[i64]) -> i64 {
    let mut steps: Vec<i64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    *steps.select_nth_unstable(middle).1
}

/// The rate of `steps` frames in `span_s` seconds, known to a tick: the standard rate nearest to
/// it when the two cannot be told apart, else the plain quotient.
fn standard_rate(span_s: f64, steps: f64, tick_s: f64) -> f64 {
    let measured = steps / span_s;
    let whole = measured.round().clamp(1.0, f64::from(HIGHEST_STANDARD_RATE));
    let ntsc = (measured * 1.001).round().max(1.0) * 1000.0 / 1001.0;
    // A hair more than a tick, because the span itself is a rounded product.
    let fits = |rate: f64| (steps / rate - span_s).abs() <= tick_s * (1.0 + 1e-9);
    let gap = |rate: f64| (rate - measured).abs();
    // Where both fit, few frames on a coarse clock, the nearer one; whole numbers on a tie.
    match (fits(whole), fits(ntsc)) {
        (true, true) if gap(ntsc) < gap(whole) => ntsc,
        (true, _) => whole,
        (false, true) => ntsc,
        (false, false) => measured,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Times of frames `indices` at `fps`, rounded down to ticks.
    fn at(indices: impl Iterator<Item = u32>, fps: f64, tick_s: f64) -> Vec<i64> {
        indices.map(|i| (f64::from(i) / fps / tick_s).round() as i64).collect()
    }

    #[test]
    fn milliseconds_do_not_blur_ntsc() {
        let fps = 30_000.0 / 1001.0;
        let timing = judge(&at(0..500, fps, 0.001), 0.001, None).unwrap();
        assert_eq!(timing, Timing { fps, variable: false, frames: Some(500) });
        let film = judge(&at(0..500, 25.0, 0.001), 0.001, Some(24.9)).unwrap();
        assert_eq!(film.fps, 25.0);
    }

    #[test]
    fn a_hole_makes_the_rate_variable_and_keeps_the_cameras_rate() {
        let times = at((0..50).filter(|i| !(10..=20).contains(i)), 25.0, 1.0 / 12_800.0);
        let timing = judge(&times, 1.0 / 12_800.0, Some(19.5)).unwrap();
        assert_eq!(timing, Timing { fps: 25.0, variable: true, frames: Some(50) });
    }

    #[test]
    fn one_frame_takes_the_stated_rate() {
        assert_eq!(judge(&[7], 0.001, Some(24.0)).unwrap().fps, 24.0);
        assert_eq!(judge(&[7], 0.001, None), None);
        assert_eq!(judge(&[], 0.001, None), None);
    }

    proptest! {
        #[test]
        fn jitter_below_a_quarter_frame_is_constant(
            fps in 5.0_f64..120.0,
            jitter in prop::collection::vec(-0.24_f64..0.24, 3..80),
        ) {
            let tick_s = 1e-5;
            let times: Vec<i64> = jitter
                .iter()
                .enumerate()
                .map(|(i, j)| ((i as f64 + 1.0 + j) / fps / tick_s).round() as i64)
                .collect();
            let timing = judge(&times, tick_s, None).unwrap();
            prop_assert!(!timing.variable);
            // The mean is off by what the two ends are off.
            let steps = (jitter.len() - 1) as f64;
            let off = (jitter[jitter.len() - 1] - jitter[0]).abs() / steps + 1e-3;
            prop_assert!((timing.fps / fps - 1.0).abs() <= 2.0 * off, "{} {}", timing.fps, fps);
        }

        #[test]
        fn long_holds_are_variable(fps in 10_u32..60, count in 10_u32..60, hold in 3_u32..20) {
            let indices = (0..count).map(|i| if i > count / 2 { i + hold } else { i });
            let timing = judge(&at(indices, f64::from(fps), 1e-5), 1e-5, None).unwrap();
            prop_assert!(timing.variable);
            prop_assert!((timing.fps - f64::from(fps)).abs() < 0.05);
            prop_assert_eq!(timing.frames, Some((count + hold) as usize));
        }
    }
}
