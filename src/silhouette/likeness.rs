//! How alike two pictures are that lie over one another to about half a pixel.

use super::lab_image::LabImage;
use super::plate::UNKNOWN;

/// The least and the greatest value of each plane in the 3 × 3 pixels about each pixel: what half a
/// pixel of misalignment may turn a colour into.
pub(super) struct Box3 {
    low: [Vec<u8>; 3],
    high: [Vec<u8>; 3],
}

impl Box3 {
    pub(super) fn of(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        let mut boxes = BoxRow::new(w);
        let [mut low, mut high]: [[Vec<u8>; 3]; 2] =
            std::array::from_fn(|_| std::array::from_fn(|_| Vec::with_capacity(w * h)));
        for (c, plane) in image.planes().iter().enumerate() {
            for y in 0..h {
                boxes.look(plane, h, y);
                low[c].extend_from_slice(&boxes.low);
                high[c].extend_from_slice(&boxes.high);
            }
        }
        Self { low, high }
    }
}

/// The boxes of one row of a plane: so little that it never leaves the nearest cache.
struct BoxRow {
    low: Vec<u8>,
    high: Vec<u8>,
    /// The same of the columns, with one more at either end.
    column_low: Vec<u8>,
    column_high: Vec<u8>,
}

impl BoxRow {
    fn new(w: usize) -> Self {
        let [low, high] = std::array::from_fn(|_| vec![0; w]);
        let [column_low, column_high] = std::array::from_fn(|_| vec![0; w + 2]);
        Self { low, high, column_low, column_high }
    }

    /// Works out row `y` of a plane of `h` rows.
    fn look(&mut self, plane: &[u8], h: usize, y: usize) {
        let w = self.low.len();
        if w == 0 {
            return;
        }
        // Where there is no row or column, the last there is stands in: that changes nothing.
        let row = |y: usize| &plane[y * w..(y + 1) * w];
        let rows = row(y.saturating_sub(1)).iter().zip(row(y)).zip(row((y + 1).min(h - 1)));
        let columns = self.column_low[1..=w].iter_mut().zip(&mut self.column_high[1..=w]);
        for ((low, high), ((a, b), c)) in columns.zip(rows) {
            *low = (*a).min(*b).min(*c);
            *high = (*a).max(*b).max(*c);
        }
        for column in [&mut self.column_low, &mut self.column_high] {
            column[0] = column[1];
            column[w + 1] = column[w];
        }
        nearest(&self.column_low, &mut self.low, u8::min);
        nearest(&self.column_high, &mut self.high, u8::max);
    }
}

/// `pick` over each three neighbours.
#[inline]
fn nearest(of: &[u8], out: &mut [u8], pick: impl Fn(u8, u8) -> u8) {
    let w = out.len();
    let three = of[..w].iter().zip(&of[1..=w]).zip(&of[2..]);
    for (out, ((a, b), c)) in out.iter_mut().zip(three) {
        *out = pick(pick(*a, *b), *c);
    }
}

/// Distance of each pixel from the other picture's box and of the other picture's pixel from this
/// one's box, whichever is larger: a colour counts as found only when each explains the other. Half
/// units of L*a*b* distance, rounded down, at most 254.
pub(super) fn compare(frame: &LabImage, own: &Box3, other: &LabImage, distances: &mut [u8]) {
    let (w, h) = (frame.width(), frame.height());
    let mut there = BoxRow::new(w);
    let [mut here, mut back] = std::array::from_fn(|_| vec![0_u16; w]);
    for (y, distances) in distances.chunks_exact_mut(w.max(1)).enumerate() {
        let row = y * w..(y + 1) * w;
        here.fill(0);
        back.fill(0);
        for c in 0..3 {
            let (seen, shown) = (&frame.planes()[c], &other.planes()[c]);
            there.look(shown, h, y);
            let (low, high) = (&own.low[c][row.clone()], &own.high[c][row.clone()]);
            let (seen, shown) = (&seen[row.clone()], &shown[row.clone()]);
            // To half units: bytes of L* are, those of a* and b* are whole ones.
            if c == 0 {
                add_squares::<false>(&mut here, seen, &there.low, &there.high);
                add_squares::<false>(&mut back, shown, low, high);
            } else {
                add_squares::<true>(&mut here, seen, &there.low, &there.high);
                add_squares::<true>(&mut back, shown, low, high);
            }
        }
        for (distance, (here, back)) in distances.iter_mut().zip(here.iter().zip(&back)) {
            let root = f32::from(*here.max(back)).sqrt();
            *distance = root.min(f32::from(UNKNOWN - 1)) as u8;
        }
    }
}

/// Adds the squared distances of values from the intervals `low..=high`, the distances doubled or
/// not. What does not fit 8 and 16 bits on the way is a distance of 255 and more, all of which are
/// one in the end.
#[inline]
fn add_squares<const DOUBLED: bool>(sums: &mut [u16], values: &[u8], low: &[u8], high: &[u8]) {
    for (sum, (value, (low, high))) in sums.iter_mut().zip(values.iter().zip(low.iter().zip(high)))
    {
        let d = low.saturating_sub(*value).max(value.saturating_sub(*high));
        let d = u16::from(if DOUBLED { d.saturating_add(d) } else { d });
        *sum = sum.saturating_add(d * d);
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
            compare(&a, &Box3::of(&a), &b, &mut found);
            for (at, &found) in found.iter().enumerate() {
                let there = from_box(a.at(at), &nine(&b, at));
                let back = from_box(b.at(at), &nine(&a, at));
                let wanted = (there.max(back) + 1e-9).floor().min(254.0);
                prop_assert_eq!(f64::from(found), wanted);
            }
        }
    }
}
