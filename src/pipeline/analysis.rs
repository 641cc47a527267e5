//! Masks to coefficients and verdict, in memory.

use crate::error::Result;
use crate::image_pca::ImagePca;
use crate::mask::Mask;
use crate::numeric::Coefficients;
use crate::silhouette::{TrendRemoval, WindowSettings, Windowed, report_of_mask, windowed};
use crate::spectrum::{self, MaskCounts, SpectralAnalysis};

/// Everything the analysis of a clip's masks gives.
#[derive(Clone, Debug)]
pub struct MaskAnalysis {
    /// The masks cut to their windows.
    pub windows: Windowed,
    /// For each frame, whether its mask entered the PCA.
    pub used: Vec<bool>,
    /// The PCA of the used masks.
    pub pca: ImagePca,
    /// Unit-deviation scores of all frames; those of unused masks are bridged linearly from their
    /// neighbours.
    pub scores: Coefficients,
    /// Spectra, band, band-passed scores, verdict.
    pub spectral: SpectralAnalysis,
}

impl MaskAnalysis {
    /// The windows of the masks that entered the PCA.
    #[must_use]
    pub fn analysed_masks(&self) -> Vec<&Mask> {
        self.windows.masks.iter().zip(&self.used).filter(|(_, u)| **u).map(|(m, _)| m).collect()
    }

    /// The scores that keys and interpolation use.
    #[must_use]
    pub fn coefficients(&self, band_pass: bool) -> &Coefficients {
        if band_pass { &self.spectral.band_passed } else { &self.scores }
    }
}

/// Cuts, analyses and judges the masks of a clip. An empty mask says nothing, and one that the
/// border of the picture cuts says something else than the gait: both are left out of the PCA and
/// bridged, unless most of the clip is cut (a close shot), when the cut masks are all there is.
///
/// # Errors
/// As [`ImagePca::fit`] and [`spectrum::analyse`].
pub fn analyse_masks(
    masks: &[Mask],
    fps: f64,
    components: usize,
    scale_trend: TrendRemoval,
    settings: &spectrum::Settings,
) -> Result<MaskAnalysis> {
    let windows = windowed(masks, WindowSettings { scale_trend });
    let used = usable(masks);
    let good: Vec<&Mask> =
        windows.masks.iter().zip(&used).filter(|(_, used)| **used).map(|(m, _)| m).collect();
    if good.is_empty() {
        // Says that all masks are empty, or that there is none.
        let all: Vec<&Mask> = windows.masks.iter().collect();
        ImagePca::fit(&all, components)?;
    }
    let pca = ImagePca::fit(&good, components)?;
    let scores = bridged(&pca.scores, &used);
    let counts = MaskCounts { frames: masks.len(), bad: masks.len() - good.len() };
    let spectral = spectrum::analyse(&scores, &pca.variance_shares(), fps, counts, settings)?;
    Ok(MaskAnalysis { windows, used, pca, scores, spectral })
}

/// Which masks enter the PCA.
fn usable(masks: &[Mask]) -> Vec<bool> {
    let filled: Vec<bool> = masks.iter().map(|m| !m.is_empty()).collect();
    let whole: Vec<bool> =
        masks.iter().enumerate().map(|(t, m)| !report_of_mask(t, m).is_excluded()).collect();
    let count = |flags: &[bool]| flags.iter().filter(|f| **f).count();
    if 2 * count(&whole) > count(&filled) { whole } else { filled }
}

/// Spreads the scores of the used frames over all frames, linear between neighbours and constant
/// beyond the ends.
fn bridged(scores: &Coefficients, used: &[bool]) -> Coefficients {
    let frames: Vec<usize> = (0..used.len()).filter(|&t| used[t]).collect();
    let values = (0..used.len())
        .flat_map(|t| {
            let after = frames.partition_point(|&f| f < t);
            let right = after.min(frames.len() - 1);
            let left = if frames[right] <= t { right } else { right.saturating_sub(1) };
            let gap = frames[right].abs_diff(frames[left]);
            let share = if gap == 0 || frames[left] > t {
                0.0
            } else {
                (t - frames[left]) as f64 / gap as f64
            };
            let (a, b) = (scores.point(left), scores.point(right));
            a.iter().zip(b).map(|(x, y)| x + share.min(1.0) * (y - x)).collect::<Vec<_>>()
        })
        .collect();
    Coefficients::from_rows(used.len(), scores.components(), values)
        .unwrap_or_else(|| scores.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_cut_by_the_border_are_left_out_unless_most_are() {
        let whole = Mask::from_fn(9, 9, |x, y| (3..6).contains(&x) && (3..6).contains(&y));
        let cut = Mask::from_fn(9, 9, |x, y| x < 3 && (3..6).contains(&y));
        let empty = Mask::new(9, 9);
        let some = [whole.clone(), cut.clone(), whole.clone(), empty.clone()];
        assert_eq!(usable(&some), [true, false, true, false]);
        assert_eq!(usable(&[whole, cut.clone(), cut, empty]), [true, true, true, false]);
    }

    #[test]
    fn gaps_are_bridged_and_ends_held() {
        let scores = Coefficients::from_rows(3, 1, vec![1.0, 4.0, 10.0]).unwrap();
        let used = [false, true, false, false, true, true, false];
        let all = bridged(&scores, &used);
        assert_eq!(all.column(0), [1.0, 1.0, 2.0, 3.0, 4.0, 10.0, 10.0]);
        let same = bridged(&scores, &[true, true, true]);
        assert_eq!(same, scores);
    }
}
