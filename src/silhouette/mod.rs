//! Footage to silhouettes: colour models from two rectangles, clean-up, the component that is the
//! animal, the window about it, and the removal of a slow trend of scale (seed 003, section 2.2).

mod colour;
mod scale_trend;
mod segmenter;
mod track;
mod window;

pub use colour::{ColourModels, ColourSettings};
pub use scale_trend::{ScaleTrend, TrendRemoval};
pub use segmenter::{CleanSettings, Segmenter, Settings, StrokeHints};
pub use track::{FrameReport, GateSettings, Status, report_of_mask};
pub use window::{WindowSettings, Windowed, windowed};
