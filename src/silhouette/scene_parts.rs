//! Parts of a draft that belong to the scene: a fence of the coat's colour that the animal passes, a
//! patch of sand between its legs. Colour takes them along, and as they are near the animal in every
//! frame no other frame shows what is behind them; but they move as the camera does, and the animal
//! does not.
//!
//! What the camera's motion explains better than the animal's, over an area wider than a leg, is no part
//! of the animal. (A hoof on the ground moves with the scene too.) Where the two motions hardly differ
//! nothing can be told, and nothing is taken away; nor before a camera at rest, where the plate shows what
//! an animal that moves leaves behind.

use rayon::prelude::*;

use super::lab_image::Region;
use super::other_motion::Places;
use super::scene_evidence::Compared;
use super::warp::Source;
use crate::mask::{Mask, Run};

/// Over how wide an area the evidence is smoothed, and how wide a part of the scene must be, roots of
/// the area. Legs are thinner.
const SMOOTHED: f64 = 0.06;
const WIDE: f64 = 0.06;

/// Mean logarithm of the ratio of the two differences under which a place is the scene's.
const SCENE: f32 = -0.1;

/// The animal moves before the scene when its own motion explains at least this share of a draft better
/// than the camera's; else it may be at rest, and nothing can be told.
const LEAST_MOVING: f64 = 0.1;

/// A draft is the animal for certain when its motion explains this share of what stays.
const CERTAIN: f64 = 0.3;

/// Where at least one draft in so many is, others have to be connected to those from frame to frame, by
/// this share of the smaller one.
const SELDOM: usize = 4;
const CONNECTED: f64 = 0.3;

/// How good a draft is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// Made by colour alone.
    Guess,
    /// Made by all there is to go by.
    Draft,
}

impl Stage {
    /// Mean logarithm of the ratio over far frames as well up to which a place counts as one that stays
    /// where it is: an animal that turns on the spot does so for near frames only. Sand, of which one
    /// patch looks like the next, is explained by any motion.
    fn stays(self) -> f32 {
        match self {
            Self::Guess => 0.1,
            Self::Draft => -0.1,
        }
    }
}

/// A draft without what is the scene's.
struct Kept {
    mask: Mask,
    /// Whether it is the animal for certain.
    certain: bool,
}

/// The drafts without what belongs to the scene; empty where nothing else was drafted.
pub(super) fn without_scene(compared: &Compared, drafts: &[Mask], stage: Stage) -> Vec<Mask> {
    let sources = compared.sources();
    let kept: Vec<Kept> = drafts
        .par_iter()
        .enumerate()
        .map(|(t, draft)| {
            kept(compared, &sources, t, draft, stage)
                .unwrap_or_else(|| Kept { mask: draft.clone(), certain: false })
        })
        .collect();
    let animal = connected(&kept);
    let nothing = |mask: &Mask| Mask::new(mask.width(), mask.height());
    let or_nothing =
        |(kept, animal): (Kept, bool)| if animal { kept.mask } else { nothing(&kept.mask) };
    kept.into_iter().zip(animal).map(or_nothing).collect()
}

/// Which drafts are the animal: those that are for certain, and, as an animal at rest cannot be told from
/// the scene, what lies about where it was the frame before or is the frame after.
fn connected(kept: &[Kept]) -> Vec<bool> {
    let certain = kept.iter().filter(|k| k.certain).count();
    if certain == 0 || SELDOM * certain < kept.len() {
        // It hardly ever moves before the scene.
        return vec![true; kept.len()];
    }
    let mut animal: Vec<bool> = kept.iter().map(|k| k.certain).collect();
    let joined = |a: &Mask, b: &Mask| {
        let smaller = a.area().min(b.area()) as f64;
        a.common_area(b) as f64 >= CONNECTED * smaller
    };
    for t in 1..kept.len() {
        animal[t] |= animal[t - 1] && joined(&kept[t - 1].mask, &kept[t].mask);
    }
    for t in (1..kept.len()).rev() {
        animal[t - 1] |= animal[t] && joined(&kept[t].mask, &kept[t - 1].mask);
    }
    animal
}

/// `None` where nothing can be told.
fn kept(
    compared: &Compared,
    sources: &[Source],
    t: usize,
    draft: &Mask,
    stage: Stage,
) -> Option<Kept> {
    let small = draft.halved();
    let length = (small.area() as f64).sqrt();
    let region = Region::about(&small, (length / 4.0) as usize);
    let places = Places::of(&small);
    let evidence = compared.evidence(t, &small, &places, region, sources)?;
    let radius = |share: f64| ((share * length).round() as usize).max(1);
    let [near, far] = smoothed([&evidence.near, &evidence.far], &places, region, radius(SMOOTHED));
    let (w, h) = (small.width(), small.height());
    let mut scene = Mask::new(w, h);
    for_each_place(&places, region, |x, y, at| {
        if near[at] < SCENE && far[at] < stage.stays() {
            scene.set(x, y, true);
        }
    });
    let scene = scene.opened(radius(WIDE));
    let (mut moving, mut moving_left) = (0_usize, 0_usize);
    for_each_place(&places, region, |x, y, at| {
        let moves = near[at] > -SCENE;
        moving += usize::from(moves);
        moving_left += usize::from(moves && !scene.get(x, y));
    });
    if (moving as f64) < LEAST_MOVING * small.area() as f64 {
        return None;
    }
    let left = small.area() - scene.area();
    let there = |v: usize, most: usize| (v / 2).min(most - 1);
    let stays = |x: usize, y: usize| draft.get(x, y) && !scene.get(there(x, w), there(y, h));
    // Before a camera at rest what is near the animal in every frame has an animal that hardly moves.
    let mask = if scene.is_empty() || compared.is_still() {
        draft.clone()
    } else {
        Mask::from_fn(draft.width(), draft.height(), stays)
    };
    Some(Kept { mask, certain: moving_left as f64 >= CERTAIN * left.max(1) as f64 })
}

/// Tells each place and its index in a region.
fn for_each_place(places: &Places, region: Region, mut tell: impl FnMut(usize, usize, usize)) {
    for &Run { y, start: left, end: right } in &places.runs {
        for x in left..right {
            tell(x, y, (y - region.top) * region.width() + x - region.left);
        }
    }
}

/// Means of values at the places within `radius` of each, twice: close to a Gaussian. By the region.
fn smoothed(values: [&[f32]; 2], places: &Places, region: Region, radius: usize) -> [Vec<f32>; 2] {
    let sums = |value: &dyn Fn(usize) -> f32| {
        let mut plane = vec![0.0; region.pixels()];
        let mut next = 0..;
        for_each_place(places, region, |_, _, at| {
            plane[at] = next.next().map_or(0.0, value);
        });
        for _ in 0..2 {
            box_sums(&mut plane, region.width(), radius);
        }
        plane
    };
    let counts = sums(&|_| 1.0);
    values.map(|values| {
        let mut means = sums(&|at| values[at]);
        for (mean, n) in means.iter_mut().zip(&counts) {
            *mean /= n.max(1.0);
        }
        means
    })
}

/// Sums over squares of `2 radius + 1` about each place, in place.
fn box_sums(plane: &mut [f32], w: usize, radius: usize) {
    let h = plane.len() / w.max(1);
    let mut running = Vec::new();
    let mut along = |first: usize, step: usize, n: usize| {
        running.clear();
        let mut sum = 0.0_f64;
        running.push(sum);
        for at in 0..n {
            sum += f64::from(plane[first + at * step]);
            running.push(sum);
        }
        for at in 0..n {
            let (from, to) = (at.saturating_sub(radius), (at + radius + 1).min(n));
            plane[first + at * step] = (running[to] - running[from]) as f32;
        }
    };
    (0..h).for_each(|y| along(y * w, 1, w));
    (0..w).for_each(|x| along(x, w, h));
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    use super::super::lab_image::LabImage;
    use super::*;

    const SIZE: (usize, usize) = (240, 120);
    const FRAMES: usize = 40;

    /// A texture without structure, blurred so that half a pixel does not change it altogether.
    fn texture(x: i64, y: i64, seed: u64) -> u8 {
        let hash = |x: i64, y: i64| {
            let mixed = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
                ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
                ^ seed.wrapping_mul(0x1656_67B1_9E37_79F9);
            (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 56
        };
        let sum: u64 = (0..9).map(|at| hash((x + at % 3) >> 2, (y + at / 3) >> 2)).sum();
        (sum / 9) as u8
    }

    /// Where the animal is in a frame, and where the fence is, for a camera that moves `pan` pixels a
    /// frame to the right.
    fn animal(t: usize, speed: i64, x: usize, y: usize) -> bool {
        let left = 100 + (speed * t as i64 - speed * FRAMES as i64 / 2);
        (left..left + 50).contains(&(x as i64)) && (40..70).contains(&y)
    }

    fn fence(t: usize, pan: i64, x: usize, y: usize) -> bool {
        let left = 150 - pan * (t as i64 - FRAMES as i64 / 2);
        (left..left + 16).contains(&(x as i64)) && (30..90).contains(&y)
    }

    /// Frames of an animal of its own texture before a scene of another, with the camera's path.
    fn clip(pan: i64, speed: i64) -> (Vec<LabImage>, Vec<Matrix3<f64>>) {
        let (w, h) = SIZE;
        let frame = |t: usize| {
            let value = |at: usize| {
                let (x, y) = (at % w, at / w);
                let (cx, cy) = (x as i64, y as i64);
                if animal(t, speed, x, y) {
                    texture(cx - speed * t as i64, cy, 1)
                } else {
                    texture(cx + pan * t as i64, cy, 2)
                }
            };
            let flat = vec![128; w * h];
            LabImage::from_planes(w, h, [(0..w * h).map(value).collect(), flat.clone(), flat])
        };
        let path = |t: usize| {
            Matrix3::new(1.0, 0.0, -(pan * t as i64) as f64, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        };
        ((0..FRAMES).map(frame).collect(), (0..FRAMES).map(path).collect())
    }

    fn drafts(of: impl Fn(usize, usize, usize) -> bool) -> Vec<Mask> {
        (0..FRAMES).map(|t| Mask::from_fn(SIZE.0, SIZE.1, |x, y| of(t, x, y))).collect()
    }

    #[test]
    fn a_fence_that_was_taken_along_goes_and_the_animal_stays() {
        for (pan, speed) in [(3, 0), (2, -1), (1, 2)] {
            let (frames, path) = clip(pan, speed);
            let compared = Compared::of(&frames, &path, 24.0);
            let taken = drafts(|t, x, y| animal(t, speed, x, y) || fence(t, pan, x, y));
            for stage in [Stage::Guess, Stage::Draft] {
                let found = without_scene(&compared, &taken, stage);
                for (t, found) in found.iter().enumerate() {
                    let own = Mask::from_fn(SIZE.0, SIZE.1, |x, y| animal(t, speed, x, y));
                    let all = found.jaccard(&own);
                    assert!(all > 0.88, "{pan} {speed} {stage:?} {t}: {all}");
                }
            }
        }
    }

    #[test]
    fn drafts_stay_as_they_are_where_animal_or_camera_rest() {
        // Before a camera at rest whatever it does.
        for (pan, speed) in [(0, 0), (3, -3), (0, 2)] {
            let (frames, path) = clip(pan, speed);
            let taken = drafts(|t, x, y| animal(t, speed, x, y) || fence(t, pan, x, y));
            let found = without_scene(&Compared::of(&frames, &path, 24.0), &taken, Stage::Guess);
            assert!(found == taken, "{pan} {speed}");
        }
    }

    #[test]
    fn a_draft_of_the_scene_alone_is_no_draft() {
        let (frames, path) = clip(3, 0);
        let astray = |t: usize| (12..20).contains(&t);
        let taken =
            drafts(|t, x, y| if astray(t) { fence(t, 3, x, y) } else { animal(t, 0, x, y) });
        let found = without_scene(&Compared::of(&frames, &path, 24.0), &taken, Stage::Guess);
        for (t, (found, taken)) in found.iter().zip(&taken).enumerate() {
            if astray(t) {
                assert!(found.is_empty(), "{t}");
            } else {
                assert!(found.jaccard(taken) > 0.93, "{t}");
            }
        }
    }

    #[test]
    fn drafts_without_pixels_and_pictures_without_room_stay_as_they_are() {
        for (w, h) in [(1, 1), (3, 3), (40, 2)] {
            let flat = || vec![128; w * h];
            let frames = vec![LabImage::from_planes(w, h, [flat(), flat(), flat()]); 12];
            let compared = Compared::of(&frames, &[Matrix3::identity(); 12], 24.0);
            let mut taken = vec![Mask::from_fn(w, h, |_, _| true); 12];
            taken[4] = Mask::new(w, h);
            assert_eq!(without_scene(&compared, &taken, Stage::Draft), taken);
        }
    }

    proptest! {
        /// Against adding up every square.
        #[test]
        fn sums_over_squares_are_those_of_the_definition(
            (w, plane) in (1_usize..9, 1_usize..9).prop_flat_map(|(w, h)| {
                (Just(w), proptest::collection::vec(-4.0..4.0_f32, w * h))
            }),
            radius in 0_usize..5,
        ) {
            let mut found = plane.clone();
            box_sums(&mut found, w, radius);
            for (at, found) in found.into_iter().enumerate() {
                let near = |other: &usize| {
                    (other % w).abs_diff(at % w) <= radius && (other / w).abs_diff(at / w) <= radius
                };
                let wanted: f32 = (0..plane.len()).filter(near).map(|other| plane[other]).sum();
                prop_assert!((found - wanted).abs() < 1e-3, "{found} {wanted}");
            }
        }
    }
}
