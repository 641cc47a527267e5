//! Time of the minimum cut of a band of pixels about an animal's outline, as a frame of footage
//! poses it: unary terms with noise of two scales, capacities that fall where the contrast is.

use divan::Bencher;
use divan::counter::ItemsCount;
use muybridge::numeric::{Cut, GridCut};

fn main() {
    divan::main();
}

/// Size of the frame and half-width of the band as a share of its height; strength of the noise
/// relative to the unary term's contrast.
#[derive(Clone, Copy, Debug)]
struct Scene {
    width: usize,
    height: usize,
    band: f64,
    noise: f64,
}

impl std::fmt::Display for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}×{}, noise {}", self.width, self.height, self.noise)
    }
}

const SCENES: [Scene; 4] = [
    Scene { width: 854, height: 480, band: 0.024, noise: 0.7 },
    Scene { width: 854, height: 480, band: 0.024, noise: 2.0 },
    Scene { width: 1920, height: 1080, band: 0.024, noise: 0.7 },
    Scene { width: 1920, height: 1080, band: 0.024, noise: 2.0 },
];

/// A standing quadruped facing right, as capsules: both ends and the radius, all as shares of the
/// frame's height, x from the middle of the frame.
const BODY: [[f64; 5]; 8] = [
    [-0.32, 0.42, 0.25, 0.42, 0.14],
    [0.25, 0.40, 0.45, 0.22, 0.075],
    [0.45, 0.22, 0.60, 0.27, 0.05],
    [-0.38, 0.45, -0.42, 0.88, 0.035],
    [-0.30, 0.45, -0.18, 0.88, 0.035],
    [0.22, 0.45, 0.16, 0.88, 0.032],
    [0.26, 0.45, 0.38, 0.86, 0.032],
    [-0.42, 0.36, -0.58, 0.60, 0.025],
];

struct Pixel {
    x: usize,
    y: usize,
    preference: i32,
    capacity: [i32; 4],
}

struct Band {
    scene: Scene,
    pixels: Vec<Pixel>,
}

impl Band {
    fn new(scene: Scene) -> Self {
        let Scene { width, height, band, noise } = scene;
        let tall = height as f64;
        let grid: Vec<f64> = (0..width * height)
            .map(|at| inside_px((at % width) as f64, (at / width) as f64, width as f64, tall))
            .collect();
        // A soft edge two pixels wide under noise of a pixel and of blotches, as of fur and grass.
        let seen: Vec<f64> = grid
            .iter()
            .enumerate()
            .map(|(at, inside)| {
                let (x, y) = (at % width, at / width);
                inside.clamp(-1.0, 1.0)
                    + noise * gaussian(x, y, 1)
                    + noise * 0.6 * gaussian(x / 9, y / 9, 2)
            })
            .collect();
        // The picture itself: the edge shows, and so does the pattern of the ground.
        let grey: Vec<f64> = grid
            .iter()
            .enumerate()
            .map(|(at, inside)| {
                let (x, y) = (at % width, at / width);
                40.0 * inside.clamp(-1.0, 1.0)
                    + 6.0 * gaussian(x, y, 3)
                    + 14.0 * gaussian(x / 9, y / 9, 4)
            })
            .collect();
        let pixels = (0..grid.len())
            .filter(|&at| grid[at].abs() < band * tall)
            .map(|at| {
                let rim = grid[at].abs() > band * tall - 1.5;
                let preference = if rim { 1e6 * grid[at].signum() } else { 100.0 * seen[at] };
                let steps = [1, width + 1, width, width - 1];
                let capacity = steps.map(|step| {
                    let Some(other) = grey.get(at + step) else { return 0 };
                    let length = if step == 1 || step == width { 1.0 } else { 2_f64.sqrt() };
                    let contrast_sq = (grey[at] - other).powi(2);
                    ((10.0 + 200.0 * (-contrast_sq / (2.0 * 250.0)).exp()) / length) as i32
                });
                let (x, y) = (at % width, at / width);
                Pixel { x, y, preference: preference as i32, capacity }
            })
            .collect();
        Self { scene, pixels }
    }

    fn solve(&self, buffers: &mut GridCut) -> Cut {
        let Scene { width, height, .. } = self.scene;
        let mut problem = buffers.problem(width, height);
        for pixel in &self.pixels {
            problem.add_pixel(pixel.x, pixel.y, pixel.preference, pixel.capacity);
        }
        problem.solve()
    }
}

/// Signed distance to the outline, pixels, positive inside.
fn inside_px(x: f64, y: f64, width: f64, height: f64) -> f64 {
    let (x, y) = ((x - width / 2.0) / height, y / height);
    let distance = |&[ax, ay, bx, by, radius]: &[f64; 5]| {
        let (dx, dy) = (bx - ax, by - ay);
        let along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy);
        let t = along.clamp(0.0, 1.0);
        radius - (x - ax - t * dx).hypot(y - ay - t * dy)
    };
    height * BODY.iter().map(distance).fold(f64::NEG_INFINITY, f64::max)
}

/// Noise of about unit deviation that depends on the place only: the sum of four uniform numbers.
fn gaussian(x: usize, y: usize, seed: u64) -> f64 {
    // SplitMix64.
    let mut z = (x as u64) << 40 ^ (y as u64) << 16 ^ seed;
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let sum: u64 = (0..4).map(|i| z >> (16 * i) & 0xffff).sum();
    (sum as f64 / 65535.0 - 2.0) * 3_f64.sqrt()
}

#[divan::bench(args = SCENES)]
fn band(bencher: Bencher<'_, '_>, scene: Scene) {
    let band = Band::new(scene);
    let mut buffers = GridCut::new();
    bencher.counter(ItemsCount::new(band.pixels.len())).bench_local(|| band.solve(&mut buffers));
}

/// The same without the search: what it takes to state the problem.
#[divan::bench(args = SCENES)]
fn stating_only(bencher: Bencher<'_, '_>, scene: Scene) {
    let mut band = Band::new(scene);
    band.pixels.iter_mut().for_each(|p| p.preference = 0);
    let mut buffers = GridCut::new();
    bencher.counter(ItemsCount::new(band.pixels.len())).bench_local(|| band.solve(&mut buffers));
}
