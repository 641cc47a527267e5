//! What of a stretch does not depend on corrections, so that it can be kept for the next one.

use crate::mask::Mask;
use crate::motion::CameraPath;

/// The camera and the drafts of a stretch, as they are without corrections.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseDrafts {
    /// One step a frame, pixels of the sketch.
    pub path: CameraPath,
    /// One draft a frame, at the sketch's size.
    pub masks: Vec<Mask>,
}
