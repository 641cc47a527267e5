//! How long work tells how far it is, and is told to stop.

use crate::shot::Stage;

/// Told how far a stage is. `false` means stop: the work ends with
/// [`Error::Interrupted`](crate::Error::Interrupted) and leaves the folder as it was.
pub trait Progress: Sync {
    /// `done` of `total` steps of a stage are done; the total is unknown while streaming.
    fn step(&self, stage: Stage, done: usize, total: Option<usize>) -> bool;
}

/// Says nothing, never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn step(&self, _stage: Stage, _done: usize, _total: Option<usize>) -> bool {
        true
    }
}
