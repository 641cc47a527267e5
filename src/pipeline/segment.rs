//! Footage, mattes or strokes to masks.

use std::path::PathBuf;

use serde::Serialize;

use super::{Options, Outcome};
use crate::error::{Error, Result};
use crate::frames::strokes::{self, Said};
use crate::mask::{Mask, default_stroke_radius_px};
use crate::shot::{
    Freshness, Input, Reads, Shot, Stage, StageWriter, hash_value, number, paths, table,
};
use crate::silhouette::{Flag, Flags, FrameReport, Segmenter, StrokeHints, report_of_mask};

/// What `segment` did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentSummary {
    /// Number of frames.
    pub frames: usize,
    /// Frames in which the animal was lost or nothing of its colour was seen.
    pub lost_frames: Vec<usize>,
    /// Frames whose silhouette reaches the border of the picture.
    pub border_frames: Vec<usize>,
    /// Masks edited by hand, which were kept.
    pub kept: Vec<String>,
    /// Whether anything had to be done.
    pub ran: bool,
}

/// Makes one mask a frame, unless they are up to date. Masks edited by hand are kept.
///
/// # Errors
/// Whatever the source fails with; [`Error::NoRectangles`] for footage without rectangles.
pub fn segment(shot: &Shot, options: Options) -> Result<SegmentSummary> {
    let reads = Reads::from([
        ("source".to_owned(), shot.source_hash()?),
        ("settings".to_owned(), hash_value(&(&shot.settings.source, &shot.settings.silhouette))),
    ]);
    if !options.force && shot.freshness(Stage::Segment, &reads) == Freshness::UpToDate {
        let outcome = Outcome { ran: false, kept: shot.edited_files(Stage::Segment)? };
        return summary(shot, &outcome);
    }
    let mut work = Work {
        writer: shot.begin(Stage::Segment, reads, options.force)?,
        reports: Vec::new(),
        options,
        total: None,
    };
    match shot.input()? {
        Input::Mattes => from_mattes(shot, &mut work)?,
        Input::Strokes => from_strokes(shot, &mut work)?,
        Input::Footage => from_footage(shot, &mut work)?,
    }
    if work.reports.is_empty() {
        return Err(Error::NoFrames { folder: shot.folder().to_owned() });
    }
    work.writer.put(paths::SILHOUETTES, reports_csv(&work.reports, shot.fps()).as_bytes())?;
    let written = work.writer.commit()?;
    summary(shot, &Outcome { ran: true, kept: written.kept })
}

/// Masks on their way to the folder.
struct Work<'a> {
    writer: StageWriter,
    reports: Vec<FrameReport>,
    options: Options<'a>,
    total: Option<usize>,
}

impl Work<'_> {
    fn put(&mut self, mask: &Mask, report: FrameReport) -> Result<()> {
        let frame = self.reports.len();
        self.writer.put(&paths::mask(frame), &mask.to_png()?)?;
        self.reports.push(report);
        if self.options.progress.step(Stage::Segment, frame + 1, self.total) {
            Ok(())
        } else {
            Err(Error::Interrupted)
        }
    }
}

fn from_mattes(shot: &Shot, work: &mut Work) -> Result<()> {
    let mattes = shot.mattes()?;
    work.total = Some(mattes.files().len());
    for (frame, matte) in mattes.enumerate() {
        let matte = matte?;
        let mask = Mask::from_bools(matte.width, matte.height, &matte.inside)
            .unwrap_or_else(|| Mask::new(matte.width, matte.height));
        work.put(&mask, report_of_mask(frame, &mask))?;
    }
    Ok(())
}

/// Strokes are thickened and used as they are (seed, section 2.2). With footage its frames, or the
/// range given, say which strokes are wanted; without, the numbers in the files' names do.
fn from_strokes(shot: &Shot, work: &mut Work) -> Result<()> {
    let files = shot.strokes()?;
    let folder = shot.strokes_folder().unwrap_or_else(|| PathBuf::from("strokes"));
    let first = files.first().map_or(0, |f| f.0);
    let last = files.last().map_or(0, |f| f.0);
    let (first, last) = match shot.range()? {
        Some(range) => (range.first(), range.last()),
        None => (first, last),
    };
    work.total = Some(last + 1 - first);
    let mut size = None;
    for (index, frame) in (first..=last).enumerate() {
        let Some((_, path)) = files.iter().find(|(f, _)| *f == frame) else {
            return Err(Error::StrokesMissing { folder, frame });
        };
        let read = strokes::read(path, frame, size)?;
        size = Some((read.width, read.height));
        let drawn = Mask::from_fn(read.width, read.height, |x, y| {
            read.said[y * read.width + x] == Said::Foreground
        });
        let mask = drawn.dilated(stroke_radius(shot, read.width, read.height));
        work.put(&mask, report_of_mask(index, &mask))?;
    }
    Ok(())
}

fn stroke_radius(shot: &Shot, width: usize, height: usize) -> usize {
    match shot.settings.silhouette.stroke_radius_px {
        0 => default_stroke_radius_px(width, height),
        radius => radius,
    }
}

fn from_footage(shot: &Shot, work: &mut Work) -> Result<()> {
    let Some(mut footage) = shot.footage()? else {
        return Err(Error::NoSource { folder: shot.folder().to_owned() });
    };
    let source = &shot.settings.source;
    let rectangles = match (source.foreground(), source.background()) {
        (Some(foreground), Some(background)) => (foreground, background),
        _ => match shot.synthetic()? {
            Some(synthetic) => synthetic.rectangles(),
            None => return Err(Error::NoRectangles { folder: shot.folder().to_owned() }),
        },
    };
    let files = shot.strokes()?;
    let offset = shot.range()?.map_or(0, |r| r.first());
    work.total = footage.frame_count();
    let mut segmenter: Option<Segmenter> = None;
    let mut frame = 0;
    while let Some(picture) = footage.next_frame()? {
        let segmenter = match &mut segmenter {
            Some(segmenter) => segmenter,
            none => none.insert(Segmenter::new(
                &picture,
                rectangles.0,
                rectangles.1,
                &shot.settings.silhouette,
            )?),
        };
        let stroke = files.iter().find(|(f, _)| *f == frame + offset);
        let hints = match stroke {
            Some((number, path)) => {
                Some(hints(shot, path, *number, (picture.width(), picture.height()))?)
            }
            None => None,
        };
        let (mask, report) = segmenter.push(&picture, hints.as_ref());
        work.put(&mask, report)?;
        frame += 1;
    }
    Ok(())
}

/// Strokes over footage: white is animal and is thickened; black, where the picture has
/// transparency to tell it from unsaid, is background.
fn hints(
    shot: &Shot,
    path: &std::path::Path,
    frame: usize,
    size: (usize, usize),
) -> Result<StrokeHints> {
    let read = strokes::read(path, frame, Some(size))?;
    let drawn = |said: Said| {
        Mask::from_fn(read.width, read.height, |x, y| read.said[y * read.width + x] == said)
    };
    let background = drawn(Said::Background);
    let thick = drawn(Said::Foreground).dilated(stroke_radius(shot, read.width, read.height));
    Ok(StrokeHints { foreground: thick.and_not(&background), background })
}

fn reports_csv(reports: &[FrameReport], fps: f64) -> String {
    let header =
        ["frame", "time_s", "area_px", "centre_x_px", "centre_y_px", "confidence", "flags"];
    let rows = reports.iter().map(|r| {
        let (x, y) =
            r.centre_px.map_or((String::new(), String::new()), |(x, y)| (number(x), number(y)));
        vec![
            r.frame.to_string(),
            number(r.frame as f64 / fps),
            r.area_px.to_string(),
            x,
            y,
            number(r.confidence),
            r.flags.names(),
        ]
    });
    table(&header.map(str::to_owned), rows)
}

fn summary(shot: &Shot, outcome: &Outcome) -> Result<SegmentSummary> {
    let mut found = SegmentSummary {
        frames: 0,
        lost_frames: Vec::new(),
        border_frames: Vec::new(),
        kept: outcome.kept.clone(),
        ran: outcome.ran,
    };
    let path = shot.path(paths::SILHOUETTES);
    let text = String::from_utf8_lossy(&crate::shot::read(&path)?).into_owned();
    for (frame, line) in text.lines().skip(1).enumerate() {
        found.frames = frame + 1;
        let flags = line.rsplit(',').next().unwrap_or_default();
        let flags = Flags::from_names(flags).unwrap_or_default();
        if flags.contains(Flag::Lost) || flags.contains(Flag::Empty) {
            found.lost_frames.push(frame);
        } else if flags.contains(Flag::AtBorder) {
            found.border_frames.push(frame);
        }
    }
    Ok(found)
}
