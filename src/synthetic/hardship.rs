//! Footage of a walking horse with what makes silhouettes hard to find, and the truth beside it.

use super::camera::{Camera, Projection, View};
use super::footage::inside;
use super::gaits::Gait;
use super::horse::horse;
use super::raster::silhouette;
use super::scene::{Canvas, SENSOR_NOISE};
use crate::image::{Picture, Rectangle};
use crate::mask::Mask;
use crate::rig::{Model, Pose};

/// Height of the pictures, pixels.
const HEIGHT: usize = 150;

/// Box that the animal is framed in, pixels.
const FRAMED: (usize, usize) = (112, 92);

/// Row of the middle of that box.
const ROW: f64 = 78.0;

/// Animals that are nearer than this touch as far as a soft picture shows, pixels.
const CLEAR_PX: usize = 6;

/// Frames a stride of the walk.
const STRIDE_FRAMES: f64 = 24.3;

/// What makes the footage hard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hardship {
    /// Nothing: the yardstick for the others.
    None,
    /// It passes behind a trunk wide enough to hide it whole.
    Trunk,
    /// It passes behind a post as wide as two of its legs.
    Post,
    /// Another one of its colour, farther away, passes above it without touching.
    Neighbour,
    /// Another one of its colour and size comes towards it, passes behind it and goes on.
    Crossing,
    /// It casts a shadow that begins at its feet and has .6 of the ground's brightness.
    Shadow,
    /// It goes away: at the end it shows at .45 of its first size.
    Retreat,
    /// At first its hind part is outside of the picture, at last all of it.
    Passage,
    /// The sensor's noise has a deviation of 16 levels of 255.
    Noise,
    /// The frames are interlaced: odd rows show half a frame later.
    Fields,
    /// The light falls to .55 and comes back, as under a cloud.
    Light,
}

impl Hardship {
    /// All of them.
    pub const ALL: [Hardship; 11] = [
        Hardship::None,
        Hardship::Trunk,
        Hardship::Post,
        Hardship::Neighbour,
        Hardship::Crossing,
        Hardship::Shadow,
        Hardship::Retreat,
        Hardship::Passage,
        Hardship::Noise,
        Hardship::Fields,
        Hardship::Light,
    ];
}

/// A walking horse under one hardship, filmed by a camera that stands still or pans along. Its step, which is what its
/// outline repeats with, takes [`HardFootage::STEP_FRAMES`].
#[derive(Clone, Debug)]
pub struct HardFootage {
    hardship: Hardship,
    pans: bool,
    frames: usize,
    seed: u64,
    model: Model,
    framed: Camera,
    /// Its way a frame on the ground, pixels.
    step_px: f64,
}

impl HardFootage {
    /// Frames a step of the walk, half a stride.
    pub const STEP_FRAMES: f64 = STRIDE_FRAMES / 2.0;

    /// So many frames of it; nothing is drawn yet.
    #[must_use]
    pub fn new(hardship: Hardship, pans: bool, frames: usize, seed: u64) -> Self {
        let model = horse();
        let view = View {
            yaw_rad: 0.0,
            projection: Projection::Orthographic,
            width: FRAMED.0,
            height: FRAMED.1,
        };
        let pose = |i: u32| Gait::Walk.pose(&model.skeleton, f64::from(i) / 24.0).pose;
        let stride: Vec<Pose> = (0..24).map(pose).collect();
        let framed = Camera::framing(&model, &stride, view);
        let way = Gait::Walk.speed_m_s() * Gait::Walk.stride_s() * framed.pixels_per_unit();
        Self { hardship, pans, frames, seed, model, framed, step_px: way / STRIDE_FRAMES }
    }

    /// Number of frames.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Width of the pictures, pixels: room for the animal on either side of what it meets.
    fn width(&self) -> usize {
        match self.hardship {
            Hardship::Trunk | Hardship::Crossing if !self.pans => 400,
            _ => 288,
        }
    }

    /// The picture of a frame.
    #[must_use]
    pub fn picture(&self, frame: usize) -> Picture {
        let time = frame as f64;
        let mut canvas = self.canvas(time);
        if self.hardship == Hardship::Fields {
            canvas.interlace(&self.canvas(time + 0.5));
        }
        let noise = if self.hardship == Hardship::Noise { 16.0 } else { SENSOR_NOISE };
        canvas.exposed(noise, self.seed, frame)
    }

    /// The whole animal in a frame as far as the picture reaches, with what hides it taken away.
    #[must_use]
    pub fn true_mask(&self, frame: usize) -> Mask {
        self.mask(frame as f64)
    }

    /// What is seen of the animal in a frame.
    #[must_use]
    pub fn visible_mask(&self, frame: usize) -> Mask {
        let mask = self.true_mask(frame);
        let Some((left, right)) = self.trunk() else { return mask };
        let shift = self.shift_px(frame as f64);
        let hidden = |x: usize| (left..right).contains(&(x as f64 + shift));
        Mask::from_fn(self.width(), HEIGHT, |x, y| mask.get(x, y) && !hidden(x))
    }

    /// Whether nothing is wrong with the animal in a frame: all of it is seen, inside the picture and
    /// clear of others by some pixels.
    #[must_use]
    pub fn is_plain(&self, frame: usize) -> bool {
        let whole = self.true_mask(frame);
        let inside = whole.bounds().is_some_and(|b| {
            b.left > 0 && b.top > 0 && b.right + 1 < self.width() && b.bottom + 1 < HEIGHT
        });
        let about = whole.dilated(CLEAR_PX);
        let alone = self
            .others(frame as f64)
            .iter()
            .all(|(pose, camera)| about.and(&silhouette(&self.model, pose, camera)).is_empty());
        inside && alone && self.visible_mask(frame) == whole
    }

    /// What the camera does, in words.
    #[must_use]
    pub fn camera_moves(&self) -> &'static str {
        if self.pans { "panning camera" } else { "still camera" }
    }

    /// Rectangles on the first frame, as a user would draw them: inside the trunk, and the widest
    /// columns clear of all animals.
    #[must_use]
    pub fn rectangles(&self) -> (Rectangle, Rectangle) {
        let mask = self.mask(0.0);
        let all = self.others(0.0).iter().fold(mask.clone(), |all, (pose, camera)| {
            all.or(&silhouette(&self.model, pose, camera))
        });
        let taken = |x: &usize| (0..HEIGHT).any(|y| all.get(*x, y));
        let mut widest = 0..0;
        let mut first = 0;
        for x in (0..self.width()).filter(taken).chain([self.width()]) {
            // Two columns beside the animal are left for its soft edge.
            if x.saturating_sub(first) > widest.len() + 4 {
                widest = first + 2..x - 2;
            }
            first = x + 1;
        }
        let background = Rectangle { x: widest.start, y: 0, width: widest.len(), height: HEIGHT };
        (inside(&mask), background)
    }

    /// How far the camera has turned, pixels.
    fn shift_px(&self, time: f64) -> f64 {
        if self.pans { self.step_px * time } else { 0.0 }
    }

    /// Column of the animal's middle at a time, in the world.
    fn column(&self, time: f64) -> f64 {
        let first = match self.hardship {
            Hardship::Passage => 20.0,
            _ if self.pans => 0.5 * self.width() as f64,
            _ => 62.0,
        };
        let step = if self.pans {
            self.step_px
        } else {
            // From side to side once, and with a passage out of the picture, whatever the frames.
            let last =
                self.width() as f64 + if self.hardship == Hardship::Passage { 60.0 } else { -62.0 };
            (last - first) / self.frames as f64
        };
        first + step * time
    }

    fn pose(&self, time: f64) -> Pose {
        Gait::Walk.pose(&self.model.skeleton, time / STRIDE_FRAMES).pose
    }

    fn camera(&self, time: f64) -> Camera {
        let share = time / self.frames as f64;
        let zoom = if self.hardship == Hardship::Retreat { 1.0 - 0.55 * share } else { 1.0 };
        // What goes away shows higher in the picture.
        let row = ROW - 30.0 * (1.0 - zoom);
        let centre = (self.column(time) - self.shift_px(time), row);
        self.framed.within(self.width(), HEIGHT, centre, zoom)
    }

    fn mask(&self, time: f64) -> Mask {
        silhouette(&self.model, &self.pose(time), &self.camera(time))
    }

    /// The other animals, behind this one.
    fn others(&self, time: f64) -> Vec<(Pose, Camera)> {
        let share = time / self.frames as f64;
        let middle =
            self.column(0.5 * self.frames as f64) - self.shift_px(0.5 * self.frames as f64);
        let (offset, row, zoom) = match self.hardship {
            Hardship::Neighbour => (110.0, ROW - 54.0, 0.5),
            Hardship::Crossing => (300.0, ROW - 2.0, 1.0),
            _ => return Vec::new(),
        };
        // Twice as fast as the picture's width allows one to follow: it comes and is gone again.
        let centre = (middle + offset * (1.0 - 2.0 * share), row);
        let turned = View {
            yaw_rad: std::f64::consts::PI,
            projection: Projection::Orthographic,
            width: FRAMED.0,
            height: FRAMED.1,
        };
        let rest: Vec<Pose> = (0..24).map(|i| self.pose(f64::from(i))).collect();
        let camera = Camera::framing(&self.model, &rest, turned);
        vec![(self.pose(time + 7.0), camera.within(self.width(), HEIGHT, centre, zoom))]
    }

    /// Columns of the world that a trunk or a post hides.
    fn trunk(&self) -> Option<(f64, f64)> {
        let width = match self.hardship {
            Hardship::Trunk => 116.0,
            Hardship::Post => 14.0,
            _ => return None,
        };
        // Where the animal is in the middle of the clip.
        let middle = self.column(0.5 * self.frames as f64);
        Some((middle - 0.5 * width, middle + 0.5 * width))
    }

    fn canvas(&self, time: f64) -> Canvas {
        let shift = self.shift_px(time);
        let mut canvas = Canvas::background(self.width(), HEIGHT, shift, self.seed);
        canvas.soil(shift, self.seed);
        if self.hardship == Hardship::Shadow {
            self.cast_shadow(time, &mut canvas);
        }
        for (pose, camera) in self.others(time) {
            canvas.animal(&self.model, &pose, &camera);
        }
        canvas.animal(&self.model, &self.pose(time), &self.camera(time));
        if let Some(span) = self.trunk() {
            canvas.trunk(span, shift, self.seed);
        }
        canvas.soften();
        if self.hardship == Hardship::Light {
            let share = time / self.frames as f64;
            let gain = 1.0 - 0.45 * (std::f64::consts::PI * share).sin().powi(2);
            canvas.change(|_, _, colour| *colour = colour.map(|c| gain * c));
        }
        canvas
    }

    /// The silhouette mirrored at the ground line, lower and slanted, as by light from above and
    /// behind.
    fn cast_shadow(&self, time: f64, canvas: &mut Canvas) {
        const SQUASH: f64 = 0.25;
        const SLANT: f64 = 0.35;
        let mask = self.mask(time);
        let Some(bounds) = mask.bounds() else { return };
        // It begins where the hooves do, not under them.
        let ground = bounds.bottom - 2;
        canvas.change(|x, y, colour| {
            let Some(below) = y.checked_sub(ground) else { return };
            let height = below as f64 / SQUASH;
            let (from_x, from_y) = (x as f64 - SLANT * height, ground as f64 - height);
            let within = from_y >= 0.0 && (0.0..mask.width() as f64).contains(&from_x);
            if within && mask.get(from_x as usize, from_y as usize) {
                *colour = colour.map(|c| 0.6 * c);
            }
        });
    }
}
