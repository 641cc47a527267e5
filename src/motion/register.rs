//! Laying one picture over another: direct, robust, coarse to fine.
//!
//! Inverse compositional Gauss–Newton (Baker and Matthews, *Lucas–Kanade 20 Years On*, 2004) on the
//! pixels of strongest gradient, one a cell of a grid, with Geman–McClure weights whose scale
//! follows the residuals, so that what moves by itself (the animal, leaves, water) does not pull.
//! The model grows with the number of pixels: translation, affine, homography. A change of gain
//! and offset of the light is estimated along.

use nalgebra::{DMatrix, DVector, Matrix3};

use super::Homography;
use super::pyramid::{Level, Pyramid};

/// Side of the cells that one pixel each is taken from, pixels.
const CELL_PX: usize = 6;

/// Least gradient of a pixel that is taken, grey values a pixel.
const LEAST_GRADIENT: f32 = 2.0;

/// Fewest pixels a registration may rest on.
const FEWEST_PIXELS: usize = 30;

/// Fewer pixels than this say by how much the picture has moved, not how it is turned and sheared: on few an
/// affine map follows what moves by itself.
const FEWEST_PIXELS_AFFINE: usize = 150;

/// The halving that a registration from a known place begins on.
const NEAR_LEVEL: usize = 1;

/// Most rounds a level, and the movement of the picture's corners that ends them, pixels.
const MAX_ROUNDS: usize = 20;
const CONVERGED_PX: f64 = 0.005;

/// How far the exhaustive search on the smallest picture looks, as a share of its sides.
const SEARCH: f64 = 0.2;

/// Residuals within this many scales count as explained.
const INLIER_SCALES: f64 = 2.5;

/// The scale of the residuals is at least this: the noise of footage, grey values.
const LEAST_SCALE: f64 = 1.0;

/// A registration that explains less than this share of its pixels is none.
const LEAST_INLIERS: f64 = 0.3;

/// … nor is one whose explained pixels differ by more than this, grey values: anything agrees with
/// anything when the scale is wide enough.
const LARGEST_SCALE: f64 = 20.0;

/// How one picture lies over another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// Takes coordinates of the first picture to those of the second, pixels.
    pub homography: Homography,
    /// Share of the pixels looked at that it explains, 0 to 1.
    pub inliers: f64,
    /// Robust scale of the residuals, grey values of 255.
    pub residual: f64,
}

/// Lays `from` over `to`. Pixels of `from` marked in `excluded` (one flag a pixel of the whole
/// picture) are not looked at. `None` when the sizes differ, the picture has too little texture, or
/// nothing fits (a cut, a blank frame).
#[must_use]
pub fn register(from: &Pyramid, to: &Pyramid, excluded: Option<&[bool]>) -> Option<Registration> {
    let pair = Pair::of(from, to, excluded)?;
    let top = from.levels().len() - 1;
    let coarse = &from.levels()[top];
    let (dx, dy) = coarse_shift(coarse, &to.levels()[top], &pair.hidden(coarse));
    pair.refined(top, Homography::translation(dx, dy))
}

/// The same for pictures of which it is known about how they lie: from there, without a search. A
/// `guess` that is off by more than some pixels is not found out of.
#[must_use]
pub fn register_near(
    from: &Pyramid,
    to: &Pyramid,
    excluded: Option<&[bool]>,
    guess: &Homography,
) -> Option<Registration> {
    let start = NEAR_LEVEL.min(from.levels().len() - 1);
    let scale = 0.5_f64.powi(start as i32);
    Pair::of(from, to, excluded)?.refined(start, guess.rescaled((scale, scale)))
}

/// Two pictures of one size, and what of the first is not looked at.
struct Pair<'a> {
    from: &'a Pyramid,
    to: &'a Pyramid,
    excluded: Option<&'a [bool]>,
}

impl<'a> Pair<'a> {
    fn of(from: &'a Pyramid, to: &'a Pyramid, excluded: Option<&'a [bool]>) -> Option<Self> {
        let excluded = excluded.filter(|e| e.len() == from.size().0 * from.size().1);
        (from.size() == to.size()).then_some(Self { from, to, excluded })
    }

    fn hidden(&self, level: &Level) -> Hidden<'a> {
        let whole_width = self.from.size().0;
        let factor = (whole_width / level.width).max(1);
        Hidden { excluded: self.excluded, whole_width, factor }
    }

    /// From level `first` up to the whole picture, beginning at `start` in pixels of that level.
    fn refined(&self, first: usize, start: Homography) -> Option<Registration> {
        let mut found = Registration { homography: start, inliers: 1.0, residual: 0.0 };
        for at in (0..=first).rev() {
            let (small, large) = (&self.from.levels()[at], &self.to.levels()[at]);
            if at < first {
                found.homography = found.homography.rescaled((2.0, 2.0));
            }
            let points = points(small, &self.hidden(small));
            if points.len() < FEWEST_PIXELS {
                // A small picture may have too little to say; the whole one has not.
                if at == 0 {
                    return None;
                }
                continue;
            }
            let model = match at {
                0 => Model::Homography,
                _ if points.len() < FEWEST_PIXELS_AFFINE => Model::Translation,
                _ => Model::Affine,
            };
            found = refine(&points, small, large, found.homography, model)?;
        }
        let good = found.inliers >= LEAST_INLIERS && found.residual <= LARGEST_SCALE;
        good.then_some(found)
    }
}

/// The shift in whole pixels of least mean absolute difference after the medians are taken off, over
/// all shifts of at most a fifth of the picture; of the pixels that are looked at.
fn coarse_shift(from: &Level, to: &Level, hidden: &Hidden) -> (f64, f64) {
    let (w, h) = (from.width as i64, from.height as i64);
    let reach = |side: i64| (side as f64 * SEARCH) as i64;
    let seen: Vec<(i64, i64, f32)> = (0..from.height)
        .flat_map(|y| (0..from.width).map(move |x| (x, y)))
        .filter(|&(x, y)| !hidden.at(x, y))
        .map(|(x, y)| (x as i64, y as i64, from.at(x, y)))
        .collect();
    let mut best = (f64::INFINITY, 0, 0);
    for dy in -reach(h)..=reach(h) {
        for dx in -reach(w)..=reach(w) {
            let difference = |&(x, y, here): &(i64, i64, f32)| {
                let (x, y) = (x + dx, y + dy);
                let inside = (0..w).contains(&x) && (0..h).contains(&y);
                inside.then(|| to.at(x as usize, y as usize) - here)
            };
            let mut differences: Vec<f32> = seen.iter().filter_map(difference).collect();
            let middle = median(&mut differences);
            let cost =
                differences.iter().map(|d| f64::from((d - middle).abs().min(40.0))).sum::<f64>()
                    / differences.len().max(1) as f64;
            // Ties go to the smaller shift.
            let cost = cost + 1e-9 * (dx * dx + dy * dy) as f64;
            if cost < best.0 {
                best = (cost, dx, dy);
            }
        }
    }
    (best.1 as f64, best.2 as f64)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Model {
    Translation,
    Affine,
    Homography,
}

impl Model {
    fn parameters(self) -> usize {
        match self {
            Model::Translation => 2,
            Model::Affine => 6,
            Model::Homography => 8,
        }
    }
}

/// A pixel that the registration looks at.
struct Point {
    x: f64,
    y: f64,
    value: f64,
    gradient: (f64, f64),
}

/// The pixels of one level that are not to be looked at.
struct Hidden<'a> {
    excluded: Option<&'a [bool]>,
    whole_width: usize,
    factor: usize,
}

impl Hidden<'_> {
    fn at(&self, x: usize, y: usize) -> bool {
        self.excluded.is_some_and(|e| {
            let (w, f) = (self.whole_width, self.factor);
            e[(y * f).min(e.len() / w - 1) * w + (x * f).min(w - 1)]
        })
    }
}

/// The pixel of strongest gradient of every cell.
fn points(level: &Level, hidden: &Hidden) -> Vec<Point> {
    let mut found = Vec::new();
    for top in (1..level.height.saturating_sub(1)).step_by(CELL_PX) {
        for left in (1..level.width.saturating_sub(1)).step_by(CELL_PX) {
            let mut best: Option<(f32, Point)> = None;
            // What is no stronger when squared is no stronger, and most is weak: few roots are taken. At first a little
            // less than the least, which the root itself decides.
            let mut most_sq = f64::from(LEAST_GRADIENT).powi(2) * 0.999;
            let right = (left + CELL_PX).min(level.width - 1);
            for y in top..(top + CELL_PX).min(level.height - 1) {
                let [above, here, below] =
                    [y - 1, y, y + 1].map(|y| &level.row(y)[left - 1..=right]);
                for at in 1..=right - left {
                    let gx = f64::from((here[at + 1] - here[at - 1]) / 2.0);
                    let gy = f64::from((below[at] - above[at]) / 2.0);
                    // In double precision nothing overflows, and no library has to be called.
                    let strength_sq = gx * gx + gy * gy;
                    if strength_sq <= most_sq {
                        continue;
                    }
                    let strength = strength_sq.sqrt() as f32;
                    let better = best.as_ref().is_none_or(|(most, _)| strength > *most);
                    let x = left + at - 1;
                    if strength >= LEAST_GRADIENT && better && !hidden.at(x, y) {
                        let (x, y) = (x as f64, y as f64);
                        let value = f64::from(here[at]);
                        best = Some((strength, Point { x, y, value, gradient: (gx, gy) }));
                        most_sq = strength_sq;
                    }
                }
            }
            found.extend(best.map(|(_, point)| point));
        }
    }
    found
}

/// Grey values by which the column of the gain is divided, to be of the other columns' size.
const GAIN_UNIT: f64 = 64.0;

/// Parameters of a homography, gain and offset.
const MOST_COLUMNS: usize = 10;

/// Rounds of Gauss–Newton on one level.
fn refine(
    points: &[Point],
    from: &Level,
    to: &Level,
    start: Homography,
    model: Model,
) -> Option<Registration> {
    // Coordinates of about ±1 keep the system well conditioned.
    let (cx, cy) = ((from.width as f64 - 1.0) / 2.0, (from.height as f64 - 1.0) / 2.0);
    let unit = cx.max(cy).max(1.0);
    let n = model.parameters() + 2;
    let rows: Vec<[f64; MOST_COLUMNS]> =
        points.iter().map(|p| row(p, (cx, cy, unit), model)).collect();
    let mut now = start;
    let mut residuals: Vec<Option<f64>> = vec![None; points.len()];
    // Gain and offset found so far, in the units of the last two columns.
    let mut light = (0.0, 0.0);
    let mut report = Registration { homography: start, inliers: 0.0, residual: 0.0 };
    for round in 0..=MAX_ROUNDS {
        let mut seen = Vec::with_capacity(points.len());
        for (residual, p) in residuals.iter_mut().zip(points) {
            let (x, y) = now.apply(p.x, p.y);
            let expected = p.value + light.0 * p.value / GAIN_UNIT + light.1;
            *residual = to.sample(x, y).map(|v| f64::from(v) - expected);
            seen.extend(residual.map(|r| r as f32));
        }
        if seen.len() < FEWEST_PIXELS {
            return None;
        }
        let middle = f64::from(median(&mut seen));
        let mut spread: Vec<f32> =
            seen.iter().map(|r| (f64::from(*r) - middle).abs() as f32).collect();
        // 1.4826 makes the median absolute deviation a standard deviation for a normal.
        let scale = (1.4826 * f64::from(median(&mut spread))).max(LEAST_SCALE);
        let within = seen.iter().filter(|r| {
            (f64::from(**r) - middle).abs() <= INLIER_SCALES * scale.min(LARGEST_SCALE)
        });
        report = Registration {
            homography: now,
            inliers: within.count() as f64 / points.len() as f64,
            residual: scale,
        };
        if round == MAX_ROUNDS {
            break;
        }
        let mut sums = [[0.0; MOST_COLUMNS]; MOST_COLUMNS];
        let mut right = [0.0; MOST_COLUMNS];
        for (row, residual) in rows.iter().zip(&residuals) {
            let Some(r) = *residual else { continue };
            let u = (r - middle) / (2.0 * scale);
            let weight = 1.0 / (1.0 + u * u).powi(2);
            // Whole rows, of which the first half counts: they are vectors then.
            for (a, sums) in sums.iter_mut().enumerate().take(n) {
                let wa = weight * row[a];
                right[a] += wa * r;
                sums.iter_mut().zip(row).for_each(|(sum, b)| *sum += wa * b);
            }
        }
        let mut normal = DMatrix::from_fn(n, n, |a, b| sums[a.max(b)][a.min(b)]);
        for a in 0..n {
            normal[(a, a)] += 1e-6 * (normal[(a, a)] + 1.0);
        }
        let right = DVector::from_column_slice(&right[..n]);
        let step = normal.cholesky()?.solve(&right);
        light = (light.0 + step[n - 2], light.1 + step[n - 1]);
        let change = Homography::from_matrix(change(&step, (cx, cy, unit), model))?;
        // I(W(x)) − T(x) ≈ J·δ says that T moved by δ looks like I: undo δ first, then W.
        let next = change.inverse().then(&now);
        let corners = [(0.0, 0.0), (2.0 * cx, 0.0), (0.0, 2.0 * cy), (2.0 * cx, 2.0 * cy)];
        let moved = corners
            .iter()
            .map(|&(x, y)| {
                let ((ax, ay), (bx, by)) = (now.apply(x, y), next.apply(x, y));
                (ax - bx).hypot(ay - by)
            })
            .fold(0.0, f64::max);
        if !moved.is_finite() {
            return None;
        }
        now = next;
        if moved < CONVERGED_PX && round > 0 {
            report.homography = now;
            break;
        }
    }
    Some(report)
}

/// Derivative of a pixel's value by the parameters of the warp at the identity, then by gain and
/// offset.
fn row(p: &Point, (cx, cy, unit): (f64, f64, f64), model: Model) -> [f64; MOST_COLUMNS] {
    let (x, y) = ((p.x - cx) / unit, (p.y - cy) / unit);
    let (gx, gy) = (p.gradient.0 * unit, p.gradient.1 * unit);
    let inward = -(gx * x + gy * y);
    let all = [gx, gy, gx * x, gx * y, gy * x, gy * y, inward * x, inward * y];
    let n = model.parameters();
    let mut row = [0.0; MOST_COLUMNS];
    row[..n].copy_from_slice(&all[..n]);
    (row[n], row[n + 1]) = (p.value / GAIN_UNIT, 1.0);
    row
}

/// The warp of a step, in pixels.
fn change(step: &DVector<f64>, (cx, cy, unit): (f64, f64, f64), model: Model) -> Matrix3<f64> {
    let mut m = Matrix3::identity();
    m[(0, 2)] = step[0];
    m[(1, 2)] = step[1];
    if model != Model::Translation {
        m[(0, 0)] += step[2];
        m[(0, 1)] = step[3];
        m[(1, 0)] = step[4];
        m[(1, 1)] += step[5];
    }
    if model == Model::Homography {
        m[(2, 0)] = step[6];
        m[(2, 1)] = step[7];
    }
    let to_unit =
        Matrix3::new(1.0 / unit, 0.0, -cx / unit, 0.0, 1.0 / unit, -cy / unit, 0.0, 0.0, 1.0);
    let to_pixels = Matrix3::new(unit, 0.0, cx, 0.0, unit, cy, 0.0, 0.0, 1.0);
    to_pixels * m * to_unit
}

fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth texture that no shift repeats.
    fn scene(x: f64, y: f64) -> f64 {
        let wave = |a: f64, b: f64, p: f64| (a * x + b * y + p).sin();
        127.0
            + 30.0 * wave(0.11, 0.05, 0.3)
            + 25.0 * wave(-0.07, 0.13, 1.7)
            + 20.0 * wave(0.031, -0.043, 2.2)
            + 15.0 * wave(0.23, 0.19, 0.9)
    }

    /// What is seen through `to_scene`, with an animal of its own texture at `animal` and noise.
    fn view(to_scene: &Homography, animal: (f64, f64), gain: f64) -> Pyramid {
        let (w, h) = (320, 200);
        let mut state = 7_u64;
        let grey: Vec<u8> = (0..w * h)
            .map(|at| {
                let (x, y) = ((at % w) as f64, (at / w) as f64);
                let (u, v) = to_scene.apply(x, y);
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let noise = (state >> 60) as f64 / 4.0 - 2.0;
                let beast = ((x - animal.0) / 60.0).hypot((y - animal.1) / 35.0) < 1.0;
                let value = if beast { 90.0 + 60.0 * (0.4 * x).sin() } else { scene(u, v) * gain };
                (value + noise).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        Pyramid::new(w, h, &grey).unwrap()
    }

    #[test]
    fn planted_motion_is_recovered_under_a_moving_animal() {
        for (h, gain) in [
            (Homography::translation(0.0, 0.0), 1.0),
            (Homography::translation(17.3, -6.8), 1.0),
            (Homography::translation(-30.2, 2.1), 1.1),
            (
                Homography::from_matrix(Matrix3::new(
                    1.02, 0.01, 5.5, -0.01, 1.02, 3.25, 2e-5, -1e-5, 1.0,
                ))
                .unwrap(),
                0.9,
            ),
        ] {
            // The second picture sees at h(x) what the first sees at x.
            let first = view(&Homography::identity(), (150.0, 110.0), 1.0);
            let second = view(&h.inverse(), (165.0, 104.0), gain);
            let found = register(&first, &second, None).unwrap();
            for (x, y) in
                [(40.0, 20.0), (280.0, 20.0), (40.0, 180.0), (280.0, 180.0), (160.0, 30.0)]
            {
                let (a, b) = (h.apply(x, y), found.homography.apply(x, y));
                let off = (a.0 - b.0).hypot(a.1 - b.1);
                assert!(off < 0.1, "off by {off} px at {x},{y}: {found:?}");
            }
        }
    }

    /// A camera goes along with an animal that fills a third of the picture and stands in it, before what passes.
    #[test]
    fn an_animal_that_stands_in_the_picture_does_not_hold_it() {
        let (w, h) = (320, 200);
        let animal = |x: f64, y: f64| ((x - 160.0) / 110.0).hypot((y - 100.0) / 60.0) < 1.0;
        let view = |shift: f64| {
            let grey: Vec<u8> = (0..w * h)
                .map(|at| {
                    let (x, y) = ((at % w) as f64, (at / w) as f64);
                    let coat = 60.0 + 55.0 * (0.13 * x).sin() * (0.11 * y).cos();
                    let ground = 127.0 + 0.7 * (scene(x + shift, y) - 127.0);
                    (if animal(x, y) { coat } else { ground }) as u8
                })
                .collect();
            Pyramid::new(w, h, &grey).unwrap()
        };
        let excluded: Vec<bool> =
            (0..w * h).map(|at| animal((at % w) as f64, (at / w) as f64)).collect();
        for shift in [-41.0, -18.0, 18.0, 41.0] {
            let found = register(&view(0.0), &view(shift), Some(&excluded)).unwrap();
            let dx = found.homography.apply(160.0, 20.0).0 - 160.0;
            assert!((dx + shift).abs() < 0.2, "{dx} for {shift}");
            let guess = Homography::translation(2.0 - shift, -1.0);
            let near = register_near(&view(0.0), &view(shift), Some(&excluded), &guess).unwrap();
            let dx = near.homography.apply(160.0, 20.0).0 - 160.0;
            assert!((dx + shift).abs() < 0.2, "{dx} for {shift}, told");
        }
    }

    #[test]
    fn what_cannot_be_registered_says_so() {
        let blank = Pyramid::new(64, 64, &[9; 64 * 64]).unwrap();
        assert!(register(&blank, &blank, None).is_none());
        let tiny = Pyramid::new(1, 1, &[9]).unwrap();
        assert!(register(&tiny, &tiny, None).is_none());
        assert!(register(&blank, &tiny, None).is_none());
        let scene = view(&Homography::identity(), (150.0, 110.0), 1.0);
        let everything = vec![true; 320 * 200];
        assert!(register(&scene, &scene, Some(&everything)).is_none());
    }

    #[test]
    fn a_cut_is_no_motion() {
        let first = view(&Homography::identity(), (150.0, 110.0), 1.0);
        let elsewhere = Homography::from_matrix(Matrix3::new(
            2.7, 1.3, 900.0, -1.3, 2.7, -700.0, 0.0, 0.0, 1.0,
        ))
        .unwrap();
        let second = view(&elsewhere, (10.0, 10.0), 1.0);
        assert!(register(&first, &second, None).is_none_or(|r| r.inliers < 0.7));
    }
}
