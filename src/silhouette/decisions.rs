//! The decision for every colour of 8 bits a channel, exact, each worked out when a picture first
//! shows it.
//!
//! A clip shows some hundred thousand of the 2²⁴ colours. Their decisions are kept in a byte each, so
//! that eight of them make the bits of eight pixels by one multiplication, in the order of the
//! channels they are stored in: the 256 colours that differ in one channel only lie side by side, and
//! a picture shows each two others with few levels of it, a cache line or two. Only what is near a
//! colour that was met takes memory.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU8, Ordering};

use super::lab_image::LabImage;
use crate::image::{Picture, YuvConversion, YuvMatrix, YuvPicture};
use crate::mask::Mask;

/// The two bits of a colour: whether it is known, and whether it is the animal's.
const KNOWN: u8 = 2;
const ANIMAL: u8 = 1;

/// The 256 colours of two fixed channels.
#[repr(align(64))]
struct Line([AtomicU8; 256]);

impl Line {
    /// Decisions never change, so it does not matter in which order threads see them.
    #[inline]
    fn at(&self, level: u8) -> u8 {
        self.0[usize::from(level)].load(Ordering::Relaxed)
    }

    fn learn(&self, level: u8, is_animal: bool) {
        let bits = KNOWN | if is_animal { ANIMAL } else { 0 };
        self.0[usize::from(level)].store(bits, Ordering::Relaxed);
    }
}

/// The lines of one fixed channel.
type Plane = Box<[Line; 256]>;

/// The decisions met so far, by what two channels are (a line) and the third.
pub(super) struct Decisions([OnceLock<Plane>; 256]);

/// The decisions of eight pixels, a byte each, as one bit each, the first in the lowest; `None` unless
/// all are known.
#[inline]
fn packed(decisions: u64) -> Option<u64> {
    let all = |bits: u8| u64::from_le_bytes([bits; 8]);
    // Byte i is moved to bit 56 + i by one of the multiplier's bits, and by no other above 56.
    (decisions & all(KNOWN) == all(KNOWN))
        .then(|| (decisions & all(ANIMAL)).wrapping_mul(0x0102_0408_1020_4080) >> 56)
}

impl Decisions {
    pub(super) fn new() -> Self {
        Self(std::array::from_fn(|_| OnceLock::new()))
    }

    /// `None` while no colour near it was met.
    #[inline]
    fn line(&self, first: u8, second: u8) -> Option<&Line> {
        Some(&self.0[usize::from(first)].get()?[usize::from(second)])
    }

    fn learn(&self, [first, second, level]: [u8; 3], decide: impl FnOnce() -> bool) {
        let plane = self.0[usize::from(first)].get_or_init(|| {
            let line = |_| Line(std::array::from_fn(|_| AtomicU8::new(0)));
            Box::new(std::array::from_fn(line))
        });
        let line = &plane[usize::from(second)];
        if line.at(level) == 0 {
            line.learn(level, decide());
        }
    }

    /// The pixels of a picture whose colours `decide` gives to the animal. Lines are by green and
    /// blue.
    pub(super) fn of_rgb(&self, picture: &Picture, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        let mut mask = Mask::new(picture.width(), picture.height());
        for (y, row) in picture.rgb().chunks_exact(3 * picture.width().max(1)).enumerate() {
            for (at, pixels) in row.as_chunks().0.chunks(64).enumerate() {
                let eights = || pixels.chunks(8).map(|eight| eight.iter().copied());
                mask.set_word(y, at, self.decided(eights, &decide));
            }
        }
        mask
    }

    /// The same of a picture in L*a*b*, each colour decided by its bytes. Lines are by a* and b*.
    fn of_lab(&self, image: &LabImage, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        let mut mask = Mask::new(image.width(), image.height());
        for y in 0..image.height() {
            let row = y * image.width()..(y + 1) * image.width();
            let [l, a, b] = image.planes().each_ref().map(|plane| plane[row.clone()].chunks(64));
            for (at, ((l, a), b)) in l.zip(a).zip(b).enumerate() {
                let eights = || {
                    l.chunks(8)
                        .zip(a.chunks(8))
                        .zip(b.chunks(8))
                        .map(|((l, a), b)| l.iter().zip(a).zip(b).map(|((l, a), b)| [*l, *a, *b]))
                };
                mask.set_word(y, at, self.decided(eights, &decide));
            }
        }
        mask
    }

    /// The animal's bits of up to 64 pixels, given by eights; lines are by their second and third channels.
    #[inline]
    fn decided<I>(&self, eights: impl Fn() -> I, decide: &impl Fn([u8; 3]) -> bool) -> u64
    where
        I: Iterator<Item: Iterator<Item = [u8; 3]>>,
    {
        let bits = self.look(eights()).or_else(|| {
            for colour in eights().flatten() {
                self.learn([colour[1], colour[2], colour[0]], || decide(colour));
            }
            self.look(eights())
        });
        bits.unwrap_or(0)
    }

    /// The same, if all colours are known.
    #[inline]
    fn look(&self, eights: impl Iterator<Item: Iterator<Item = [u8; 3]>>) -> Option<u64> {
        let mut bits = 0;
        for (at, eight) in eights.enumerate() {
            // What is missing at a row's end is known to be ground.
            let mut found = [KNOWN; 8];
            for (found, [level, first, second]) in found.iter_mut().zip(eight) {
                *found = self.line(first, second)?.at(level);
            }
            bits |= packed(u64::from_le_bytes(found))? << (8 * at);
        }
        Some(bits)
    }

    /// The same of a picture in luma and chroma, each colour decided as the red, green and blue it
    /// stands for. Lines are by chroma, so a table serves one matrix.
    pub(super) fn of_yuv(&self, picture: &YuvPicture, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        let conversion = YuvConversion::new(picture.matrix());
        let mut mask = Mask::new(picture.width(), picture.height());
        for pair in 0..picture.height() / 2 {
            let rows = [picture.luma_row(2 * pair), picture.luma_row(2 * pair + 1)];
            let (us, vs) = picture.chroma_rows(pair);
            let blocks = us.chunks(32).zip(vs.chunks(32));
            let luma = rows[0].chunks(64).zip(rows[1].chunks(64));
            for (at, ((us, vs), (upper, lower))) in blocks.zip(luma).enumerate() {
                let block = Block { us, vs, upper, lower };
                let bits = block.look(self).or_else(|| {
                    block.learn(self, |y, u, v| decide(conversion.rgb(y, u, v)));
                    block.look(self)
                });
                let [upper, lower] = bits.unwrap_or_default();
                mask.set_word(2 * pair, at, upper);
                mask.set_word(2 * pair + 1, at, lower);
            }
        }
        mask
    }
}

/// Up to 64 columns of two rows, and the chroma of each two columns.
struct Block<'a> {
    us: &'a [u8],
    vs: &'a [u8],
    upper: &'a [u8],
    lower: &'a [u8],
}

impl Block<'_> {
    /// The animal's bits of the upper and the lower row, if all colours are known.
    #[inline]
    fn look(&self, decisions: &Decisions) -> Option<[u64; 2]> {
        let mut bits = [0, 0];
        let (us, last_us) = self.us.as_chunks();
        let (vs, last_vs) = self.vs.as_chunks();
        let (upper, last_upper) = self.upper.as_chunks();
        let (lower, last_lower) = self.lower.as_chunks();
        let chroma = us.iter().zip(vs);
        for (at, ((us, vs), luma)) in chroma.zip(upper.iter().zip(lower)).enumerate() {
            for (bits, found) in bits.iter_mut().zip(eight(decisions, us, vs, luma)?) {
                *bits |= found << (8 * at);
            }
        }
        if !last_us.is_empty() {
            let [us, vs] = [last_us, last_vs].map(filled_up);
            let luma = [last_upper, last_lower].map(filled_up);
            let found = eight(decisions, &us, &vs, (&luma[0], &luma[1]))?;
            for (bits, found) in bits.iter_mut().zip(found) {
                let there = (1 << last_upper.len()) - 1;
                *bits |= (found & there) << (8 * upper.len());
            }
        }
        Some(bits)
    }

    fn learn(&self, decisions: &Decisions, decide: impl Fn(u8, u8, u8) -> bool) {
        let luma = self.upper.chunks_exact(2).zip(self.lower.chunks_exact(2));
        for ((&u, &v), (a, b)) in self.us.iter().zip(self.vs).zip(luma) {
            for &y in a.iter().chain(b) {
                decisions.learn([u, v, y], || decide(y, u, v));
            }
        }
    }
}

/// The animal's bits of eight columns of two rows, if all colours are known.
#[inline]
fn eight(
    decisions: &Decisions,
    us: &[u8; 4],
    vs: &[u8; 4],
    (upper, lower): (&[u8; 8], &[u8; 8]),
) -> Option<[u64; 2]> {
    let (mut above, mut below) = (0, 0);
    for k in 0..4 {
        let line = decisions.line(us[k], vs[k])?;
        for x in [2 * k, 2 * k + 1] {
            above |= u64::from(line.at(upper[x])) << (8 * x);
            below |= u64::from(line.at(lower[x])) << (8 * x);
        }
    }
    Some([packed(above)?, packed(below)?])
}

/// A row's end with its last value once more for what is missing, of which is known as much.
fn filled_up<const N: usize>(end: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| end.get(i).or(end.last()).copied().unwrap_or(0))
}

/// Tables of one model: by red, green and blue, by L*a*b* bytes, and by luma and chroma of one matrix. Each is made
/// when first needed.
#[derive(Default)]
pub(super) struct DecisionTables {
    rgb: OnceLock<Decisions>,
    lab: OnceLock<Decisions>,
    yuv: OnceLock<(YuvMatrix, Decisions)>,
}

impl DecisionTables {
    pub(super) fn of_rgb(&self, picture: &Picture, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        self.rgb.get_or_init(Decisions::new).of_rgb(picture, decide)
    }

    pub(super) fn of_lab(&self, image: &LabImage, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        self.lab.get_or_init(Decisions::new).of_lab(image, decide)
    }

    pub(super) fn of_yuv(&self, picture: &YuvPicture, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        let (matrix, table) = self.yuv.get_or_init(|| (picture.matrix(), Decisions::new()));
        if *matrix == picture.matrix() {
            table.of_yuv(picture, decide)
        } else {
            // A file has one matrix; this is right for any caller all the same.
            self.of_rgb(&picture.to_rgb(), decide)
        }
    }
}

/// The decisions are not worth showing, nor worth taking along.
impl std::fmt::Debug for DecisionTables {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("DecisionTables")
    }
}

impl Clone for DecisionTables {
    fn clone(&self) -> Self {
        Self::default()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A decision without order in it, so that a colour taken for another shows.
    fn decide(rgb: [u8; 3]) -> bool {
        let code = u32::from_le_bytes([rgb[0], rgb[1], rgb[2], 0]);
        code.wrapping_mul(0x9E37_79B9) >> 31 == 1
    }

    proptest! {
        #[test]
        fn every_pixel_is_decided_as_its_colour(
            w in 1_usize..75, h in 1_usize..5, levels in 1_u8..=255, seed: u64
        ) {
            let (w, h) = (2 * w, 2 * h);
            let mut state = seed;
            let mut level = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                ((state >> 33) % u64::from(levels)) as u8
            };
            let bytes = (0..w * h * 3 / 2).map(|_| level()).collect();
            let stored = YuvPicture::new(w, h, YuvMatrix::Bt709, bytes).unwrap();
            let picture = stored.to_rgb();
            let plain = Mask::from_fn(w, h, |x, y| decide(picture.pixel(x, y)));
            let tables = DecisionTables::default();
            // The first time colours are learnt, the second time they are known.
            for _ in 0..2 {
                prop_assert_eq!(&tables.of_yuv(&stored, decide), &plain);
                prop_assert_eq!(&tables.of_rgb(&picture, decide), &plain);
                let planes = [0, 1, 2].map(|c| picture.rgb().iter().skip(c).step_by(3).copied().collect());
                let image = LabImage::from_planes(w, h, planes);
                prop_assert_eq!(&tables.of_lab(&image, decide), &plain);
            }
            let bytes = stored.into_bytes();
            let other = YuvPicture::new(w, h, YuvMatrix::Bt601, bytes).unwrap();
            let picture = other.to_rgb();
            let plain = Mask::from_fn(w, h, |x, y| decide(picture.pixel(x, y)));
            prop_assert_eq!(tables.of_yuv(&other, decide), plain);
        }
    }
}
