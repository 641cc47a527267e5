//! Sums over a long clip's masks, a band of rows at a time.
//!
//! Packed at once, the windows of 3000 frames that show an animal at its largest take a quarter of
//! a gigabyte, and what the kernels make of them as much again. The Gram matrix is a sum over
//! pixels and a component image is made pixel by pixel, so only one band of every mask needs to be
//! packed; the results are the same to the bit.

use rayon::prelude::*;

use super::Changes;
use super::changes::common_size;
use super::gram::add_gram;
use crate::error::{Error, Result};
use crate::mask::{CroppedMask, Mask};
use crate::numeric::InstructionSet;

/// Bytes of one band of all masks. A clip that fits has one band.
const BAND_BYTES: usize = 32 << 20;

/// The masks of one clip, all of one size, to be packed band by band.
#[derive(Clone, Debug)]
pub struct MaskBands<'a> {
    masks: &'a [&'a CroppedMask],
    size: (usize, usize),
    /// Rows of a band.
    rows: usize,
}

impl<'a> MaskBands<'a> {
    /// Looks at `masks`, all of one size.
    ///
    /// # Errors
    /// As [`Changes::of`].
    pub fn of(masks: &'a [&'a CroppedMask]) -> Result<Self> {
        let size = common_size(masks.iter().map(|m| (m.width(), m.height())))?;
        if masks.iter().all(|mask| mask.is_empty()) {
            return Err(Error::MasksEmpty { frames: masks.len() });
        }
        let row_bytes = 8 * size.0.div_ceil(64) * masks.len();
        Ok(Self { masks, size, rows: (BAND_BYTES / row_bytes).max(1) })
    }

    /// Number of masks.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.masks.len()
    }

    /// The bands, from top to bottom.
    pub(super) fn packed(&self) -> impl Iterator<Item = Changes> {
        let (width, height) = self.size;
        (0..height).step_by(self.rows).map(move |top| {
            let rows = self.rows.min(height - top);
            let cut = |mask: &&CroppedMask| mask.window(0, top as i64, width, rows);
            let band: Vec<Mask> = self.masks.par_iter().map(cut).collect();
            Changes::packed(&band.iter().collect::<Vec<_>>(), (width, rows))
        })
    }

    /// The Gram matrix, as [`Changes::gram`].
    pub(super) fn gram(&self) -> Vec<u32> {
        let n = self.masks.len();
        let mut matrix = vec![0; n * n];
        self.packed().for_each(|band| add_gram(&band, InstructionSet::best(), &mut matrix));
        matrix
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CentredGram, ImagePca};
    use super::*;

    #[test]
    fn bands_give_what_whole_masks_give_to_the_bit() {
        let masks: Vec<Mask> = (0..70)
            .map(|t| {
                let (cx, cy) = (60.0 + (t as f64).sin() * 20.0, 14.0);
                // The lowest rows are empty, so one band holds nothing.
                Mask::from_fn(150, 33, |x, y| {
                    (x as f64 - cx).hypot(2.0 * (y as f64 - cy)) < 25.0 + (t % 7) as f64
                })
            })
            .collect();
        let whole = Changes::of(&masks.iter().collect::<Vec<_>>()).unwrap();
        let cropped: Vec<CroppedMask> = masks.iter().map(CroppedMask::from).collect();
        let cropped: Vec<&CroppedMask> = cropped.iter().collect();
        let pca = ImagePca::of(&whole, 4).unwrap();
        for rows in [1, 7, 33, 40] {
            let bands = MaskBands { rows, ..MaskBands::of(&cropped).unwrap() };
            assert_eq!(CentredGram::of_bands(&bands), CentredGram::of(&whole), "{rows}");
            assert_eq!(pca.images_of_bands(&bands), pca.images(&whole), "{rows}");
        }
    }

    #[test]
    fn what_cannot_be_analysed_is_said_as_of_whole_masks() {
        let (empty, small) = (CroppedMask::empty(9, 9), CroppedMask::empty(8, 9));
        assert!(matches!(MaskBands::of(&[&empty]), Err(Error::TooFewMasks { frames: 1 })));
        assert!(matches!(MaskBands::of(&[&empty; 3]), Err(Error::MasksEmpty { frames: 3 })));
        let sizes = [&empty, &small];
        assert!(matches!(MaskBands::of(&sizes), Err(Error::MaskSize { frame: 1, .. })));
    }
}
