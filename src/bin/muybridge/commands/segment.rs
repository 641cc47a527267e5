//! `muybridge segment`.

use muybridge::pipeline::SegmentSummary;
use muybridge::shot::{Shot, paths};
use muybridge::work::{self, OverlayDocument};

use super::{open, options, shown};
use crate::Ending;
use crate::args::Segment;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Segment, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(&args.stage)?;
    let document = work::segment(&shot, args.overlay, options(bars, args.stage.force))?;
    bars.finish();
    output.kept(&document.summary.kept);
    let mut text = text(&document.summary, &shot);
    if let Some(overlay) = &document.overlay {
        text.push_str(&overlay_text(overlay));
    }
    output.result(&document, &text)?;
    Ok(Ending::Done)
}

pub(crate) fn text(summary: &SegmentSummary, shot: &Shot) -> String {
    let mut text = format!("{} masks in {}\n", summary.frames, shown(&shot.path("masks")));
    for excludes in [true, false] {
        let lines: Vec<_> = summary.flagged.iter().filter(|f| f.excludes == excludes).collect();
        if lines.is_empty() {
            continue;
        }
        text.push_str(if excludes { "flagged frames:\n" } else { "also noted:\n" });
        for line in lines {
            text.push_str(&format!("  {}: {}\n", ranges(&line.frames), line.words));
        }
    }
    if let Some(frame) = summary.correct_next {
        let sure = summary.silhouettes.get(frame).map_or(0.0, |s| s.confidence);
        text.push_str(&format!(
            "least sure: frame {frame} (confidence {sure:.2}); repaint {} or draw strokes on it\n",
            paths::mask(frame)
        ));
    }
    text
}

fn overlay_text(overlay: &OverlayDocument) -> String {
    let mut text = format!("outlines over the footage: {}\n", overlay.path);
    match overlay.drawn.flagged_left_out {
        0 => {}
        1 => text.push_str("one flagged frame more found no room on it\n"),
        more => text.push_str(&format!("{more} flagged frames more found no room on it\n")),
    }
    text
}

/// `3, 12–17, 40`: ascending frames with their runs joined; what is beyond twelve runs is counted.
fn ranges(frames: &[usize]) -> String {
    const MOST: usize = 12;
    let runs: Vec<&[usize]> = frames.chunk_by(|a, b| *b == a + 1).collect();
    let mut shown: Vec<String> = runs
        .iter()
        .take(MOST)
        .map(|run| match run {
            [first, .., last] => format!("{first}–{last}"),
            other => other.iter().map(ToString::to_string).collect(),
        })
        .collect();
    let more: usize = runs.iter().skip(MOST).map(|run| run.len()).sum();
    if more > 0 {
        shown.push(format!("… {more} more"));
    }
    shown.join(", ")
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn runs_are_joined_and_many_are_counted() {
        assert_eq!(ranges(&[3]), "3");
        assert_eq!(ranges(&[3, 12, 13, 14, 40, 41]), "3, 12–14, 40–41");
        let many: Vec<usize> = (0..30).map(|i| 2 * i).collect();
        assert!(ranges(&many).ends_with("22, … 18 more"), "{}", ranges(&many));
    }
}
