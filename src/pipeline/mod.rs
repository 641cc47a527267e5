//! The only place where stages meet: what each stage of a shot reads, does and writes.
//!
//! [`analysis`](analyse_masks) and [`choose`] are the method itself, in memory; the stage functions
//! wrap them with the shot folder. Every stage first brings the stages before it up to date.

mod analysis;
mod animate;
mod bridge;
mod choose;
mod demo;
mod drift;
mod feet;
mod footage;
mod kept;
mod mirror;
mod new;
mod pan;
mod phase;
mod progress;
mod segment;
mod segments;
mod spool;
mod stages;
mod status;
mod timing;
mod view_drift;

pub use analysis::{MaskAnalysis, MaskClip, Trends, analyse_masks};
pub use animate::{AnimationResult, animate};
pub use choose::{
    Chosen, KeyRequest, KeysOnPhase, OverPhase, choose, choose_by_phase, interpolation_weights,
    keys_by_phase, phase_weights, resolved_method, time_order,
};
pub use demo::{demo, pose_from_truth};
pub use drift::ShapeDrift;
pub use mirror::halves_alike;
pub use new::{NewShot, NewShotReport, new_shot};
pub use progress::{NoProgress, Progress};
pub use segment::{FlaggedLine, SegmentSummary, SilhouetteLine, segment};
pub use segments::{Segment, SegmentGait, analyse_segments};
pub use stages::{AnalyzeResult, KeysResult, analyze, keys, stored_masks_hash, weights};
pub use status::{StageState, stage_states};

/// How a stage runs.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Told how far the work is; may stop it.
    pub progress: &'a dyn Progress,
    /// Run the named stage again and overwrite files edited by hand.
    pub force: bool,
}

impl Options<'_> {
    /// The same for a stage that was not named by the user but is needed by the one that was.
    #[must_use]
    pub fn for_earlier_stage(self) -> Self {
        Self { force: false, ..self }
    }
}

/// What a stage did to the folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Whether it ran; `false` when everything was up to date.
    pub ran: bool,
    /// Files edited by hand that were kept.
    pub kept: Vec<String>,
}
