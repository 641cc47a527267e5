//! The line of the back: what a swap of near and far legs does not touch.

use super::Windowed;
use crate::mask::CroppedMask;
use crate::numeric::Coefficients;

/// The centre of mass lies in the trunk: a column belongs to it when its pixel in the row of the
/// centre is set in at least this share of the frames. So neck, head and tail are left out, whose
/// outline is too steep to have a height.
const TRUNK_SHARE: f64 = 0.97;

/// Columns that are looked at, evenly spread; neighbours say the same.
const MOST_COLUMNS: usize = 48;

impl Windowed {
    /// Height of the back in the picture: for each frame and for columns of the trunk fixed to the
    /// animal, the row of the upper outline, pixels from the picture's top. It is counted from the
    /// picture, not from the window: the window follows the centre of mass, which the legs move.
    /// Rows of frames that are not `used` mean nothing. `None` without used frames or trunk.
    #[must_use]
    pub fn back_rows_px(&self, used: &[bool]) -> Option<Coefficients> {
        let seen: Vec<&CroppedMask> =
            self.masks.iter().zip(used).filter(|(_, u)| **u).map(|(m, _)| m).collect();
        let first = seen.first()?;
        let centre = first.height() / 2;
        let least = TRUNK_SHARE * seen.len() as f64;
        let trunk: Vec<usize> = (0..first.width())
            .filter(|&x| seen.iter().filter(|m| m.get(x, centre)).count() as f64 >= least)
            .collect();
        if trunk.is_empty() {
            return None;
        }
        let taken = trunk.len().min(MOST_COLUMNS);
        let columns: Vec<usize> = (0..taken).map(|k| trunk[k * trunk.len() / taken]).collect();
        let rows = self.masks.iter().zip(&self.corners_px).flat_map(|(mask, corner)| {
            columns.iter().map(move |&x| {
                // The number of set pixels, not the first one: a speck above changes it by one.
                let above = (0..centre).filter(|&y| mask.get(x, y)).count();
                corner.1 as f64 + centre as f64 - above as f64
            })
        });
        Coefficients::from_rows(self.masks.len(), taken, rows.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{WindowSettings, windowed};
    use super::*;
    use crate::mask::Mask;

    /// A trunk whose back stands at `top`, on a leg that is `leg` pixels long.
    fn animal(top: usize, leg: usize) -> Mask {
        Mask::from_fn(120, 90, |x, y| {
            let trunk = (20..100).contains(&x) && (top..50).contains(&y);
            trunk || ((30..40).contains(&x) && (50..50 + leg).contains(&y))
        })
    }

    #[test]
    fn the_back_is_where_it_stands_in_the_picture_whatever_the_legs_do() {
        let masks = [animal(20, 5), animal(20, 30), animal(17, 12), Mask::new(120, 90)];
        let cropped: Vec<CroppedMask> = masks.iter().map(CroppedMask::from).collect();
        let windows = windowed(&cropped.iter().collect::<Vec<_>>(), WindowSettings::default());
        let back = windows.back_rows_px(&[true, true, true, false]).unwrap();
        assert_eq!((back.frames(), back.components()), (4, 48));
        for (t, row) in [(0, 20.0), (1, 20.0), (2, 17.0)] {
            assert!(back.point(t).iter().all(|r| *r == row), "{t}: {:?}", back.point(t));
        }
        assert!(windows.back_rows_px(&[false; 4]).is_none());
    }
}
