//! Products by AND and popcount. The compiler makes vector instructions of the counts where the
//! processor has them; without those the tables are several times as fast.

use super::super::changes::{Changes, TILE, TileWord};
use super::{TileSums, rows_of};

/// Words a block: 16 KiB of columns stay in the first-level cache, beside as much of the rows.
const BLOCK_WORDS: usize = 32;

/// Columns whose sums are one vector.
const LANES: usize = 8;

/// The sums of all rows above and within a tile with its columns.
#[inline(always)]
pub(super) fn tile_sums(changes: &Changes, tile: usize) -> Vec<TileSums> {
    let mut sums = vec![[0; TILE]; rows_of(changes, tile)];
    for first in (0..changes.words.len()).step_by(BLOCK_WORDS) {
        let block = first..(first + BLOCK_WORDS).min(changes.words.len());
        let columns = &changes.tiles[tile][block.clone()];
        for (row, sums) in sums.iter_mut().enumerate() {
            let rows = &changes.tiles[row / TILE][block.clone()];
            for lane in (0..TILE).step_by(LANES) {
                let counts = lane_counts(rows, row % TILE, columns, lane);
                for (sum, count) in sums[lane..].iter_mut().zip(counts) {
                    *sum += count as u32;
                }
            }
        }
    }
    sums
}

/// The sums of one row with [`LANES`] columns.
#[inline(always)]
fn lane_counts(
    rows: &[TileWord],
    row: usize,
    columns: &[TileWord],
    first_column: usize,
) -> [u64; LANES] {
    let mut counts = [0; LANES];
    for (rows, columns) in rows.iter().zip(columns) {
        let word = rows[row];
        let columns = &columns[first_column..first_column + LANES];
        for (count, column) in counts.iter_mut().zip(columns) {
            *count += u64::from((word & column).count_ones());
        }
    }
    counts
}
