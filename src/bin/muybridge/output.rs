//! Results on standard output: text for people, or one JSON document.

use std::io::{self, Write};

use serde::Serialize;

/// Where and how results are printed.
pub(crate) struct Output {
    /// One JSON document instead of text.
    pub(crate) json: bool,
    /// No notes beside results.
    pub(crate) quiet: bool,
}

impl Output {
    /// Prints a result: `document` with `--json`, else `text`.
    pub(crate) fn result<T: Serialize>(&self, document: &T, text: &str) -> anyhow::Result<()> {
        let mut out = io::stdout().lock();
        let written = if self.json {
            serde_json::to_writer_pretty(&mut out, document)?;
            writeln!(out)
        } else {
            writeln!(out, "{}", text.trim_end())
        };
        match written.and_then(|()| out.flush()) {
            // A reader that has seen enough (`| head`) is no failure.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => Ok(other?),
        }
    }

    /// Says something beside the result, on standard error.
    pub(crate) fn note(&self, text: &str) {
        if !self.quiet {
            super::terminal::say(text);
        }
    }

    /// Says which hand-edited files were kept.
    pub(crate) fn kept(&self, files: &[String]) {
        match files {
            [] => {}
            [one] => self.note(&format!("kept as edited by hand: {one} (--force replaces it)")),
            [first, .., last] => self.note(&format!(
                "kept as edited by hand: {} files, {first} … {last} (--force replaces them)",
                files.len()
            )),
        }
    }
}
