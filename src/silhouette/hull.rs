//! The convex hull of runs of pixels.

use std::ops::Range;

use crate::mask::Run;

/// The pixels whose centres lie in the convex hull of those of some runs, given by row and columns.
pub(super) fn hull(runs: impl Iterator<Item = (usize, Range<usize>)>) -> Vec<Run> {
    let mut sides: Vec<(usize, Range<usize>)> = Vec::new();
    for (y, run) in runs {
        match sides.binary_search_by_key(&y, |side| side.0) {
            Ok(at) => {
                let side = &mut sides[at].1;
                *side = side.start.min(run.start)..side.end.max(run.end);
            }
            Err(at) => sides.insert(at, (y, run)),
        }
    }
    let rows = sides.first().map_or(0, |s| s.0)..sides.last().map_or(0, |s| s.0 + 1);
    rows.map(|y| {
        // Between any row at or above this one and any at or below it the sides are straight.
        let above = sides.iter().filter(|side| side.0 <= y);
        let pairs = above.flat_map(|a| sides.iter().filter(|b| b.0 >= y).map(move |b| (a, b)));
        let between = |a: (usize, usize), b: (usize, usize)| {
            let share = if b.0 == a.0 { 0.0 } else { (y - a.0) as f64 / (b.0 - a.0) as f64 };
            a.1 as f64 + share * (b.1 as f64 - a.1 as f64)
        };
        let (mut start, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in pairs {
            start = start.min(between((a.0, a.1.start), (b.0, b.1.start)));
            last = last.max(between((a.0, a.1.end - 1), (b.0, b.1.end - 1)));
        }
        // A pixel on a side may be off by what is rounded.
        Run { y, start: (start - 1e-9).ceil() as usize, end: (last + 1e-9) as usize + 1 }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mask::Mask;

    /// Twice the area of a triangle, less than zero the other way round.
    fn area(a: (i64, i64), b: (i64, i64), c: (i64, i64)) -> i64 {
        (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
    }

    proptest! {
        /// Against the definition in the plane: a point is outside if all lie strictly to one side of a line
        /// through it.
        #[test]
        fn a_hull_holds_what_no_line_parts_from_the_points(
            points in proptest::collection::vec((3_i64..14, 3_i64..14), 1..7)
        ) {
            let runs = points.iter().map(|(x, y)| (*y as usize, *x as usize..*x as usize + 1));
            let mut found = Mask::new(18, 18);
            hull(runs).into_iter().for_each(|run| found.fill(run));
            for (x, y) in (0..18_i64).flat_map(|y| (0..18).map(move |x| (x, y))) {
                let held = points.iter().any(|a| points.iter().any(|b| points.iter().any(|c| {
                    let p = (x, y);
                    let sides = [area(*a, *b, p), area(*b, *c, p), area(*c, *a, p)];
                    let within = |side: fn(&i64) -> bool| sides.iter().all(side);
                    let boxed = |of: fn((i64, i64)) -> i64| {
                        let all = [of(*a), of(*b), of(*c)];
                        all.iter().min() <= Some(&of(p)) && Some(&of(p)) <= all.iter().max()
                    };
                    (within(|s| *s >= 0) || within(|s| *s <= 0)) && boxed(|p| p.0) && boxed(|p| p.1)
                })));
                prop_assert_eq!(found.get(x as usize, y as usize), held, "{} {}", x, y);
            }
        }
    }
}
