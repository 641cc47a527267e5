//! One shot as the studio holds it: who writes, which job runs, who is told.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use serde_json::json;
use tokio::sync::broadcast;

use super::jobs::Job;
use super::names;
use super::refusal::{Refusal, Result};
use super::root::Root;
use super::versions::Versions;
use crate::shot::{Lock, Shot, paths};

/// Events kept for a page that is slow to take them.
const EVENTS_KEPT: usize = 256;

/// Something the pages of a shot are told.
#[derive(Clone, Debug)]
pub(super) struct Event {
    pub(super) name: &'static str,
    pub(super) data: Arc<str>,
}

/// Versions of all files of a shot, by name.
type Snapshot = BTreeMap<String, String>;

/// One shot.
#[derive(Debug)]
pub(super) struct Desk {
    folder: PathBuf,
    /// Relative to the root.
    pub(super) name: String,
    pub(super) versions: Versions,
    /// Held while a file is compared with the version a change was based on, and replaced.
    writing: Mutex<()>,
    job: Mutex<Option<Arc<Job>>>,
    events: broadcast::Sender<Event>,
    told: Mutex<Option<Snapshot>>,
}

impl Desk {
    pub(super) fn new(folder: PathBuf, name: String) -> Self {
        let (events, _) = broadcast::channel(EVENTS_KEPT);
        Self {
            folder,
            name,
            versions: Versions::default(),
            writing: Mutex::new(()),
            job: Mutex::new(None),
            events,
            told: Mutex::new(None),
        }
    }

    /// The shot as its settings are now.
    pub(super) fn shot(&self) -> Result<Shot> {
        Ok(Shot::open(&self.folder)?)
    }

    /// Keeps everybody else from writing: other pages, jobs, and other processes.
    pub(super) fn write(&self) -> Result<(MutexGuard<'_, ()>, Lock)> {
        let guard = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        if self.job().is_some() {
            return Err(Refusal::busy());
        }
        Ok((guard, self.shot()?.lock()?))
    }

    /// The job that runs.
    pub(super) fn job(&self) -> Option<Arc<Job>> {
        self.job.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn set_job(&self, job: Option<Arc<Job>>) {
        *self.job.lock().unwrap_or_else(PoisonError::into_inner) = job;
    }

    /// Takes part in what is told from now on.
    pub(super) fn listen(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    pub(super) fn has_listeners(&self) -> bool {
        self.events.receiver_count() > 0
    }

    /// Tells all pages; nobody need listen.
    pub(super) fn tell<T: Serialize>(&self, name: &'static str, data: &T) {
        let data = serde_json::to_string(data).unwrap_or_else(|_| "{}".to_owned());
        let _ = self.events.send(Event { name, data: data.into() });
    }

    /// Tells which files are new, changed or gone since the last time. The first time everything is
    /// as the page that just loaded the shot has seen it.
    pub(super) fn tell_changes(&self, root: &Root) {
        let Ok(shot) = self.shot() else { return };
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let now = self.snapshot(root, &shot);
        let Some(before) = told.replace(now.clone()) else { return };
        let mut changed: Snapshot = now
            .iter()
            .filter(|(name, version)| before.get(*name) != Some(version))
            .map(|(name, version)| (name.clone(), version.clone()))
            .collect();
        let gone = before.keys().filter(|name| !now.contains_key(*name));
        changed.extend(gone.map(|name| (name.clone(), String::new())));
        if !changed.is_empty() {
            let settings = now.get(paths::SETTINGS);
            self.tell("changed", &json!({"files": changed, "settings_version": settings}));
        }
    }

    /// The versions of all files there are.
    pub(super) fn snapshot(&self, root: &Root, shot: &Shot) -> Snapshot {
        names::all(root, shot)
            .into_iter()
            .filter_map(|(name, path)| Some((name, self.versions.of(&path).ok()?)))
            .filter(|(_, version)| !version.is_empty())
            .collect()
    }
}
