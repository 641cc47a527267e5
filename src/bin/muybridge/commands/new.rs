//! `muybridge new`.

use muybridge::pipeline::{NewShot, new_shot};

use super::shown;
use crate::Ending;
use crate::args::New;
use crate::output::Output;
use crate::usage;

pub(crate) fn execute(args: &New, output: &Output) -> anyhow::Result<Ending> {
    let rectangle = |flag: &'static str, text: &Option<String>| {
        text.as_deref().map(|t| usage::rectangle(flag, t)).transpose()
    };
    let wanted = NewShot {
        from: args.from.clone(),
        mattes: args.mattes.clone(),
        invert: args.invert,
        strokes: args.strokes.clone(),
        fps: args.fps,
        frames: args.frames.clone(),
        foreground: rectangle("--foreground", &args.foreground)?,
        background: rectangle("--background", &args.background)?,
    };
    let report = new_shot(&args.shot, &wanted, args.force)?;
    for finding in &report.findings {
        output.note(&format!("note: {finding}"));
    }
    if report.fps_assumed {
        output.note("note: the source does not say its frame rate; 25 is taken (--fps sets it)");
    }
    let frames = report.frames.map(|n| format!(", {n} frames")).unwrap_or_default();
    let text = format!(
        "{}: {} × {} pixels{frames} at {} frames a second\nnext: muybridge run {}",
        shown(&args.shot),
        report.size_px[0],
        report.size_px[1],
        report.fps,
        shown(&args.shot)
    );
    output.result(&report, &text)?;
    Ok(Ending::Done)
}
