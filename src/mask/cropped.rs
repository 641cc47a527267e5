//! Silhouettes held as what lies within their bounds.

use std::sync::Arc;

use super::{Bounds, Mask};

/// A silhouette without the empty picture about it: a clip's worth of them takes the memory of the
/// animal, whatever the size of the footage. All places and sizes are those of the picture. Copies
/// share the pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CroppedMask {
    width: usize,
    height: usize,
    /// Column and row of the first pixel of `inside`.
    corner: (usize, usize),
    /// The pixels within the bounds; none of an empty mask.
    inside: Arc<Mask>,
}

impl From<&Mask> for CroppedMask {
    fn from(mask: &Mask) -> Self {
        let (width, height) = (mask.width(), mask.height());
        let Some(b) = mask.bounds() else { return Self::empty(width, height) };
        let inside = mask.window(b.left as i64, b.top as i64, b.width(), b.height());
        Self { width, height, corner: (b.left, b.top), inside: Arc::new(inside) }
    }
}

impl CroppedMask {
    /// No pixel set, in a picture of `width` × `height`.
    #[must_use]
    pub fn empty(width: usize, height: usize) -> Self {
        Self { width, height, corner: (0, 0), inside: Arc::new(Mask::new(0, 0)) }
    }

    /// Width of the picture, pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the picture, pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Whether the pixel in column `x` and row `y` of the picture is set.
    ///
    /// # Panics
    /// When there is no such pixel.
    #[must_use]
    pub fn get(&self, x: usize, y: usize) -> bool {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) outside the picture");
        let (x, y) = (x.wrapping_sub(self.corner.0), y.wrapping_sub(self.corner.1));
        x < self.inside.width() && y < self.inside.height() && self.inside.get(x, y)
    }

    /// Whether no pixel is set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.inside.is_empty()
    }

    /// Number of pixels set.
    #[must_use]
    pub fn area(&self) -> usize {
        self.inside.area()
    }

    /// As [`Mask::bounds`].
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        let (left, top) = self.corner;
        (!self.is_empty()).then(|| Bounds {
            left,
            top,
            right: left + self.inside.width() - 1,
            bottom: top + self.inside.height() - 1,
        })
    }

    /// As [`Mask::centre_of_mass`], to the last bit.
    #[must_use]
    pub fn centre_of_mass(&self) -> Option<(f64, f64)> {
        self.inside.centre_of_mass_from(self.corner)
    }

    /// As [`Mask::window`].
    #[must_use]
    pub fn window(&self, left: i64, top: i64, width: usize, height: usize) -> Mask {
        let (x, y) = (self.corner.0 as i64, self.corner.1 as i64);
        self.inside.window(left - x, top - y, width, height)
    }

    /// The same part of the picture as [`Self::window`] cuts, as a picture of its own. What lies
    /// wholly inside is not copied.
    #[must_use]
    pub fn cut(&self, left: i64, top: i64, width: usize, height: usize) -> Self {
        let Some(b) = self.bounds() else { return Self::empty(width, height) };
        let within = |first: usize, last: usize, start: i64, size: usize| {
            let (first, last) = (first as i64 - start, last as i64 - start);
            (first >= 0 && last < size as i64).then_some(first as usize)
        };
        match (within(b.left, b.right, left, width), within(b.top, b.bottom, top, height)) {
            (Some(x), Some(y)) => {
                Self { width, height, corner: (x, y), inside: Arc::clone(&self.inside) }
            }
            _ => Self::from(&self.window(left, top, width, height)),
        }
    }

    /// Column and row of the first pixel within the bounds, and the pixels within them.
    pub(super) fn part(&self) -> ((usize, usize), &Mask) {
        (self.corner, &self.inside)
    }

    /// The mask with the picture about it.
    #[must_use]
    pub fn to_mask(&self) -> Mask {
        self.window(0, 0, self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn nothing_is_lost_by_cropping(
            w in 1_usize..150, h in 1_usize..9, seed in any::<u64>(), left in -80_i64..160, top in -4_i64..8
        ) {
            let mask = Mask::from_fn(w, h, |x, y| {
                x * 3 > w && y > 1 && (seed >> ((x * 7 + y * 13) % 64)) & 1 == 1
            });
            let cropped = CroppedMask::from(&mask);
            prop_assert_eq!((cropped.width(), cropped.height()), (w, h));
            prop_assert_eq!(cropped.is_empty(), mask.is_empty());
            prop_assert_eq!(cropped.area(), mask.area());
            prop_assert_eq!(cropped.bounds(), mask.bounds());
            prop_assert_eq!(cropped.centre_of_mass(), mask.centre_of_mass());
            prop_assert_eq!(cropped.window(left, top, 70, 5), mask.window(left, top, 70, 5));
            let part = cropped.cut(left, top, 170, 9);
            prop_assert_eq!(&part, &CroppedMask::from(&mask.window(left, top, 170, 9)));
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                prop_assert_eq!(cropped.get(x, y), mask.get(x, y));
            }
            prop_assert_eq!(cropped.to_mask(), mask);
        }
    }
}
