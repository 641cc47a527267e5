//! The contrast-sensitive random field: neighbouring pixels prefer one label, less so across an
//! edge of the picture (Boykov and Jolly 2001). Its optimum is found exactly, by a minimum cut.

use std::ops::Range;

use super::lab_image::LabImage;
use super::pair_costs::{Fall, PairCosts, SCALE};
use crate::mask::Mask;
use crate::numeric::{GridCut, InstructionSet, Kernel};

/// The preference of a pixel that is known: more than all neighbours together can cost.
const CERTAIN: i32 = i32::MAX / 2;

/// Places that are looked at together.
const PLACES: usize = 512;

/// What is known of a pixel before the cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// To be decided.
    Free,
    /// The animal.
    Animal,
    /// Background.
    Background,
}

/// The labelling of least cost: `odds` is each pixel's logarithm of the odds to be the animal.
pub(super) fn least_cost(
    image: &LabImage,
    fall: &Fall,
    odds: &[f32],
    known: &[Known],
    cut: &mut GridCut,
) -> Mask {
    let (w, h) = (image.width(), image.height());
    if known.is_empty() {
        return Mask::new(w, h);
    }
    let is_free = |known: &Known| *known == Known::Free;
    let free = |row: &[Known]| {
        let first = row.iter().position(is_free).unwrap_or(0);
        first..row.iter().rposition(is_free).map_or(0, |last| last + 1)
    };
    let spans: Vec<Range<usize>> = known.chunks_exact(w).map(free).collect();
    let costs = PairCosts::of(image, fall, &spans);
    let settled = Settled::of(&costs, odds, known, &spans);
    let mut problem = cut.problem(w, h);
    let (ahead, towards) = (costs.ahead(), costs.towards());
    for (y, span) in spans.into_iter().enumerate() {
        for x in span {
            let at = y * w + x;
            let place = costs.margin() + at;
            if settled.sides[place] != Known::Free {
                continue;
            }
            let (mut preference, mut capacities) = (preference(odds[at]), [0; 4]);
            let mut decided = |cost: i32, near: Known| match near {
                Known::Animal => preference += cost,
                Known::Background => preference -= cost,
                Known::Free => {}
            };
            for side in 0..4 {
                let cost = i32::from(towards[side][place]);
                let near = settled.sides[place + ahead[side]];
                decided(cost, near);
                capacities[side] = if near == Known::Free { cost } else { 0 };
                // Pairs with an open pixel before this one are that one's.
                let before = place - ahead[side];
                decided(i32::from(towards[side][before]), settled.sides[before]);
            }
            problem.add_pixel(x, y, preference, capacities);
        }
    }
    let found = problem.solve().foreground;
    let sides = &settled.sides[costs.margin()..];
    let animal: Vec<bool> =
        found.iter().zip(sides).map(|(cut, side)| *cut || *side == Known::Animal).collect();
    Mask::from_bools(w, h, &animal).unwrap_or_else(|| Mask::new(w, h))
}

/// What it costs as background, above zero, or as the animal, below.
#[inline(always)]
fn preference(odds: f32) -> i32 {
    (odds * SCALE) as i32
}

/// Pixels that no labelling of least cost has otherwise than they prefer, which need no cut.
///
/// First flow is pushed from pixels that prefer the animal to neighbours that do not, as the cut would begin:
/// that leaves all labellings as far from one another as they were, and nothing of most specks. Then take all
/// that still prefers the background. If each of its pixels would lose no less by its own preference than
/// it could gain from its neighbours outside of that set, so would any part of the set, and the
/// least cost has it as background (persistency, as in Hammer, Hansen and Simeone, *Roof duality*,
/// Mathematical Programming 28, 1984). A pixel for which that does not hold borrows from neighbours of the
/// same set, through what can flow between them. If that is not enough it is left open and taken out of
/// the set, and its neighbours are asked again. The same of the animal. What stays open is a strip
/// about the outline and what looks like neither; the labelling is the same one.
struct Settled {
    /// Of each place of the costs: what it prefers; free where it is open.
    sides: Vec<Known>,
    /// What is left of its preference.
    terms: Vec<i32>,
    /// What flows to each of the four that follow a place.
    flows: [Vec<i16>; 4],
    /// By how much what is left outweighs its neighbours on other sides. Below zero a pixel is open.
    margins: Vec<i32>,
}

impl Settled {
    fn of(costs: &PairCosts, odds: &[f32], known: &[Known], spans: &[Range<usize>]) -> Self {
        let (margin, places) = (costs.margin(), costs.places());
        let mut settled = Self {
            sides: vec![Known::Background; places],
            terms: vec![-CERTAIN; places],
            flows: std::array::from_fn(|_| vec![0; places]),
            margins: vec![CERTAIN; places],
        };
        for (term, (known, odds)) in settled.terms[margin..].iter_mut().zip(known.iter().zip(odds))
        {
            *term = match known {
                Known::Free => preference(*odds),
                Known::Animal => CERTAIN,
                Known::Background => -CERTAIN,
            };
        }
        InstructionSet::best().run(Neighbours { settled: &mut settled, costs });
        settled.open(costs, spans);
        settled
    }

    /// Opens what is not decided.
    fn open(&mut self, costs: &PairCosts, spans: &[Range<usize>]) {
        let (ahead, towards) = (costs.ahead(), costs.towards());
        let width = ahead[2];
        let mut open: Vec<usize> = Vec::new();
        for (y, span) in spans.iter().enumerate() {
            let row = costs.margin() + y * width;
            let places = row + span.start..row + span.end;
            open.extend(places.filter(|place| self.margins[*place] < 0));
        }
        // Which pair is that with a neighbour, from its first pixel on or back, and how far from a place the first
        // pixel and the neighbour are.
        let steps: [(usize, bool, usize, usize); 8] = std::array::from_fn(|step| {
            let (which, back) = (step / 2, ahead[step / 2].wrapping_neg());
            if step % 2 == 0 { (which, true, 0, ahead[which]) } else { (which, false, back, back) }
        });
        while let Some(place) = open.pop() {
            let side = self.sides[place];
            // From what is open into the background, and from the animal to what is open.
            let from_here = side == Known::Background;
            for (which, forth, first, near) in steps {
                let (first, near) = (place.wrapping_add(first), place.wrapping_add(near));
                if self.sides[near] != side {
                    continue;
                }
                let along = forth == from_here;
                let flow = &mut self.flows[which][first];
                let lent = (-self.margins[place]).min(self.margins[near]).min(room(
                    towards[which][first],
                    *flow,
                    along,
                ));
                if lent > 0 {
                    *flow += if along { lent } else { -lent } as i16;
                    self.margins[near] -= lent;
                    self.margins[place] += lent;
                    if self.margins[place] >= 0 {
                        break;
                    }
                }
            }
            if self.margins[place] >= 0 {
                continue;
            }
            self.sides[place] = Known::Free;
            for (which, forth, first, near) in steps {
                let (first, near) = (place.wrapping_add(first), place.wrapping_add(near));
                if self.sides[near] != side {
                    continue;
                }
                let flow = self.flows[which][first];
                let margin = &mut self.margins[near];
                let before = *margin;
                *margin -= room(towards[which][first], flow, forth == from_here);
                if before >= 0 && *margin < 0 {
                    open.push(near);
                }
            }
        }
    }

    /// Pushes flow between neighbours, and weighs what is left against them.
    #[inline(always)]
    fn look_at_neighbours(&mut self, costs: &PairCosts) {
        let (ahead, towards) = (costs.ahead(), costs.towards());
        let (first, width) = (costs.margin(), ahead[2]);
        let last = costs.places() - first;
        for which in [2, 1, 3] {
            for row in (first..last).step_by(width) {
                // The first pixel of a row has none south-west of it, the last none south-east.
                let from = row + usize::from(which == 3);
                let length = width - usize::from(which != 2);
                let (here, below) = self.terms.split_at_mut(from + ahead[which]);
                let terms = here[from..from + length].iter_mut().zip(below);
                let pairs = self.flows[which][from..].iter_mut().zip(&towards[which][from..]);
                terms.zip(pairs).for_each(|((a, b), (flow, cost))| *flow = push(a, b, *cost));
            }
        }
        for row in (first..last).step_by(width) {
            for from in [row, row + 1] {
                let length = (row + width - from) / 2 * 2;
                let here = from..from + length;
                let terms = self.terms[here.clone()].as_chunks_mut::<2>().0;
                let flows = self.flows[0][here.clone()].as_chunks_mut::<2>().0;
                let costs = towards[0][here].as_chunks::<2>().0;
                for (([a, b], [flow, _]), [cost, _]) in terms.iter_mut().zip(flows).zip(costs) {
                    *flow = push(a, b, *cost);
                }
            }
        }
        let all = self.sides.iter_mut().zip(&mut self.margins).zip(&self.terms);
        for ((side, margin), term) in all {
            *side = if *term > 0 { Known::Animal } else { Known::Background };
            // Of several labellings of least cost the one with the smallest animal is wanted, so to be the
            // animal something must be left.
            *margin = if *term > 0 { *term - 1 } else { -*term };
        }
        let mut rooms = [0_i32; PLACES];
        for which in 0..4 {
            for start in (first..last).step_by(PLACES) {
                let here = start..(start + PLACES).min(last);
                let there = here.start + ahead[which]..here.end + ahead[which];
                let rooms = &mut rooms[..here.len()];
                let sides = self.sides[here.clone()].iter().zip(&self.sides[there.clone()]);
                let pairs =
                    towards[which][here.clone()].iter().zip(&self.flows[which][here.clone()]);
                for (free, ((a, b), (cost, flow))) in rooms.iter_mut().zip(sides.zip(pairs)) {
                    let parted = *a as u8 != *b as u8;
                    let along = *a as u8 == Known::Animal as u8;
                    *free = if parted { room(*cost, *flow, along) } else { 0 };
                }
                for places in [here, there] {
                    for (margin, room) in self.margins[places].iter_mut().zip(&*rooms) {
                        *margin -= room;
                    }
                }
            }
        }
    }
}

/// Pushes what flows from one of two neighbours to the other, from a positive term to a negative one, and
/// returns it: below zero, it flows from the second.
#[inline(always)]
fn push(a: &mut i32, b: &mut i32, cost: u16) -> i16 {
    let most = i32::from(cost).min(a.abs()).min(b.abs());
    let most = if (*a ^ *b) < 0 { most } else { 0 };
    let flow = if *a < 0 { -most } else { most };
    *a -= flow;
    *b += flow;
    flow as i16
}

/// What can flow more through a pair, from its first pixel to the second or back.
#[inline(always)]
fn room(cost: u16, flow: i16, along: bool) -> i32 {
    let flow = i32::from(flow);
    i32::from(cost) - if along { flow } else { -flow }
}

/// All pixels to be weighed against their neighbours.
struct Neighbours<'a> {
    settled: &'a mut Settled,
    costs: &'a PairCosts,
}

impl Kernel for Neighbours<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.settled.look_at_neighbours(self.costs);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::pair_costs::tests::{pairs, picture};
    use super::*;

    type Problem = (LabImage, Vec<f32>, Vec<Known>);

    /// A picture with odds, some of its pixels decided.
    fn problem(w: usize, h: usize) -> impl Strategy<Value = Problem> {
        picture(w, h).prop_flat_map(|image| {
            let pixels = image.width() * image.height();
            let odds = proptest::collection::vec(-12.0..12.0_f32, pixels);
            let known = prop_oneof![
                4 => Just(Known::Free), 1 => Just(Known::Animal), 1 => Just(Known::Background),
            ];
            (Just(image), odds, proptest::collection::vec(known, pixels))
        })
    }

    /// What a labelling costs: the odds it goes against, and the pairs it parts.
    fn cost(labels: &dyn Fn(usize) -> bool, odds: &[f32], pairs: &[(usize, usize, f64)]) -> f64 {
        let against = |at: usize| {
            let odds = f64::from(odds[at]);
            if labels(at) { (-odds).max(0.0) } else { odds.max(0.0) }
        };
        let parted: f64 =
            pairs.iter().filter(|(a, b, _)| labels(*a) != labels(*b)).map(|p| p.2).sum();
        (0..odds.len()).map(against).sum::<f64>() + parted
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Against all labellings that agree with what is known, by the textbook's cost.
        #[test]
        fn no_labelling_costs_less((image, odds, known) in problem(5, 4)) {
            let (w, n) = (image.width(), odds.len());
            let found = least_cost(&image, &Fall::of(&image), &odds, &known, &mut GridCut::new());
            let pairs = pairs(&image);
            for (at, known) in known.iter().enumerate() {
                let set = found.get(at % w, at / w);
                prop_assert!(*known == Known::Free || set == (*known == Known::Animal));
            }
            let agrees = |labels: u32| {
                known.iter().enumerate().all(|(at, known)| match known {
                    Known::Free => true,
                    Known::Animal => labels >> at & 1 == 1,
                    Known::Background => labels >> at & 1 == 0,
                })
            };
            let least = (0..1_u32 << n)
                .filter(|labels| agrees(*labels))
                .map(|labels| cost(&|at| labels >> at & 1 == 1, &odds, &pairs))
                .fold(f64::INFINITY, f64::min);
            let own = cost(&|at| found.get(at % w, at / w), &odds, &pairs);
            // A step of the exponential's table is 1/64, of the integer costs a thousandth.
            let slack = pairs.iter().map(|p| p.2 / 64.0 + 0.001).sum::<f64>() + 0.001 * n as f64;
            prop_assert!(own <= least + slack, "{own} {least}");
        }

        /// Against the cut with all that is free in it, of which there is one answer.
        #[test]
        fn what_is_settled_beforehand_changes_nothing((image, odds, known) in problem(40, 30)) {
            let (w, h) = (image.width(), image.height());
            let fall = Fall::of(&image);
            let costs = PairCosts::of(&image, &fall, &vec![0..w; h]);
            let mut buffers = GridCut::new();
            let mut whole = buffers.problem(w, h);
            // What is known is wanted more than anything can cost.
            let certain = |at: usize| match known[at] {
                Known::Free => preference(odds[at]),
                Known::Animal => CERTAIN,
                Known::Background => -CERTAIN,
            };
            for at in 0..w * h {
                let capacities = costs.towards().map(|c| i32::from(c[costs.margin() + at]));
                whole.add_pixel(at % w, at / w, certain(at), capacities);
            }
            let whole = whole.solve().foreground;
            let found = least_cost(&image, &fall, &odds, &known, &mut GridCut::new());
            for (at, wanted) in whole.into_iter().enumerate() {
                prop_assert_eq!(found.get(at % w, at / w), wanted);
            }
        }
    }
}
