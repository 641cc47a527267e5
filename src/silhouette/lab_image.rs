//! A picture in CIE L*a*b*, one byte a channel: small enough to keep a clip's worth of them, and
//! distances in it are what the eye sees as different.

use std::sync::LazyLock;

use crate::image::Picture;
use crate::mask::Mask;
use crate::numeric::{InstructionSet, Kernel, whole_part};

/// Steps of the table of the Lab curve over linear light. The curve is steepest at black, 7.8 a
/// unit: a step moves L* by .1 there and by far less elsewhere.
const CURVE_STEPS: usize = 8192;

/// Bytes a unit of L*: 0 … 100 becomes 0 … 200. The two colour axes are stored as they are, offset
/// by 128.
pub(super) const LIGHTNESS_STEPS: f32 = 2.0;

/// Rectangle of pixels: columns `left..right` of rows `top..bottom`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Region {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) right: usize,
    pub(super) bottom: usize,
}

impl Region {
    /// The bounds of a mask grown by `by` pixels on all sides, as far as there are any.
    pub(super) fn about(mask: &Mask, by: usize) -> Self {
        let Some(b) = mask.bounds() else { return Self { left: 0, top: 0, right: 0, bottom: 0 } };
        Self {
            left: b.left.saturating_sub(by),
            top: b.top.saturating_sub(by),
            right: (b.right + 1 + by).min(mask.width()),
            bottom: (b.bottom + 1 + by).min(mask.height()),
        }
    }

    pub(super) fn width(self) -> usize {
        self.right - self.left
    }

    pub(super) fn height(self) -> usize {
        self.bottom - self.top
    }

    pub(super) fn pixels(self) -> usize {
        self.width() * self.height()
    }
}

/// Three planes of bytes: 2 L*, a* + 128, b* + 128.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LabImage {
    width: usize,
    height: usize,
    planes: [Vec<u8>; 3],
}

impl LabImage {
    /// The picture, pixel for pixel.
    pub(super) fn of(picture: &Picture) -> Self {
        let (right, bottom) = (picture.width(), picture.height());
        Self::of_region(picture, Region { left: 0, top: 0, right, bottom })
    }

    /// The pixels of a region.
    pub(super) fn of_region(picture: &Picture, region: Region) -> Self {
        let planes = InstructionSet::best().run(Conversion { picture, region });
        Self { width: region.width(), height: region.height(), planes }
    }

    /// A picture of the given planes, each `width * height` bytes.
    pub(super) fn from_planes(width: usize, height: usize, planes: [Vec<u8>; 3]) -> Self {
        debug_assert!(planes.iter().all(|p| p.len() == width * height), "planes of one size");
        Self { width, height, planes }
    }

    /// The picture at half the size, each pixel the mean of four; an odd last row or column is left out.
    pub(super) fn halved(&self) -> Self {
        let (w, h) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let (last_x, last_y) = (self.width - 1, self.height - 1);
        let planes = self.planes.each_ref().map(|plane| {
            let mut halved = Vec::with_capacity(w * h);
            for y in 0..h {
                let row = |y: usize| &plane[y.min(last_y) * self.width..][..self.width];
                let (upper, lower) = (row(2 * y), row(2 * y + 1));
                halved.extend((0..w).map(|x| {
                    let (left, right) = (2 * x, (2 * x + 1).min(last_x));
                    let sum = [upper[left], upper[right], lower[left], lower[right]];
                    ((sum.into_iter().map(u16::from).sum::<u16>() + 2) / 4) as u8
                }));
            }
            halved
        });
        Self { width: w, height: h, planes }
    }

    /// The same in the light in which the cube root of luminance is 1/`light` of what it is here:
    /// L* + 16, a* and b* are all proportional to that.
    pub(super) fn relit(&self, light: f32) -> Self {
        let table = |origin: f32| -> [u8; 256] {
            std::array::from_fn(|byte| ((byte as f32 - origin) / light + origin + 0.5) as u8)
        };
        // The origin of L* + 16 lies below that of the bytes.
        let (lightness, colour) = (table(-16.0 * LIGHTNESS_STEPS), table(128.0));
        let through = |plane: &[u8], table: &[u8; 256]| {
            plane.iter().map(|byte| table[usize::from(*byte)]).collect()
        };
        let [l, a, b] = &self.planes;
        let planes = [through(l, &lightness), through(a, &colour), through(b, &colour)];
        Self::from_planes(self.width, self.height, planes)
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    pub(super) fn planes(&self) -> &[Vec<u8>; 3] {
        &self.planes
    }

    pub(super) fn planes_mut(&mut self) -> &mut [Vec<u8>; 3] {
        &mut self.planes
    }

    /// The pixels of a region.
    pub(super) fn cropped(&self, region: Region) -> Self {
        let planes = std::array::from_fn(|c| {
            let mut plane = Vec::with_capacity(region.pixels());
            for y in region.top..region.bottom {
                let row = y * self.width;
                plane.extend_from_slice(&self.planes[c][row + region.left..row + region.right]);
            }
            plane
        });
        Self::from_planes(region.width(), region.height(), planes)
    }

    pub(super) fn at(&self, index: usize) -> [u8; 3] {
        [self.planes[0][index], self.planes[1][index], self.planes[2][index]]
    }
}

/// Real coordinates of a byte triple: L*, a*, b*.
pub(super) fn lab_of(bytes: [u8; 3]) -> [f32; 3] {
    [
        f32::from(bytes[0]) / LIGHTNESS_STEPS,
        f32::from(bytes[1]) - 128.0,
        f32::from(bytes[2]) - 128.0,
    ]
}

/// The sRGB colour that a byte triple stands for, as near as bytes say.
pub(super) fn rgb_of(bytes: [u8; 3]) -> [u8; 3] {
    let curve = |f: f32| if f > 6.0 / 29.0 { f.powi(3) } else { (f - 4.0 / 29.0) * 0.128_418_55 };
    let code = |v: f32| {
        let v = v.clamp(0.0, 1.0);
        let code = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (255.0 * code + 0.5) as u8
    };
    let [l, a, b] = lab_of(bytes);
    let f = (l + 16.0) / 116.0;
    let (x, y, z) = (0.950_47 * curve(f + a / 500.0), curve(f), 1.088_83 * curve(f - b / 200.0));
    [
        code(3.240_454 * x - 1.537_139 * y - 0.498_531 * z),
        code(-0.969_266 * x + 1.876_011 * y + 0.041_556 * z),
        code(0.055_643 * x - 0.204_026 * y + 1.057_225 * z),
    ]
}

/// Pixels that are converted together.
const BLOCK: usize = 32;

/// The pixels of a region of a picture, to be converted to three planes.
struct Conversion<'a> {
    picture: &'a Picture,
    region: Region,
}

impl Kernel for Conversion<'_> {
    type Result = [Vec<u8>; 3];

    #[inline(always)]
    fn run(self) -> [Vec<u8>; 3] {
        let Self { picture, region } = self;
        let mut planes = std::array::from_fn(|_| Vec::with_capacity(region.pixels()));
        let curves = &*CURVES;
        for y in region.top..region.bottom {
            let row = 3 * y * picture.width();
            let row = &picture.rgb()[row + 3 * region.left..row + 3 * region.right];
            for pixels in row.as_chunks::<3>().0.chunks(BLOCK) {
                let mut block = [[0; 3]; BLOCK];
                block[..pixels.len()].copy_from_slice(pixels);
                for (plane, values) in planes.iter_mut().zip(curves.lab(&block)) {
                    plane.extend_from_slice(&values[..pixels.len()]);
                }
            }
        }
        planes
    }
}

struct Curves {
    linear: [f32; 256],
    curve: Vec<f32>,
}

static CURVES: LazyLock<Curves> = LazyLock::new(|| Curves {
    linear: std::array::from_fn(|code| {
        let v = code as f64 / 255.0;
        (if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }) as f32
    }),
    curve: (0..=CURVE_STEPS).map(|at| lab_curve(at as f64 / CURVE_STEPS as f64) as f32).collect(),
});

impl Curves {
    /// CIE L*a*b* (D65, 2° observer) of 8-bit sRGB colours. Between the tables all of a block is worked out
    /// step by step, as vectors.
    #[inline(always)]
    fn lab(&self, rgb: &[[u8; 3]; BLOCK]) -> [[u8; BLOCK]; 3] {
        // Plain loops: what works on arrays as a whole is not compiled into them.
        let mut linear = [[0.0; BLOCK]; 3];
        for (i, rgb) in rgb.iter().enumerate() {
            for (linear, level) in linear.iter_mut().zip(rgb) {
                linear[i] = self.linear[usize::from(*level)];
            }
        }
        let [r, g, b] = &linear;
        let mut places = [[0_u32; BLOCK]; 3];
        for i in 0..BLOCK {
            let x = 0.433_953 * r[i] + 0.376_219 * g[i] + 0.189_828 * b[i];
            let y = 0.212_673 * r[i] + 0.715_152 * g[i] + 0.072_175 * b[i];
            let z = 0.017_758 * r[i] + 0.109_477 * g[i] + 0.872_766 * b[i];
            for (places, light) in places.iter_mut().zip([x, y, z]) {
                places[i] = whole_part(light * CURVE_STEPS as f32 + 0.5);
            }
        }
        let mut curves = [[0.0; BLOCK]; 3];
        for (curve, places) in curves.as_flattened_mut().iter_mut().zip(places.as_flattened()) {
            *curve = self.curve[(*places as usize).min(CURVE_STEPS)];
        }
        let [x, y, z] = &curves;
        let mut planes = [[0; BLOCK]; 3];
        for i in 0..BLOCK {
            let values = [
                LIGHTNESS_STEPS * (116.0 * y[i] - 16.0) + 0.5,
                500.0 * (x[i] - y[i]) + 128.5,
                200.0 * (y[i] - z[i]) + 128.5,
            ];
            for (plane, value) in planes.iter_mut().zip(values) {
                plane[i] = whole_part(value.clamp(0.0, 255.0)) as u8;
            }
        }
        planes
    }
}

/// The function f of CIE 15 that light goes through before L*, a* and b* are formed.
pub(super) fn lab_curve(t: f64) -> f64 {
    let delta: f64 = 6.0 / 29.0;
    if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_size_is_the_mean_of_four() {
        let plane = |w: usize, h: usize| (0..w * h).map(|at| (at * 37 % 251) as u8).collect();
        for (w, h) in [(6, 4), (7, 5), (1, 1), (1, 4), (3, 1)] {
            let image = LabImage::from_planes(w, h, [plane(w, h), plane(w, h), vec![9; w * h]]);
            let half = image.halved();
            assert_eq!((half.width(), half.height()), ((w / 2).max(1), (h / 2).max(1)));
            for at in 0..half.width() * half.height() {
                let (x, y) = (2 * (at % half.width()), 2 * (at / half.width()));
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let value = |(dx, dy): (usize, usize)| {
                    f64::from(image.at((y + dy).min(h - 1) * w + (x + dx).min(w - 1))[0])
                };
                let mean = four.into_iter().map(value).sum::<f64>() / 4.0;
                let found = half.at(at);
                assert!((f64::from(found[0]) - mean).abs() <= 0.5 && found[2] == 9, "{w} {h} {at}");
            }
        }
    }

    #[test]
    fn known_colours() {
        // Lindbloom's values of the sRGB primaries under D65, rounded to our bytes.
        for (rgb, lab) in [
            ([255, 255, 255], [200, 128, 128]),
            ([255, 0, 0], [106, 208, 195]),
            ([0, 0, 255], [65, 207, 20]),
            ([0, 0, 0], [0, 128, 128]),
        ] {
            let picture = Picture::from_rgb(1, 1, rgb.to_vec()).unwrap();
            let found = LabImage::of(&picture).at(0);
            for (a, b) in found.iter().zip(lab) {
                assert!(a.abs_diff(b) <= 1, "{rgb:?} {found:?}");
            }
        }
    }

    #[test]
    fn colours_come_back_and_a_darker_light_can_be_taken_out() {
        for rgb in [[200, 120, 40], [90, 130, 60], [30, 30, 30], [128, 72, 44], [230, 240, 250]] {
            let lab = LabImage::of(&Picture::from_rgb(1, 1, rgb.to_vec()).unwrap());
            let back = rgb_of(lab.at(0));
            assert!(back.iter().zip(rgb).all(|(a, b)| a.abs_diff(b) <= 4), "{rgb:?} {back:?}");
            // Half the luminance and back.
            let half = 0.5_f32.cbrt();
            let again = lab.relit(1.0 / half).relit(half);
            for (a, b) in again.at(0).into_iter().zip(lab.at(0)) {
                assert!(a.abs_diff(b) <= 2, "{rgb:?}");
            }
        }
    }
}
