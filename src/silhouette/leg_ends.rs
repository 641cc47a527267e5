//! Feet and lower legs that a cut left out: what stands out from the ground close under the end of a leg.
//!
//! Between a leg and its foot there may be nothing that can be told from the ground: a white sock before
//! sand, an ankle of a pixel's width. The foot alone is too small for the cut to keep, or is a piece by
//! itself, which the animal is not. So what is as large as a foot, and lies where one has to be, is joined
//! to its leg; and so is what is upright as a leg and hangs by nothing.

use std::ops::Range;

use super::hull::hull;
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

/// A lower leg that the cut found is so many times as high as wide, has at least the area of a square of
/// this side, begins so close under the rest of its leg in the lower half of the animal, and of its upper
/// end so much is joined to that.
const UPRIGHT: f64 = 1.5;
const LEAST_LOWER_LEG: f64 = 0.1;
const LOWER_LEG_GAP: f64 = 0.16;
const LOWER_LEG_END: f64 = 0.1;

/// The animal with the lower legs that are pieces of the cut by themselves, and with the feet that are, or
/// that the log odds of its pixels, row by row, show under the ends of its legs.
pub(super) fn with_leg_ends(animal: &Mask, cut: &Mask, odds: &[f32]) -> Mask {
    with_feet(&with_lower_legs(animal, cut), cut, odds)
}

fn with_lower_legs(animal: &Mask, cut: &Mask) -> Mask {
    let mut whole = animal.clone();
    let Some(bounds) = animal.bounds() else { return whole };
    let legs = Legs::of(animal, bounds.top + bounds.height() / 2, LOWER_LEG_GAP);
    for piece in components(&cut.and_not(animal), Connectivity::Eight) {
        if let Some(between) = legs.up_to(&piece) {
            piece.draw(&mut whole);
            between.into_iter().for_each(|run| whole.fill(run));
        }
    }
    whole
}

fn with_feet(animal: &Mask, cut: &Mask, odds: &[f32]) -> Mask {
    let mut whole = animal.clone();
    let Some(bounds) = animal.bounds() else { return whole };
    let w = animal.width();
    let top = bounds.bottom - (FEET * bounds.height() as f64) as usize;
    let legs = Legs::of(animal, top, GAP);
    // What was cut is surely none of the ground: it needs no leg to be seen above it.
    for piece in components(&cut.and_not(animal), Connectivity::Eight) {
        if piece.bounds.top >= top && legs.is_as_large_as_a_foot(&piece) {
            let joined = legs.nearest(&piece).and_then(|near| legs.joined(&piece, near));
            joined.into_iter().flatten().for_each(|run| whole.fill(run));
        }
    }
    let stands_out = Mask::from_fn(w, animal.height(), |x, y| {
        y >= top && odds[y * w + x] > STANDS_OUT && !animal.get(x, y)
    });
    for piece in components(&stands_out, Connectivity::Eight) {
        let on_average = || {
            let row = |run: &Run| odds[run.y * w..][run.start..run.end].iter();
            piece.runs().iter().flat_map(row).sum::<f32>() / piece.area_px as f32
        };
        if legs.is_as_large_as_a_foot(&piece) && on_average() >= STANDS_OUT_ON_AVERAGE {
            let under_leg = legs.nearest(&piece).filter(|(_, end)| legs.is_leg(*end));
            let joined = under_leg.and_then(|near| legs.joined(&piece, near));
            joined.into_iter().flatten().for_each(|run| whole.fill(run));
        }
    }
    whole
}

/// Column and row of a pixel.
type At = (usize, usize);

/// The animal whose legs end.
struct Legs<'a> {
    animal: &'a Mask,
    /// The highest row that a leg may end in.
    top: usize,
    /// Root of the area.
    length: f64,
    /// Columns and rows to pixels as far away as a piece may be from its leg, the nearest first.
    near: Vec<(i64, i64)>,
}

impl<'a> Legs<'a> {
    fn of(animal: &'a Mask, top: usize, gap: f64) -> Self {
        let length = (animal.area() as f64).sqrt();
        Self { animal, top, length, near: disc(gap * length) }
    }

    fn is_as_large_as_a_foot(&self, piece: &Component) -> bool {
        let b = piece.bounds;
        piece.area_px as f64 >= (LEAST * self.length).powi(2)
            && b.width() as f64 <= WIDTH * self.length
            && b.height() as f64 <= HEIGHT * self.length
    }

    /// A foot and what joins it to what it lies under; `None` where it lies under nothing. `foot` and
    /// `end` are the pixels of both that are nearest to one another.
    fn joined(&self, piece: &Component, (foot, end): (At, At)) -> Option<Vec<Run>> {
        if end.1 < self.top {
            return None;
        }
        let (x, y) = piece.centre_px;
        let (aside, below) = ((x - end.0 as f64).abs(), y - end.1 as f64);
        if below <= 0.0 || aside > LEAN * below + 1.0 || self.is_anything_under(piece) {
            return None;
        }
        let of_foot = piece.runs().iter().map(|run| (run.y, run.start..run.end));
        Some(hull(of_foot.chain(self.end_of_leg(foot, end))))
    }

    /// What joins the upper end of a lower leg to the rest of it; `None` if the piece is no lower leg.
    fn up_to(&self, piece: &Component) -> Option<Vec<Run>> {
        let b = piece.bounds;
        let like_a_leg = b.height() as f64 >= UPRIGHT * b.width() as f64
            && piece.area_px as f64 >= (LEAST_LOWER_LEG * self.length).powi(2)
            && piece.centre_px.1 > self.top as f64;
        if !like_a_leg {
            return None;
        }
        let (upper, end) = self.nearest(piece)?;
        if end.1 > upper.1 || upper.1 > b.top + b.height() / 3 {
            return None;
        }
        let bottom = b.top + (LOWER_LEG_END * self.length) as usize;
        let of_piece = piece.runs().iter().filter(|run| run.y <= bottom);
        let of_piece = of_piece.map(|run| (run.y, run.start..run.end));
        Some(hull(of_piece.chain(self.end_of_leg(upper, end))))
    }

    /// The animal's pixels about its `end` that are nearest to `from`.
    fn end_of_leg(&self, from: At, end: At) -> impl Iterator<Item = (usize, Range<usize>)> {
        let distance = (from.0 as f64 - end.0 as f64).hypot(from.1 as f64 - end.1 as f64);
        let near = disc(distance + END * self.length + 1.0).into_iter();
        near.filter_map(move |to| self.moved(from, to)).map(|(x, y)| (y, x..x + 1))
    }

    /// The pixel of a piece and that of the animal that are nearest to one another.
    fn nearest(&self, piece: &Component) -> Option<(At, At)> {
        self.near.iter().find_map(|&to| {
            piece.runs().iter().find_map(|run| {
                let from = |x| ((x, run.y), self.moved((x, run.y), to));
                (run.start..run.end).map(from).find_map(|(from, to)| Some((from, to?)))
            })
        })
    }

    /// The animal's pixel so far from another, if there is one.
    fn moved(&self, (x, y): At, (dx, dy): (i64, i64)) -> Option<At> {
        let to = (x.checked_add_signed(dx as isize)?, y.checked_add_signed(dy as isize)?);
        let inside = to.0 < self.animal.width() && to.1 < self.animal.height();
        (inside && self.animal.get(to.0, to.1)).then_some(to)
    }

    /// Whether a leg goes up from a pixel of the animal.
    fn is_leg(&self, (x, y): At) -> bool {
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

#[cfg(test)]
mod tests {
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
        with_leg_ends(&animal(), &animal(), &odds)
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
        assert_eq!(with_leg_ends(&nothing, &nothing, &[3.0; 81]), nothing);
    }

    /// What a rectangle adds that is a piece of the cut by itself, of which the odds say nothing.
    fn added(columns: Range<usize>, rows: Range<usize>) -> (Mask, Mask) {
        let piece = Mask::from_fn(SIZE.0, SIZE.1, |x, y| columns.contains(&x) && rows.contains(&y));
        let against = vec![-2.0; SIZE.0 * SIZE.1];
        let whole = with_leg_ends(&animal(), &animal().or(&piece), &against);
        (whole.and_not(&animal()), piece)
    }

    #[test]
    fn a_foot_that_the_cut_found_by_itself_is_joined() {
        let (added, foot) = added(58..70, 110..118);
        assert!(foot.and_not(&added).is_empty());
        assert_eq!(components(&animal().or(&added), Connectivity::Eight).len(), 1);
    }

    #[test]
    fn a_lower_leg_that_the_cut_found_by_itself_is_joined_to_what_is_above() {
        let (joined, leg) = added(95..105, 78..116);
        assert!(leg.and_not(&joined).is_empty());
        let between = joined.and_not(&leg).bounds().unwrap();
        assert!(between.top == 70 && between.bottom < 86);
        assert!(between.left >= 85 && between.right <= 106, "{between:?}");
    }

    #[test]
    fn nothing_else_of_the_cut_is_taken_for_a_leg() {
        let flat = added(84..112, 84..110);
        let far = added(95..105, 86..116);
        let thin = added(100..101, 78..116);
        let beside_the_animal = added(155..163, 30..60);
        for (at, (added, _)) in [flat, far, thin, beside_the_animal].iter().enumerate() {
            assert!(added.is_empty(), "{at}: {:?}", added.bounds());
        }
    }
}
