//! The Gram matrix of bit-packed masks: K_ij = popcount(a_i AND a_j), an exact integer.
//!
//! A silhouette is a few runs of pixels a row, whatever its area. What a run has in common with a column is the
//! number of the column's pixels before the run's end less the number before its beginning (`runs`). These
//! numbers are counted for 64 columns at a time and a block of words that stays in the cache while all rows pass;
//! a row then costs as much as it has edges. Words in which all masks are alike are counted once for all.
//!
//! Sums of integers do not depend on the order, so instruction sets and threads all give the same
//! matrix.

mod runs;

use rayon::prelude::*;

use super::changes::{Changes, TILE};

use crate::numeric::InstructionSet;
use runs::{Runs, Tile};

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
    let runs = &Runs::of(changes);
    // The last tile has the most rows: begun first, it ends first.
    let mut tiles: Vec<Vec<TileSums>> = (0..changes.tiles.len())
        .into_par_iter()
        .rev()
        .map(|tile| instructions.run(Tile { changes, runs, tile }))
        .collect();
    tiles.reverse();
    let alike = changes.pixels_alike();
    matrix.par_chunks_mut(n.max(1)).enumerate().for_each(|(i, row)| {
        for (j, entry) in row.iter_mut().enumerate() {
            let (low, high) = (i.min(j), i.max(j));
            *entry += tiles[high / TILE][low][high % TILE] + alike;
        }
    });
}

/// Rows that a tile of columns is multiplied with: the matrix is symmetric.
fn rows_of(changes: &Changes, tile: usize) -> usize {
    ((tile + 1) * TILE).min(changes.masks)
}

#[cfg(test)]
mod tests;
