//! `muybridge segment`.

use muybridge::pipeline::{self, SegmentSummary};

use super::{open, options, shown};
use crate::Ending;
use crate::args::Stage;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Stage, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(args)?;
    let summary = pipeline::segment(&shot, options(bars, args.force))?;
    bars.finish();
    output.kept(&summary.kept);
    output.result(&summary, &text(&summary, &shown(&shot.path("masks"))))?;
    Ok(Ending::Done)
}

pub(crate) fn text(summary: &SegmentSummary, folder: &str) -> String {
    let mut text = format!("{} masks in {folder}\n", summary.frames);
    let mut line = |what: &str, frames: &[usize]| {
        if !frames.is_empty() {
            let shown: Vec<String> = frames.iter().take(12).map(ToString::to_string).collect();
            let more = if frames.len() > 12 { ", …" } else { "" };
            text.push_str(&format!(
                "{what} in {} frames: {}{more}\n",
                frames.len(),
                shown.join(", ")
            ));
        }
    };
    line("the animal was lost", &summary.lost_frames);
    line("it reaches the border of the picture", &summary.border_frames);
    text
}
