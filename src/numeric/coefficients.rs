//! The coefficients of a clip's frames on its principal components.

/// Coefficients of every frame on every principal component: `frames` rows, `components`
/// columns, row-major. What the analysis hands to key choice and interpolation.
///
/// Columns are in order of falling eigenvalue. Whether a column is scaled to unit standard
/// deviation (population, divisor n) is said by the function that made it.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    frames: usize,
    components: usize,
    values: Vec<f64>,
}

impl Coefficients {
    /// From row-major values; `None` when `values` has not `frames * components` entries.
    #[must_use]
    pub fn from_rows(frames: usize, components: usize, values: Vec<f64>) -> Option<Self> {
        (values.len() == frames.checked_mul(components)?).then_some(Self {
            frames,
            components,
            values,
        })
    }

    /// From columns of equal length; `None` when their lengths differ.
    #[must_use]
    pub fn from_columns(columns: &[Vec<f64>]) -> Option<Self> {
        let frames = columns.first().map_or(0, Vec::len);
        if columns.iter().any(|c| c.len() != frames) {
            return None;
        }
        let values = (0..frames).flat_map(|t| columns.iter().map(move |c| c[t])).collect();
        Some(Self { frames, components: columns.len(), values })
    }

    /// Number of frames, n.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Number of components, c.
    #[must_use]
    pub fn components(&self) -> usize {
        self.components
    }

    /// The point p(t) of frame `t`: its `components` coefficients.
    ///
    /// # Panics
    /// When `t` is not a frame.
    #[must_use]
    pub fn point(&self, t: usize) -> &[f64] {
        &self.values[t * self.components..(t + 1) * self.components]
    }

    /// The points of some frames, a copy.
    ///
    /// # Panics
    /// When `frames` are not all frames.
    #[must_use]
    pub fn rows(&self, frames: std::ops::Range<usize>) -> Self {
        let values =
            self.values[frames.start * self.components..frames.end * self.components].to_vec();
        Self { frames: frames.len(), components: self.components, values }
    }

    /// One component over time, a copy.
    ///
    /// # Panics
    /// When `component` is not a component.
    #[must_use]
    pub fn column(&self, component: usize) -> Vec<f64> {
        assert!(component < self.components, "no such component");
        self.values.iter().skip(component).step_by(self.components).copied().collect()
    }

    /// Fails with the place of the first coefficient that is NaN or infinite.
    ///
    /// # Errors
    /// [`crate::Error::CoefficientNotFinite`].
    pub fn check_finite(&self) -> crate::Result<()> {
        match self.values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(at) => Err(crate::Error::CoefficientNotFinite {
                frame: at / self.components,
                component: at % self.components,
            }),
        }
    }

    /// The first `components` columns (all of them when there are fewer).
    #[must_use]
    pub fn leading(&self, components: usize) -> Self {
        let kept = components.min(self.components);
        let values = (0..self.frames).flat_map(|t| self.point(t)[..kept].iter().copied()).collect();
        Self { frames: self.frames, components: kept, values }
    }
}
