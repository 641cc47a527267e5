//! How alike two pictures are that lie over one another to about half a pixel.

use super::lab_image::LabImage;
use super::plate::UNKNOWN;
use crate::numeric::{InstructionSet, Kernel, whole_part};

/// The least and the greatest value of each plane in the 3 × 3 pixels about each pixel: what half a
/// pixel of misalignment may turn a colour into.
pub(super) struct Box3 {
    low: [Vec<u8>; 3],
    high: [Vec<u8>; 3],
}

impl Box3 {
    pub(super) fn of(image: &LabImage) -> Self {
        InstructionSet::best().run(Boxes(image))
    }

    #[inline(always)]
    fn worked_out(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        let mut boxes = BoxRow::new(w);
        let [mut low, mut high]: [[Vec<u8>; 3]; 2] =
            std::array::from_fn(|_| std::array::from_fn(|_| Vec::with_capacity(w * h)));
        for (c, plane) in image.planes().iter().enumerate() {
            for y in 0..h {
                boxes.look(plane, h, y);
                low[c].extend_from_slice(&boxes.low.as_flattened()[..w]);
                high[c].extend_from_slice(&boxes.high.as_flattened()[..w]);
            }
        }
        Self { low, high }
    }
}

/// The boxes of a picture, to be worked out.
struct Boxes<'a>(&'a LabImage);

impl Kernel for Boxes<'_> {
    type Result = Box3;

    #[inline(always)]
    fn run(self) -> Box3 {
        Box3::worked_out(self.0)
    }
}

/// Pixels that are looked at together: all of them are a few vectors, whatever the instructions.
const BLOCK: usize = 64;
type Block = [u8; BLOCK];

/// The boxes of one row of a plane: so little that it never leaves the nearest cache. What lies beyond the
/// row up to whole blocks says nothing.
struct BoxRow {
    width: usize,
    low: Vec<Block>,
    high: Vec<Block>,
    /// The same of the columns, with one more at either end.
    column_low: Vec<u8>,
    column_high: Vec<u8>,
}

impl BoxRow {
    fn new(width: usize) -> Self {
        let blocks = width.div_ceil(BLOCK);
        let [low, high] = std::array::from_fn(|_| vec![[0; BLOCK]; blocks]);
        let [column_low, column_high] = std::array::from_fn(|_| vec![0; blocks * BLOCK + 2]);
        Self { width, low, high, column_low, column_high }
    }

    /// Works out row `y` of a plane of `h` rows.
    #[inline(always)]
    fn look(&mut self, plane: &[u8], h: usize, y: usize) {
        let w = self.width;
        if w == 0 {
            return;
        }
        // Where there is no row or column, the last there is stands in: that changes nothing.
        let rows = [y.saturating_sub(1), y, (y + 1).min(h - 1)].map(|y| &plane[y * w..]);
        // Whole blocks, with the beginning of the next row, but for the last rows.
        let whole = (rows[2].len() / BLOCK).min(self.low.len());
        for at in 0..whole {
            let [a, b, c] = rows.map(|row| block(row, at));
            let (low, high) = (&mut self.column_low[1..], &mut self.column_high[1..]);
            let low = &mut low.as_chunks_mut::<BLOCK>().0[at];
            let high = &mut high.as_chunks_mut::<BLOCK>().0[at];
            for i in 0..BLOCK {
                low[i] = a[i].min(b[i]).min(c[i]);
                high[i] = a[i].max(b[i]).max(c[i]);
            }
        }
        for x in whole * BLOCK..w {
            let [a, b, c] = rows.map(|row| row[x]);
            self.column_low[1 + x] = a.min(b).min(c);
            self.column_high[1 + x] = a.max(b).max(c);
        }
        for column in [&mut self.column_low, &mut self.column_high] {
            column[0] = column[1];
            column[w + 1] = column[w];
        }
        nearest(&self.column_low, &mut self.low, u8::min);
        nearest(&self.column_high, &mut self.high, u8::max);
    }
}

/// Block `at` of a row that has it.
#[inline(always)]
fn block(row: &[u8], at: usize) -> &Block {
    piece(row, at * BLOCK)
}

/// `pick` over each three neighbours.
#[inline(always)]
fn nearest(of: &[u8], out: &mut [Block], pick: impl Fn(u8, u8) -> u8) {
    for (at, out) in out.iter_mut().enumerate() {
        let [a, b, c] = [0, 1, 2].map(|shift| block(&of[shift..], at));
        for (i, out) in out.iter_mut().enumerate() {
            *out = pick(pick(a[i], b[i]), c[i]);
        }
    }
}

/// Distance of each pixel from the other picture's box and of the other picture's pixel from this
/// one's box, whichever is larger: a colour counts as found only when each explains the other. Half
/// units of L*a*b* distance, rounded down, at most 254.
pub(super) fn compare(frame: &LabImage, own: &Box3, other: &LabImage, distances: &mut [u8]) {
    InstructionSet::best().run(Comparison { frame, own, other, distances });
}

/// A comparison to be made.
struct Comparison<'a> {
    frame: &'a LabImage,
    own: &'a Box3,
    other: &'a LabImage,
    distances: &'a mut [u8],
}

impl Kernel for Comparison<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Self { frame, own, other, distances } = self;
        let (w, h) = (frame.width(), frame.height());
        let mut there: [BoxRow; 3] = std::array::from_fn(|_| BoxRow::new(w));
        for (y, distances) in distances.chunks_exact_mut(w.max(1)).enumerate() {
            for (boxes, plane) in there.iter_mut().zip(other.planes()) {
                boxes.look(plane, h, y);
            }
            let row = y * w..(y + 1) * w;
            let channel = |c: usize| Channel {
                seen: &frame.planes()[c][row.clone()],
                own: (&own.low[c][row.clone()], &own.high[c][row.clone()]),
                shown: &other.planes()[c][row.clone()],
                there: (there[c].low.as_flattened(), there[c].high.as_flattened()),
            };
            // The `map` of an array is not compiled into a kernel.
            let channels = [channel(0), channel(1), channel(2)];
            match w {
                BLOCK.. => compare_row::<BLOCK>(&channels, distances),
                8.. => compare_row::<8>(&channels, distances),
                _ => compare_row::<1>(&channels, distances),
            }
        }
    }
}

/// What is compared of one plane's row, the boxes as the least and the greatest values.
struct Channel<'a> {
    seen: &'a [u8],
    own: (&'a [u8], &'a [u8]),
    shown: &'a [u8],
    there: (&'a [u8], &'a [u8]),
}

/// Distances of a row of `N` pixels or more, `N` at a time; some of the last ones are worked out twice.
#[inline(always)]
fn compare_row<const N: usize>(channels: &[Channel; 3], distances: &mut [u8]) {
    for at in (0..distances.len()).step_by(N) {
        let start = at.min(distances.len() - N);
        distances[start..start + N].copy_from_slice(&compared::<N>(channels, start));
    }
}

/// Distances of the pixels from `start` on.
#[inline(always)]
fn compared<const N: usize>(channels: &[Channel; 3], start: usize) -> [u8; N] {
    let [mut here, mut back] = [[0_u16; N]; 2];
    // To half units: bytes of L* are, those of a* and b* are whole ones.
    for (c, channel) in channels.iter().enumerate() {
        let Channel { seen, own, shown, there } = channel;
        add_squares(&mut here, piece(seen, start), ends(*there, start), c > 0);
        add_squares(&mut back, piece(shown, start), ends(*own, start), c > 0);
    }
    let mut distances = [0; N];
    for i in 0..N {
        let root = f32::from(here[i].max(back[i])).sqrt();
        distances[i] = whole_part(root.min(f32::from(UNKNOWN - 1))) as u8;
    }
    distances
}

/// The `N` pixels from `start` on, which there are.
#[inline(always)]
fn piece<const N: usize>(row: &[u8], start: usize) -> &[u8; N] {
    &row[start..].as_chunks().0[0]
}

#[inline(always)]
fn ends<'a, const N: usize>(
    (low, high): (&'a [u8], &'a [u8]),
    start: usize,
) -> (&'a [u8; N], &'a [u8; N]) {
    (piece(low, start), piece(high, start))
}

/// Adds the squared distances of values from the intervals `low..=high`, the distances doubled or
/// not. What does not fit 8 and 16 bits on the way is a distance of 255 and more, all of which are
/// one in the end.
#[inline(always)]
fn add_squares<const N: usize>(
    sums: &mut [u16; N],
    values: &[u8; N],
    (low, high): (&[u8; N], &[u8; N]),
    doubled: bool,
) {
    for i in 0..N {
        let d = low[i].saturating_sub(values[i]).max(values[i].saturating_sub(high[i]));
        let d = u16::from(if doubled { d.saturating_add(d) } else { d });
        sums[i] = sums[i].saturating_add(d * d);
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
        // Up to two whole blocks, too.
        let width = prop_oneof![4 => 1_usize..9, 1 => 60_usize..140];
        (width, 1_usize..9).prop_flat_map(move |(w, h)| {
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
        #![proptest_config(ProptestConfig::with_cases(64))]

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
