//! Footage to silhouettes: colour models from two rectangles, clean-up, the component that is the
//! animal, the window about it, and the removal of a slow trend of scale (seed 003, section 2.2).

mod area_jumps;
mod back;
mod base_drafts;
mod clip;
mod colour;
mod colour_cube;
mod colour_table;
mod correction;
mod cues;
mod decisions;
mod drafts;
mod evidence;
mod expected;
mod field;
mod frame_report;
mod lab_image;
mod least_sure;
mod light;
mod likeness;
mod location;
mod occlusions;
mod outline;
mod plate;
mod reach;
mod resemblance;
mod scale;
mod scale_trend;
mod segmenter;
mod shadow;
mod track;
mod warp;
mod warp_row;
mod window;

pub use area_jumps::{area_jumps, flag_area_jumps};
pub use base_drafts::BaseDrafts;
pub use clip::{ClipSegmenter, STRETCH_FRAMES};
pub use colour::{ColourModels, ColourSettings};
pub use correction::Labels;
pub use frame_report::{Flag, Flags, FrameReport, report_of_corrected_mask, report_of_mask};
pub use least_sure::least_sure;
pub use occlusions::{flag_companions, flag_occlusions};
pub use scale_trend::{ScaleTrend, TrendRemoval};
pub use segmenter::{Chosen, CleanSettings, Method, Parts, Segmenter, Settings};
pub use track::GateSettings;
pub use window::{WindowSettings, Windowed, windowed};
