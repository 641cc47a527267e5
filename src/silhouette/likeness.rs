//! How alike two pictures are that lie over one another to about half a pixel.

use super::lab_image::LabImage;
use super::plate::UNKNOWN;

/// Pixels compared at a time: their sums stay in the first cache.
const CHUNK: usize = 1024;

/// The least and the greatest value of each plane in the 3 × 3 pixels about each pixel: what half a
/// pixel of misalignment may turn a colour into.
pub(super) struct Box3 {
    low: [Vec<u8>; 3],
    high: [Vec<u8>; 3],
}

impl Box3 {
    pub(super) fn of(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        Self {
            low: std::array::from_fn(|c| filtered(&image.planes()[c], w, h, u8::min)),
            high: std::array::from_fn(|c| filtered(&image.planes()[c], w, h, u8::max)),
        }
    }
}

/// `pick` over the 3 × 3 neighbourhood, by columns and then by rows.
fn filtered(plane: &[u8], w: usize, h: usize, pick: impl Fn(u8, u8) -> u8) -> Vec<u8> {
    let mut across = plane.to_vec();
    for (row, out) in plane.chunks_exact(w).zip(across.chunks_exact_mut(w)) {
        for (o, (a, b)) in out[1..].iter_mut().zip(row[..w - 1].iter().zip(&row[1..])) {
            *o = pick(*a, *b);
        }
        for (o, b) in out[..w - 1].iter_mut().zip(&row[1..]) {
            *o = pick(*o, *b);
        }
    }
    let mut result = across.clone();
    for y in 0..h {
        let out = &mut result[y * w..(y + 1) * w];
        for near in [y.checked_sub(1), Some(y + 1).filter(|&n| n < h)].into_iter().flatten() {
            for (o, v) in out.iter_mut().zip(&across[near * w..(near + 1) * w]) {
                *o = pick(*o, *v);
            }
        }
    }
    result
}

/// Distance of each pixel from the other picture's box and of the other picture's pixel from this
/// one's box, whichever is larger: a colour counts as found only when each explains the other. Half
/// units of L*a*b* distance, rounded down, at most 254.
pub(super) fn compare(
    frame: &LabImage,
    own: &Box3,
    other: &LabImage,
    there: &Box3,
    distances: &mut [u8],
) {
    for (at, distances) in distances.chunks_mut(CHUNK).enumerate() {
        let range = at * CHUNK..at * CHUNK + distances.len();
        let (mut here, mut back) = ([0_i32; CHUNK], [0_i32; CHUNK]);
        for c in 0..3 {
            // To half units: bytes of L* are, those of a* and b* are whole ones; squared.
            let unit = if c == 0 { 1 } else { 4 };
            let part = |planes: &[Vec<u8>; 3]| -> [u8; CHUNK] {
                let mut part = [0; CHUNK];
                part[..range.len()].copy_from_slice(&planes[c][range.clone()]);
                part
            };
            let (seen, shown) = (part(frame.planes()), part(other.planes()));
            add_squares(&mut here, &seen, &part(&there.low), &part(&there.high), unit);
            add_squares(&mut back, &shown, &part(&own.low), &part(&own.high), unit);
        }
        for (distance, (here, back)) in distances.iter_mut().zip(here.iter().zip(&back)) {
            let root = (*here.max(back) as f32).sqrt();
            *distance = root.min(f32::from(UNKNOWN - 1)) as u8;
        }
    }
}

/// Adds `unit` times the squared distances of values from the intervals `low..=high`.
#[inline]
fn add_squares(
    sums: &mut [i32; CHUNK],
    values: &[u8; CHUNK],
    low: &[u8; CHUNK],
    high: &[u8; CHUNK],
    unit: i32,
) {
    for i in 0..CHUNK {
        let d = low[i].saturating_sub(values[i]).max(values[i].saturating_sub(high[i]));
        sums[i] += i32::from(u16::from(d) * u16::from(d)) * unit;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Two pictures of one size.
    fn two() -> impl Strategy<Value = (LabImage, LabImage)> {
        let planes = |n: usize| {
            proptest::array::uniform3(proptest::collection::vec(proptest::num::u8::ANY, n))
        };
        (1_usize..9, 1_usize..9).prop_flat_map(move |(w, h)| {
            let image = move |planes| LabImage::from_planes(w, h, planes);
            (planes(w * h).prop_map(image), planes(w * h).prop_map(image))
        })
    }

    /// The nine pixels about one, as far as there are any.
    fn nine(image: &LabImage, at: usize) -> Vec<[u8; 3]> {
        let (w, h) = (image.width(), image.height());
        let near =
            |other: &usize| (other % w).abs_diff(at % w) < 2 && (other / w).abs_diff(at / w) < 2;
        (0..w * h).filter(near).map(|other| image.at(other)).collect()
    }

    /// Distance of a colour from the box about some colours, by the definition.
    fn from_box(colour: [u8; 3], colours: &[[u8; 3]]) -> f64 {
        let along = |c: usize| {
            let low = colours.iter().map(|v| v[c]).min().unwrap();
            let high = colours.iter().map(|v| v[c]).max().unwrap();
            let off = f64::from(low) - f64::from(colour[c]);
            let over = f64::from(colour[c]) - f64::from(high);
            off.max(over).max(0.0) * if c == 0 { 1.0 } else { 2.0 }
        };
        along(0).hypot(along(1)).hypot(along(2))
    }

    proptest! {
        /// Against looking at the nine pixels of either picture.
        #[test]
        fn distances_are_those_from_the_boxes_about_each_pixel((a, b) in two()) {
            let mut found = vec![0; a.width() * a.height()];
            compare(&a, &Box3::of(&a), &b, &Box3::of(&b), &mut found);
            for (at, &found) in found.iter().enumerate() {
                let there = from_box(a.at(at), &nine(&b, at));
                let back = from_box(b.at(at), &nine(&a, at));
                let wanted = (there.max(back) + 1e-9).floor().min(254.0);
                prop_assert_eq!(f64::from(found), wanted);
            }
        }
    }
}
