//! The filters of PNG (W3C Recommendation, section 9) on rows of one-bit pixels, which are whole bytes
//! to a filter, and the choice of one a row.
//!
//! The PNG library has the same and gives the same bytes, but hands each row to the compressor by
//! itself, which clears its output buffer every time: half the time of a mask file.

/// Filter types 1 to 4, in the order they are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Filter {
    Up = 2,
    Sub = 1,
    Average = 3,
    Paeth = 4,
}

/// Rows of `row_bytes` bytes, each filtered and led by the type of its filter: the one with the
/// smallest sum of absolute differences, of equals the last tried, and the first with none at all.
pub(super) fn filtered(rows: &[u8], row_bytes: usize) -> Vec<u8> {
    let mut result = Vec::with_capacity(rows.len() + rows.len() / row_bytes.max(1));
    let mut previous = &vec![0; row_bytes][..];
    let mut tried = vec![0; row_bytes];
    let mut best = vec![0; row_bytes];
    for row in rows.chunks_exact(row_bytes.max(1)) {
        // Before the first byte that is set in either row, and from the second after the last on,
        // every filter leaves what is there: nothing.
        let set = |(here, above): (&u8, &u8)| here | above != 0;
        let mut pairs = row.iter().zip(previous);
        let first = pairs.clone().position(set).unwrap_or(row_bytes);
        let end = pairs.rposition(set).map_or(first, |last| (last + 2).min(row_bytes));
        let part = first..end;
        let mut chosen = (u64::MAX, Filter::Up);
        for filter in [Filter::Up, Filter::Sub, Filter::Average, Filter::Paeth] {
            tried.fill(0);
            apply(filter, &previous[part.clone()], &row[part.clone()], &mut tried[part.clone()]);
            let filtered = &tried[part.clone()];
            let cost = filtered.iter().map(|&b| u64::from((b as i8).unsigned_abs())).sum();
            if cost <= chosen.0 {
                chosen = (cost, filter);
                std::mem::swap(&mut tried, &mut best);
                if cost == 0 {
                    break;
                }
            }
        }
        result.push(chosen.1 as u8);
        result.extend_from_slice(&best);
        previous = row;
    }
    result
}

fn apply(filter: Filter, previous: &[u8], row: &[u8], to: &mut [u8]) {
    let (mut left, mut above_left) = (0_u8, 0_u8);
    for ((to, &here), &above) in to.iter_mut().zip(row).zip(previous) {
        let expected = match filter {
            Filter::Up => above,
            Filter::Sub => left,
            Filter::Average => (left & above) + ((left ^ above) >> 1),
            Filter::Paeth => paeth(left, above, above_left),
        };
        *to = here.wrapping_sub(expected);
        (left, above_left) = (here, above);
    }
}

/// Of left, above and above left the one nearest to left + above − above left, in this order.
fn paeth(left: u8, above: u8, above_left: u8) -> u8 {
    let [a, b, c] = [left, above, above_left].map(i16::from);
    let (from_left, from_above) = ((b - c).abs(), (a - c).abs());
    let from_corner = (a + b - 2 * c).abs();
    if from_left <= from_above && from_left <= from_corner {
        left
    } else if from_above <= from_corner {
        above
    } else {
        above_left
    }
}
