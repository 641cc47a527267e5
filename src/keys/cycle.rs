//! The order of keys along the cycle, which is not their order in time.

use std::f64::consts::TAU;

use crate::numeric::{Coefficients, CyclePhase};
use crate::{Error, Result};

/// Positions in `keys` in the order in which the motion passes their silhouettes, beginning with
/// position 0: `keys[order[0]]`, `keys[order[1]]`, … follow one another round the loop in the plane
/// of the first two components.
///
/// Keys are usually spread over many cycles of a clip; this is the order a viewer would see them
/// in within one cycle.
///
/// # Errors
/// [`Error::KeyFrameOutOfRange`], [`Error::CoefficientNotFinite`].
pub fn cycle_order(coefficients: &Coefficients, keys: &[usize]) -> Result<Vec<usize>> {
    coefficients.check_finite()?;
    let frames = coefficients.frames();
    if let Some(&frame) = keys.iter().find(|&&k| k >= frames) {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    let phase = CyclePhase::measure(coefficients, None);
    let unwrapped = phase.unwrapped_rad();
    let from_first = |i: usize| (unwrapped[keys[i]] - unwrapped[keys[0]]).rem_euclid(TAU);
    let mut order: Vec<usize> = (0..keys.len()).collect();
    // The first key stays first: rem_euclid can turn its zero into almost a full turn.
    if let Some((_, rest)) = order.split_first_mut() {
        rest.sort_by(|&i, &j| from_first(i).total_cmp(&from_first(j)).then(i.cmp(&j)));
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_different_cycles_come_in_order_of_angle_and_of_motion() {
        for direction in [1.0, -1.0] {
            let values = (0..60)
                .flat_map(|t| {
                    let a = direction * TAU * f64::from(t) / 12.0;
                    [a.cos(), a.sin()]
                })
                .collect();
            let c = Coefficients::from_rows(60, 2, values).unwrap();
            // Phases in twelfths of a turn: 3, 9, 0, 6.
            assert_eq!(cycle_order(&c, &[3, 21, 36, 54]).unwrap(), vec![0, 3, 1, 2]);
        }
    }
}
