//! What all requests share.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::clips::Clips;
use super::desk::Desk;
use super::guard::Guard;
use super::jobs::JobNumbers;
use super::refusal::{Refusal, Result};
use super::rigs::Rigs;
use super::root::Root;
use crate::shot::paths;

/// The studio.
pub(super) struct Studio {
    pub(super) root: Root,
    pub(super) guard: Guard,
    /// The shot to open at once.
    pub(super) first: Option<String>,
    pub(super) clips: Clips,
    pub(super) rigs: Rigs,
    pub(super) numbers: JobNumbers,
    desks: Mutex<BTreeMap<PathBuf, Arc<Desk>>>,
    stop: tokio::sync::watch::Sender<bool>,
}

impl Studio {
    pub(super) fn new(root: Root, guard: Guard, first: Option<String>) -> Self {
        Self {
            root,
            guard,
            first,
            clips: Clips::default(),
            rigs: Rigs::default(),
            numbers: JobNumbers::default(),
            desks: Mutex::default(),
            stop: tokio::sync::watch::channel(false).0,
        }
    }

    /// The shot in a folder named by the page.
    pub(super) fn desk(&self, shot: &str) -> Result<Arc<Desk>> {
        let folder = self.root.existing(shot)?;
        if !self.root.holds(&folder.join(paths::SETTINGS)) {
            let hint = Some("make one first".to_owned());
            let refusal = Refusal::not_found(format!("{shot}: there is no shot here"));
            return Err(Refusal { hint, ..refusal });
        }
        let name = self.root.name(&folder);
        let mut desks = self.lock();
        let desk = desks.entry(folder.clone()).or_insert_with(|| Arc::new(Desk::new(folder, name)));
        Ok(Arc::clone(desk))
    }

    /// All shots that were opened.
    pub(super) fn desks(&self) -> Vec<Arc<Desk>> {
        self.lock().values().cloned().collect()
    }

    /// Asks a job to stop.
    pub(super) fn cancel(&self, id: &str) -> Result<()> {
        let mut jobs = self.desks().into_iter().filter_map(|desk| desk.job());
        let job = jobs.find(|job| job.id() == id);
        job.map(|job| job.cancel()).ok_or_else(|| Refusal::not_found("this job does not run"))
    }

    /// Ends the studio.
    pub(super) fn stop(&self) {
        self.stop.send_replace(true);
    }

    /// Ready when the studio is to end.
    pub(super) async fn stopped(&self) {
        let mut stop = self.stop.subscribe();
        // The sender lives as long as `self`.
        let _ = stop.wait_for(|stopped| *stopped).await;
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Arc<Desk>>> {
        self.desks.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
