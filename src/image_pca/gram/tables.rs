//! Products by tables of half-bytes; compiled once for each instruction set.

use rayon::prelude::*;

use super::super::changes::{Changes, TILE, TileWord};
use super::{TileSums, rows_of};
use crate::numeric::Kernel;

/// Words a block. Its tables are 128 KiB, a quarter to the whole of a second-level cache. Measured
/// on a core with 32 KiB and 512 KiB of cache: 4 words 11 % slower, 2 words 35 %, 16 words 10 %.
const BLOCK_WORDS: usize = 8;

/// Table entries a word: sixteen half-bytes of sixteen values.
const WORD_ENTRIES: usize = 256;

const BLOCK_ENTRIES: usize = BLOCK_WORDS * WORD_ENTRIES;

/// Entries that can be added in bytes: each is at most 4.
const FITS_BYTES: usize = 63;

/// One byte a column; on its own cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Entry([u8; TILE]);

/// For each block of words and each mask, the table entries it adds up.
pub(super) struct HalfBytes {
    blocks: Vec<Block>,
}

struct Block {
    /// Where each mask's entries begin, and where the last ones end.
    starts: Vec<u32>,
    entries: Vec<u16>,
}

impl HalfBytes {
    pub(super) fn of(changes: &Changes) -> Self {
        let starts: Vec<usize> = (0..changes.words.len()).step_by(BLOCK_WORDS).collect();
        Self { blocks: starts.par_iter().map(|&first| Block::of(changes, first)).collect() }
    }
}

impl Block {
    fn of(changes: &Changes, first: usize) -> Self {
        let last = (first + BLOCK_WORDS).min(changes.words.len());
        let mut block = Self { starts: vec![0], entries: Vec::new() };
        for mask in 0..changes.masks {
            let words = &changes.tiles[mask / TILE][first..last];
            for (w, word) in words.iter().enumerate() {
                block.push(w * WORD_ENTRIES, word[mask % TILE]);
            }
            block.starts.push(block.entries.len() as u32);
        }
        block
    }

    /// The half-bytes of one word that are not zero.
    fn push(&mut self, first_entry: usize, word: u64) {
        let any = word | word >> 1;
        let mut open = (any | any >> 2) & 0x1111_1111_1111_1111;
        while open != 0 {
            let bit = open.trailing_zeros() as usize;
            // Sixteen entries for each four bits.
            self.entries.push((first_entry + 4 * bit) as u16 + (word >> bit & 15) as u16);
            open &= open - 1;
        }
    }

    fn of_mask(&self, mask: usize) -> &[u16] {
        &self.entries[self.starts[mask] as usize..self.starts[mask + 1] as usize]
    }
}

/// A tile of columns, to be multiplied with all rows above and within it.
pub(super) struct Tile<'a> {
    pub(super) changes: &'a Changes,
    pub(super) half_bytes: &'a HalfBytes,
    pub(super) tile: usize,
}

impl Kernel for Tile<'_> {
    type Result = Vec<TileSums>;

    #[inline(always)]
    fn run(self) -> Vec<TileSums> {
        tile_sums(self.changes, self.half_bytes, self.tile)
    }
}

/// The sums of all rows above and within a tile with its columns.
#[inline(always)]
fn tile_sums(changes: &Changes, half_bytes: &HalfBytes, tile: usize) -> Vec<TileSums> {
    let mut sums = vec![[0; TILE]; rows_of(changes, tile)];
    let mut tables = Box::new([Entry([0; TILE]); BLOCK_ENTRIES]);
    let words = changes.tiles[tile].chunks(BLOCK_WORDS);
    for (words, block) in words.zip(&half_bytes.blocks) {
        for (word, table) in words.iter().zip(tables.as_chunks_mut::<WORD_ENTRIES>().0) {
            fill(word, table);
        }
        for (row, sum) in sums.iter_mut().enumerate() {
            add(block.of_mask(row), &tables, sum);
        }
    }
    sums
}

/// The tables of one word: for each half-byte and each of its values, the number of common bits
/// with the half-byte of each column.
#[inline(always)]
fn fill(word: &TileWord, table: &mut [Entry; WORD_ENTRIES]) {
    for (half_byte, table) in table.as_chunks_mut::<16>().0.iter_mut().enumerate() {
        let mut values = [0_u8; TILE];
        for (value, word) in values.iter_mut().zip(word) {
            *value = (word >> (4 * half_byte)) as u8;
        }
        table[0] = Entry([0; TILE]);
        for bit in 0..4 {
            let size = 1 << bit;
            for smaller in 0..size {
                for (column, value) in values.iter().enumerate() {
                    let with_bit = table[smaller].0[column] + (value >> bit & 1);
                    table[size + smaller].0[column] = with_bit;
                }
            }
        }
    }
}

/// Adds up the entries of one row.
#[inline(always)]
fn add(entries: &[u16], tables: &[Entry; BLOCK_ENTRIES], sums: &mut TileSums) {
    for entries in entries.chunks(FITS_BYTES) {
        let mut bytes = [0_u8; TILE];
        for &entry in entries {
            // The remainder changes nothing and spares the bounds check.
            let entry = &tables[usize::from(entry) % BLOCK_ENTRIES];
            for (byte, value) in bytes.iter_mut().zip(&entry.0) {
                *byte += value;
            }
        }
        for (sum, byte) in sums.iter_mut().zip(bytes) {
            *sum += u32::from(byte);
        }
    }
}
