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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A mask, and a pixel-for-pixel list of what was said (animal, background) of a picture of its
    /// size.
    fn said() -> impl Strategy<Value = ((usize, usize), Vec<(bool, u8)>)> {
        (1_usize..12, 1_usize..12).prop_flat_map(|(w, h)| {
            let pixels = proptest::collection::vec((proptest::bool::ANY, 0_u8..3), w * h);
            (Just((w, h)), pixels)
        })
    }

    fn labels((w, h): (usize, usize), pixels: &[(bool, u8)]) -> Labels {
        let of = |kind: u8| Mask::from_fn(w, h, |x, y| pixels[y * w + x].1 == kind);
        Labels { animal: of(1), background: of(2) }
    }

    proptest! {
        /// Pixel by pixel: what was said holds, the rest stays.
        #[test]
        fn what_was_said_holds_and_the_rest_stays((size, pixels) in said()) {
            let (w, h) = size;
            let labels = labels(size, &pixels);
            let mask = Mask::from_fn(w, h, |x, y| pixels[y * w + x].0);
            let applied = labels.applied_to(&mask);
            let mut known = vec![Known::Free; w * h];
            labels.mark(&mut known);
            for (at, &(was, said)) in pixels.iter().enumerate() {
                let (set, known_as) = match said {
                    1 => (true, Known::Animal),
                    2 => (false, Known::Background),
                    _ => (was, Known::Free),
                };
                prop_assert_eq!(applied.get(at % w, at / w), set);
                prop_assert_eq!(known[at], known_as);
            }
            prop_assert_eq!(labels.is_whole(), pixels.iter().all(|p| p.1 != 0));
            prop_assert!(Labels::whole(&mask).is_whole());
            prop_assert_eq!(Labels::whole(&mask).applied_to(&applied), mask);
        }

        /// Each pixel of the other size is what the pixel under its middle is, found by searching.
        #[test]
        fn another_size_says_the_same(
            (size, pixels) in said(), other in (1_usize..20, 1_usize..20),
        ) {
            let found = labels(size, &pixels).resized(other);
            let under = |at: usize, to: usize, from: usize| {
                let middle = (at as f64 + 0.5) / to as f64;
                (0..from).rfind(|&i| i as f64 / from as f64 <= middle + 1e-12).unwrap()
            };
            for y in 0..other.1 {
                for x in 0..other.0 {
                    let at = under(y, other.1, size.1) * size.0 + under(x, other.0, size.0);
                    prop_assert_eq!(found.animal.get(x, y), pixels[at].1 == 1);
                    prop_assert_eq!(found.background.get(x, y), pixels[at].1 == 2);
                }
            }
        }
    }
}
