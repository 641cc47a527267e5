//! How far the silhouette reaches, in bands across the window: places on the outline, which move as
//! far as the animal does, where pixels are only set or not.

use rayon::prelude::*;

use super::Windowed;
use crate::numeric::Coefficients;

/// Bands of rows, and as many of columns.
const BANDS: usize = 32;

/// A band in which nothing is set in more frames than this share says nothing.
const MOST_EMPTY: f64 = 0.02;

impl Windowed {
    /// For each frame the mean first and last set column of each band of rows, and the mean first and last set row of each
    /// band of columns, window pixels; bands that are empty in more than a fiftieth of the `used` frames are left
    /// out. Where a band is empty all the same, and in frames that are not used, its mean stands. `None` where no band
    /// is left.
    #[must_use]
    pub fn reach_px(&self, used: &[bool]) -> Option<Coefficients> {
        let frames: Vec<Vec<Option<[f64; 2]>>> = self
            .masks
            .par_iter()
            .zip(used)
            .map(|(mask, used)| {
                if !used {
                    return vec![None; 2 * BANDS];
                }
                let reach = mask.reach();
                [banded(&reach.rows), banded(&reach.columns)].concat()
            })
            .collect();
        let count = used.iter().filter(|u| **u).count() as f64;
        let columns: Vec<Vec<f64>> = (0..2 * BANDS)
            .filter_map(|band| {
                let seen: Vec<[f64; 2]> = frames.iter().filter_map(|f| f[band]).collect();
                let enough = seen.len() as f64 >= (1.0 - MOST_EMPTY) * count && !seen.is_empty();
                enough.then(|| {
                    [0, 1].map(|end| {
                        let mean = seen.iter().map(|s| s[end]).sum::<f64>() / seen.len() as f64;
                        frames.iter().map(|f| f[band].map_or(mean, |s| s[end])).collect()
                    })
                })
            })
            .flatten()
            .collect();
        Coefficients::from_columns(&columns).filter(|c| c.components() > 0)
    }
}

/// Means of the ends over each band's lines in which something is set.
fn banded(lines: &[Option<(usize, usize)>]) -> Vec<Option<[f64; 2]>> {
    let of_band = |band: usize| {
        let own = &lines[band * lines.len() / BANDS..(band + 1) * lines.len() / BANDS];
        let set: Vec<(usize, usize)> = own.iter().flatten().copied().collect();
        let mean = |end: fn(&(usize, usize)) -> usize| {
            set.iter().map(end).sum::<usize>() as f64 / set.len() as f64
        };
        (!set.is_empty()).then(|| [mean(|e| e.0), mean(|e| e.1)])
    };
    (0..BANDS).map(of_band).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{WindowSettings, windowed};
    use crate::mask::{CroppedMask, Mask};

    #[test]
    fn a_leg_that_swings_farther_reaches_farther() {
        // A trunk, and a leg under it whose foot stands `out` columns farther than its top.
        let animal = |out: usize| {
            Mask::from_fn(200, 128, |x, y| {
                let leg = 90 + out * y.saturating_sub(60) / 60;
                ((40..160).contains(&x) && (20..60).contains(&y))
                    || ((60..120).contains(&y) && (leg..leg + 8).contains(&x))
            })
        };
        let masks: Vec<CroppedMask> =
            [10, 20, 30, 20].iter().map(|out| CroppedMask::from(&animal(*out))).collect();
        let windows = windowed(&masks.iter().collect::<Vec<_>>(), WindowSettings::default());
        let reach = windows.reach_px(&[true, true, true, false]).unwrap();
        assert_eq!(reach.frames(), 4);
        let moved = |c: usize| reach.point(2)[c] - reach.point(0)[c];
        // The last band of the leg, after the centre of mass has moved with it by a column.
        let foot = (0..reach.components()).any(|c| (17.0..20.0).contains(&moved(c)));
        // The trunk's bands, but for that column, stand.
        let still = (0..reach.components()).filter(|c| moved(*c).abs() < 1.5).count();
        assert!(foot && still > reach.components() / 3, "{foot} {still}");
        // The frame that is not used says nothing: it has the mean.
        for c in 0..reach.components() {
            let mean = (0..3).map(|t| reach.point(t)[c]).sum::<f64>() / 3.0;
            assert!((reach.point(3)[c] - mean).abs() < 1e-9);
        }
        assert!(windows.reach_px(&[false; 4]).is_none());
    }
}
