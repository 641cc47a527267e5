//! What a clip says about where the places of a draft belong: to the scene, which moves as the camera
//! does, or to the animal, which moves by itself.
//!
//! A frame is compared with a few near ones twice: laid over them by the camera's motion, and by the one
//! other motion that explains best what of the draft the camera's does not. It is compared with far ones
//! by the camera's motion alone.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::lab_image::{LabImage, Region};
use super::other_motion::{LEVELS, MOST, Places, Reduced, around, best_shift, difference, shifted};
use super::plate::REFERENCE_FPS;
use super::warp::{Source, Warped};
use crate::mask::{Mask, Run};

/// Frames before and after that a frame is compared with, for footage at [`REFERENCE_FPS`]: in the
/// near ones the animal's pose has changed little, in the far ones no part of it is where it was.
const NEAR: [usize; 2] = [4, 8];
const FAR: [usize; 3] = [16, 24, 32];

/// How far the animal is looked for from where the camera's motion would have it, along and across,
/// roots of its area a frame of [`REFERENCE_FPS`]: a gallop is some .12.
const SPEED_ALONG: f64 = 0.15;
const SPEED_ACROSS: f64 = 0.04;

/// Two motions tell something when they part by this many pixels of the sketch.
const LEAST_PARTING_PX: f64 = 3.0;

/// The frames of a clip as they are compared.
pub(super) struct Compared {
    frames: Vec<Reduced>,
    /// Takes coordinates of the first frame to those of each frame, and back, pixels of half the sketch.
    from_first: Vec<Matrix3<f64>>,
    to_first: Vec<Option<Matrix3<f64>>>,
    /// Offsets of near and far frames.
    near: Vec<usize>,
    far: Vec<usize>,
    /// Frames of [`REFERENCE_FPS`] a frame.
    pace: f64,
}

/// Logarithms of the ratio of two differences at each place of a draft: from what the camera's motion
/// brings there, in the middle of near frames, and of near and far ones, and from what the animal's
/// motion does, in the middle of near ones. Negative where the scene explains it better.
pub(super) struct SceneEvidence {
    pub(super) near: Vec<f32>,
    pub(super) far: Vec<f32>,
}

impl Compared {
    /// `from_first` takes coordinates of the first frame to those of each, pixels of the frames.
    pub(super) fn of(frames: &[LabImage], from_first: &[Matrix3<f64>], fps: f64) -> Self {
        let from_first: Vec<Matrix3<f64>> = from_first.iter().map(halved).collect();
        let stretch = (fps / REFERENCE_FPS).max(1.0);
        let offset = |o: &usize| (*o as f64 * stretch).round() as usize;
        Self {
            frames: frames.par_iter().map(Reduced::of).collect(),
            to_first: from_first.iter().map(|m| m.try_inverse()).collect(),
            from_first,
            near: NEAR.iter().map(offset).collect(),
            far: FAR.iter().map(offset).collect(),
            pace: 1.0 / stretch,
        }
    }

    /// Whether the camera is at rest.
    pub(super) fn is_still(&self) -> bool {
        self.from_first.iter().all(|m| *m == Matrix3::identity())
    }

    /// The frames at half the size, to be laid over one another.
    pub(super) fn sources(&self) -> Vec<Source<'_>> {
        let of = |frame: &'_ Reduced| (frame.levels[0].width(), frame.levels[0].height());
        let nowhere = self.frames.first().map(of).map_or(Mask::new(1, 1), |(w, h)| Mask::new(w, h));
        self.frames.iter().map(|f| Source::of(&f.levels[0], &nowhere)).collect()
    }

    /// `None` where the animal moves with the scene.
    pub(super) fn evidence(
        &self,
        t: usize,
        draft: &Mask,
        places: &Places,
        region: Region,
        sources: &[Source],
    ) -> Option<SceneEvidence> {
        let back = self.to_first[t]?;
        // Between fewer pixels than two by two nothing can be interpolated.
        if draft.width().min(draft.height()) < 2 {
            return None;
        }
        let own = self.frames[t].levels[0].cropped(region);
        let centre = draft.centre_of_mass()?;
        let at_levels = levels_of(draft, places);
        let mut of_scene: Vec<Vec<u16>> = Vec::new();
        let mut of_animal: Vec<Vec<u16>> = Vec::new();
        for s in self.frames_at(t, &self.near) {
            let camera = self.from_first[s] * back;
            let with_camera = differences(&own, &sources[s], &camera, region);
            let by_camera = displacement(&camera, centre);
            let shift = self.other_motion(
                t,
                s,
                &at_levels,
                by_camera,
                &gathered(&with_camera, places, region),
            )?;
            let parting = (shift.0 as f64 - by_camera.0).hypot(shift.1 as f64 - by_camera.1);
            if 2.0 * parting >= LEAST_PARTING_PX {
                let mut found = Vec::new();
                let pictures = (&self.frames[t].levels[0], &self.frames[s].levels[0]);
                shifted(pictures.0, pictures.1, places, shift, &mut found);
                of_animal.push(found);
            }
            of_scene.push(with_camera);
        }
        if of_animal.is_empty() {
            return None;
        }
        let noise = noise(&of_scene, draft, region);
        let mut of_scene: Vec<Vec<u16>> =
            of_scene.iter().map(|d| gathered(d, places, region)).collect();
        let log: Vec<f32> = (0..=MOST).map(|d| f32::from(d + noise).ln()).collect();
        let animal = middles(&of_animal);
        let ratios = |scene: &[Vec<u16>]| -> Vec<f32> {
            let of = |(scene, animal): (u16, &u16)| {
                if scene > MOST { 0.0 } else { log[usize::from(scene)] - log[usize::from(*animal)] }
            };
            middles(scene).into_iter().zip(&animal).map(of).collect()
        };
        let near = ratios(&of_scene);
        for s in self.frames_at(t, &self.far) {
            let with_camera = differences(&own, &sources[s], &(self.from_first[s] * back), region);
            of_scene.push(gathered(&with_camera, places, region));
        }
        Some(SceneEvidence { near, far: ratios(&of_scene) })
    }

    fn frames_at(&self, t: usize, offsets: &[usize]) -> Vec<usize> {
        let before = offsets.iter().filter_map(|o| t.checked_sub(*o));
        let after = offsets.iter().map(|o| t + o).filter(|s| *s < self.frames.len());
        before.chain(after).collect()
    }

    /// The displacement from frame `t` to frame `s`, pixels of half the sketch, that explains best what
    /// the camera's motion does not: looked for at an eighth of the size, then more finely.
    fn other_motion(
        &self,
        t: usize,
        s: usize,
        at_levels: &[Places; LEVELS],
        by_camera: (f64, f64),
        with_camera: &[u16],
    ) -> Option<(i64, i64)> {
        let frames = t.abs_diff(s) as f64 * self.pace;
        let length = (at_levels[LEVELS - 1].count() as f64).sqrt();
        let reach = |speed: f64| (speed * frames * length).ceil() as i64;
        let mut found = None;
        let mut explained = Vec::new();
        for level in (0..LEVELS).rev() {
            let pictures = (&self.frames[t].levels[level], &self.frames[s].levels[level]);
            let places = &at_levels[level];
            let scale = f64::from(1_u32 << level);
            let camera =
                ((by_camera.0 / scale).round() as i64, (by_camera.1 / scale).round() as i64);
            if level == 0 {
                explained.clear();
                explained.extend(with_camera.iter().map(|d| (*d).min(MOST)));
            } else {
                shifted(pictures.0, pictures.1, places, camera, &mut explained);
            }
            found = match found {
                None => {
                    let shifts = around(camera, reach(SPEED_ALONG), reach(SPEED_ACROSS));
                    best_shift(pictures, places, &explained, shifts)
                }
                Some((dx, dy)) => {
                    best_shift(pictures, places, &explained, around((2 * dx, 2 * dy), 1, 1))
                }
            };
            found?;
        }
        found
    }
}

/// The places of a draft at each size, from those at the first.
fn levels_of(draft: &Mask, places: &Places) -> [Places; LEVELS] {
    let quarter = draft.halved();
    [places.clone(), Places::of(&quarter), Places::of(&quarter.halved())]
}

/// Differences of a part of a frame from another one laid over it, up to [`MOST`]; more where the other
/// one has nothing.
fn differences(
    own: &LabImage,
    other: &Source,
    to_other: &Matrix3<f64>,
    region: Region,
) -> Vec<u16> {
    let warped = Warped::of(other, to_other, region);
    let pairs = |c: usize| own.planes()[c].iter().zip(&warped.image.planes()[c]);
    let channels = pairs(0).zip(pairs(1)).zip(pairs(2)).zip(&warped.outside);
    channels.map(|(((l, a), b), outside)| difference(l, a, b).max(u16::from(*outside))).collect()
}

/// The values of a region at the places.
fn gathered(of_region: &[u16], places: &Places, region: Region) -> Vec<u16> {
    let mut values = Vec::with_capacity(places.count());
    for &Run { y, start: left, end: right } in &places.runs {
        let row = (y - region.top) * region.width();
        values.extend_from_slice(&of_region[row + left - region.left..row + right - region.left]);
    }
    values
}

/// The middle one of the differences at each place, of those that are known; above [`MOST`] where none
/// is.
fn middles(of: &[Vec<u16>]) -> Vec<u16> {
    let mut known = Vec::new();
    (0..of.first().map_or(0, Vec::len))
        .map(|at| {
            known.clear();
            known.extend(of.iter().map(|differences| differences[at]).filter(|d| *d <= MOST));
            known.sort_unstable();
            known.get(known.len() / 2).copied().unwrap_or(MOST + 1)
        })
        .collect()
}

/// What the scene differs by from itself: the median about the draft, and one.
fn noise(with_camera: &[Vec<u16>], draft: &Mask, region: Region) -> u16 {
    let near = draft.dilated(2);
    let mut counts = [0_usize; MOST as usize + 1];
    for y in region.top..region.bottom {
        for x in (region.left..region.right).filter(|x| !near.get(*x, y)) {
            let at = (y - region.top) * region.width() + x - region.left;
            for differences in with_camera {
                if let Some(count) = counts.get_mut(usize::from(differences[at])) {
                    *count += 1;
                }
            }
        }
    }
    let all: usize = counts.iter().sum();
    let mut below = 0;
    let median = counts.iter().position(|count| {
        below += count;
        2 * below >= all
    });
    median.map_or(1, |d| d as u16 + 1)
}

/// The same motion of pictures of half the size, whose first pixel lies between the first two.
fn halved(m: &Matrix3<f64>) -> Matrix3<f64> {
    let up = Matrix3::new(2.0, 0.0, 0.5, 0.0, 2.0, 0.5, 0.0, 0.0, 1.0);
    let down = Matrix3::new(0.5, 0.0, -0.25, 0.0, 0.5, -0.25, 0.0, 0.0, 1.0);
    down * m * up
}

/// How far a motion moves a point.
fn displacement(m: &Matrix3<f64>, (x, y): (f64, f64)) -> (f64, f64) {
    let p = m * Vector3::new(x, y, 1.0);
    (p.x / p.z - x, p.y / p.z - y)
}
