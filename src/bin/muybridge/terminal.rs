//! What goes to the terminal beside results: progress bars, notes, errors. Results go to standard
//! output, all of this to standard error.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use muybridge::pipeline::Progress;
use muybridge::shot::Stage;

/// Set by Ctrl-C and SIGTERM; every progress report then answers "stop".
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// When the first of them came.
static FIRST_INTERRUPT: OnceLock<Instant> = OnceLock::new();

/// A second Ctrl-C after this long ends the program at once.
const IMPATIENCE: Duration = Duration::from_millis(500);

/// From now on Ctrl-C ends the work in an orderly way; a second one ends it at once.
pub(crate) fn catch_interrupts() {
    let handler = || {
        // One key press can arrive twice (from the terminal and from a parent that passes it on);
        // only a later one means impatience.
        let first = *FIRST_INTERRUPT.get_or_init(Instant::now);
        if INTERRUPTED.swap(true, Ordering::SeqCst) && first.elapsed() > IMPATIENCE {
            std::process::exit(130);
        }
    };
    // Without a handler Ctrl-C still works: the process dies and the next run mends the folder.
    if let Err(error) = ctrlc::set_handler(handler) {
        tracing::debug!(%error, "no interrupt handler");
    }
}

/// Whether Ctrl-C was pressed.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// A progress bar a stage, on a terminal only.
pub(crate) struct Bars {
    shown: bool,
    current: Mutex<Option<(Stage, ProgressBar)>>,
}

impl Bars {
    /// Bars that are drawn when `quiet` is false and standard error is a terminal (indicatif
    /// itself stays silent otherwise).
    pub(crate) fn new(quiet: bool) -> Self {
        Self { shown: !quiet, current: Mutex::new(None) }
    }

    /// Removes the bar from the screen.
    pub(crate) fn finish(&self) {
        if let Ok(mut current) = self.current.lock()
            && let Some((_, bar)) = current.take()
        {
            bar.finish_and_clear();
        }
    }

    fn bar(stage: Stage, total: Option<usize>) -> ProgressBar {
        let bar = match total {
            Some(total) => ProgressBar::new(total as u64),
            None => ProgressBar::no_length(),
        };
        let template = match total {
            Some(_) => "{msg:>9} {bar:32} {pos}/{len}  {elapsed}, {eta} to go",
            None => "{msg:>9} {spinner} {pos} frames  {elapsed}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(stage.name());
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}

impl Progress for Bars {
    fn step(&self, stage: Stage, done: usize, total: Option<usize>) -> bool {
        if self.shown
            && let Ok(mut current) = self.current.lock()
        {
            if current.as_ref().is_none_or(|(s, _)| *s != stage) {
                if let Some((_, old)) = current.take() {
                    old.finish_and_clear();
                }
                *current = Some((stage, Self::bar(stage, total)));
            }
            if let Some((_, bar)) = current.as_ref() {
                if let Some(total) = total {
                    bar.set_length(total as u64);
                }
                bar.set_position(done as u64);
            }
        }
        !interrupted()
    }
}

/// Writes a line to standard error; a closed one is no reason to fail.
pub(crate) fn say(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Log lines on standard error: warnings, with `-v` what is done, with `-vv` everything.
pub(crate) fn start_log(verbose: u8, quiet: bool) {
    let level = match (quiet, verbose) {
        (true, _) => tracing::Level::ERROR,
        (false, 0) => tracing::Level::WARN,
        (false, 1) => tracing::Level::INFO,
        (false, 2) => tracing::Level::DEBUG,
        _ => tracing::Level::TRACE,
    };
    let colour = std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
        && std::io::stderr().is_terminal();
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_ansi(colour)
        .with_target(false)
        .without_time()
        .init();
}
