//! The decision for every colour of 8 bits a channel, exact, each worked out when a picture first
//! shows it.
//!
//! A clip shows some hundred thousand of the 2²⁴ colours. Their decisions are kept in two bits each,
//! 4 MiB in all, in the order of the channels they are stored in: the 256 colours that differ in one
//! channel only fill one cache line, so that the four pixels of a video that share their chroma look
//! into one line.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::image::{Picture, YuvConversion, YuvMatrix, YuvPicture};
use crate::mask::Mask;

/// The two bits of a colour: whether it is known, and whether it is the animal's.
const KNOWN: u64 = 2;
const ANIMAL: u64 = 1;

/// The 256 colours of two fixed channels: 32 a word.
#[repr(align(64))]
struct Line([AtomicU64; 8]);

impl Line {
    /// Decisions never change, so it does not matter in which order threads see them.
    #[inline]
    fn at(&self, level: u8) -> u64 {
        self.0[usize::from(level >> 5)].load(Ordering::Relaxed) >> (2 * (level & 31)) & 3
    }

    fn learn(&self, level: u8, is_animal: bool) {
        let bits = KNOWN | if is_animal { ANIMAL } else { 0 };
        self.0[usize::from(level >> 5)].fetch_or(bits << (2 * (level & 31)), Ordering::Relaxed);
    }
}

/// The decisions met so far, by what two channels are (a line) and the third.
pub(super) struct Decisions(Vec<Line>);

impl Decisions {
    pub(super) fn new() -> Self {
        let line = |_| Line(std::array::from_fn(|_| AtomicU64::new(0)));
        Self((0..1 << 16).map(line).collect())
    }

    #[inline]
    fn line(&self, first: u8, second: u8) -> &Line {
        &self.0[usize::from(first) << 8 | usize::from(second)]
    }

    /// The pixels of a picture whose colours `decide` gives to the animal. Lines are by green and
    /// blue.
    pub(super) fn of_rgb(&self, picture: &Picture, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        let mut mask = Mask::new(picture.width(), picture.height());
        for (y, row) in picture.rgb().chunks_exact(3 * picture.width().max(1)).enumerate() {
            for (at, pixels) in row.chunks(3 * 64).enumerate() {
                let look = || {
                    let (mut bits, mut known) = (0, KNOWN);
                    for (k, p) in pixels.chunks_exact(3).enumerate() {
                        let found = self.line(p[1], p[2]).at(p[0]);
                        bits |= (found & ANIMAL) << k;
                        known &= found;
                    }
                    (known != 0).then_some(bits)
                };
                let bits = look().or_else(|| {
                    for p in pixels.chunks_exact(3) {
                        let line = self.line(p[1], p[2]);
                        if line.at(p[0]) == 0 {
                            line.learn(p[0], decide([p[0], p[1], p[2]]));
                        }
                    }
                    look()
                });
                mask.set_word(y, at, bits.unwrap_or(0));
            }
        }
        mask
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
        let (mut upper, mut lower, mut known) = (0, 0, KNOWN);
        let luma = self.upper.chunks_exact(2).zip(self.lower.chunks_exact(2));
        for (k, ((&u, &v), (a, b))) in self.us.iter().zip(self.vs).zip(luma).enumerate() {
            let line = decisions.line(u, v);
            let [a, c] = [line.at(a[0]), line.at(a[1])];
            let [b, d] = [line.at(b[0]), line.at(b[1])];
            upper |= (a & ANIMAL | (c & ANIMAL) << 1) << (2 * k);
            lower |= (b & ANIMAL | (d & ANIMAL) << 1) << (2 * k);
            known &= a & b & c & d;
        }
        (known != 0).then_some([upper, lower])
    }

    fn learn(&self, decisions: &Decisions, decide: impl Fn(u8, u8, u8) -> bool) {
        let luma = self.upper.chunks_exact(2).zip(self.lower.chunks_exact(2));
        for ((&u, &v), (a, b)) in self.us.iter().zip(self.vs).zip(luma) {
            let line = decisions.line(u, v);
            for &y in a.iter().chain(b) {
                if line.at(y) == 0 {
                    line.learn(y, decide(y, u, v));
                }
            }
        }
    }
}

/// Tables of one model: by red, green and blue, and by luma and chroma of one matrix. Each is made
/// when first needed.
#[derive(Default)]
pub(super) struct DecisionTables {
    rgb: std::sync::OnceLock<Decisions>,
    yuv: std::sync::OnceLock<(YuvMatrix, Decisions)>,
}

impl DecisionTables {
    pub(super) fn of_rgb(&self, picture: &Picture, decide: impl Fn([u8; 3]) -> bool) -> Mask {
        self.rgb.get_or_init(Decisions::new).of_rgb(picture, decide)
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
            }
            let bytes = stored.into_bytes();
            let other = YuvPicture::new(w, h, YuvMatrix::Bt601, bytes).unwrap();
            let picture = other.to_rgb();
            let plain = Mask::from_fn(w, h, |x, y| decide(picture.pixel(x, y)));
            prop_assert_eq!(tables.of_yuv(&other, decide), plain);
        }
    }
}
