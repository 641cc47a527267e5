//! The Gram matrix of bit-packed masks: K_ij = popcount(a_i AND a_j), an exact integer.

use rayon::prelude::*;

use crate::mask::Mask;

/// Words a block of the inner loop reads from each of two masks: 512 words are 4 KiB, so a tile
/// of masks stays in the first-level cache while it is compared.
const BLOCK_WORDS: usize = 512;

/// Masks a tile: rows and columns of the matrix worked on together.
const TILE: usize = 16;

/// Inner products of all pairs of masks, row-major n × n. All masks have the same size.
///
/// Words that no mask sets are dropped first: an animal fills a small part of its window. Sums of
/// integers do not depend on the order, so any number of threads gives the same matrix.
pub(super) fn gram(masks: &[&Mask]) -> Vec<u64> {
    let packed = without_empty_words(masks);
    let n = masks.len();
    let words = packed.first().map_or(0, Vec::len);
    let tiles = n.div_ceil(TILE);
    let pairs: Vec<(usize, usize)> =
        (0..tiles).flat_map(|a| (a..tiles).map(move |b| (a, b))).collect();
    let blocks: Vec<Vec<(usize, usize, u64)>> = pairs
        .par_iter()
        .map(|&(a, b)| tile_products(&packed, words, tile_range(a, n), tile_range(b, n)))
        .collect();
    let mut matrix = vec![0_u64; n * n];
    for (i, j, product) in blocks.into_iter().flatten() {
        matrix[i * n + j] = product;
        matrix[j * n + i] = product;
    }
    matrix
}

fn tile_range(tile: usize, n: usize) -> std::ops::Range<usize> {
    tile * TILE..((tile + 1) * TILE).min(n)
}

fn tile_products(
    packed: &[Vec<u64>],
    words: usize,
    rows: std::ops::Range<usize>,
    columns: std::ops::Range<usize>,
) -> Vec<(usize, usize, u64)> {
    let pairs: Vec<(usize, usize)> =
        rows.flat_map(|i| columns.clone().filter(move |&j| j >= i).map(move |j| (i, j))).collect();
    let mut sums = vec![0_u64; pairs.len()];
    for start in (0..words).step_by(BLOCK_WORDS) {
        let block = start..(start + BLOCK_WORDS).min(words);
        for (sum, &(i, j)) in sums.iter_mut().zip(&pairs) {
            let (a, b) = (&packed[i][block.clone()], &packed[j][block.clone()]);
            *sum += a.iter().zip(b).map(|(x, y)| u64::from((x & y).count_ones())).sum::<u64>();
        }
    }
    pairs.into_iter().zip(sums).map(|((i, j), sum)| (i, j, sum)).collect()
}

fn without_empty_words(masks: &[&Mask]) -> Vec<Vec<u64>> {
    let Some(first) = masks.first() else { return Vec::new() };
    let used: Vec<usize> =
        (0..first.words().len()).filter(|&w| masks.iter().any(|m| m.words()[w] != 0)).collect();
    masks.par_iter().map(|m| used.iter().map(|&w| m.words()[w]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn products_equal_those_of_plain_booleans(
            width in 1_usize..150,
            height in 1_usize..6,
            n in 1_usize..40,
            seed in any::<u64>(),
        ) {
            let bit = |i: usize, x: usize, y: usize| {
                let mut h = seed ^ ((i * 7919 + x * 31 + y) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                h ^= h >> 29;
                h.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 63 == 1
            };
            let masks: Vec<Mask> =
                (0..n).map(|i| Mask::from_fn(width, height, |x, y| bit(i, x, y))).collect();
            let matrix = gram(&masks.iter().collect::<Vec<_>>());
            for i in 0..n {
                for j in 0..n {
                    let slow = (0..height)
                        .flat_map(|y| (0..width).map(move |x| (x, y)))
                        .filter(|&(x, y)| bit(i, x, y) && bit(j, x, y))
                        .count() as u64;
                    prop_assert_eq!(matrix[i * n + j], slow);
                }
            }
        }
    }
}
