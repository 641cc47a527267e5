//! Footage of the horse, with the truth beside it.

use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::camera::{Camera, Projection, View};
use super::gaits::{Gait, StridePose};
use super::horse::horse;
use super::raster::silhouette;
use super::scene::{Canvas, SENSOR_NOISE};
use crate::error::Result;
use crate::frames::FrameSource;
use crate::image::{Picture, Rectangle};
use crate::mask::Mask;
use crate::rig::Model;

/// Most frames that are drawn side by side.
const MOST_AHEAD: usize = 8;

/// Footage whose pictures take more bytes than this is drawn anew each time it is read.
const MOST_KEPT_BYTES: usize = 64 << 20;

/// What is filmed and how.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SyntheticSettings {
    /// Number of frames.
    pub frames: usize,
    /// Frames a second.
    pub fps: f64,
    /// Frames a stride.
    pub frames_per_stride: f64,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Camera yaw, radians.
    pub yaw_rad: f64,
    /// Seed of background and sensor noise.
    pub seed: u64,
}

impl Default for SyntheticSettings {
    fn default() -> Self {
        Self {
            frames: 100,
            fps: 25.0,
            frames_per_stride: 24.3,
            width: 320,
            height: 240,
            yaw_rad: 0.0,
            seed: 42,
        }
    }
}

/// The horse in a gait, filmed by a camera that pans along with it. Clones share the pictures that
/// any of them has drawn.
#[derive(Clone, Debug)]
pub struct SyntheticFootage {
    gait: Gait,
    settings: SyntheticSettings,
    model: Model,
    camera: Camera,
    next: usize,
    end: usize,
    /// The pictures drawn so far; no places for them in footage that is too large.
    kept: Arc<[OnceLock<Picture>]>,
    /// The frames from `next` on that are drawn already, and how many are drawn next time: one at
    /// first, since often one is all that is wanted.
    drawn: VecDeque<Picture>,
    ahead: usize,
}

impl SyntheticFootage {
    /// Sets up the camera; nothing is drawn yet.
    #[must_use]
    pub fn new(gait: Gait, settings: SyntheticSettings) -> Self {
        let model = horse();
        let view = View {
            yaw_rad: settings.yaw_rad,
            projection: Projection::Orthographic,
            width: settings.width,
            height: settings.height,
        };
        let stride: Vec<_> =
            (0..24).map(|i| gait.pose(&model.skeleton, f64::from(i) / 24.0).pose).collect();
        let camera = Camera::framing(&model, &stride, view);
        let bytes = settings.frames.saturating_mul(3 * settings.width * settings.height);
        let kept = if bytes <= MOST_KEPT_BYTES { settings.frames } else { 0 };
        Self {
            gait,
            settings,
            model,
            camera,
            next: 0,
            end: settings.frames,
            kept: (0..kept).map(|_| OnceLock::new()).collect(),
            drawn: VecDeque::new(),
            ahead: 1,
        }
    }

    /// Reads only the frames from `first` to `last`, both included.
    #[must_use]
    pub fn with_range(mut self, first: usize, last: usize) -> Self {
        self.end = self.settings.frames.min(last.saturating_add(1));
        self.next = first.min(self.end);
        self.drawn.clear();
        self
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &SyntheticSettings {
        &self.settings
    }

    /// The gait that is filmed.
    #[must_use]
    pub fn gait(&self) -> Gait {
        self.gait
    }

    /// The rig that is filmed.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// True phase of a frame, cycles of the stride.
    #[must_use]
    pub fn phase_cycles(&self, frame: usize) -> f64 {
        frame as f64 / self.settings.frames_per_stride
    }

    /// True pose of a frame.
    #[must_use]
    pub fn truth(&self, frame: usize) -> StridePose {
        self.gait.pose(&self.model.skeleton, self.phase_cycles(frame))
    }

    /// True silhouette of a frame.
    #[must_use]
    pub fn true_mask(&self, frame: usize) -> Mask {
        silhouette(&self.model, &self.truth(frame).pose, &self.camera)
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The picture of a frame.
    #[must_use]
    pub fn picture(&self, frame: usize) -> Picture {
        match self.kept.get(frame) {
            Some(kept) => kept.get_or_init(|| self.draw(frame)).clone(),
            None => self.draw(frame),
        }
    }

    fn draw(&self, frame: usize) -> Picture {
        // One stride's way in pixels, at the speed of the stance feet.
        let way = self.gait.speed_m_s() * self.gait.stride_s() * self.camera.pixels_per_unit();
        let shift = way * self.phase_cycles(frame) * self.settings.yaw_rad.cos();
        let pose = self.truth(frame).pose;
        let (width, height, seed) = (self.settings.width, self.settings.height, self.settings.seed);
        let mut canvas = Canvas::background(width, height, shift, seed);
        canvas.animal(&self.model, &pose, &self.camera);
        canvas.exposed(SENSOR_NOISE, seed, frame)
    }

    /// Rectangles as a user would draw them on the first frame: inside the trunk, and clear of the
    /// animal over the whole height at the picture's left or right border (whichever is wider).
    #[must_use]
    pub fn rectangles(&self) -> (Rectangle, Rectangle) {
        let mask = self.true_mask(0);
        (inside(&mask), clear(&mask))
    }
}

impl FrameSource for SyntheticFootage {
    fn width(&self) -> usize {
        self.settings.width
    }

    fn height(&self) -> usize {
        self.settings.height
    }

    fn fps(&self) -> Option<f64> {
        Some(self.settings.fps)
    }

    fn frame_count(&self) -> Option<usize> {
        Some(self.end - self.next)
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        if self.next >= self.end {
            return Ok(None);
        }
        if self.drawn.is_empty() {
            let frames = self.next..self.end.min(self.next + self.ahead);
            let drawn: Vec<Picture> = frames.into_par_iter().map(|t| self.picture(t)).collect();
            self.drawn = drawn.into();
            self.ahead = (2 * self.ahead).min(MOST_AHEAD);
        }
        self.next += 1;
        Ok(self.drawn.pop_front())
    }

    fn skip_frame(&mut self) -> Result<bool> {
        let any = self.next < self.end;
        self.drawn.pop_front();
        // Who leaves frames out is likely to go on with that.
        self.ahead = 1;
        self.next += usize::from(any);
        Ok(any)
    }
}

/// The rectangle of sides 2 : 1 about the centre of mass, grown while it stays inside.
pub(super) fn inside(mask: &Mask) -> Rectangle {
    let (cx, cy) = mask.centre_of_mass().unwrap_or((0.0, 0.0));
    let (cx, cy) = (cx.round() as usize, cy.round() as usize);
    let fits = |half: usize| {
        let (left, top) = (cx.checked_sub(2 * half)?, cy.checked_sub(half)?);
        let (right, bottom) = (cx + 2 * half, cy + half);
        let whole = right < mask.width()
            && bottom < mask.height()
            && (top..=bottom).all(|y| (left..=right).all(|x| mask.get(x, y)));
        whole.then_some(Rectangle { x: left, y: top, width: 4 * half + 1, height: 2 * half + 1 })
    };
    let start = Rectangle { x: cx, y: cy, width: 1, height: 1 };
    (1..mask.height()).map_while(fits).last().unwrap_or(start)
}

/// The widest of the four strips beside the silhouette's bounds.
pub(super) fn clear(mask: &Mask) -> Rectangle {
    let (w, h) = (mask.width(), mask.height());
    let Some(b) = mask.bounds() else { return Rectangle { x: 0, y: 0, width: w, height: h } };
    let gap = 2;
    let strips = [
        Rectangle { x: 0, y: 0, width: b.left.saturating_sub(gap), height: h },
        Rectangle {
            x: (b.right + 1 + gap).min(w),
            y: 0,
            width: w.saturating_sub(b.right + 1 + gap),
            height: h,
        },
        Rectangle { x: 0, y: 0, width: w, height: b.top.saturating_sub(gap) },
        Rectangle {
            x: 0,
            y: (b.bottom + 1 + gap).min(h),
            width: w,
            height: h.saturating_sub(b.bottom + 1 + gap),
        },
    ];
    // Above and below show only one of meadow and bushes; the strips at the sides show both.
    let sides = if strips[0].width >= strips[1].width { strips[0] } else { strips[1] };
    let ends = if strips[2].height >= strips[3].height { strips[2] } else { strips[3] };
    if sides.width >= 8 { sides } else { ends }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rectangles_are_on_the_animal_and_clear_of_it() {
        for gait in Gait::ALL {
            let footage = SyntheticFootage::new(gait, SyntheticSettings::default());
            let mask = footage.true_mask(0);
            let (inside, clear) = footage.rectangles();
            let count = |r: Rectangle| {
                (r.y..r.y + r.height)
                    .flat_map(|y| (r.x..r.x + r.width).map(move |x| (x, y)))
                    .filter(|&(x, y)| mask.get(x, y))
                    .count()
            };
            assert_eq!(count(inside), inside.width * inside.height);
            assert!(inside.width * inside.height > 300, "{inside:?}");
            assert_eq!(count(clear), 0);
            assert!(clear.width * clear.height > 1000, "{gait} {clear:?}");
        }
    }

    #[test]
    fn a_picture_that_was_kept_is_the_one_that_is_drawn() {
        let small = SyntheticSettings { frames: 4, ..SyntheticSettings::default() };
        let large = SyntheticSettings { frames: 100_000, ..small };
        let (small, large) =
            (SyntheticFootage::new(Gait::Walk, small), SyntheticFootage::new(Gait::Walk, large));
        assert_eq!((small.kept.len(), large.kept.len()), (4, 0));
        let drawn = small.clone().picture(2);
        assert!(small.kept[2].get().is_some() && small.kept[1].get().is_none());
        assert_eq!(drawn, small.picture(2));
        assert_eq!(drawn, large.picture(2));
    }

    #[test]
    fn frames_come_in_order_and_end() {
        let settings = SyntheticSettings { frames: 3, ..SyntheticSettings::default() };
        let mut footage = SyntheticFootage::new(Gait::Gallop, settings);
        let first = footage.next_frame().unwrap().unwrap();
        assert_eq!(first, footage.picture(0));
        assert_ne!(footage.next_frame().unwrap().unwrap(), first);
        assert!(footage.next_frame().unwrap().is_some());
        assert!(footage.next_frame().unwrap().is_none());
        let settings = SyntheticSettings { frames: 9, ..settings };
        let mut footage = SyntheticFootage::new(Gait::Gallop, settings);
        for frame in 0..9 {
            if frame % 3 == 1 {
                assert!(footage.skip_frame().unwrap());
            } else {
                assert_eq!(footage.next_frame().unwrap().unwrap(), footage.picture(frame));
            }
        }
        assert!(!footage.skip_frame().unwrap() && footage.next_frame().unwrap().is_none());
    }
}
