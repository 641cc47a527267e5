//! How far a silhouette reaches in each row and each column.

use super::{CroppedMask, Mask};

/// First and last set pixel of every row (columns, from the left) and of every column (rows, from the top); `None` where
/// nothing is set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reach {
    /// One entry a row.
    pub rows: Vec<Option<(usize, usize)>>,
    /// One entry a column.
    pub columns: Vec<Option<(usize, usize)>>,
}

impl Mask {
    /// The first and last set pixels of all rows and columns.
    #[must_use]
    pub fn reach(&self) -> Reach {
        let words = self.words_per_row();
        let row = |y: usize| &self.words()[y * words..(y + 1) * words];
        let of_row = |y: usize| {
            let first = row(y).iter().position(|w| *w != 0)?;
            let last = row(y).iter().rposition(|w| *w != 0)?;
            let left = 64 * first + row(y)[first].trailing_zeros() as usize;
            Some((left, 64 * last + 63 - row(y)[last].leading_zeros() as usize))
        };
        let tops = self.first_in_columns(0..self.height());
        let bottoms = self.first_in_columns((0..self.height()).rev());
        Reach {
            rows: (0..self.height()).map(of_row).collect(),
            columns: tops.into_iter().zip(bottoms).map(|(t, b)| Some((t?, b?))).collect(),
        }
    }

    /// The first of the rows, in the order given, in which each column is set.
    fn first_in_columns(&self, rows: impl Iterator<Item = usize>) -> Vec<Option<usize>> {
        let words = self.words_per_row();
        let mut seen = vec![0_u64; words];
        let mut found = vec![None; self.width()];
        for y in rows {
            let row = &self.words()[y * words..(y + 1) * words];
            for (at, (word, seen)) in row.iter().zip(&mut seen).enumerate() {
                let mut new = word & !*seen;
                *seen |= word;
                while new != 0 {
                    found[64 * at + new.trailing_zeros() as usize] = Some(y);
                    new &= new - 1;
                }
            }
        }
        found
    }
}

impl CroppedMask {
    /// The same of the whole picture.
    #[must_use]
    pub fn reach(&self) -> Reach {
        let (corner, inside) = self.part();
        let part = inside.reach();
        let placed =
            |own: Vec<Option<(usize, usize)>>, size: usize, first: usize, across: usize| {
                let mut all = vec![None; size];
                for (slot, ends) in all[first..].iter_mut().zip(own) {
                    *slot = ends.map(|(a, b)| (a + across, b + across));
                }
                all
            };
        Reach {
            rows: placed(part.rows, self.height(), corner.1, corner.0),
            columns: placed(part.columns, self.width(), corner.0, corner.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The definition, pixel by pixel.
    fn slow(mask: &Mask) -> Reach {
        let ends = |set: Vec<usize>| Some((*set.first()?, *set.last()?));
        let (w, h) = (mask.width(), mask.height());
        Reach {
            rows: (0..h).map(|y| ends((0..w).filter(|&x| mask.get(x, y)).collect())).collect(),
            columns: (0..w).map(|x| ends((0..h).filter(|&y| mask.get(x, y)).collect())).collect(),
        }
    }

    proptest! {
        #[test]
        fn it_is_the_first_and_last_pixel_of_each_row_and_column(
            (width, pixels) in (1_usize..150).prop_flat_map(|w| {
                (Just(w), proptest::collection::vec(proptest::bool::weighted(0.05), w * 9))
            })
        ) {
            let mask = Mask::from_bools(width, 9, &pixels).unwrap();
            prop_assert_eq!(mask.reach(), slow(&mask));
            prop_assert_eq!(CroppedMask::from(&mask).reach(), slow(&mask));
        }
    }

    #[test]
    fn nothing_reaches_nowhere() {
        let empty = CroppedMask::empty(5, 3).reach();
        assert_eq!((empty.rows, empty.columns), (vec![None; 3], vec![None; 5]));
    }
}
