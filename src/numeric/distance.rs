//! Exact distances on a grid.

use super::instructions::{InstructionSet, Kernel};

/// The longest side of a grid whose squared distances all fit `u32` and stay below `u32::MAX`.
const MAX_SIDE: usize = 46_341;

/// A member of the set as a row sees it: the parabola (x − site)² + height, the least of all from
/// `from` to where the next one begins.
#[derive(Clone, Copy)]
struct Parabola {
    from: usize,
    site: usize,
    height: u32,
}

/// For every pixel the squared Euclidean distance, pixels², to the nearest pixel of the set;
/// `u32::MAX` everywhere when the set is empty.
///
/// Pixels go row by row, `width` × `height` of them. The method is that of Felzenszwalb and
/// Huttenlocher, *Distance Transforms of Sampled Functions* (Theory of Computing 8, 2012), linear
/// in the number of pixels: distances within columns, then the lower envelope of one parabola a
/// column within each row. It departs from the paper in that everything is an integer, as in
/// Meijster, Roerdink and Hesselink (2000), so that nothing is rounded.
///
/// # Panics
/// When `set` has not `width * height` pixels, or a side is longer than 46 341.
#[must_use]
pub fn grid_distances_sq(set: &[bool], width: usize, height: usize) -> Vec<u32> {
    assert!(width.max(height) <= MAX_SIDE, "squared distances beyond u32");
    assert_eq!(set.len(), width * height, "one flag a pixel");
    if set.is_empty() {
        return Vec::new();
    }
    let mut distances: Vec<u32> = set.iter().map(|&s| if s { 0 } else { u32::MAX }).collect();
    InstructionSet::best().run(WithinColumns { distances: &mut distances, width });
    let mut envelope = Vec::with_capacity(width);
    for row in distances.chunks_exact_mut(width) {
        across(row, &mut envelope);
    }
    distances
}

/// Distances within columns to be found, of pixels that are 0 or far away.
struct WithinColumns<'a> {
    distances: &'a mut [u32],
    width: usize,
}

impl Kernel for WithinColumns<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Self { distances, width } = self;
        let height = distances.len() / width;
        for row in 1..height {
            let (above, here) = distances[(row - 1) * width..(row + 1) * width].split_at_mut(width);
            step_from(above, here);
        }
        for row in (1..height).rev() {
            let (here, below) = distances[(row - 1) * width..(row + 1) * width].split_at_mut(width);
            step_from(below, here);
        }
    }
}

/// Distances within columns, by way of the neighbouring row.
#[inline(always)]
fn step_from(from: &[u32], to: &mut [u32]) {
    for (&from, to) in from.iter().zip(to) {
        *to = (*to).min(from.saturating_add(1));
    }
}

/// Turns the distances within columns of one row into squared distances in the plane.
fn across(row: &mut [u32], envelope: &mut Vec<Parabola>) {
    envelope.clear();
    for (site, &distance) in row.iter().enumerate() {
        if distance == u32::MAX {
            continue;
        }
        let height = distance * distance;
        let mut from = 0;
        while let Some(&last) = envelope.last() {
            // The new parabola is no higher than the last from x = rise / run on.
            let run = 2 * (site - last.site) as i64;
            let rise = (site * site) as i64 - (last.site * last.site) as i64 + i64::from(height)
                - i64::from(last.height);
            if rise > last.from as i64 * run {
                // Both fit 32 bits, in which division is the faster.
                from = (rise as u32).div_ceil(run as u32) as usize;
                break;
            }
            envelope.pop();
        }
        if from < row.len() {
            envelope.push(Parabola { from, site, height });
        }
    }
    let mut end = row.len();
    for parabola in envelope.iter().rev() {
        for (x, value) in (parabola.from as u32..).zip(&mut row[parabola.from..end]) {
            let along = x.abs_diff(parabola.site as u32);
            *value = along * along + parabola.height;
        }
        end = parabola.from;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn by_definition(set: &[bool], width: usize) -> Vec<u32> {
        let place = |at: usize| ((at % width) as u32, (at / width) as u32);
        let to = |at: usize, member: usize| {
            let ((x, y), (a, b)) = (place(at), place(member));
            x.abs_diff(a).pow(2) + y.abs_diff(b).pow(2)
        };
        let members: Vec<usize> = (0..set.len()).filter(|&at| set[at]).collect();
        (0..set.len())
            .map(|at| members.iter().map(|&m| to(at, m)).min().unwrap_or(u32::MAX))
            .collect()
    }

    proptest! {
        #[test]
        fn agrees_with_the_definition(
            (width, set) in (1..24_usize, 0..24_usize, 0.0..1.0_f64).prop_flat_map(|(w, h, share)| {
                let flags = prop::bool::weighted(share.powi(3));
                (Just(w), prop::collection::vec(flags, w * h))
            })
        ) {
            let found = grid_distances_sq(&set, width, set.len() / width);
            prop_assert_eq!(found, by_definition(&set, width));
        }
    }

    #[test]
    fn one_member_at_a_corner() {
        let set = [true, false, false, false, false, false];
        assert_eq!(grid_distances_sq(&set, 3, 2), [0, 1, 4, 1, 2, 5]);
    }

    #[test]
    fn an_empty_set_is_nowhere() {
        assert_eq!(grid_distances_sq(&[false; 4], 2, 2), [u32::MAX; 4]);
        assert!(grid_distances_sq(&[], 0, 7).is_empty());
        assert!(grid_distances_sq(&[], 7, 0).is_empty());
    }

    #[test]
    fn the_longest_sides_do_not_overflow() {
        let mut set = vec![false; MAX_SIDE];
        set[0] = true;
        let most = (MAX_SIDE as u32 - 1).pow(2);
        for (width, height) in [(MAX_SIDE, 1), (1, MAX_SIDE)] {
            assert_eq!(grid_distances_sq(&set, width, height).last(), Some(&most));
        }
    }
}
