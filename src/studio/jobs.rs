//! Work that takes time: the same functions the command line calls, on a thread of their own.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::desk::Desk;
use super::refusal::{Refusal, Result};
use super::root::Root;
use crate::error::Error;
use crate::pipeline::{Options, Progress};
use crate::shot::{Lock, Shot, Stage};
use crate::work;

/// Where the movie goes: a name that a shot shows beside its animation.
const MOVIE: &str = "animation.mp4";

/// Progress is told at most this often.
const TELL_EVERY: Duration = Duration::from_millis(100);

/// What `POST /api/run` asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Order {
    pub(super) shot: String,
    stage: Command,
    #[serde(default)]
    force: bool,
    #[serde(default)]
    overlay: bool,
    /// With the report: footage and rig side by side as `animation.mp4`.
    #[serde(default)]
    movie: bool,
}

/// The commands that do work on a shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Command {
    Segment,
    Analyze,
    Keys,
    Animate,
    Report,
    Run,
}

/// A job under way.
#[derive(Debug)]
pub(super) struct Job {
    id: String,
    command: Command,
    desk: Arc<Desk>,
    cancelled: AtomicBool,
    told: Mutex<Told>,
}

/// How far the job said it is.
#[derive(Debug)]
struct Told {
    stage: &'static str,
    done: usize,
    total: Option<usize>,
    at: Option<Instant>,
}

impl Job {
    pub(super) fn id(&self) -> &str {
        &self.id
    }

    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::SeqCst);
    }

    /// What the page is told of a job that runs.
    pub(super) fn status(&self) -> Value {
        let told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        json!({
            "job": self.id, "command": self.command, "stage": told.stage,
            "done": told.done, "total": told.total,
        })
    }
}

impl Progress for Job {
    fn step(&self, stage: Stage, done: usize, total: Option<usize>) -> bool {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        (told.stage, told.done, told.total) = (stage.name(), done, total);
        if told.at.is_none_or(|at| at.elapsed() >= TELL_EVERY) {
            told.at = Some(Instant::now());
            drop(told);
            let data = json!({"job": self.id, "stage": stage.name(), "done": done, "total": total});
            self.desk.tell("progress", &data);
        }
        !self.cancelled.load(Ordering::SeqCst)
    }
}

/// Numbers jobs.
#[derive(Debug, Default)]
pub(super) struct JobNumbers(AtomicU64);

/// Starts a job; its id. One at a time works on a shot.
pub(super) fn start(
    numbers: &JobNumbers,
    root: &Root,
    desk: &Arc<Desk>,
    order: &Order,
) -> Result<String> {
    let (writing, lock) = desk.write()?;
    let shot = desk.shot()?;
    let id = (numbers.0.fetch_add(1, Ordering::SeqCst) + 1).to_string();
    let job = Arc::new(Job {
        id: id.clone(),
        command: order.stage,
        desk: Arc::clone(desk),
        cancelled: AtomicBool::new(false),
        told: Mutex::new(Told { stage: "", done: 0, total: None, at: None }),
    });
    desk.set_job(Some(Arc::clone(&job)));
    drop(writing);
    let (root, order) = (root.clone(), order.clone());
    let started = std::thread::Builder::new().name(format!("job {id}")).spawn({
        let desk = Arc::clone(desk);
        move || {
            let ended = Ended { desk, root };
            carry_out(&ended, &job, &order, shot, lock);
        }
    });
    if started.is_err() {
        desk.set_job(None);
        return Err(Refusal::defect());
    }
    Ok(id)
}

/// However a job ends, its shot is free again afterwards and the pages know which files changed.
struct Ended {
    desk: Arc<Desk>,
    root: Root,
}

impl Drop for Ended {
    fn drop(&mut self) {
        if let Some(job) = self.desk.job() {
            self.desk.set_job(None);
            if std::thread::panicking() {
                let failed = Refusal::defect();
                self.desk.tell(
                    "failed",
                    &json!({"job": job.id, "error": failed.sentence, "hint": null}),
                );
            }
        }
        self.desk.tell_changes(&self.root);
    }
}

fn carry_out(ended: &Ended, job: &Job, order: &Order, shot: Shot, lock: Lock) {
    let begun = Instant::now();
    let result = perform(job, order, &shot);
    // The shot is free before the pages hear of the end, so that they can go on at once.
    drop(lock);
    let Ended { desk, root } = ended;
    desk.tell_changes(root);
    desk.set_job(None);
    match result {
        Ok(done) => {
            let result = root.without_paths(done.result);
            let data = json!({
                "job": job.id, "stage": order.stage, "ran": done.ran,
                "seconds": begun.elapsed().as_secs_f64(), "kept": done.kept, "result": result,
            });
            desk.tell("done", &data);
        }
        Err(Error::Interrupted) => {
            desk.tell("cancelled", &json!({"job": job.id, "stage": order.stage}));
        }
        Err(error) => {
            let refusal = Refusal::from(error).map_text(|text| root.without_path(text));
            let data = json!({
                "job": job.id, "stage": order.stage, "error": refusal.sentence, "hint": refusal.hint,
            });
            desk.tell("failed", &data);
        }
    }
}

struct Done {
    /// False when everything was up to date.
    ran: bool,
    /// Files edited by hand that were kept.
    kept: Vec<String>,
    /// The document of the command.
    result: Value,
}

fn perform(job: &Job, order: &Order, shot: &Shot) -> crate::error::Result<Done> {
    let options = Options { progress: job, force: order.force };
    Ok(match order.stage {
        Command::Segment => {
            let done = work::segment(shot, order.overlay, options)?;
            Done {
                ran: done.summary.ran,
                kept: done.summary.kept.clone(),
                result: document(&done)?,
            }
        }
        Command::Analyze => {
            let done = work::analyze(shot, options)?;
            let result = document(&done.diagnosis)?;
            Done { ran: done.outcome.ran, kept: done.outcome.kept, result }
        }
        Command::Keys => {
            let done = work::keys(shot, options)?;
            let result = document(&done.keys)?;
            Done { ran: done.outcome.ran, kept: done.outcome.kept, result }
        }
        Command::Animate => {
            let done = work::animate(shot, options)?;
            let result = document(&work::animate_document(shot, &done.animation))?;
            Done { ran: done.outcome.ran, kept: done.outcome.kept, result }
        }
        Command::Report => {
            let movie = order.movie.then(|| shot.path(MOVIE));
            let work::Reported { document: done, kept, .. } =
                work::report(shot, movie.as_deref(), options)?;
            Done { ran: true, kept, result: document(&done)? }
        }
        Command::Run => {
            let (done, kept) = work::run(shot, options)?;
            Done { ran: true, kept, result: document(&done)? }
        }
    })
}

fn document<T: Serialize>(value: &T) -> crate::error::Result<Value> {
    serde_json::to_value(value)
        .map_err(|e| Error::Document { path: "(result)".into(), what: e.to_string() })
}
