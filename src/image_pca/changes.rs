//! A clip's masks as changes from what most of them show: few words, few bits.
//!
//! With m the pixels set in more than half of the masks, a mask is a = m XOR d, and d is empty
//! wherever the animal always is or never is. Words in which no mask changes are dropped, which
//! also crops the masks to where something moves. Component images are sums over the d and simple terms
//! in m, the Gram matrix goes by the edges of the a.

use rayon::prelude::*;

use super::gram;
use crate::error::{Error, Result};
use crate::mask::Mask;
use crate::numeric::{InstructionSet, Kernel};

/// Masks a tile.
pub(super) const TILE: usize = 64;

/// Words of a picture whose counters are held together: eleven counter planes of 256 words are
/// 22 KiB and stay in the first-level cache while all masks pass.
const COUNTED_WORDS: usize = 256;

/// The same word of the masks of one tile; masks past the last are empty.
pub(super) type TileWord = [u64; TILE];

/// The masks of one clip, packed for sums over all of them: as changes from the pixels that most of
/// them show.
#[derive(Clone, Debug)]
pub struct Changes {
    /// Number of masks.
    pub(super) masks: usize,
    /// Width and height, pixels.
    pub(super) size: (usize, usize),
    /// The pixels set in more than half of the masks, all words of the picture.
    pub(super) majority: Vec<u64>,
    /// Indices of the words in which some masks differ.
    pub(super) words: Vec<usize>,
    /// For each 64 masks, each of those words' changes.
    pub(super) tiles: Vec<Vec<TileWord>>,
}

impl Changes {
    /// Packs `masks`, all of one size. Memory: about an eighth of a byte for each mask and each
    /// pixel in whose word of 64 pixels anything changes.
    ///
    /// # Errors
    /// [`Error::TooFewMasks`] with fewer than two masks, [`Error::MaskSize`] when sizes differ,
    /// [`Error::MasksEmpty`] when no mask has a pixel.
    pub fn of(masks: &[&Mask]) -> Result<Self> {
        let size = common_size(masks.iter().map(|m| (m.width(), m.height())))?;
        let changes = Self::packed(masks, size);
        if changes.words.is_empty() && changes.majority.iter().all(|&w| w == 0) {
            return Err(Error::MasksEmpty { frames: masks.len() });
        }
        Ok(changes)
    }

    /// Number of masks.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.masks
    }

    /// The Gram matrix K_ij = number of pixels set in both mask i and mask j, row-major; the same
    /// with any instructions. Those that the processor lacks are replaced by plain ones.
    ///
    /// # Panics
    /// When a mask has 2³² pixels or more.
    #[must_use]
    pub fn gram(&self, instructions: InstructionSet) -> Vec<u32> {
        gram::gram(self, instructions)
    }

    /// Number of pixels set in every mask, of the words in which all masks are alike.
    pub(super) fn pixels_alike(&self) -> u32 {
        let all: u32 = self.majority.iter().map(|word| word.count_ones()).sum();
        let changing: u32 = self.words.iter().map(|&w| self.majority[w].count_ones()).sum();
        all - changing
    }

    /// Of masks that are known to be of one size.
    pub(super) fn packed(masks: &[&Mask], size: (usize, usize)) -> Self {
        let length = masks.first().map_or(0, |first| first.words().len());
        let mut majority = vec![0; length];
        let mut changing = vec![false; length];
        let instructions = InstructionSet::best();
        majority
            .par_chunks_mut(COUNTED_WORDS)
            .zip(changing.par_chunks_mut(COUNTED_WORDS))
            .enumerate()
            .for_each(|(c, (majority, changing))| {
                let first = c * COUNTED_WORDS;
                instructions.run(Counting { masks, first, majority, changing });
            });
        let words: Vec<usize> = (0..length).filter(|&w| changing[w]).collect();
        let tiles: Vec<Vec<TileWord>> =
            masks.par_chunks(TILE).map(|tile| tile_words(tile, &words, &majority)).collect();
        Self { masks: masks.len(), size, majority, words, tiles }
    }
}

/// Some words of all masks to be counted, from the `first` on.
struct Counting<'a> {
    masks: &'a [&'a Mask],
    first: usize,
    majority: &'a mut [u64],
    changing: &'a mut [bool],
}

impl Kernel for Counting<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        count(self.masks, self.first, self.majority, self.changing);
    }
}

/// Counts each pixel's masks in binary, one plane of bits a digit and 64 pixels at a time, and
/// compares the counts with half of the masks.
#[inline(always)]
fn count(masks: &[&Mask], first: usize, majority: &mut [u64], changing: &mut [bool]) {
    let length = majority.len();
    let digits = (usize::BITS - masks.len().leading_zeros()) as usize;
    let mut planes = vec![0_u64; digits * length];
    let mut carry = vec![0_u64; length];
    for mask in masks {
        carry.copy_from_slice(&mask.words()[first..first + length]);
        for plane in planes.chunks_mut(length) {
            let mut left = 0;
            for (digit, carry) in plane.iter_mut().zip(&mut carry) {
                let next = *digit & *carry;
                *digit ^= *carry;
                *carry = next;
                left |= next;
            }
            if left == 0 {
                break;
            }
        }
    }
    let (half, all) = (masks.len() / 2, masks.len());
    for word in 0..length {
        let (mut more, mut same, mut some, mut full) = (0, u64::MAX, 0, u64::MAX);
        for digit in (0..digits).rev() {
            let bits = planes[digit * length + word];
            if half >> digit & 1 == 1 {
                same &= bits;
            } else {
                more |= same & bits;
                same &= !bits;
            }
            some |= bits;
            full &= if all >> digit & 1 == 1 { bits } else { !bits };
        }
        majority[word] = more;
        changing[word] = some & !full != 0;
    }
}

/// The changes of up to [`TILE`] masks, word by word.
fn tile_words(masks: &[&Mask], words: &[usize], majority: &[u64]) -> Vec<TileWord> {
    let mut tile = vec![[0; TILE]; words.len()];
    // A few words of all masks at a time: what is written stays in the first-level cache.
    for (tile, words) in tile.chunks_mut(8).zip(words.chunks(8)) {
        for (place, mask) in masks.iter().enumerate() {
            for (changes, &word) in tile.iter_mut().zip(words) {
                changes[place] = mask.words()[word] ^ majority[word];
            }
        }
    }
    tile
}
/// The size of all masks of a clip.
pub(super) fn common_size(
    sizes: impl ExactSizeIterator<Item = (usize, usize)>,
) -> Result<(usize, usize)> {
    let frames = sizes.len();
    let mut sizes = sizes.enumerate();
    let (Some((_, size)), true) = (sizes.next(), frames > 1) else {
        return Err(Error::TooFewMasks { frames });
    };
    match sizes.find(|(_, found)| *found != size) {
        Some((frame, found)) => Err(Error::MaskSize { frame, found, expected: size }),
        None => Ok(size),
    }
}
