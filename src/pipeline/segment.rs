//! Footage, mattes or strokes to masks.

use std::path::PathBuf;

use serde::Serialize;

use super::footage::{corrected_masks, from_footage};
use super::{Options, Outcome};
use crate::error::{Error, Result};
use crate::frames::strokes::{self, Said};
use crate::mask::{Mask, default_stroke_radius_px};
use crate::shot::{
    Freshness, Input, Reads, Shot, SilhouetteTable, Stage, StageWriter, hash_files, hash_value,
    paths,
};
use crate::silhouette::{Flag, Flags, FrameReport, least_sure, report_of_mask};

/// What `segment` found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentSummary {
    /// Number of frames.
    pub frames: usize,
    /// What is known of each frame's silhouette, in order.
    pub silhouettes: Vec<SilhouetteLine>,
    /// The flags that occur with the frames that carry them, the gravest first.
    pub flagged: Vec<FlaggedLine>,
    /// The least sure frame, worth correcting next; `None` when there is none.
    pub correct_next: Option<usize>,
    /// Masks edited by hand, which were kept.
    pub kept: Vec<String>,
    /// Whether anything had to be done.
    pub ran: bool,
    /// Masks that were made in this run; the others stayed as they were.
    pub made: usize,
}

/// One frame's silhouette, for people and programs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SilhouetteLine {
    /// The frame, from 0.
    pub frame: usize,
    /// Its time, seconds.
    pub time_s: f64,
    /// Area of the silhouette, pixels.
    pub area_px: usize,
    /// Its centre of mass, pixels; `None` of an empty mask.
    pub centre_px: Option<(f64, f64)>,
    /// How sure the outline is, 0 to 1.
    pub confidence: f64,
    /// What was noticed, the gravest first.
    pub flags: Flags,
    /// The same in words, joined by semicolons; empty without flags.
    pub words: String,
}

/// A flag with the frames that carry it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlaggedLine {
    /// Its name.
    pub flag: &'static str,
    /// What it says, a sentence.
    pub words: &'static str,
    /// Whether such frames are left out of the PCA unless the settings say otherwise.
    pub excludes: bool,
    /// The frames, ascending.
    pub frames: Vec<usize>,
}

impl SegmentSummary {
    fn of(reports: &[FrameReport], fps: f64, outcome: Outcome, made: usize) -> Self {
        let line = |r: &FrameReport| SilhouetteLine {
            frame: r.frame,
            time_s: r.frame as f64 / fps,
            area_px: r.area_px,
            centre_px: r.centre_px,
            confidence: r.confidence,
            flags: r.flags,
            words: r.flags.iter().map(Flag::sentence).collect::<Vec<_>>().join("; "),
        };
        let flagged = |flag: Flag| FlaggedLine {
            flag: flag.name(),
            words: flag.sentence(),
            excludes: flag.excludes(),
            frames: reports.iter().filter(|r| r.flags.contains(flag)).map(|r| r.frame).collect(),
        };
        Self {
            frames: reports.len(),
            silhouettes: reports.iter().map(line).collect(),
            flagged: Flag::ALL.map(flagged).into_iter().filter(|f| !f.frames.is_empty()).collect(),
            correct_next: least_sure(reports),
            kept: outcome.kept,
            ran: outcome.ran,
            made,
        }
    }
}

/// Makes one mask a frame, unless they are up to date. Masks edited by hand are kept.
///
/// # Errors
/// Whatever the source fails with; [`Error::NoRectangles`] for footage without rectangles.
pub fn segment(shot: &Shot, options: Options) -> Result<SegmentSummary> {
    let (reads, by_hand) = segment_reads(shot, options)?;
    let corrected: Vec<PathBuf> = by_hand.iter().map(|f| shot.path(f)).collect();
    if !options.force && shot.freshness(Stage::Segment, &reads) == Freshness::UpToDate {
        let outcome = Outcome { ran: false, kept: shot.edited_files(Stage::Segment)? };
        return summary(shot, outcome, 0);
    }
    let mut work = Work {
        writer: shot.begin(Stage::Segment, reads, options.force)?,
        reports: Vec::new(),
        options,
        total: None,
        made: 0,
        by_hand,
    };
    match shot.input()? {
        Input::Mattes => from_mattes(shot, &mut work)?,
        Input::Strokes => from_strokes(shot, &mut work)?,
        Input::Footage => from_footage(shot, &corrected, &mut work)?,
    }
    if work.reports.is_empty() {
        return Err(Error::NoFrames { folder: shot.folder().to_owned() });
    }
    let table = SilhouetteTable { reports: work.reports };
    work.writer.put(paths::SILHOUETTES, table.to_csv(shot.fps()).as_bytes())?;
    let written = work.writer.commit()?;
    summary(shot, Outcome { ran: true, kept: written.kept }, work.made)
}

/// What the masks depend on, and the masks a person repainted, files relative to the shot.
pub(super) fn segment_reads(shot: &Shot, options: Options) -> Result<(Reads, Vec<String>)> {
    let by_hand = corrected_masks(shot, options)?;
    let corrected: Vec<PathBuf> = by_hand.iter().map(|f| shot.path(f)).collect();
    let reads = Reads::from([
        ("source".to_owned(), shot.source_hash()?),
        ("settings".to_owned(), hash_value(&(&shot.settings.source, &shot.settings.silhouette))),
        // A table of other columns is made anew.
        ("columns".to_owned(), SilhouetteTable::COLUMNS.join(",")),
        ("corrections".to_owned(), hash_files(&corrected)?),
    ]);
    Ok((reads, by_hand))
}

/// Masks on their way to the folder.
pub(super) struct Work<'a> {
    pub(super) writer: StageWriter,
    pub(super) reports: Vec<FrameReport>,
    pub(super) options: Options<'a>,
    /// Number of frames, where it is known before they are read.
    pub(super) total: Option<usize>,
    /// Masks that did not just stay as they were.
    pub(super) made: usize,
    /// The masks that a person repainted.
    by_hand: Vec<String>,
}

impl Work<'_> {
    /// Takes in the mask of the next frame.
    fn put(&mut self, mask: &Mask, report: FrameReport) -> Result<()> {
        self.store(&mask.to_png()?, report)?;
        self.made += 1;
        self.step(self.reports.len())
    }

    /// The same of a mask that is encoded already, without telling the progress.
    pub(super) fn store(&mut self, png: &[u8], report: FrameReport) -> Result<()> {
        let file = paths::mask(self.reports.len());
        if self.by_hand.contains(&file) {
            self.writer.leave(&file);
        } else {
            self.writer.put(&file, png)?;
        }
        self.reports.push(report);
        Ok(())
    }

    /// Tells that as much as `done` frames' work is done.
    pub(super) fn step(&self, done: usize) -> Result<()> {
        if self.options.progress.step(Stage::Segment, done, self.total) {
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

pub(super) fn stroke_radius(shot: &Shot, width: usize, height: usize) -> usize {
    match shot.settings.silhouette.stroke_radius_px {
        0 => default_stroke_radius_px(width, height),
        radius => radius,
    }
}

fn summary(shot: &Shot, outcome: Outcome, made: usize) -> Result<SegmentSummary> {
    Ok(SegmentSummary::of(&shot.frame_reports()?, shot.fps(), outcome, made))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_names_flags_with_their_frames() {
        let dot = Mask::from_fn(9, 9, |x, y| x == 4 && y == 4);
        let cut = Mask::from_fn(9, 9, |x, _| x < 2);
        let masks = [dot.clone(), cut.clone(), cut, dot];
        let mut reports: Vec<FrameReport> =
            masks.iter().enumerate().map(|(t, m)| report_of_mask(t, m)).collect();
        reports[1].flags.insert(Flag::Occluded);
        reports[3].confidence = 0.3;
        let found = SegmentSummary::of(&reports, 10.0, Outcome::default(), 0);
        let flagged: Vec<_> = found.flagged.iter().map(|f| (f.flag, f.frames.clone())).collect();
        assert_eq!(flagged, [("at_border", vec![1, 2]), ("occluded", vec![1])]);
        assert_eq!((found.frames, found.correct_next), (4, Some(3)));
        assert!(found.silhouettes[1].words.contains("; ") && found.silhouettes[0].words.is_empty());
        assert_eq!(found.silhouettes[3].time_s, 0.3);
    }
}
