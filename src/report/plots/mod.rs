//! Plots as SVG, one function and one input struct each.
//!
//! Every plot has a white ground, so that it can be read on its own wherever it is shown; the
//! page recolours the few named colours where the reader prefers a dark one. Curves are drawn on
//! a tenth-of-a-pixel grid. Values that are not finite leave a gap.

mod error_curves;
mod figure;
mod panel;
mod scores;
mod silhouettes;
mod spectra;
mod trajectory;
mod weights;

pub use error_curves::{ErrorCurve, ErrorCurves, ReferenceLevel, error_curves};
pub use figure::Svg;
pub use scores::{Scores, scores};
pub use silhouettes::{SilhouetteMeasures, silhouette_measures};
pub use spectra::{Band, Spectra, spectra};
pub use trajectory::{Trajectory, trajectory};
pub use weights::{WeightCurve, Weights, weights};
