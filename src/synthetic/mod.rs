//! Animals whose motion is known: a skeleton horse, its gaits, and the renderer that makes
//! silhouettes and footage of any rig (seed 003, section 4).

mod camera;
mod footage;
mod gaits;
mod glb;
mod hardship;
mod horse;
mod legs;
mod noise;
mod raster;
mod samples;
mod scene;
mod sketch;

pub use camera::{Camera, Projection, View};
pub use footage::{SyntheticFootage, SyntheticSettings};
pub use gaits::{Foot, Gait, StridePose};
pub use glb::{NamedClip, to_glb};
pub use hardship::{HardFootage, Hardship};
pub use horse::{IN_PLANE_ANGLES, IN_PLANE_JOINTS, horse};
pub use noise::edge_noise;
pub use raster::silhouette;
pub use samples::{Sample, samples};
pub use scene::rendering;
pub use sketch::sketch_strokes;
