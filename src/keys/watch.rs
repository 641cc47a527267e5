//! The clock of a search, its measure of work, and the caller's say in it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How often progress is reported.
const TICK: Duration = Duration::from_millis(100);

/// The clock, the caller's progress callback and the stop they can call for.
pub(super) struct Watch<'a> {
    deadline: Option<Instant>,
    progress: &'a (dyn Fn(usize, usize) -> bool + Sync),
    start: Instant,
    last_tick: AtomicU64,
    late: AtomicBool,
    interrupted: AtomicBool,
    work: AtomicU64,
    work_limit: u64,
}

impl<'a> Watch<'a> {
    pub(super) fn new(
        deadline: Option<Instant>,
        work_limit: u64,
        progress: &'a (dyn Fn(usize, usize) -> bool + Sync),
    ) -> Self {
        Self {
            deadline,
            progress,
            start: Instant::now(),
            last_tick: AtomicU64::new(0),
            late: AtomicBool::new(false),
            interrupted: AtomicBool::new(false),
            work: AtomicU64::new(0),
            work_limit,
        }
    }

    /// Counts work done by the proof; beyond the limit it ends as if time were up.
    pub(super) fn worked(&self, amount: u64) {
        if self.work.fetch_add(amount, Ordering::Relaxed) + amount > self.work_limit {
            self.late.store(true, Ordering::Relaxed);
        }
    }

    /// Whether work should end, for the time limit or for the user; reports progress now and then.
    pub(super) fn halted(&self) -> bool {
        if self.late.load(Ordering::Relaxed) || self.interrupted.load(Ordering::Relaxed) {
            return true;
        }
        let now = Instant::now();
        if self.deadline.is_some_and(|d| now >= d) {
            self.late.store(true, Ordering::Relaxed);
        }
        let elapsed = now.duration_since(self.start).as_nanos() as u64;
        let last = self.last_tick.load(Ordering::Relaxed);
        if elapsed >= last + TICK.as_nanos() as u64
            && self
                .last_tick
                .compare_exchange(last, elapsed, Ordering::Relaxed, Ordering::Relaxed)
                .is_ok()
        {
            let milliseconds = |d: Duration| d.as_millis() as usize;
            let total = self.deadline.map_or(0, |d| milliseconds(d.duration_since(self.start)));
            let done = milliseconds(now.duration_since(self.start));
            let done = if total > 0 { done.min(total) } else { done };
            if !(self.progress)(done, total) {
                self.interrupted.store(true, Ordering::Relaxed);
            }
        }
        self.late.load(Ordering::Relaxed) || self.interrupted.load(Ordering::Relaxed)
    }

    /// Whether the caller asked to stop.
    pub(super) fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}
