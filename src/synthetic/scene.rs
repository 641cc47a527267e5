//! A coloured picture of the horse over a textured background that moves with the ground.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::camera::Camera;
use super::raster::cover;
use crate::image::Picture;
use crate::rig::{Model, Pose};

/// Deviation of the sensor noise, levels of 255.
pub(super) const SENSOR_NOISE: f64 = 4.0;

/// Where the ground begins, as a share of the picture's height.
const HORIZON: f64 = 0.62;

/// Direction towards the light in camera space: from above, behind the viewer's left shoulder.
const LIGHT: [f64; 3] = [-0.35, 0.8, 0.5];

/// A picture in the making.
#[derive(Clone)]
pub(super) struct Canvas {
    width: usize,
    /// Levels of 255, row by row; not bounded yet.
    colours: Vec<[f64; 3]>,
}

impl Canvas {
    /// The background, which has moved to the left by `shift_px`; `seed` fixes its texture.
    pub(super) fn background(width: usize, height: usize, shift_px: f64, seed: u64) -> Self {
        let mut colours: Vec<[f64; 3]> = Vec::with_capacity(width * height);
        for y in 0..height {
            let mut row = BackgroundRow::new(y as f64, height, seed);
            colours.extend((0..width).map(|x| row.colour(x as f64 + shift_px)));
        }
        Self { width, colours }
    }

    /// Draws an animal over what is there.
    pub(super) fn animal(&mut self, model: &Model, pose: &Pose, camera: &Camera) {
        let coats: Vec<[f64; 3]> =
            model.meshes.iter().map(|m| coat_colour(&model.skeleton.nodes[m.node].name)).collect();
        draw(model, pose, camera, &|mesh, _| coats[mesh], &mut self.colours);
    }

    /// Changes the colour of every pixel, given with its column and row.
    pub(super) fn change(&mut self, change: impl Fn(usize, usize, &mut [f64; 3])) {
        for (at, colour) in self.colours.iter_mut().enumerate() {
            change(at % self.width, at / self.width, colour);
        }
    }

    /// A trunk over the whole height in columns `span` of the world, which has moved to the left by
    /// `shift_px`.
    pub(super) fn trunk(&mut self, span: (f64, f64), shift_px: f64, seed: u64) {
        for (y, row) in self.colours.chunks_exact_mut(self.width).enumerate() {
            let mut bark = NoiseRow::new(4.0, y as f64 / 30.0, seed ^ 5);
            for (x, colour) in row.iter_mut().enumerate() {
                let x = x as f64 + shift_px;
                if x >= span.0 && x < span.1 {
                    let level = bark.at(x);
                    *colour = [70.0 + 50.0 * level, 68.0 + 48.0 * level, 62.0 + 44.0 * level];
                }
            }
        }
    }

    /// Lays patches of bare soil, the colour of which is near that of the animal, over the background.
    pub(super) fn soil(&mut self, shift_px: f64, seed: u64) {
        for (y, row) in self.colours.chunks_exact_mut(self.width).enumerate() {
            let mut patches = NoiseRow::new(26.0, y as f64 / 13.0, seed ^ 6);
            let mut grain = NoiseRow::new(5.0, y as f64 / 4.0, seed ^ 7);
            for (x, colour) in row.iter_mut().enumerate() {
                let x = x as f64 + shift_px;
                let share = ((patches.at(x) - 0.55) / 0.15).clamp(0.0, 1.0);
                let level = 0.8 + 0.4 * grain.at(x);
                for (channel, soil) in colour.iter_mut().zip([120.0, 86.0, 62.0]) {
                    *channel += share * (soil * level - *channel);
                }
            }
        }
    }

    /// Softens it as a lens does: a quarter of each pixel's light goes to either side, across and down.
    pub(super) fn soften(&mut self) {
        let (w, h) = (self.width, self.colours.len() / self.width.max(1));
        for step in [1, w] {
            let sharp = self.colours.clone();
            let line = |at: usize| if step == 1 { (at % w, w) } else { (at / w, h) };
            for (at, colour) in self.colours.iter_mut().enumerate() {
                let (place, length) = line(at);
                let before = sharp[if place > 0 { at - step } else { at }];
                let after = sharp[if place + 1 < length { at + step } else { at }];
                for c in 0..3 {
                    colour[c] = 0.25 * before[c] + 0.5 * colour[c] + 0.25 * after[c];
                }
            }
        }
    }

    /// Takes the odd rows of another picture of the same size: the second field of an interlaced
    /// frame.
    pub(super) fn interlace(&mut self, second: &Canvas) {
        let rows = self.colours.chunks_exact_mut(self.width);
        for (row, other) in rows.zip(second.colours.chunks_exact(self.width)).skip(1).step_by(2) {
            row.copy_from_slice(other);
        }
    }

    /// The picture a sensor makes of it, whose noise has deviation `noise`, levels of 255, fixed by
    /// `seed` and `frame`.
    pub(super) fn exposed(&self, noise: f64, seed: u64, frame: usize) -> Picture {
        let mut sensor = SensorNoise::new(seed, frame, self.width);
        let mut rgb = Vec::with_capacity(3 * self.colours.len());
        for row in self.colours.chunks_exact(self.width.max(1)) {
            let noisy = row.as_flattened().iter().zip(sensor.row());
            rgb.extend(noisy.map(|(value, unit)| level(value + noise * unit)));
        }
        // The length is that of the pixels by construction; a black picture would be seen at once.
        Picture::from_rgb(self.width, self.colours.len() / self.width.max(1), rgb)
            .unwrap_or_else(|| unreachable!("three bytes were made for every pixel"))
    }
}

/// Noise of about unit deviation for each channel of each pixel, a row at a time.
struct SensorNoise {
    random: ChaCha8Rng,
    bytes: Vec<u8>,
}

/// Random numbers a value is the sum of: of four uniform ones it is close to normal, and the same on
/// every platform.
const SUMMANDS: usize = 4;

impl SensorNoise {
    fn new(seed: u64, frame: usize, width: usize) -> Self {
        let seed = seed ^ (frame as u64 + 1).wrapping_mul(0x9E37_79B9);
        let bytes = vec![0; 3 * width * SUMMANDS * size_of::<u64>()];
        Self { random: ChaCha8Rng::seed_from_u64(seed), bytes }
    }

    /// That of the next row.
    fn row(&mut self) -> impl Iterator<Item = f64> {
        self.random.fill_bytes(&mut self.bytes);
        self.bytes.as_chunks::<{ SUMMANDS * size_of::<u64>() }>().0.iter().map(|four| {
            // Uniform numbers from −1 to 1 are whole multiples of 2⁻⁵¹, and so are sums of four, which
            // fit 53 bits: they are added as integers, to the bit what the library gives as numbers.
            let sum: u64 = (four.as_chunks().0.iter())
                .map(|bytes| u64::from_le_bytes(*bytes) >> UNIFORM_SHIFT)
                .sum();
            let centred = sum as i64 - ((SUMMANDS as i64) << 51);
            centred as f64 * (1.0 / (1_u64 << 51) as f64) * 0.866
        })
    }
}

/// Bits by which 64 random ones exceed the 52 of a uniform number.
const UNIFORM_SHIFT: u32 = 12;

/// A picture of a rig in a pose on a plain ground, each triangle in one colour, lit from above.
/// `colour` gives that of a mesh's triangle, sRGB levels of 255.
#[must_use]
pub fn rendering(
    model: &Model,
    pose: &Pose,
    camera: &Camera,
    colour: &dyn Fn(usize, usize) -> [f64; 3],
    ground: [u8; 3],
) -> Picture {
    let mut colours = vec![ground.map(f64::from); camera.width() * camera.height()];
    draw(model, pose, camera, colour, &mut colours);
    let rgb = colours.iter().flatten().map(|value| level(*value)).collect();
    Picture::from_rgb(camera.width(), camera.height(), rgb)
        .unwrap_or_else(|| unreachable!("three bytes were made for every pixel"))
}

/// The nearest byte, halves away from zero. Not `round`: a processor without an instruction for it
/// takes longer over that than over all the rest of a pixel.
#[inline]
fn level(value: f64) -> u8 {
    let value = value.clamp(0.0, 255.0);
    let whole = value as u8;
    whole + u8::from(value - f64::from(whole) >= 0.5)
}

fn draw(
    model: &Model,
    pose: &Pose,
    camera: &Camera,
    colour: &dyn Fn(usize, usize) -> [f64; 3],
    colours: &mut [[f64; 3]],
) {
    let width = camera.width();
    let light = Vector3::from(LIGHT).normalize();
    let mut depths = vec![f64::NEG_INFINITY; colours.len()];
    for (at, (mesh, vertices)) in model.meshes.iter().zip(model.posed_vertices(pose)).enumerate() {
        let seen: Vec<Vector3<f64>> = vertices.iter().map(|v| camera.project(v)).collect();
        for (which, triangle) in mesh.triangles.iter().enumerate() {
            let coat = colour(at, which);
            let corners = triangle.map(|v| seen[v]);
            let to_space =
                |v: Vector3<f64>| Vector3::new(v.x, -v.y, v.z * camera.pixels_per_unit());
            let [a, b, c] = corners.map(to_space);
            let normal = (b - a).cross(&(c - a));
            let normal = if normal.z < 0.0 { -normal } else { normal };
            let shade = 0.55 + 0.45 * normal.normalize().dot(&light).max(0.0);
            cover(&corners, width, camera.height(), |x, y, depth| {
                let at = y * width + x;
                if depth > depths[at] {
                    depths[at] = depth;
                    colours[at] = coat.map(|channel| channel * shade);
                }
            });
        }
    }
}

/// A bay: brown body, darker legs, tail and ears.
fn coat_colour(node: &str) -> [f64; 3] {
    let dark = ["tail", "carpus", "fetlock", "tarsus", "ear"];
    if dark.iter().any(|part| node.starts_with(part)) {
        [74.0, 44.0, 34.0]
    } else if node.starts_with("coffin") {
        [52.0, 40.0, 38.0]
    } else {
        [128.0, 72.0, 44.0]
    }
}

/// Bushes over grass, both of smooth noise that is fixed in the world: one row of the picture.
struct BackgroundRow {
    bushes: bool,
    noises: [NoiseRow; 2],
}

impl BackgroundRow {
    fn new(y: f64, height: usize, seed: u64) -> Self {
        let bushes = y < HORIZON * height as f64;
        let noise =
            |width: f64, height: f64, which: u64| NoiseRow::new(width, y / height, seed ^ which);
        let noises = if bushes {
            [noise(38.0, 26.0, 0), noise(7.0, 6.0, 1)]
        } else {
            [noise(3.0, 9.0, 2), noise(60.0, 20.0, 3)]
        };
        Self { bushes, noises }
    }

    fn colour(&mut self, x: f64) -> [f64; 3] {
        let [first, second] = &mut self.noises;
        let (first, second) = (first.at(x), second.at(x));
        if self.bushes {
            let level = 0.65 * first + 0.35 * second;
            [92.0 + 62.0 * level, 120.0 + 58.0 * level, 88.0 + 66.0 * level]
        } else {
            let level = 0.5 * first + 0.5 * second;
            [118.0 + 62.0 * level, 138.0 + 52.0 * level, 70.0 + 40.0 * level]
        }
    }
}

/// Value noise, 0…1: random values on a grid, joined smoothly. One row of it, whose pixels have the
/// same four values about them for as long as they are in one cell.
struct NoiseRow {
    seed: u64,
    cell_width: f64,
    top: f64,
    v: f64,
    left: f64,
    corners: [f64; 4],
}

impl NoiseRow {
    /// Of cells so many pixels wide; `y` counts in cells.
    fn new(cell_width: f64, y: f64, seed: u64) -> Self {
        let top = floor(y);
        let v = ease(y - top);
        Self { seed, cell_width, top, v, left: f64::NAN, corners: [0.0; 4] }
    }

    fn at(&mut self, x: f64) -> f64 {
        let x = x / self.cell_width;
        let left = floor(x);
        if left != self.left {
            self.left = left;
            self.corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.value(dx, dy));
        }
        let (u, v) = (ease(x - left), self.v);
        let [a, b, c, d] = self.corners;
        let above = a * (1.0 - u) + b * u;
        let below = c * (1.0 - u) + d * u;
        above * (1.0 - v) + below * v
    }

    fn value(&self, dx: i64, dy: i64) -> f64 {
        let mut z = self
            .seed
            .wrapping_add((self.left as i64 + dx) as u64 ^ 0x51_7C_C1_B7)
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ ((self.top as i64 + dy) as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn ease(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// The floor of a number of a picture's size, without a call where there is no instruction for it.
#[inline]
fn floor(x: f64) -> f64 {
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;

    #[test]
    fn noise_is_the_sum_of_the_librarys_uniform_numbers() {
        let (seed, frame, width) = (42, 7, 33);
        let mut noise = SensorNoise::new(seed, frame, width);
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ (8 * 0x9E37_79B9));
        for _ in 0..9 {
            let found: Vec<f64> = noise.row().collect();
            assert_eq!(found.len(), 3 * width);
            for found in found {
                let sum: f64 = (0..4).map(|_| random.random_range(-1.0..1.0)).sum();
                assert_eq!(found.to_bits(), (sum * 0.866).to_bits());
            }
        }
    }

    #[test]
    fn levels_and_floors_are_those_of_the_library() {
        for value in [-3.7, -0.5, -0.2, 0.0, 0.499_999_999_999_999_94, 0.5, 1.5, 2.5, 254.5, 300.0]
        {
            assert_eq!(level(value), value.round().clamp(0.0, 255.0) as u8, "{value}");
            assert_eq!(floor(value), value.floor(), "{value}");
        }
        for at in 0..2000_i32 {
            let value = f64::from(at) * 0.137 - 9.0;
            assert_eq!(level(value), value.round().clamp(0.0, 255.0) as u8, "{value}");
            assert_eq!(floor(value), value.floor(), "{value}");
        }
    }
}
