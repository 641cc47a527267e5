//! The Gram matrix of bit-packed masks: K_ij = popcount(a_i AND a_j), an exact integer.
//!
//! With a = m XOR d (see `changes`), summed pixel by pixel where m is clear and where it is set:
//! a_i·a_j = d_i·d_j + m·a_i + m·a_j − m·m. Only d_i·d_j needs all pairs. It is worked out for 64
//! columns at a time and a block of words that stays in the cache while all rows pass (`tables`): a
//! half-byte of four pixels has sixteen values. The sums of the sixteen with each of the 64 columns are
//! tabled as bytes; a row adds the entries of its half-bytes that are not zero. No popcount at all, and
//! time goes by what changes.
//!
//! Sums of integers do not depend on the order, so instruction sets and threads all give the same
//! matrix.

mod tables;

use rayon::prelude::*;

use super::changes::{Changes, TILE, common};

use crate::numeric::InstructionSet;
use tables::{HalfBytes, Tile};

/// Sums of one row with the columns of a tile.
type TileSums = [u32; TILE];

/// The Gram matrix, row-major, masks × masks.
///
/// # Panics
/// When a mask has 2³² pixels or more.
pub(super) fn gram(changes: &Changes, instructions: InstructionSet) -> Vec<u32> {
    let mut matrix = vec![0; changes.masks * changes.masks];
    add_gram(changes, instructions, &mut matrix);
    matrix
}

/// Adds the Gram matrix of a part of the masks' pixels to that of the parts before.
///
/// # Panics
/// When a mask has 2³² pixels or more.
pub(super) fn add_gram(changes: &Changes, instructions: InstructionSet, matrix: &mut [u32]) {
    let n = changes.masks;
    assert!(changes.majority.len() < (u32::MAX / 64) as usize, "a mask of fewer than 2^32 pixels");
    let half_bytes = &HalfBytes::of(changes);
    // The last tile has the most rows: begun first, it ends first.
    let mut tiles: Vec<Vec<TileSums>> = (0..changes.tiles.len())
        .into_par_iter()
        .rev()
        .map(|tile| instructions.run(Tile { changes, half_bytes, tile }))
        .collect();
    tiles.reverse();
    let squared = common(&changes.majority, &changes.majority) as i64;
    let linear = |i: usize| changes.in_majority[i] as i64;
    matrix.par_chunks_mut(n.max(1)).enumerate().for_each(|(i, row)| {
        for (j, entry) in row.iter_mut().enumerate() {
            let (low, high) = (i.min(j), i.max(j));
            let product = i64::from(tiles[high / TILE][low][high % TILE]);
            *entry += (product + linear(i) + linear(j) - squared) as u32;
        }
    });
}

/// Rows that a tile of columns is multiplied with: the matrix is symmetric.
fn rows_of(changes: &Changes, tile: usize) -> usize {
    ((tile + 1) * TILE).min(changes.masks)
}

#[cfg(test)]
mod tests;
