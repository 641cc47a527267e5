//! A picture in CIE L*a*b*, one byte a channel: small enough to keep a clip's worth of them, and
//! distances in it are what the eye sees as different.

use std::sync::LazyLock;

use ::image::imageops::thumbnail;
use ::image::{ImageBuffer, Rgb};

use crate::image::Picture;

/// Steps of the table of the Lab curve over linear light. The curve is steepest at black, 7.8 a
/// unit: a step moves L* by .1 there and by far less elsewhere.
const CURVE_STEPS: usize = 8192;

/// Bytes a unit of L*: 0 … 100 becomes 0 … 200. The two colour axes are stored as they are, offset
/// by 128.
pub(super) const LIGHTNESS_STEPS: f32 = 2.0;

/// Rectangle of pixels: columns `left..right` of rows `top..bottom`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Region {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) right: usize,
    pub(super) bottom: usize,
}

impl Region {
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
        let mut planes = std::array::from_fn(|_| Vec::with_capacity(region.pixels()));
        let [l, a, b] = &mut planes;
        let curves = &*CURVES;
        for y in region.top..region.bottom {
            let row = 3 * y * picture.width();
            for rgb in picture.rgb()[row + 3 * region.left..row + 3 * region.right].chunks_exact(3)
            {
                let lab = curves.lab([rgb[0], rgb[1], rgb[2]]);
                l.push(lab[0]);
                a.push(lab[1]);
                b.push(lab[2]);
            }
        }
        Self { width: region.width(), height: region.height(), planes }
    }

    /// A picture of the given planes, each `width * height` bytes.
    pub(super) fn from_planes(width: usize, height: usize, planes: [Vec<u8>; 3]) -> Self {
        debug_assert!(planes.iter().all(|p| p.len() == width * height), "planes of one size");
        Self { width, height, planes }
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

/// The picture at another size, no larger than it is: each pixel the mean of those it covers.
pub(super) fn reduced(picture: &Picture, width: usize, height: usize) -> Option<Picture> {
    let (w, h) = (u32::try_from(picture.width()).ok()?, u32::try_from(picture.height()).ok()?);
    let whole: ImageBuffer<Rgb<u8>, &[u8]> = ImageBuffer::from_raw(w, h, picture.rgb())?;
    let small = thumbnail(&whole, u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    Picture::from_rgb(width, height, small.into_raw())
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
    /// CIE L*a*b* (D65, 2° observer) of an 8-bit sRGB colour.
    #[inline]
    fn lab(&self, rgb: [u8; 3]) -> [u8; 3] {
        let [r, g, b] = rgb.map(|c| self.linear[usize::from(c)]);
        let x = 0.433_953 * r + 0.376_219 * g + 0.189_828 * b;
        let y = 0.212_673 * r + 0.715_152 * g + 0.072_175 * b;
        let z = 0.017_758 * r + 0.109_477 * g + 0.872_766 * b;
        let f = |t: f32| self.curve[((t * CURVE_STEPS as f32 + 0.5) as usize).min(CURVE_STEPS)];
        let (fx, fy, fz) = (f(x), f(y), f(z));
        // A saturating cast: what lies beyond the byte is clamped.
        [
            (LIGHTNESS_STEPS * (116.0 * fy - 16.0) + 0.5) as u8,
            (500.0 * (fx - fy) + 128.5) as u8,
            (200.0 * (fy - fz) + 128.5) as u8,
        ]
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
    fn halving_takes_the_mean_of_four() {
        let rgb: Vec<u8> = (0..8).flat_map(|v| [v * 10, v * 10, 100]).collect();
        let small = reduced(&Picture::from_rgb(4, 2, rgb).unwrap(), 2, 1).unwrap();
        assert_eq!(small.rgb(), [25, 25, 100, 45, 45, 100]);
    }
}
