//! What corrected frames say about a pixel by what they have about the same place of the animal.
//!
//! Colours that are told apart nowhere in the whole clip often are within a hand's breadth: the brown
//! of a leg before the brown of the bank, the belly and the shadow under it. So the probability of
//! being the animal is estimated once more from the pixels of the nearest corrected frames alone, by
//! place relative to the body, colour and distance from the background plate together (Parzen, *On
//! estimation of a probability density function and mode*, 1962).

use super::lab_image::{LabImage, Region};
use super::location::distances;
use super::plate::{PlateDistances, UNKNOWN};
use crate::mask::Mask;

/// Deviations of the kernel: in place, roots of the animal's area; in colour, half units of L*a*b*; in
/// distance from the plate, its units.
const PLACE: f32 = 0.06;
const COLOUR: f32 = 8.0;
const PLATE: f32 = 24.0;

/// Distances from the plate beyond this are alike: the background is not there.
const FAR_FROM_PLATE: u8 = 80;

/// The kernel ends where u, half the sum of squared deviations, is this: (1 − u/3)³ is close to exp(−u)
/// and needs no exponential.
const END: f32 = 3.0;

/// Pixels of a corrected frame are looked at in steps of this share of the kernel's deviation in
/// place, up to two deviations away.
const STEP: f32 = 0.5;
const REACH: f32 = 2.0;

/// Share of all kernels about a place that either class has besides, so that what was seen in neither
/// says nothing.
const UNSEEN: f32 = 0.005;

/// Only so close to an outline, roots of the area, does a pixel have to be asked.
const BAND: f32 = 0.25;

/// The most that this says, nats.
const STRONGEST: f32 = 3.0;

/// Corrected frames of less weight say nothing.
const LEAST_WEIGHT: f32 = 0.05;

/// Steps a nat in which the odds are kept: as bytes, since there is a set of them for every frame.
const STEPS: f32 = 32.0;

/// A frame as it is seen here.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub(super) image: &'a LabImage,
    pub(super) plate: &'a PlateDistances,
    /// The silhouette: a draft, or the truth of a corrected frame.
    pub(super) mask: &'a Mask,
}

/// Log odds of the pixels of a region to be the animal, by their resemblance to those of corrected
/// frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Resemblance {
    region: Region,
    /// In 32nds of a nat.
    odds: Vec<i8>,
}

impl Resemblance {
    /// Compares the region of a frame that its plate was looked at in with corrected frames, each of
    /// which has a weight of 0 to 1; `None` when none has weight enough.
    pub(super) fn of(frame: Seen, corrected: &[(Seen, f32)]) -> Option<Self> {
        let region = frame.plate.region;
        let (w, h) = (frame.mask.width(), frame.mask.height());
        let centre = frame.mask.centre_of_mass()?;
        let own = Features::of(frame);
        let mut shares = vec![[0.0_f32; 2]; region.pixels()];
        let mut most = 0.0_f32;
        for &(known, weight) in corrected.iter().filter(|c| c.1 >= LEAST_WEIGHT) {
            let Some(from) = known.mask.centre_of_mass() else { continue };
            let shift = ((from.0 - centre.0).round() as i64, (from.1 - centre.1).round() as i64);
            let moved = known.mask.window(shift.0, shift.1, w, h);
            let length = (known.mask.area() as f32).sqrt();
            let asked = Asked::of(region, &moved, frame.mask, BAND * length);
            let sums = compared(&own, &Features::of(known), known.mask, shift, length, &asked);
            let places = (region.top..region.bottom)
                .flat_map(|y| (region.left..region.right).map(move |x| (x, y)));
            for (share, (x, y)) in shares.iter_mut().zip(places) {
                let at = y * w + x;
                // Far from both outlines the place alone tells.
                let classes = match (asked.pixels[at], moved.get(x, y)) {
                    (true, _) => [sums.animal[at] / sums.whole, sums.background[at] / sums.whole],
                    (false, true) => [1.0, 0.0],
                    (false, false) => [0.0, 1.0],
                };
                share.iter_mut().zip(classes).for_each(|(sum, class)| *sum += weight * class);
            }
            most = most.max(weight);
        }
        let unseen = UNSEEN * most;
        let odds = |[a, b]: &[f32; 2]| {
            let ratio = ((a + unseen) / (b + unseen)).ln();
            (STEPS * most * ratio.clamp(-STRONGEST, STRONGEST)).round() as i8
        };
        (most > 0.0).then(|| Self { region, odds: shares.iter().map(odds).collect() })
    }

    /// Log odds of a pixel, at most 3 nats either way; 0 outside the region.
    #[inline]
    pub(super) fn log_odds(&self, x: usize, y: usize) -> f32 {
        let r = self.region;
        let inside = x >= r.left && x < r.right && y >= r.top && y < r.bottom;
        let at = inside.then(|| (y - r.top) * r.width() + x - r.left);
        at.map_or(0.0, |at| f32::from(self.odds[at]) / STEPS)
    }
}

/// The pixels that are compared: near the outline here or there.
struct Asked {
    pixels: Vec<bool>,
    /// For each row the columns from the first such pixel to behind the last.
    rows: Vec<(usize, usize)>,
}

impl Asked {
    fn of(region: Region, moved: &Mask, draft: &Mask, band: f32) -> Self {
        let (w, h) = (draft.width(), draft.height());
        let outside = distances(&moved.or(draft));
        let inside = distances(&moved.and(draft).not());
        let near = |at: usize| {
            let (x, y) = (at % w, at / w);
            let there = (region.left..region.right).contains(&x)
                && (region.top..region.bottom).contains(&y);
            there && outside[at] <= band && inside[at] <= band
        };
        let pixels: Vec<bool> = (0..w * h).map(near).collect();
        let rows = (0..h)
            .map(|y| {
                let row = &pixels[y * w..(y + 1) * w];
                let first = row.iter().position(|p| *p).unwrap_or(0);
                (first, row.iter().rposition(|p| *p).map_or(first, |last| last + 1))
            })
            .collect();
        Self { pixels, rows }
    }
}

/// What is compared of each pixel, in units in which the kernel's u is a sum of squares.
struct Features {
    size: (usize, usize),
    planes: [Vec<f32>; 4],
}

impl Features {
    fn of(frame: Seen) -> Self {
        let (w, h) = (frame.mask.width(), frame.mask.height());
        let [l, a, b] = frame.image.planes();
        let colour = |plane: &[u8], unit: f32| -> Vec<f32> {
            let scale = unit / (COLOUR * std::f32::consts::SQRT_2);
            plane.iter().map(|v| f32::from(*v) * scale).collect()
        };
        let scale = 1.0 / (PLATE * std::f32::consts::SQRT_2);
        // Where no frame shows the background a middle distance is the least wrong.
        let plate = (0..w * h).map(|at| match frame.plate.shown(at % w, at / w) {
            UNKNOWN => 0.5 * f32::from(FAR_FROM_PLATE) * scale,
            shown => f32::from(shown.min(FAR_FROM_PLATE)) * scale,
        });
        let planes = [colour(l, 1.0), colour(a, 2.0), colour(b, 2.0), plate.collect()];
        Self { size: (w, h), planes }
    }

    fn row(&self, y: usize, from: usize, to: usize) -> [&[f32]; 4] {
        let row = y * self.size.0;
        self.planes.each_ref().map(|plane| &plane[row + from..row + to])
    }
}

/// Sums of kernels at each asked pixel, and what they would come to if all were alike.
struct Sums {
    animal: Vec<f32>,
    background: Vec<f32>,
    whole: f32,
}

/// Compares the asked pixels with those about the same place, `shift` away, of a corrected frame.
fn compared(
    own: &Features,
    there: &Features,
    truth: &Mask,
    shift: (i64, i64),
    length: f32,
    asked: &Asked,
) -> Sums {
    let (w, h) = own.size;
    let deviation = (PLACE * length).max(1.0);
    let step = ((STEP * deviation).round() as i64).max(1);
    let steps = (REACH * deviation) as i64 / step;
    let labels: Vec<f32> =
        (0..w * h).map(|at| f32::from(u8::from(truth.get(at % w, at / w)))).collect();
    let mut sums = Sums { animal: vec![0.0; w * h], background: vec![0.0; w * h], whole: 0.0 };
    for (i, j) in (-steps..=steps).flat_map(|j| (-steps..=steps).map(move |i| (i, j))) {
        let (dx, dy) = (i * step, j * step);
        let away = ((dx * dx + dy * dy) as f32) / (2.0 * deviation * deviation);
        sums.whole += (1.0 - away / END).max(0.0).powi(3);
        for (y, &(first, last)) in asked.rows.iter().enumerate() {
            let there_y = y as i64 + shift.1 + dy;
            if !(0..h as i64).contains(&there_y) {
                continue;
            }
            // The columns of which the other side lies in the picture.
            let right = shift.0 + dx;
            let first = (first as i64).max(-right);
            let last = (last as i64).min(w as i64 - right);
            if first >= last {
                continue;
            }
            let (from, to) = (first as usize, last as usize);
            let (there_from, there_to) = ((first + right) as usize, (last + right) as usize);
            let row = y * w;
            let there_y = there_y as usize;
            add_row(
                own.row(y, from, to),
                there.row(there_y, there_from, there_to),
                &labels[there_y * w + there_from..there_y * w + there_to],
                away,
                &mut sums.animal[row + from..row + to],
                &mut sums.background[row + from..row + to],
            );
        }
    }
    sums
}

/// Adds the kernels of one row to the sums of the class that each corrected pixel is of.
fn add_row(
    own: [&[f32]; 4],
    there: [&[f32]; 4],
    labels: &[f32],
    away: f32,
    animal: &mut [f32],
    background: &mut [f32],
) {
    let n = labels.len();
    let [l, a, b, p] = own.map(|plane| &plane[..n]);
    let [tl, ta, tb, tp] = there.map(|plane| &plane[..n]);
    let (animal, background) = (&mut animal[..n], &mut background[..n]);
    for i in 0..n {
        let (dl, da, db, dp) = (l[i] - tl[i], a[i] - ta[i], b[i] - tb[i], p[i] - tp[i]);
        let u = away + dl * dl + da * da + db * db + dp * dp;
        let k = (1.0 - u / END).max(0.0);
        let k = k * k * k;
        animal[i] += k * labels[i];
        background[i] += k * (1.0 - labels[i]);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::silhouette::plate::{Asked, plate_distances};

    /// A picture of blobs whose colours are often alike, with a silhouette of several rows.
    fn frame() -> impl Strategy<Value = (LabImage, Mask)> {
        let (w, h) = (13_usize, 11_usize);
        let plane = move || proptest::collection::vec(100_u8..130, w * h);
        let rows = proptest::collection::vec((0_usize..8, 2_usize..8), 3..8);
        ((plane(), plane(), plane()), rows, 0_usize..4).prop_map(move |((l, a, b), rows, top)| {
            let inside = |x: usize, y: usize| {
                let row = y.checked_sub(top).and_then(|y| rows.get(y));
                row.is_some_and(|&(left, width)| (left..left + width).contains(&x))
            };
            (LabImage::from_planes(w, h, [l, a, b]), Mask::from_fn(w, h, inside))
        })
    }

    /// The estimate at one pixel near the outlines, by its definition: shares of both classes.
    fn estimate(frame: Seen, known: Seen, shift: (i64, i64), x: i64, y: i64) -> [f64; 2] {
        let (w, h) = (frame.mask.width() as i64, frame.mask.height() as i64);
        let deviation = (0.06 * (known.mask.area() as f64).sqrt()).max(1.0);
        let step = (0.5 * deviation).round().max(1.0) as i64;
        let steps = (2.0 * deviation) as i64 / step;
        let distance = |seen: Seen, x: i64, y: i64| match seen.plate.shown(x as usize, y as usize) {
            UNKNOWN => 40.0,
            shown => f64::from(shown).min(80.0),
        };
        let (mut shares, mut whole) = ([0.0; 2], 0.0);
        for j in -steps..=steps {
            for i in -steps..=steps {
                let away =
                    ((i * step).pow(2) + (j * step).pow(2)) as f64 / (2.0 * deviation.powi(2));
                let kernel = |u: f64| (1.0 - u / 3.0).max(0.0).powi(3);
                whole += kernel(away);
                let (kx, ky) = (x + shift.0 + i * step, y + shift.1 + j * step);
                if !(0..w).contains(&kx) || !(0..h).contains(&ky) {
                    continue;
                }
                let own = frame.image.at((y * w + x) as usize).map(f64::from);
                let other = known.image.at((ky * w + kx) as usize).map(f64::from);
                let colour = (own[0] - other[0]).powi(2)
                    + 4.0 * (own[1] - other[1]).powi(2)
                    + 4.0 * (own[2] - other[2]).powi(2);
                let plate = distance(frame, x, y) - distance(known, kx, ky);
                let u = away + colour / 128.0 + plate.powi(2) / (2.0 * 24.0 * 24.0);
                let class = usize::from(!known.mask.get(kx as usize, ky as usize));
                shares[class] += kernel(u);
            }
        }
        shares.map(|share| share / whole)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        /// Against the definition, pixel by pixel, for one and for two corrected frames.
        #[test]
        fn odds_are_those_of_the_kernels_about_the_same_place(
            (image, mask) in frame(),
            (first, truth) in frame(),
            (second, other_truth) in frame(),
            weights in (0.05..1.0_f32, 0.0..1.0_f32),
        ) {
            let (w, h) = (mask.width(), mask.height());
            let region = Region { left: 1, top: 0, right: w, bottom: h - 1 };
            let plates = [&image, &first, &second]
                .map(|image| plate_distances(image, region, std::iter::empty(), Asked::Nothing));
            let frame = Seen { image: &image, plate: &plates[0], mask: &mask };
            let known = [
                (Seen { image: &first, plate: &plates[1], mask: &truth }, weights.0),
                (Seen { image: &second, plate: &plates[2], mask: &other_truth }, weights.1),
            ];
            let found = Resemblance::of(frame, &known).unwrap();
            let centre = mask.centre_of_mass().unwrap();
            let counted: Vec<(Seen, f64)> = known
                .into_iter()
                .filter(|k| k.1 >= 0.05)
                .map(|(seen, weight)| (seen, f64::from(weight)))
                .collect();
            let most = counted.iter().map(|k| k.1).fold(0.0, f64::max);
            for (x, y) in (0..w * h).map(|at| (at % w, at / w)) {
                if x == 0 || y == h - 1 {
                    prop_assert_eq!(found.log_odds(x, y), 0.0);
                    continue;
                }
                let mut sums = [0.005 * most; 2];
                for &(seen, weight) in &counted {
                    let from = seen.mask.centre_of_mass().unwrap();
                    let shift =
                        ((from.0 - centre.0).round() as i64, (from.1 - centre.1).round() as i64);
                    let moved = seen.mask.window(shift.0, shift.1, w, h);
                    let band = 0.25 * (seen.mask.area() as f32).sqrt();
                    let (all, both) = (moved.or(&mask), moved.and(&mask).not());
                    let near = distances(&all)[y * w + x] <= band
                        && distances(&both)[y * w + x] <= band;
                    let shares = match (near, moved.get(x, y)) {
                        (true, _) => estimate(frame, seen, shift, x as i64, y as i64),
                        (false, true) => [1.0, 0.0],
                        (false, false) => [0.0, 1.0],
                    };
                    sums[0] += weight * shares[0];
                    sums[1] += weight * shares[1];
                }
                let wanted = most * (sums[0] / sums[1]).ln().clamp(-3.0, 3.0);
                let found = f64::from(found.log_odds(x, y));
                prop_assert!((found - wanted).abs() < 0.02, "{x} {y}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn without_a_corrected_frame_of_weight_nothing_is_said() {
        let flat =
            |value: u8| LabImage::from_planes(5, 5, std::array::from_fn(|_| vec![value; 25]));
        let image = flat(90);
        let mask = Mask::from_fn(5, 5, |x, y| x > 1 && y > 1);
        let plate = PlateDistances::nowhere();
        let seen = Seen { image: &image, plate: &plate, mask: &mask };
        assert_eq!(Resemblance::of(seen, &[]), None);
        assert_eq!(Resemblance::of(seen, &[(seen, 0.04)]), None);
        let nothing = Mask::new(5, 5);
        assert_eq!(Resemblance::of(Seen { mask: &nothing, ..seen }, &[(seen, 1.0)]), None);
    }
}
