//! Following the camera over a clip: every frame is laid over the one before, and a step that is odd among its
//! neighbours is tried again from theirs.
//!
//! A pan by many pixels over ground whose texture repeats, or behind an animal that fills the picture, has more
//! places where pictures seem to agree than the true one; the search of a single step then errs now and then, but
//! seldom in several in a row. What a camera did about a frame is the best guess for it. It is taken only where
//! it explains the frame better, so that a camera that shakes is followed as it shakes.

use rayon::prelude::*;

use super::{Homography, Pyramid, Registration, register, register_near};
use crate::numeric::median;

/// Steps on either side that a step is compared with.
const NEIGHBOURS: usize = 4;

/// Fewest of them that say what the camera did.
const FEWEST: usize = 3;

/// A step this far from its neighbours' median is odd, as a share of the picture's diagonal.
const ODD: f64 = 0.005;

/// How each frame after the first lies over the one before; `None` where nothing fits. A frame without a picture has
/// none. `excluded` marks the pixels of a frame, one flag each, that are not to be looked at; where nothing fits
/// without them they are.
pub fn follow(
    pictures: &[Option<Pyramid>],
    excluded: impl Fn(usize) -> Vec<bool> + Sync,
) -> Vec<Option<Registration>> {
    let pair = |t: usize| Some((pictures[t].as_ref()?, pictures[t + 1].as_ref()?));
    let searched: Vec<Option<Registration>> = (0..pictures.len().saturating_sub(1))
        .into_par_iter()
        .map(|t| {
            let (from, to) = pair(t)?;
            register(from, to, Some(&excluded(t))).or_else(|| register(from, to, None))
        })
        .collect();
    let size = pictures.iter().flatten().next().map_or((0, 0), Pyramid::size);
    let odd = odd_steps(&searched, size);
    let again = |(t, step): (usize, &Option<Registration>)| {
        let guess = odd[t]?;
        let (from, to) = pair(t)?;
        let near = register_near(from, to, Some(&excluded(t)), &guess)?;
        step.is_none_or(|step| near.residual < step.residual).then_some(near)
    };
    searched.par_iter().enumerate().map(|step| again(step).or(*step.1)).collect()
}

/// For each step that is odd among its neighbours, what they say it should be.
fn odd_steps(steps: &[Option<Registration>], size: (usize, usize)) -> Vec<Option<Homography>> {
    let (x, y) = (size.0 as f64 / 2.0, size.1 as f64 / 2.0);
    let most = ODD * (size.0 as f64).hypot(size.1 as f64);
    let shifts: Vec<Option<(f64, f64)>> = steps
        .iter()
        .map(|step| {
            let (u, v) = step.as_ref()?.homography.apply(x, y);
            Some((u - x, v - y))
        })
        .collect();
    (0..steps.len())
        .map(|t| {
            let around = t.saturating_sub(NEIGHBOURS)..(t + NEIGHBOURS + 1).min(steps.len());
            let others: Vec<(f64, f64)> =
                around.filter(|&s| s != t).filter_map(|s| shifts[s]).collect();
            let (dx, dy) = (others.len() >= FEWEST).then(|| middle(&others))?;
            let odd = shifts[t].is_none_or(|(sx, sy)| (sx - dx).hypot(sy - dy) > most);
            odd.then(|| Homography::translation(dx, dy))
        })
        .collect()
}

/// The median of each coordinate.
fn middle(points: &[(f64, f64)]) -> (f64, f64) {
    let of = |axis: fn(&(f64, f64)) -> f64| median(&points.iter().map(axis).collect::<Vec<_>>());
    (of(|p| p.0), of(|p| p.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (160, 120);

    fn step(dx: f64) -> Option<Registration> {
        let homography = Homography::translation(dx, 0.0);
        Some(Registration { homography, inliers: 0.9, residual: 2.0 })
    }

    #[test]
    fn a_step_is_compared_with_those_about_it() {
        let pan: Vec<_> = [8.0, 8.2, 7.9, 0.3, 8.1].into_iter().map(step).chain([None]).collect();
        let odd = odd_steps(&pan, SIZE);
        let said: Vec<Option<f64>> =
            odd.iter().map(|h| h.map(|h| (10.0 * h.apply(0.0, 0.0).0).round() / 10.0)).collect();
        // The lower median of the others: of five in the middle, of four at the end.
        assert_eq!(said, [None, None, None, Some(8.0), None, Some(7.9)]);
        // Two neighbours say nothing, and a camera that turns slowly is not odd.
        assert!(odd_steps(&[step(0.0), step(9.0), step(0.0)], SIZE).iter().all(Option::is_none));
        let slow: Vec<_> = (0..20).map(|t| step(0.2 * f64::from(t))).collect();
        assert!(odd_steps(&slow, SIZE).iter().all(Option::is_none));
    }

    /// A wall with waves of several lengths, seen from farther and farther to the right.
    fn wall(shift: f64) -> Option<Pyramid> {
        let (w, h) = SIZE;
        let grey: Vec<u8> = (0..w * h)
            .map(|at| {
                let (x, y) = ((at % w) as f64 + shift, (at / w) as f64);
                let value = 128.0 + 40.0 * (0.09 * x + 0.05 * y).sin() + 30.0 * (0.31 * x).sin();
                (value + 20.0 * (0.021 * x - 0.17 * y).sin()) as u8
            })
            .collect();
        Pyramid::new(w, h, &grey)
    }

    #[test]
    fn a_camera_that_jolts_is_followed_as_it_does() {
        // One frame of a pan is held, and then made up for.
        let at = [0.0, 6.0, 12.0, 18.0, 18.0, 30.0, 36.0, 42.0, 48.0];
        let pictures: Vec<_> = at.iter().map(|&shift| wall(shift)).collect();
        let found = follow(&pictures, |_| vec![false; SIZE.0 * SIZE.1]);
        for (t, step) in found.iter().enumerate() {
            let dx = step.unwrap().homography.apply(80.0, 60.0).0 - 80.0;
            assert!((dx + at[t + 1] - at[t]).abs() < 0.1, "step {t}: {dx}");
        }
        // A frame without a picture is none, on either side.
        let mut torn = pictures;
        torn[4] = None;
        let found = follow(&torn, |_| vec![false; SIZE.0 * SIZE.1]);
        assert!(found[3].is_none() && found[4].is_none() && found[5].is_some());
    }
}
