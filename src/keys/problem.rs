//! The request, validated: which frames may be chosen, which must.

use crate::numeric::{Coefficients, KernelMatrix};
use crate::{Error, Result};

use super::{KeySettings, MAX_KEYS};

/// A key-choice problem that has at least one admissible set.
pub(super) struct Problem {
    /// Kernel matrix of all frames of the clip.
    pub(super) kernel: KernelMatrix,
    /// Number of keys, m.
    pub(super) keys: usize,
    /// Frames that must be chosen, ascending.
    pub(super) forced: Vec<usize>,
    /// Frames that may be chosen besides, in order of angle in the plane of the first two
    /// components: neighbours on the loop come together, which makes good colour classes.
    pub(super) free: Vec<usize>,
    /// Least distance in time of two keys, frames; at least 1.
    pub(super) spacing: usize,
}

impl Problem {
    pub(super) fn new(coefficients: &Coefficients, settings: &KeySettings) -> Result<Self> {
        check_numbers(coefficients, settings)?;
        let frames = coefficients.frames();
        let spacing = settings.min_spacing_frames.max(1);
        let mut forced = settings.force.clone();
        forced.sort_unstable();
        forced.dedup();
        let mut allowed = vec![true; frames];
        for &f in &settings.exclude {
            *allowed.get_mut(f).ok_or(Error::KeyFrameOutOfRange { frame: f, frames })? = false;
        }
        check_forced(coefficients, &forced, &allowed, spacing, settings.keys)?;
        let mut free: Vec<usize> = (0..frames)
            .filter(|&f| allowed[f] && forced.iter().all(|&g| g.abs_diff(f) >= spacing))
            .collect();
        if spacing == 1 {
            free = first_of_equals(coefficients, &forced, &free);
        }
        let possible = forced.len() + spread(&free, spacing);
        if possible < settings.keys {
            return Err(Error::TooFewFramesForKeys { keys: settings.keys, possible });
        }
        sort_by_angle(coefficients, &mut free);
        let kernel = KernelMatrix::of(coefficients, settings.alpha);
        Ok(Self { kernel, keys: settings.keys, forced, free, spacing })
    }

    /// Whether two frames may be chosen together as far as time goes.
    pub(super) fn apart(&self, f: usize, g: usize) -> bool {
        f.abs_diff(g) >= self.spacing
    }
}

fn check_numbers(coefficients: &Coefficients, settings: &KeySettings) -> Result<()> {
    if settings.keys == 0 || settings.keys > MAX_KEYS {
        return Err(Error::KeyCountOutOfRange { keys: settings.keys, most: MAX_KEYS });
    }
    if !(settings.alpha.is_finite() && settings.alpha > 0.0) {
        return Err(Error::KernelSetting {
            name: "alpha",
            value: settings.alpha,
            allowed: "a positive number",
        });
    }
    if settings.time_limit_s.is_nan() || settings.time_limit_s < 0.0 {
        return Err(Error::KernelSetting {
            name: "time_limit_s",
            value: settings.time_limit_s,
            allowed: "zero or a positive number of seconds",
        });
    }
    coefficients.check_finite()
}

fn check_forced(
    coefficients: &Coefficients,
    forced: &[usize],
    allowed: &[bool],
    spacing: usize,
    keys: usize,
) -> Result<()> {
    let frames = allowed.len();
    for &f in forced {
        match allowed.get(f) {
            None => return Err(Error::KeyFrameOutOfRange { frame: f, frames }),
            Some(false) => return Err(Error::ForcedKeyExcluded { frame: f }),
            Some(true) => {}
        }
    }
    if forced.len() > keys {
        return Err(Error::TooManyForcedKeys { forced: forced.len(), keys });
    }
    for (i, &g) in forced.iter().enumerate() {
        for &f in &forced[..i] {
            if g - f < spacing {
                return Err(Error::ForcedKeysTooClose { first: f, second: g, spacing });
            }
            if coefficients.point(f) == coefficients.point(g) {
                return Err(Error::CoincidingKeys { first: f, second: g });
            }
        }
    }
    Ok(())
}

/// Leaves of frames with identical points the first only, and none that equals a forced frame.
///
/// Two such frames never go together (H would be singular) and are exchangeable, so the optimum
/// with the smallest frame numbers survives. An exactly periodic clip would otherwise have
/// (repeats)^m optima to enumerate.
fn first_of_equals(coefficients: &Coefficients, forced: &[usize], free: &[usize]) -> Vec<usize> {
    let order = |&f: &usize, &g: &usize| {
        let (p, q) = (coefficients.point(f), coefficients.point(g));
        p.iter().zip(q).map(|(a, b)| (a + 0.0).total_cmp(&(b + 0.0))).find(|o| o.is_ne())
    };
    let mut sorted: Vec<usize> = free.to_vec();
    sorted.sort_by(|f, g| order(f, g).unwrap_or_else(|| f.cmp(g)));
    sorted.dedup_by(|g, f| order(f, g).is_none());
    sorted.retain(|f| forced.iter().all(|g| order(f, g).is_some()));
    sorted
}

/// The most frames that fit with at least `spacing` between any two: taking the earliest that fits
/// is optimal on a line.
pub(super) fn spread(frames: &[usize], spacing: usize) -> usize {
    let mut sorted = frames.to_vec();
    sorted.sort_unstable();
    let mut count = 0;
    let mut next = 0;
    for f in sorted {
        if f >= next {
            count += 1;
            next = f + spacing;
        }
    }
    count
}

fn sort_by_angle(coefficients: &Coefficients, free: &mut [usize]) {
    let angle = |f: usize| {
        let p = coefficients.point(f);
        match p {
            [] => 0.0,
            [x] => *x,
            [x, y, ..] => y.atan2(*x),
        }
    };
    free.sort_by(|&f, &g| angle(f).total_cmp(&angle(g)).then(f.cmp(&g)));
}
