//! Values over the cube of colours, 64 steps a channel, each worked out when a picture first shows a
//! colour of its cell: a clip shows some thousands of the 2¹⁸.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Bits a channel.
const BITS: u32 = 6;
const DROPPED_BITS: u32 = 8 - BITS;

/// What no value is.
const UNKNOWN: u32 = f32::NAN.to_bits();

/// The values met so far. Clones share them.
#[derive(Clone)]
pub(super) struct ColourCube {
    cells: Arc<[AtomicU32]>,
}

impl ColourCube {
    pub(super) fn new() -> Self {
        Self { cells: (0..1 << (3 * BITS)).map(|_| AtomicU32::new(UNKNOWN)).collect() }
    }

    /// The value of the cell that a colour lies in: what `work_out`, which must always say the same,
    /// says of the colour in its middle.
    #[inline]
    pub(super) fn of(&self, colour: [u8; 3], work_out: impl FnOnce([u8; 3]) -> f32) -> f32 {
        let at =
            colour.iter().fold(0, |at, &level| at << BITS | usize::from(level >> DROPPED_BITS));
        // Values never change, so it does not matter in which order threads see them.
        let known = f32::from_bits(self.cells[at].load(Ordering::Relaxed));
        if known.is_nan() { self.learn(at, colour, work_out) } else { known }
    }

    #[cold]
    fn learn(&self, at: usize, colour: [u8; 3], work_out: impl FnOnce([u8; 3]) -> f32) -> f32 {
        let half = 1 << (DROPPED_BITS - 1);
        let value = work_out(colour.map(|level| level >> DROPPED_BITS << DROPPED_BITS | half));
        self.cells[at].store(value.to_bits(), Ordering::Relaxed);
        value
    }
}

/// The values are not worth showing.
impl std::fmt::Debug for ColourCube {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ColourCube")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_has_the_value_of_its_middle_worked_out_once() {
        let cube = ColourCube::new();
        let value = |c: [u8; 3]| f32::from(c[0]) - 2.0 * f32::from(c[1]) + 0.5 * f32::from(c[2]);
        for colour in [[0, 0, 0], [255, 254, 3], [7, 8, 9], [4, 11, 255]] {
            let middle = colour.map(|level: u8| level / 4 * 4 + 2);
            assert_eq!(cube.of(colour, value), value(middle));
            let known = cube.clone().of(middle, |_| unreachable!("it is known"));
            assert_eq!(known, value(middle));
        }
        assert_eq!(cube.of([3, 3, 3], |_| unreachable!("it is known")), value([2, 2, 2]));
    }
}
