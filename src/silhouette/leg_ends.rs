//! Feet that a cut left out: what stands out from the ground close under the end of a leg.
//!
//! Between a leg and its foot there may be nothing that can be told from the ground: a white sock before
//! sand, an ankle of a pixel's width. The foot alone is too small for the cut to keep, or is a piece by
//! itself, which the animal is not. So what is as large as a foot, and lies where one has to be, is joined
//! to its leg.

use std::ops::Range;

use crate::mask::{Component, Connectivity, Mask, Run, components};

/// Log odds of a pixel of a foot, and of all of them on average, nats.
const STANDS_OUT: f32 = 0.5;
const STANDS_OUT_ON_AVERAGE: f32 = 1.0;

// All lengths are shares of the root of the silhouette's area.

/// Side of the square that a foot has at least the area of, and its width and height at most: shadows are
/// larger.
const LEAST: f64 = 0.015;
const WIDTH: f64 = 0.25;
const HEIGHT: f64 = 0.16;

/// How far a foot may be from its leg, and how far its middle to the side of the leg's end beside how far
/// it is below.
const GAP: f64 = 0.08;
const LEAN: f64 = 1.6;

/// A leg is so narrow where it ends and so far above, where it may be so far to the side.
const LEG_WIDTH: f64 = 0.2;
const LEG: f64 = 0.1;
const LEG_LEAN: f64 = 0.15;

/// A leg ends in this share of the silhouette's height, counted from below.
const FEET: f64 = 0.4;

/// Under a foot, and so far beside, there is nothing of the animal: dark ground along a leg is no foot.
const BESIDE: f64 = 0.06;

/// What of a leg is nearest to its foot, up to so much further than the nearest pixel, is joined to it.
const END: f64 = 0.03;

/// The animal with the feet that the log odds of its pixels, row by row, show under the ends of its legs.
pub(super) fn with_feet(animal: &Mask, odds: &[f32]) -> Mask {
    let mut whole = animal.clone();
    let Some(bounds) = animal.bounds() else { return whole };
    let w = animal.width();
    let top = bounds.bottom - (FEET * bounds.height() as f64) as usize;
    let stands_out = Mask::from_fn(w, animal.height(), |x, y| {
        y >= top && odds[y * w + x] > STANDS_OUT && !animal.get(x, y)
    });
    let legs = Legs::of(animal, top);
    for piece in components(&stands_out, Connectivity::Eight) {
        let on_average = || {
            let row = |run: &Run| odds[run.y * w..][run.start..run.end].iter();
            piece.runs().iter().flat_map(row).sum::<f32>() / piece.area_px as f32
        };
        if legs.is_as_large_as_a_foot(&piece) && on_average() >= STANDS_OUT_ON_AVERAGE {
            for run in legs.joined(&piece).unwrap_or_default() {
                whole.fill(run);
            }
        }
    }
    whole
}

/// The animal whose legs end.
struct Legs<'a> {
    animal: &'a Mask,
    /// The highest row that a leg may end in.
    top: usize,
    /// Root of the area.
    length: f64,
    /// Columns and rows to pixels as far away as a foot may be from its leg, the nearest first.
    near: Vec<(i64, i64)>,
}

impl<'a> Legs<'a> {
    fn of(animal: &'a Mask, top: usize) -> Self {
        let length = (animal.area() as f64).sqrt();
        Self { animal, top, length, near: disc(GAP * length) }
    }

    fn is_as_large_as_a_foot(&self, piece: &Component) -> bool {
        let b = piece.bounds;
        piece.area_px as f64 >= (LEAST * self.length).powi(2)
            && b.width() as f64 <= WIDTH * self.length
            && b.height() as f64 <= HEIGHT * self.length
    }

    /// The piece and what joins it to the leg that it lies under; `None` where it lies under none.
    fn joined(&self, piece: &Component) -> Option<Vec<Run>> {
        let (foot, end) = self.nearest(piece)?;
        if end.1 < self.top || !self.is_leg(end) {
            return None;
        }
        let (x, y) = piece.centre_px;
        let (aside, below) = ((x - end.0 as f64).abs(), y - end.1 as f64);
        if below <= 0.0 || aside > LEAN * below + 1.0 || self.is_anything_under(piece) {
            return None;
        }
        let distance = (foot.0 as f64 - end.0 as f64).hypot(foot.1 as f64 - end.1 as f64);
        let of_leg = disc(distance + END * self.length + 1.0).into_iter();
        let of_leg = of_leg.filter_map(|to| self.moved(foot, to)).map(|(x, y)| (y, x..x + 1));
        let of_foot = piece.runs().iter().map(|run| (run.y, run.start..run.end));
        Some(hull(of_foot.chain(of_leg)))
    }

    /// The pixel of a piece and that of the animal that are nearest to one another.
    fn nearest(&self, piece: &Component) -> Option<((usize, usize), (usize, usize))> {
        self.near.iter().find_map(|&to| {
            piece.runs().iter().find_map(|run| {
                let from = |x| ((x, run.y), self.moved((x, run.y), to));
                (run.start..run.end).map(from).find_map(|(from, to)| Some((from, to?)))
            })
        })
    }

    /// The animal's pixel so far from another, if there is one.
    fn moved(&self, (x, y): (usize, usize), (dx, dy): (i64, i64)) -> Option<(usize, usize)> {
        let to = (x.checked_add_signed(dx as isize)?, y.checked_add_signed(dy as isize)?);
        let inside = to.0 < self.animal.width() && to.1 < self.animal.height();
        (inside && self.animal.get(to.0, to.1)).then_some(to)
    }

    /// Whether a leg goes up from a pixel of the animal.
    fn is_leg(&self, (x, y): (usize, usize)) -> bool {
        let narrow = |run: Range<usize>| run.len() as f64 <= LEG_WIDTH * self.length;
        let Some(above) = y.checked_sub((LEG * self.length) as usize) else { return false };
        let lean = (LEG_LEAN * self.length) as usize;
        let columns = x.saturating_sub(lean)..(x + lean + 1).min(self.animal.width());
        let nearest =
            columns.filter(|x| self.animal.get(*x, above)).min_by_key(|at| at.abs_diff(x));
        narrow(self.run(x, y)) && nearest.is_some_and(|x| narrow(self.run(x, above)))
    }

    /// The run of the animal's pixels about one of them.
    fn run(&self, x: usize, y: usize) -> Range<usize> {
        let set = |x: &usize| self.animal.get(*x, y);
        let left = (0..x).rev().take_while(set).last().unwrap_or(x);
        left..(x..self.animal.width()).take_while(set).last().unwrap_or(x) + 1
    }

    fn is_anything_under(&self, piece: &Component) -> bool {
        let (b, beside) = (piece.bounds, (BESIDE * self.length) as usize);
        let columns =
            b.left.saturating_sub(beside)..(b.right + beside + 1).min(self.animal.width());
        let middle = piece.centre_px.1.round() as usize;
        (middle + 1..self.animal.height()).any(|y| columns.clone().any(|x| self.animal.get(x, y)))
    }
}

/// Columns and rows to all pixels up to a distance, the nearest first.
fn disc(radius: f64) -> Vec<(i64, i64)> {
    let reach = radius as i64;
    let far = |(x, y): &(i64, i64)| x * x + y * y;
    let mut all: Vec<(i64, i64)> = (-reach..=reach)
        .flat_map(|y| (-reach..=reach).map(move |x| (x, y)))
        .filter(|to| far(to) as f64 <= radius * radius)
        .collect();
    all.sort_by_key(far);
    all
}

/// The pixels whose centres lie in the convex hull of those of some runs, given by row and columns.
fn hull(runs: impl Iterator<Item = (usize, Range<usize>)>) -> Vec<Run> {
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

    const SIZE: (usize, usize) = (200, 160);

    /// A trunk of 100 × 50 pixels on two legs of 12, the left one ending 14 pixels higher, and a belly.
    fn animal() -> Mask {
        Mask::from_fn(SIZE.0, SIZE.1, |x, y| {
            let trunk = (50..150).contains(&x) && (20..70).contains(&y);
            let left = (60..72).contains(&x) && (70..106).contains(&y);
            trunk || left || ((120..132).contains(&x) && (70..120).contains(&y))
        })
    }

    /// The animal with what is made of a rectangle of some log odds; everywhere else they are against it.
    fn with(columns: Range<usize>, rows: Range<usize>, log_odds: f32) -> Mask {
        let at = |x: &usize, y: &usize| columns.contains(x) && rows.contains(y);
        let odds: Vec<f32> = (0..SIZE.0 * SIZE.1)
            .map(|i| if at(&(i % SIZE.0), &(i / SIZE.0)) { log_odds } else { -2.0 })
            .collect();
        with_feet(&animal(), &odds)
    }

    #[test]
    fn a_foot_close_under_a_leg_is_joined_to_it() {
        let whole = with(58..70, 110..118, 2.0);
        assert_eq!(components(&whole, Connectivity::Eight).len(), 1);
        let foot =
            Mask::from_fn(SIZE.0, SIZE.1, |x, y| (58..70).contains(&x) && (110..118).contains(&y));
        assert!(foot.and_not(&whole).is_empty());
        let added = whole.and_not(&animal()).and_not(&foot);
        let bounds = added.bounds().unwrap();
        assert!(bounds.top >= 106 && bounds.bottom < 118 && bounds.left >= 58 && bounds.right < 72);
    }

    #[test]
    fn nothing_else_is_taken_for_a_foot() {
        let weak = with(58..70, 110..118, 0.9);
        let far = with(58..70, 114..122, 2.0);
        let specks = with(64..65, 110..111, 2.0);
        let shadow = with(40..72, 110..118, 2.0);
        let beside_the_leg = with(74..80, 95..103, 2.0);
        let under_the_belly = with(90..100, 72..80, 2.0);
        let within_the_step = with(108..118, 100..110, 2.0);
        let all = [weak, far, specks, shadow, beside_the_leg, under_the_belly, within_the_step];
        for (at, found) in all.iter().enumerate() {
            assert!(*found == animal(), "{at}: {:?}", found.and_not(&animal()).bounds());
        }
        let nothing = Mask::new(9, 9);
        assert_eq!(with_feet(&nothing, &[3.0; 81]), nothing);
    }

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
