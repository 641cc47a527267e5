//! Pictures of the animated rig by the CPU.

use ::image::imageops::{FilterType, resize};
use ::image::{RgbImage, RgbaImage};
use nalgebra::{Point3, Vector3};

use crate::error::Result;
use crate::report::rig_copy::texture;
use crate::report::sheets::evenly_chosen;
use crate::rig::{Animation, File, Model, Pose, Surface};
use crate::shot::{Shot, StoredAnimation};
use crate::synthetic::{Camera, Projection, View, rendering};

/// Pictures are drawn so many times as large and reduced, which smooths their edges.
const FINER: usize = 2;
/// Poses that the camera is framed on.
const FRAMED_POSES: usize = 24;
const GROUND: [u8; 3] = [0xee, 0xf1, 0xf4];

/// The animated rig, its colours and a camera that stands still or goes along with it.
pub(super) struct RigPanel {
    model: Model,
    animation: Animation,
    /// For each mesh the colour of each of its triangles, sRGB levels.
    colours: Vec<Vec<[f64; 3]>>,
    camera: Camera,
    follow: Option<usize>,
    size: (usize, usize),
    /// When it begins in the footage.
    start_s: f64,
    retime: f64,
    duration_s: f64,
    looped: bool,
}

impl RigPanel {
    pub(super) fn new(
        shot: &Shot,
        stored: &StoredAnimation,
        heading: i8,
        size: (usize, usize),
    ) -> Result<Self> {
        let file = File::read(&shot.path(&stored.path))?;
        let model = file.model()?;
        let animation = file.animation(&stored.animation)?;
        let (surfaces, _) = file.surfaces()?;
        let feet = stored.feet.as_ref();
        let follow = feet
            .and_then(|f| f.root_node.as_deref())
            .and_then(|name| model.skeleton.nodes.iter().position(|n| n.name == name));
        let forward = feet.map_or([0.0, 0.0, 1.0], |f| f.forward);
        let behind = if heading < 0 { std::f64::consts::PI } else { 0.0 };
        let view = View {
            yaw_rad: forward[0].atan2(forward[2]) + behind,
            projection: Projection::Orthographic,
            width: FINER * size.0,
            height: FINER * size.1,
        };
        let poses: Vec<Pose> = evenly_chosen(stored.frames, FRAMED_POSES)
            .into_iter()
            .map(|frame| animation.sample(&model.skeleton, frame as f64 / stored.fps))
            .map(|pose| accompanied(&model, pose, follow))
            .collect();
        Ok(Self {
            camera: Camera::framing(&model, &poses, view),
            colours: surfaces.iter().map(|s| colours(&file, s)).collect(),
            model,
            animation,
            follow,
            size,
            start_s: stored.first_frame as f64 / shot.fps(),
            retime: stored.retime,
            duration_s: stored.frames.saturating_sub(1) as f64 / stored.fps,
            looped: stored.looped.is_some(),
        })
    }

    /// The rig at a time of the footage, seconds.
    pub(super) fn at(&self, footage_s: f64) -> RgbImage {
        let time_s = (footage_s - self.start_s).max(0.0) / self.retime;
        let time_s = match self.looped && self.duration_s > 0.0 {
            true => time_s % self.duration_s,
            false => time_s.min(self.duration_s),
        };
        let pose = self.animation.sample(&self.model.skeleton, time_s);
        let pose = accompanied(&self.model, pose, self.follow);
        let colour = |mesh: usize, triangle: usize| self.colours[mesh][triangle];
        let large = rendering(&self.model, &pose, &self.camera, &colour, GROUND);
        let pixels =
            RgbImage::from_raw(large.width() as u32, large.height() as u32, large.rgb().to_vec());
        let pixels = pixels.unwrap_or_default();
        resize(&pixels, self.size.0 as u32, self.size.1 as u32, FilterType::Triangle)
    }
}

/// The pose with the followed node brought back over the middle of the ground.
fn accompanied(model: &Model, mut pose: Pose, follow: Option<usize>) -> Pose {
    let Some(node) = follow else { return pose };
    let at = model.skeleton.world_matrices(&pose)[node].transform_point(&Point3::origin());
    let moved = Vector3::new(at.x, 0.0, at.z);
    for (node, own) in model.skeleton.nodes.iter().zip(&mut pose.nodes) {
        if node.parent.is_none() {
            own.translation -= moved;
        }
    }
    pose
}

/// The colour of every triangle: that of the texture at its middle, times the base colour.
fn colours(file: &File, surface: &Surface) -> Vec<[f64; 3]> {
    let image = surface.look.image.filter(|_| !surface.texture_coordinates.is_empty());
    let texture = image.and_then(|i| texture::picture(file, i)).map(|t| t.into_rgba8());
    let base = surface.look.base_colour;
    let shade = |channel: usize, texel: f64| 255.0 * texel * base[channel].max(0.0).powf(1.0 / 2.2);
    let colour = |triangle: &[usize; 3]| {
        let texel = texture.as_ref().map_or([1.0; 3], |t| texel(t, surface, triangle));
        std::array::from_fn(|c| shade(c, texel[c]))
    };
    surface.mesh.triangles.iter().map(colour).collect()
}

/// The texture at the middle of a triangle, 0 to 1; coordinates repeat beyond 0 to 1.
fn texel(texture: &RgbaImage, surface: &Surface, triangle: &[usize; 3]) -> [f64; 3] {
    let middle = |axis: usize| {
        let sum: f64 = triangle.iter().map(|&v| surface.texture_coordinates[v][axis]).sum();
        (sum / 3.0).rem_euclid(1.0)
    };
    let place = |share: f64, side: u32| ((share * f64::from(side)) as u32).min(side - 1);
    let (x, y) = (place(middle(0), texture.width()), place(middle(1), texture.height()));
    let pixel = texture.get_pixel(x, y);
    std::array::from_fn(|c| f64::from(pixel[c]) / 255.0)
}
