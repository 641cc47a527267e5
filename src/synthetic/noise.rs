//! Noise on the edge of a silhouette, as segmentation makes it.

use rand::{Rng, RngExt};

use crate::mask::Mask;

/// Flips each edge pixel with probability `share` (0…1). An edge pixel has one of its four
/// neighbours on the other side of the silhouette's outline, so pixels on both sides of it can
/// flip; the picture's border makes no edge.
#[must_use]
pub fn edge_noise(mask: &Mask, share: f64, rng: &mut impl Rng) -> Mask {
    let inner = mask.and_not(&mask.eroded(1));
    let outer = mask.dilated(1).and_not(mask);
    let edge = inner.or(&outer);
    let mut noisy = mask.clone();
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            if edge.get(x, y) && rng.random_range(0.0..1.0) < share {
                noisy.set(x, y, !mask.get(x, y));
            }
        }
    }
    noisy
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn about_the_share_of_edge_pixels_flips_and_nothing_else() {
        let mask = Mask::from_fn(200, 200, |x, y| (20..180).contains(&x) && (20..180).contains(&y));
        let noisy = edge_noise(&mask, 0.15, &mut ChaCha8Rng::seed_from_u64(1));
        let flipped = mask.and_not(&noisy).or(&noisy.and_not(&mask));
        // 636 pixels inside the outline and 640 outside.
        let expected = 0.15 * 1276.0;
        assert!((flipped.area() as f64 - expected).abs() < 0.2 * expected, "{}", flipped.area());
        assert_eq!(flipped.and(&mask.eroded(2)).area(), 0);
        assert_eq!(flipped.and_not(&mask.dilated(1)).area(), 0);
        assert_eq!(edge_noise(&mask, 0.0, &mut ChaCha8Rng::seed_from_u64(1)), mask);
    }
}
