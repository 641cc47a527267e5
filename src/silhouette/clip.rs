//! A clip's silhouettes from two rectangles: seen once front to back, drafted as a whole, outlined
//! frame by frame.
//!
//! A long clip is worked through in stretches of at most [`STRETCH_FRAMES`] frames, so that memory
//! is bounded; each begins with the colours of the first frame and the place where the stretch
//! before it left the animal.

use std::borrow::{Borrow, Cow};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::base_drafts::BaseDrafts;
use super::correction::Labels;
use super::drafts::{Clip, Corrected, Drafted};
use super::enlarged::enlarged;
use super::frame_report::{Flag, FrameReport, report_of_corrected_mask, report_of_mask};
use super::lab_image::LabImage;
use super::light::light;
use super::outline::outline;
use super::reduced::{sized, sized_picture};
use super::segmenter::{Chosen, Parts, Segmenter, Settings};
use crate::error::Result;
use crate::image::{Frame, Picture, Rectangle};
use crate::mask::{Connectivity, Mask, components};
use crate::motion::{CameraPath, Pyramid, follow};
use crate::numeric::GridCut;

/// Most frames of a stretch: their sketches and plates take up to .9 MB a frame.
pub const STRETCH_FRAMES: usize = 240;

/// Most pixels of a sketch, the size at which the clip is worked through as a whole.
const SKETCH_PIXELS: usize = 110_000;

/// Most pixels of the size at which outlines are cut; larger footage has its outline found there
/// and drawn smoothly at its own size.
const OUTLINE_PIXELS: usize = 4 * SKETCH_PIXELS;

/// How far beyond the first guess pixels are kept out of the camera's estimate, as a share of the
/// sketch's diagonal.
const CAMERA_MARGIN: f64 = 0.01;

/// Under this confidence an outline is flagged.
const LEAST_CONFIDENCE: f64 = 0.5;

/// Segments one clip.
pub struct ClipSegmenter {
    guess: Segmenter,
    size: (usize, usize),
    sketch: (usize, usize),
    fine: (usize, usize),
    seed: u64,
    fps: f64,
    /// Index of the stretch's first frame.
    first: usize,
    frames: Vec<LabImage>,
    guesses: Vec<Mask>,
    /// The guessing as it was before the stretch, for when its light turns out to change.
    guess_before: Segmenter,
    /// The light of each frame of the stretch, where it changes; the frames are relit then.
    light: Option<Vec<f32>>,
    /// What a person said, at the footage's size, by frame of the clip.
    labels: BTreeMap<usize, Labels>,
    /// The last frame of the stretch before, which the camera is followed from.
    before: Option<(LabImage, Mask)>,
    /// The drafts without corrections, and with the corrections.
    base: Option<Arc<Drafted>>,
    drafted: Option<Arc<Drafted>>,
    /// The stretch's camera, pixels of the sketch, and the whole clip's, pixels of the footage.
    path: CameraPath,
    camera: CameraPath,
    /// What an earlier run left of the stretch, and the frames whose drafts are wanted.
    recalled: Option<BaseDrafts>,
    wanted: Vec<bool>,
}

impl ClipSegmenter {
    /// From the first picture, which still has to be observed. `labels` is what a person said, by
    /// frame.
    ///
    /// # Errors
    /// As [`super::ColourModels::fit`].
    pub fn new(
        first: &Picture,
        foreground: Rectangle,
        background: Rectangle,
        fps: f64,
        settings: &Settings,
        labels: BTreeMap<usize, Labels>,
    ) -> Result<Self> {
        let size = (first.width(), first.height());
        let sketch = within(size, SKETCH_PIXELS);
        let guess = Segmenter::new(first, foreground, background, settings)?.on_size(sketch, size);
        Ok(Self {
            guess_before: guess.clone(),
            light: None,
            guess,
            size,
            sketch,
            fine: within(size, OUTLINE_PIXELS),
            seed: settings.colour.seed,
            fps,
            first: 0,
            frames: Vec::new(),
            guesses: Vec::new(),
            labels,
            before: None,
            base: None,
            drafted: None,
            path: CameraPath::default(),
            camera: CameraPath::default(),
            recalled: None,
            wanted: Vec::new(),
        })
    }

    /// Takes in the next pictures of a stretch: frames [at the size of outlines](Self::at_outline_size),
    /// or whole ones. The first after a draft begin the next one.
    pub fn observe<P: Borrow<Picture> + Sync>(&mut self, pictures: &[P]) {
        if self.drafted.take().is_some() {
            self.base = None;
            self.first += self.frames.len();
            self.before = self.frames.pop().zip(self.guesses.pop());
            self.frames.clear();
            self.guesses.clear();
            self.light = None;
            self.guess_before = self.guess.clone();
        }
        let look = |picture: &P| {
            let small = sized_picture(picture.borrow(), self.sketch);
            (self.guess.rough_parts(&small), LabImage::of(&small))
        };
        let seen: Vec<(Parts, LabImage)> = pictures.par_iter().map(look).collect();
        let (parts, frames): (Vec<Parts>, Vec<LabImage>) = seen.into_iter().unzip();
        self.frames.extend(frames);
        let guesses = guessed(&mut self.guess, parts);
        self.guesses.extend(guesses);
    }

    /// Replaces what a person said; the next [`draft`](Self::draft) goes by it.
    pub fn correct(&mut self, labels: BTreeMap<usize, Labels>) {
        self.labels = labels;
    }

    /// Takes over what an earlier run with other corrections knew of the observed stretch, so that the
    /// next [`draft`](Self::draft) only works over the stretches between corrections that hold a
    /// `wanted` frame (one entry a frame). Only wanted frames can be outlined then. Without corrections
    /// the drafts are made anew, unless no frame is wanted.
    pub fn recall(&mut self, base: BaseDrafts, wanted: Vec<bool>) {
        let frames = self.frames.len();
        let corrected = self.labels.range(self.first..self.first + frames).next().is_some();
        let useful = corrected || !wanted.contains(&true);
        let fits = base.masks.len() == frames
            && base.path.steps().len() == frames
            && wanted.len() == frames
            && base.masks.iter().all(|m| (m.width(), m.height()) == self.sketch);
        if fits && useful {
            self.recalled = Some(base);
            self.wanted = wanted;
        }
    }

    /// What a later run with other corrections can [`recall`](Self::recall) of the stretch drafted
    /// last.
    #[must_use]
    pub fn base(&self) -> Option<BaseDrafts> {
        let masks: Vec<Mask> = self.base.as_ref()?.frames.iter().map(|d| d.mask.clone()).collect();
        (masks.len() == self.frames.len()).then(|| BaseDrafts { path: self.path.clone(), masks })
    }

    /// Works the observed stretch through; a second time only the corrections. `step` is told how
    /// many of how many parts of the work under way are done and stops it by `false`; then this
    /// returns `false`, and the stretch has no outlines.
    pub fn draft(&mut self, step: &dyn Fn(usize, usize) -> bool) -> bool {
        let fresh = self.base.is_none();
        let recalled = self.recalled.take();
        let wanted = std::mem::take(&mut self.wanted);
        if fresh {
            self.path = match &recalled {
                Some(base) => base.path.clone(),
                None => self.settled_camera(),
            };
            self.take_light_out();
            let scale = |whole: usize, sketch: usize| whole as f64 / sketch as f64;
            let up = (scale(self.size.0, self.sketch.0), scale(self.size.1, self.sketch.1));
            self.camera.extend(&self.path.rescaled(up));
        }
        let clip = self.clip();
        let go_on = Cell::new(true);
        let told = |done: usize, all: usize| {
            go_on.set(go_on.get() && step(done, all));
            go_on.get()
        };
        let known = recalled.is_some();
        if let Some(base) = recalled {
            self.base = Some(Arc::new(Drafted::remembered(base.masks)));
        } else if fresh {
            self.base = Some(clip.drafted(&self.guesses, &told));
        }
        let wanted = |t: usize| wanted.get(t).copied().unwrap_or(true);
        let mut found = self.base.as_ref().map(|base| clip.corrected(base, &wanted, &told));
        if known && matches!(found, Some(Corrected::InPart(_))) {
            // The frames that keep their base drafts need more of them than was remembered.
            let base = clip.drafted(&self.guesses, &told);
            found = Some(clip.corrected(&base, &wanted, &told));
            self.base = Some(base);
        }
        self.drafted = match found {
            Some(Corrected::Done(drafted) | Corrected::InPart(drafted)) => Some(drafted),
            Some(Corrected::Stopped) | None => None,
        };
        self.frames = clip.frames;
        if !go_on.get() {
            self.base = None;
            self.drafted = None;
        }
        go_on.get()
    }

    /// Makes the light of all frames that of the clip's first, where it changes, and guesses anew.
    fn take_light_out(&mut self) {
        let before = self.before.as_ref().map(|(frame, _)| frame);
        let Some(found) = light(&self.frames, before, self.path.steps()) else { return };
        self.frames =
            self.frames.par_iter().zip(&found).map(|(frame, light)| frame.relit(*light)).collect();
        let before = &self.guess_before;
        let parts = self.frames.par_iter().map(|frame| before.rough_parts_of_lab(frame)).collect();
        self.guess = self.guess_before.clone();
        self.guesses = guessed(&mut self.guess, parts);
        self.light = Some(found);
    }

    /// The observed stretch at sketch size; its frames are lent out until they are put back.
    fn clip(&mut self) -> Clip {
        let range = self.first..self.first + self.frames.len();
        let labels = self.labels.range(range);
        Clip {
            labels: labels.map(|(t, l)| (t - self.first, l.resized(self.sketch))).collect(),
            frames: std::mem::take(&mut self.frames),
            from_first: self.path.from_first().iter().map(|m| *m.matrix()).collect(),
            fps: self.fps,
            seed: self.seed,
        }
    }

    /// The camera's motion, without the estimate's own drift where it stands still.
    fn settled_camera(&self) -> CameraPath {
        let camera = self.follow_camera();
        if camera.is_static(self.sketch) { camera.stilled() } else { camera }
    }

    /// The camera's motion over all stretches drafted so far, pixels of the footage.
    #[must_use]
    pub fn camera(&self) -> &CameraPath {
        &self.camera
    }

    /// Width and height at which outlines are cut, pixels.
    #[must_use]
    pub fn outline_size(&self) -> (usize, usize) {
        self.fine
    }

    /// A frame of the clip at the size at which outlines are cut: all that
    /// [`observe`](Self::observe) and [`outline`](Self::outline) need of it.
    #[must_use]
    pub fn at_outline_size<'a>(&self, frame: &'a Frame) -> Cow<'a, Picture> {
        sized(frame, self.fine)
    }

    /// The silhouette of frame `t` of the clip, which lies in the stretch drafted last, and what is
    /// known of it. Frames can be outlined in any order and side by side.
    #[must_use]
    pub fn outline(&self, t: usize, picture: &Picture, cut: &mut GridCut) -> (Mask, FrameReport) {
        let labels = self.labels.get(&t);
        if let Some(whole) = labels.filter(|l| l.is_whole()) {
            return (whole.animal.clone(), report_of_corrected_mask(t, &whole.animal));
        }
        let draft = self.drafted.as_ref().and_then(|d| {
            let draft = d.frames.get(t.checked_sub(self.first)?)?;
            Some((draft, d.cues.get(draft.cues)?))
        });
        let Some((draft, cues)) = draft else {
            let mask = Mask::new(self.size.0, self.size.1);
            let report = report_of_mask(t, &mask);
            return (mask, report);
        };
        let fine_labels = labels.map(|l| l.resized(self.fine));
        let picture = sized_picture(picture, self.fine);
        let light = self.light.as_ref().and_then(|light| light.get(t - self.first)).copied();
        let (mask, confidence) = outline(&picture, draft, cues, fine_labels.as_ref(), light, cut);
        let mut mask = enlarged(&mask, self.size);
        if let Some(labels) = labels {
            mask = labels.applied_to(&mask);
        }
        let mut report = match labels {
            Some(_) => report_of_corrected_mask(t, &mask),
            None => FrameReport { confidence, ..report_of_mask(t, &mask) },
        };
        let pieces = components(&mask, Connectivity::Eight).len();
        if pieces > 1 {
            report.flags.insert(Flag::SeveralPieces);
        }
        if labels.is_none() && !mask.is_empty() && confidence < LEAST_CONFIDENCE {
            report.flags.insert(Flag::LowConfidence);
        }
        (mask, report)
    }

    /// The camera's motion from frame to frame, without what the first guess takes for the animal.
    fn follow_camera(&self) -> CameraPath {
        let (w, h) = self.sketch;
        let margin = (CAMERA_MARGIN * (w as f64).hypot(h as f64)).round() as usize;
        let before = self.before.as_ref().map(|(frame, guess)| (frame, guess));
        let all: Vec<(&LabImage, &Mask)> =
            before.into_iter().chain(self.frames.iter().zip(&self.guesses)).collect();
        let pyramids: Vec<Option<Pyramid>> =
            all.par_iter().map(|(frame, _)| Pyramid::new(w, h, &frame.planes()[0])).collect();
        let registrations = follow(&pyramids, |t| {
            let animal = all[t].1.dilated(margin);
            (0..w * h).map(|at| animal.get(at % w, at / w)).collect()
        });
        let mut path = CameraPath::default();
        if before.is_none() {
            path.push(None);
        }
        for registration in registrations {
            path.push(registration);
        }
        path
    }
}

/// The silhouettes guessed of the next frames: the choice alone goes in order.
fn guessed(guess: &mut Segmenter, parts: Vec<Parts>) -> Vec<Mask> {
    let chosen: Vec<Chosen> = parts.into_iter().map(|p| guess.choose(p)).collect();
    let guess = &*guess;
    chosen.par_iter().map(|chosen| guess.silhouette(chosen).0).collect()
}

fn within(size: (usize, usize), most: usize) -> (usize, usize) {
    let pixels = size.0 * size.1;
    if pixels <= most {
        return size;
    }
    let scale = (most as f64 / pixels as f64).sqrt();
    let side = |s: usize| ((s as f64 * scale) as usize).max(1);
    (side(size.0), side(size.1))
}
