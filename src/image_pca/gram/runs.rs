//! Products by runs of pixels; compiled once for each instruction set.

use rayon::prelude::*;

use super::super::changes::{Changes, TILE, TileWord};
use super::{TileSums, rows_of};
use crate::numeric::Kernel;

/// Words a block. Its counts are 128 KiB, a quarter to the whole of a second-level cache. Measured on a core with
/// 48 KiB and 2 MiB of cache: 4 words half as slow again, 8 words a seventh slower, 32 words a tenth faster.
const BLOCK_WORDS: usize = 16;

/// Places between the pixels of a block, its ends included.
const PLACES: usize = 64 * BLOCK_WORDS + 1;

/// Blocks whose sums fit 16 bits.
const FIT_SHORT: usize = u16::MAX as usize / (64 * BLOCK_WORDS);

/// One count a column; on its own cache lines.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Counts([u16; TILE]);

/// For each block of words, where the runs of set pixels of each mask begin and end.
pub(super) struct Runs {
    blocks: Vec<Block>,
}

struct Block {
    begins: Places,
    ends: Places,
}

/// Places of one block for each mask.
struct Places {
    /// Where each mask's begin in the list, and where the last ones end.
    starts: Vec<u32>,
    places: Vec<u16>,
}

impl Runs {
    pub(super) fn of(changes: &Changes) -> Self {
        let starts: Vec<usize> = (0..changes.words.len()).step_by(BLOCK_WORDS).collect();
        Self { blocks: starts.par_iter().map(|&first| Block::of(changes, first)).collect() }
    }
}

impl Block {
    /// Words that are neighbours here need not be in the picture: what matters is which pixels are set.
    fn of(changes: &Changes, first: usize) -> Self {
        let words = &changes.words[first..(first + BLOCK_WORDS).min(changes.words.len())];
        let mut block = Self { begins: Places::new(), ends: Places::new() };
        for mask in 0..changes.masks {
            let tile = &changes.tiles[mask / TILE][first..];
            let mut last_pixel = 0;
            for (w, (word, change)) in words.iter().zip(tile).enumerate() {
                let word = changes.majority[*word] ^ change[mask % TILE];
                let before = word << 1 | last_pixel;
                block.begins.push(w, word & !before);
                block.ends.push(w, before & !word);
                last_pixel = word >> 63;
            }
            // A run that goes on ends with the block.
            block.ends.push(words.len(), last_pixel);
            block.begins.close();
            block.ends.close();
        }
        block
    }
}

impl Places {
    fn new() -> Self {
        Self { starts: vec![0], places: Vec::new() }
    }

    /// The places before the pixels of word `w` that are set in `bits`. Nothing is counted before the first.
    fn push(&mut self, w: usize, bits: u64) {
        let mut open = bits;
        while open != 0 {
            let place = 64 * w + open.trailing_zeros() as usize;
            if place > 0 {
                self.places.push(place as u16);
            }
            open &= open - 1;
        }
    }

    /// Ends the list of one mask.
    fn close(&mut self) {
        self.starts.push(self.places.len() as u32);
    }

    fn of_mask(&self, mask: usize) -> &[u16] {
        &self.places[self.starts[mask] as usize..self.starts[mask + 1] as usize]
    }
}

/// A tile of columns, to be multiplied with all rows above and within it.
pub(super) struct Tile<'a> {
    pub(super) changes: &'a Changes,
    pub(super) runs: &'a Runs,
    pub(super) tile: usize,
}

impl Kernel for Tile<'_> {
    type Result = Vec<TileSums>;

    #[inline(always)]
    fn run(self) -> Vec<TileSums> {
        tile_sums(self.changes, self.runs, self.tile)
    }
}

/// The sums of all rows above and within a tile with its columns.
#[inline(always)]
fn tile_sums(changes: &Changes, runs: &Runs, tile: usize) -> Vec<TileSums> {
    let mut sums = vec![[0; TILE]; rows_of(changes, tile)];
    let mut short = vec![Counts([0; TILE]); sums.len()];
    let mut counts = Box::new([Counts([0; TILE]); PLACES]);
    let words = changes.words.chunks(BLOCK_WORDS).zip(changes.tiles[tile].chunks(BLOCK_WORDS));
    for (at, ((words, tile), block)) in words.zip(&runs.blocks).enumerate() {
        if at % FIT_SHORT == 0 {
            widen(&mut short, &mut sums);
        }
        let words = words.iter().zip(tile).map(|(word, change)| (changes.majority[*word], change));
        count(words, &mut counts);
        for (row, sum) in short.iter_mut().enumerate() {
            add(block.begins.of_mask(row), block.ends.of_mask(row), &counts, sum);
        }
    }
    widen(&mut short, &mut sums);
    sums
}

/// For each place of a block the number of set pixels before it, column by column. Before the first there is none.
#[inline(always)]
fn count<'a>(words: impl Iterator<Item = (u64, &'a TileWord)>, counts: &mut [Counts; PLACES]) {
    let mut so_far = [0_u16; TILE];
    let mut place = 1;
    for (majority, change) in words {
        for byte in 0..8 {
            let mut pixels = [0_u8; TILE];
            for (pixels, change) in pixels.iter_mut().zip(change) {
                *pixels = ((change ^ majority) >> (8 * byte)) as u8;
            }
            for bit in 0..8 {
                for (count, pixels) in so_far.iter_mut().zip(&pixels) {
                    *count += u16::from(pixels >> bit & 1);
                }
                counts[place] = Counts(so_far);
                place += 1;
            }
        }
    }
}

/// Adds what the runs of one row have in common with each column: the counts where they end less those where they
/// begin. Modulo 2¹⁶, so that the order does not matter.
#[inline(always)]
fn add(begins: &[u16], ends: &[u16], counts: &[Counts; PLACES], sum: &mut Counts) {
    if ends.is_empty() {
        return;
    }
    let mut now = sum.0;
    for &place in ends {
        for (sum, count) in now.iter_mut().zip(&counts[usize::from(place)].0) {
            *sum = sum.wrapping_add(*count);
        }
    }
    for &place in begins {
        for (sum, count) in now.iter_mut().zip(&counts[usize::from(place)].0) {
            *sum = sum.wrapping_sub(*count);
        }
    }
    sum.0 = now;
}

/// Moves short sums to where there is room.
#[inline(always)]
fn widen(short: &mut [Counts], sums: &mut [TileSums]) {
    for (short, sums) in short.iter_mut().zip(sums) {
        for (short, sum) in short.0.iter_mut().zip(sums) {
            *sum += u32::from(*short);
            *short = 0;
        }
    }
}
