//! What a person said about a frame: some strokes, or the whole mask.

use super::field::Known;
use crate::mask::Mask;

/// Pixels that are known on one frame. Where neither mask is set nothing was said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Labels {
    /// Pixels said to be the animal.
    pub animal: Mask,
    /// Pixels said to be background.
    pub background: Mask,
}

impl Labels {
    /// Every pixel is known: the animal is where `mask` is set and nowhere else.
    #[must_use]
    pub fn whole(mask: &Mask) -> Self {
        Self { animal: mask.clone(), background: mask.not() }
    }

    /// Whether every pixel is known.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        let pixels = self.animal.width() * self.animal.height();
        self.animal.or(&self.background).area() == pixels
    }

    /// A mask made to agree.
    #[must_use]
    pub fn applied_to(&self, mask: &Mask) -> Mask {
        mask.or(&self.animal).and_not(&self.background)
    }

    /// Writes what is known over `known`, one entry a pixel.
    pub(super) fn mark(&self, known: &mut [Known]) {
        let width = self.animal.width();
        for (at, known) in known.iter_mut().enumerate() {
            let (x, y) = (at % width, at / width);
            if self.animal.get(x, y) {
                *known = Known::Animal;
            } else if self.background.get(x, y) {
                *known = Known::Background;
            }
        }
    }

    /// The same at another size: each pixel what the one in its middle is.
    pub(super) fn resized(&self, size: (usize, usize)) -> Self {
        let resize = |mask: &Mask| {
            let (w, h) = (mask.width(), mask.height());
            Mask::from_fn(size.0, size.1, |x, y| {
                mask.get((2 * x + 1) * w / (2 * size.0), (2 * y + 1) * h / (2 * size.1))
            })
        };
        Self { animal: resize(&self.animal), background: resize(&self.background) }
    }
}
