//! Two mixtures of colours, animal and background, and the likelihood ratio of a pixel.

use std::sync::LazyLock;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::colour_cube::ColourCube;
use super::decisions::DecisionTables;
use super::lab_image::{LabImage, rgb_of};
use crate::error::{Error, Result};
use crate::image::{Frame, Picture, Rectangle};
use crate::mask::Mask;
use crate::numeric::{Mixture, MixtureSettings};

/// Most pixels of a rectangle that a mixture is fitted to; a larger one is sampled on an even
/// grid. More samples move the fit less than the choice of the rectangle does.
const MAX_SAMPLES: usize = 6_000;

/// Fewest pixels a rectangle must have.
const MIN_SAMPLES: usize = 16;

/// Variance under which colours do not differ, in CIE L*a*b* units squared: about the step of an
/// 8-bit channel.
const VARIANCE_FLOOR: f64 = 1.0;

/// Share of each class that may have any colour at all, evenly over the 8-bit RGB cube. It keeps a
/// colour that neither rectangle shows from being decided by the far tails of the Gaussians.
const OUTLIERS: f64 = 0.01;

/// Volume of the L*a*b* box that holds the sRGB cube: 100 × 185 × 203.
const LAB_VOLUME: f64 = 100.0 * 185.0 * 203.0;

/// Settings of the colour models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ColourSettings {
    /// Gaussians in each mixture, 1 to 8; 0 chooses the number by the Bayesian information
    /// criterion.
    pub components: usize,
    /// Prior probability of a pixel to be the animal, between 0 and 1.
    pub prior: f64,
    /// Seed of the mixtures' start.
    pub seed: u64,
}

impl Default for ColourSettings {
    fn default() -> Self {
        Self { components: 0, prior: 0.3, seed: 42 }
    }
}

/// The two mixtures with their decision for every colour.
#[derive(Clone, Debug)]
pub struct ColourModels {
    foreground: Mixture,
    background: Mixture,
    log_prior_odds: f64,
    /// Whether each colour is the animal's.
    tables: DecisionTables,
    /// 1 for those cells of a coarser cube whose middle is the animal's, 0 for others: colours that
    /// differ by less than four levels of 255 are in one, which is below the noise of footage.
    rough: ColourCube,
    /// The same decisions for pictures in L*a*b*, exact.
    rough_of_lab: DecisionTables,
}

impl ColourModels {
    /// Fits both mixtures to the rectangles of one picture.
    ///
    /// # Errors
    /// [`Error::Rectangle`] when one lies outside the picture or has under 16 pixels,
    /// [`Error::Setting`] when the prior is not between 0 and 1 or over 8 components are asked for.
    pub fn fit(
        picture: &Picture,
        foreground: Rectangle,
        background: Rectangle,
        settings: &ColourSettings,
    ) -> Result<Self> {
        Self::from_samples(
            &samples(picture, foreground, "foreground")?,
            &samples(picture, background, "background")?,
            settings,
        )
    }

    /// Fits both mixtures to L*a*b* samples.
    fn from_samples(
        foreground: &[Vector3<f64>],
        background: &[Vector3<f64>],
        settings: &ColourSettings,
    ) -> Result<Self> {
        if !(settings.prior > 0.0 && settings.prior < 1.0) {
            return Err(Error::setting("silhouette.colour.prior", "lies between 0 and 1"));
        }
        if settings.components > 8 {
            return Err(Error::setting("silhouette.colour.components", "is at most 8"));
        }
        let how = MixtureSettings { seed: settings.seed, variance_floor: VARIANCE_FLOOR };
        let fit = |samples: &[Vector3<f64>]| match settings.components {
            0 => Mixture::fit_by_bic(samples, 8, how),
            k => Mixture::fit(samples, k, how),
        };
        let (Some(foreground), Some(background)) =
            rayon::join(|| fit(foreground), || fit(background))
        else {
            return Err(Error::setting("the rectangles", "hold at least two pixels each"));
        };
        let log_prior_odds = (settings.prior / (1.0 - settings.prior)).ln();
        let [tables, rough_of_lab] = [DecisionTables::default(), DecisionTables::default()];
        let rough = ColourCube::new();
        Ok(Self { foreground, background, log_prior_odds, tables, rough, rough_of_lab })
    }

    /// Number of Gaussians of the animal and of the background.
    #[must_use]
    pub fn components(&self) -> (usize, usize) {
        (self.foreground.components(), self.background.components())
    }

    /// Logarithm of the posterior odds that a pixel of this colour is the animal.
    #[must_use]
    pub fn log_odds(&self, rgb: [u8; 3]) -> f64 {
        let lab = lab(rgb);
        let with_outliers = |mixture: &Mixture| {
            ((1.0 - OUTLIERS) * mixture.log_density(&lab).exp() + OUTLIERS / LAB_VOLUME).ln()
        };
        with_outliers(&self.foreground) - with_outliers(&self.background) + self.log_prior_odds
    }

    /// The pixels that are more likely the animal's than the background's, each colour decided by
    /// its own [`log_odds`](Self::log_odds).
    #[must_use]
    pub fn classify(&self, frame: &Frame) -> Mask {
        let decide = |rgb| self.log_odds(rgb) > 0.0;
        match frame {
            Frame::Rgb(picture) => self.tables.of_rgb(picture, decide),
            Frame::Yuv(picture) => self.tables.of_yuv(picture, decide),
        }
    }

    /// The same for a first guess: 64 colours are decided at once, by the one in their middle.
    #[must_use]
    pub fn classify_roughly(&self, picture: &Picture) -> Mask {
        let mut mask = Mask::new(picture.width(), picture.height());
        for (y, row) in picture.rgb().chunks_exact(3 * picture.width()).enumerate() {
            let pixels = row.as_chunks().0;
            mask.set_row(y, pixels.iter().map(|rgb| self.is_roughly_the_animals(*rgb)));
        }
        mask
    }

    /// The same of a picture in L*a*b*, each colour as the sRGB colour that it stands for.
    pub(super) fn classify_lab_roughly(&self, image: &LabImage) -> Mask {
        self.rough_of_lab.of_lab(image, |bytes| self.is_roughly_the_animals(rgb_of(bytes)))
    }

    #[inline]
    fn is_roughly_the_animals(&self, rgb: [u8; 3]) -> bool {
        self.rough.of(rgb, |rgb| if self.log_odds(rgb) > 0.0 { 1.0 } else { 0.0 }) > 0.0
    }
}

fn samples(
    picture: &Picture,
    rectangle: Rectangle,
    which: &'static str,
) -> Result<Vec<Vector3<f64>>> {
    let right = rectangle.x.checked_add(rectangle.width);
    let bottom = rectangle.y.checked_add(rectangle.height);
    let inside = right.is_some_and(|r| r <= picture.width())
        && bottom.is_some_and(|b| b <= picture.height());
    let area = rectangle.width.saturating_mul(rectangle.height);
    if !inside || area < MIN_SAMPLES {
        let picture = (picture.width(), picture.height());
        let rectangle = [rectangle.x, rectangle.y, rectangle.width, rectangle.height];
        return Err(Error::Rectangle { which, rectangle, picture, least_px: MIN_SAMPLES });
    }
    let step = area.div_ceil(MAX_SAMPLES);
    Ok((0..area)
        .step_by(step)
        .map(|at| {
            let (x, y) = (rectangle.x + at % rectangle.width, rectangle.y + at / rectangle.width);
            lab(picture.pixel(x, y))
        })
        .collect())
}

/// CIE L*a*b* (D65, 2° observer) of an 8-bit sRGB colour: distances in it are closer to what the
/// eye sees as different than those in RGB.
fn lab(rgb: [u8; 3]) -> Vector3<f64> {
    /// Linear light of each code value.
    static LINEAR: LazyLock<[f64; 256]> = LazyLock::new(|| {
        std::array::from_fn(|code| {
            let v = code as f64 / 255.0;
            if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        })
    });
    let [r, g, b] = rgb.map(|c| LINEAR[usize::from(c)]);
    let x = (0.412_456 * r + 0.357_576 * g + 0.180_438 * b) / 0.950_47;
    let y = 0.212_673 * r + 0.715_152 * g + 0.072_175 * b;
    let z = (0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83;
    let f = |t: f64| {
        let delta: f64 = 6.0 / 29.0;
        if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
    };
    Vector3::new(116.0 * f(y) - 16.0, 500.0 * (f(x) - f(y)), 200.0 * (f(y) - f(z)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_halves(left: [u8; 3], right: [u8; 3]) -> Picture {
        let mut rgb = Vec::new();
        for y in 0..40_usize {
            for x in 0..80_usize {
                let base = if x < 40 { left } else { right };
                let noise = ((x * 37 + y * 91) % 11) as u8;
                rgb.extend(base.map(|c| c.saturating_add(noise)));
            }
        }
        Picture::from_rgb(80, 40, rgb).unwrap()
    }

    const LEFT: Rectangle = Rectangle { x: 2, y: 2, width: 30, height: 30 };
    const RIGHT: Rectangle = Rectangle { x: 45, y: 2, width: 30, height: 30 };

    #[test]
    fn known_colours_in_lab() {
        // Reference values of sRGB primaries under D65 (Lindbloom).
        let near = |rgb, expected: [f64; 3]| {
            assert!((lab(rgb) - Vector3::from(expected)).norm() < 0.05, "{:?}", lab(rgb));
        };
        near([255, 255, 255], [100.0, 0.0, 0.0]);
        near([255, 0, 0], [53.24, 80.09, 67.20]);
        near([0, 0, 255], [32.30, 79.19, -107.86]);
        near([0, 0, 0], [0.0, 0.0, 0.0]);
    }

    #[test]
    fn two_plain_colours_are_told_apart() {
        let picture = two_halves([150, 90, 40], [60, 120, 60]);
        let models = ColourModels::fit(&picture, LEFT, RIGHT, &ColourSettings::default()).unwrap();
        let truth = Mask::from_fn(80, 40, |x, _| x < 40);
        assert!(models.classify_roughly(&picture).jaccard(&truth) > 0.999);
        assert!(models.classify(&Frame::Rgb(picture)).jaccard(&truth) > 0.999);
    }

    #[test]
    fn each_colour_is_decided_by_the_mixtures() {
        let picture = two_halves([150, 110, 80], [120, 120, 70]);
        let models = ColourModels::fit(&picture, LEFT, RIGHT, &ColourSettings::default()).unwrap();
        let (w, h) = (picture.width(), picture.height());
        let slow = Mask::from_fn(w, h, |x, y| models.log_odds(picture.pixel(x, y)) > 0.0);
        assert_eq!(models.classify(&Frame::Rgb(picture)), slow);
        assert!(!slow.is_empty() && !slow.not().is_empty());
    }

    #[test]
    fn the_rough_table_decides_nearly_as_the_mixtures_do() {
        let picture = two_halves([150, 110, 80], [120, 120, 70]);
        let models = ColourModels::fit(&picture, LEFT, RIGHT, &ColourSettings::default()).unwrap();
        let mut differing = 0;
        for code in (0..1 << 24).step_by(1009) {
            let rgb = [(code >> 16) as u8, (code >> 8) as u8, code as u8];
            let odds = models.log_odds(rgb);
            // Within a cell only colours close to the decision may differ.
            let pixel = Picture::from_rgb(1, 1, rgb.to_vec()).unwrap();
            if models.classify_roughly(&pixel).get(0, 0) != (odds > 0.0) {
                differing += 1;
                assert!(odds.abs() < 25.0, "{rgb:?} {odds}");
            }
        }
        assert!(differing < (1 << 24) / 1009 / 50, "{differing}");
    }

    #[test]
    fn rectangles_outside_or_too_small_are_refused() {
        let picture = two_halves([150, 90, 40], [60, 120, 60]);
        for rectangle in [
            Rectangle { x: 60, y: 0, width: 21, height: 10 },
            Rectangle { x: 0, y: 0, width: 3, height: 3 },
            Rectangle { x: usize::MAX, y: 0, width: 2, height: 20 },
        ] {
            let found = ColourModels::fit(&picture, rectangle, RIGHT, &ColourSettings::default());
            assert!(matches!(found, Err(Error::Rectangle { which: "foreground", .. })));
        }
        let settings = ColourSettings { prior: 1.0, ..ColourSettings::default() };
        assert!(matches!(
            ColourModels::fit(&picture, LEFT, RIGHT, &settings),
            Err(Error::Setting { .. })
        ));
    }
}
