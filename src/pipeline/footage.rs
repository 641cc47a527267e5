//! Footage to masks: read once; the silhouettes of a stretch are drafted together, and then outlined
//! on its pictures, which were put aside at the size that takes.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::Options;
use super::kept::{Kept, Said};
use super::segment::{Work, stroke_radius};
use super::spool::Spool;
use crate::error::{Error, Result};
use crate::frames::strokes::{self, Said as Drawn};
use crate::frames::{Ahead, FrameSource, read_ahead};
use crate::image::{Frame, Picture, Rectangle};
use crate::mask::Mask;
use crate::numeric::GridCut;
use crate::shot::{CameraTable, Shot, Stage, hash_file, paths, read};
use crate::silhouette::{
    ClipSegmenter, FrameReport, Labels, Method, STRETCH_FRAMES, Segmenter, flag_area_jumps,
    flag_companions, flag_occlusions, report_of_corrected_mask,
};

/// Pictures that are worked on side by side.
const BATCH: usize = 8;

/// What is decoded meanwhile, which bounds the pixels in memory: of 1920×1080 eight frames of video, 25 MB,
/// or eight pictures, 50 MB, and more of smaller ones, so that decoding goes on while colours are learnt.
const AHEAD: Ahead = Ahead { frames: 4, pixels: 8 * 1920 * 1080 };

/// The same where next to nothing but decoding takes time.
const AHEAD_BY_COLOUR: Ahead = Ahead { frames: 12, pixels: 12 * 1920 * 1080 };

/// Pictures at the size of outlines, 1.3 MB at most, that are outlined side by side: the more of them,
/// the less a thread waits for the last.
const OUTLINED: usize = 24;

/// The masks that a person repainted, files relative to the shot. Forced work overwrites them, so they say
/// nothing then.
pub(super) fn corrected_masks(shot: &Shot, options: Options) -> Result<Vec<String>> {
    if options.force {
        return Ok(Vec::new());
    }
    let mut edited = shot.edited_files(Stage::Segment)?;
    edited.retain(|f| frame_of(f).is_some());
    Ok(edited)
}

/// The frame whose mask a file of the shot is.
fn frame_of(file: &str) -> Option<usize> {
    file.strip_prefix("masks/")?.strip_suffix(".png")?.parse().ok()
}

/// Segments the shot's footage; `corrected` are the masks a person repainted.
pub(super) fn from_footage(shot: &Shot, corrected: &[PathBuf], work: &mut Work) -> Result<()> {
    let by_colour = shot.settings.silhouette.method == Method::Colour;
    let mut seen = open(shot, if by_colour { AHEAD_BY_COLOUR } else { AHEAD })?;
    let rectangles = rectangles(shot)?;
    work.total = seen.frame_count();
    if by_colour {
        return segment_by_colour(shot, corrected, seen, rectangles, work);
    }
    let said = said(shot, corrected, (seen.width(), seen.height()))?;
    let mut kept = Kept::load(shot, &said, work.options.force)?;
    let mut said = Some(labels(said));
    let mut segmenter: Option<ClipSegmenter> = None;
    let mut spool: Option<Spool> = None;
    let mut observed = 0;
    loop {
        let start = observed;
        while observed < start + STRETCH_FRAMES {
            let frames = next_frames(seen.as_mut(), BATCH.min(start + STRETCH_FRAMES - observed))?;
            let Some(first) = frames.first() else { break };
            let segmenter = match &mut segmenter {
                Some(segmenter) => segmenter,
                none => none.insert(ClipSegmenter::new(
                    &first.rgb(),
                    rectangles.0,
                    rectangles.1,
                    shot.fps(),
                    &shot.settings.silhouette,
                    said.take().unwrap_or_default(),
                )?),
            };
            let pictures: Vec<_> =
                frames.par_iter().map(|f| segmenter.at_outline_size(f)).collect();
            segmenter.observe(&pictures);
            let spool = match &mut spool {
                Some(spool) => spool,
                none => {
                    let file = work.writer.scratch()?;
                    let folder = work.writer.staging().to_owned();
                    none.insert(Spool::new(file, folder, segmenter.outline_size()))
                }
            };
            for picture in &pictures {
                spool.put(picture)?;
            }
            observed += frames.len();
            // Every frame is worked on twice.
            work.step((start + observed) / 2)?;
        }
        let (Some(segmenter), Some(spool)) = (&mut segmenter, &mut spool) else { break };
        if observed == start {
            break;
        }
        let mut plan = kept.plan(shot, start..observed);
        if let Some(base) = plan.base.take() {
            segmenter.recall(base, plan.drafts);
        }
        let middle = (start + observed) / 2;
        if !segmenter.draft(&|_, _| work.step(middle).is_ok()) {
            return Err(Error::Interrupted);
        }
        let stretch = Stretch { frames: start..observed, stay: plan.stay };
        outline(segmenter, spool, stretch, &mut kept, work)?;
        kept.finish_stretch(segmenter.base());
    }
    kept.now().put(&mut work.writer)?;
    // Masks from a person are not doubted; the segmenter's own may have slipped for some frames.
    flag_occlusions(&mut work.reports);
    flag_companions(&mut work.reports);
    flag_area_jumps(&mut work.reports);
    if let Some(segmenter) = segmenter {
        let table = CameraTable { path: segmenter.camera().clone() };
        let size = (seen.width(), seen.height());
        work.writer.put(paths::CAMERA, table.to_csv(shot.fps(), size).as_bytes())?;
    }
    Ok(())
}

/// The seed's method: one reading, frame by frame. What a person said holds where it was said.
fn segment_by_colour(
    shot: &Shot,
    corrected: &[PathBuf],
    mut footage: Box<dyn FrameSource>,
    rectangles: (Rectangle, Rectangle),
    work: &mut Work,
) -> Result<()> {
    let settings = &shot.settings.silhouette;
    let labels = labels(said(shot, corrected, (footage.width(), footage.height()))?);
    let mut started: Option<Segmenter> = None;
    loop {
        let frames = next_frames(footage.as_mut(), BATCH)?;
        let Some(first) = frames.first() else { break };
        let segmenter = match &mut started {
            Some(started) => started,
            none => {
                none.insert(Segmenter::new(&first.rgb(), rectangles.0, rectangles.1, settings)?)
            }
        };
        let parts: Vec<_> = frames.par_iter().map(|frame| segmenter.parts(frame)).collect();
        let chosen: Vec<_> = parts.into_iter().map(|parts| segmenter.choose(parts)).collect();
        let drawn: Vec<(Vec<u8>, FrameReport)> = chosen
            .par_iter()
            .map(|chosen| {
                let (mut mask, mut report) = segmenter.silhouette(chosen);
                if let Some(labels) = labels.get(&report.frame) {
                    mask = labels.applied_to(&mask);
                    report = report_of_corrected_mask(report.frame, &mask);
                }
                Ok((mask.to_png()?, report))
            })
            .collect::<Result<_>>()?;
        for (png, report) in drawn {
            work.store(&png, report)?;
            work.made += 1;
            work.step(report.frame + 1)?;
        }
    }
    flag_occlusions(&mut work.reports);
    flag_companions(&mut work.reports);
    flag_area_jumps(&mut work.reports);
    Ok(())
}

/// A stretch, with the mask files of frames that stay as they are.
struct Stretch {
    frames: Range<usize>,
    stay: Vec<Option<Vec<u8>>>,
}

/// The second pass over a stretch.
fn outline(
    segmenter: &ClipSegmenter,
    spool: &mut Spool,
    mut stretch: Stretch,
    kept: &mut Kept,
    work: &mut Work,
) -> Result<()> {
    let Range { start, end } = stretch.frames.clone();
    let mut next = start;
    while next < end {
        let wanted = OUTLINED.min(end - next);
        let pictures: Vec<Picture> =
            (0..wanted).map_while(|_| spool.take().transpose()).collect::<Result<_>>()?;
        debug_assert_eq!(pictures.len(), wanted, "every picture of a stretch is put aside");
        let outlined: Vec<Option<(Vec<u8>, FrameReport)>> = pictures
            .par_iter()
            .enumerate()
            .map_init(GridCut::new, |cut, (at, picture)| {
                if stretch.stay[next - start + at].is_some() {
                    return Ok(None);
                }
                let (mask, report) = segmenter.outline(next + at, picture, cut);
                Ok(Some((mask.to_png()?, report)))
            })
            .collect::<Result<_>>()?;
        for (t, outlined) in (next..).zip(outlined) {
            let stays = stretch.stay[t - start].take().zip(kept.report(t));
            work.made += usize::from(stays.is_none());
            let Some((png, report)) = stays.or(outlined) else { continue };
            kept.note(&stretch.frames, &png, report);
            work.store(&png, report)?;
        }
        next += wanted;
        work.step((end + next).div_ceil(2))?;
    }
    Ok(())
}

fn open(shot: &Shot, ahead: Ahead) -> Result<Box<dyn FrameSource>> {
    let shot = shot.clone();
    let footage = move || {
        let footage = shot.stored_footage()?;
        footage.ok_or_else(|| Error::NoSource { folder: shot.folder().to_owned() })
    };
    // With one thread there is none to read ahead with.
    if rayon::current_num_threads() > 1 { read_ahead(footage, ahead) } else { footage() }
}

/// Up to `wanted` more frames in the form the source holds them, fewer at its end.
fn next_frames(footage: &mut dyn FrameSource, wanted: usize) -> Result<Vec<Frame>> {
    let mut frames = Vec::with_capacity(wanted);
    while frames.len() < wanted {
        let Some(frame) = footage.next_stored()? else { break };
        frames.push(frame);
    }
    Ok(frames)
}

fn rectangles(shot: &Shot) -> Result<(Rectangle, Rectangle)> {
    let source = &shot.settings.source;
    match (source.foreground(), source.background()) {
        (Some(foreground), Some(background)) => Ok((foreground, background)),
        _ => match shot.synthetic()? {
            Some(synthetic) => Ok(synthetic.rectangles()),
            None => Err(Error::NoRectangles { folder: shot.folder().to_owned() }),
        },
    }
}

fn labels(said: BTreeMap<usize, Said>) -> BTreeMap<usize, Labels> {
    said.into_iter().map(|(t, said)| (t, said.labels)).collect()
}

/// What a person said of some frames: repainted masks, and strokes where the mask was not
/// repainted. A mask painted empty says that the animal is not there, which is kept but teaches
/// nothing.
fn said(shot: &Shot, corrected: &[PathBuf], size: (usize, usize)) -> Result<BTreeMap<usize, Said>> {
    let mut said = BTreeMap::new();
    let offset = shot.range()?.map_or(0, |r| r.first());
    for (number, path) in shot.strokes()? {
        if let Some(frame) = number.checked_sub(offset) {
            let labels = stroke_labels(shot, &path, number, size)?;
            said.insert(frame, Said { labels, hash: hash_file(&path)? });
        }
    }
    for path in corrected {
        let mask = Mask::from_image_bytes(path, &read(path)?)?;
        let stem = path.file_stem().and_then(|s| s.to_str());
        let Some(frame) = stem.and_then(|s| s.parse().ok()).filter(|_| !mask.is_empty()) else {
            continue;
        };
        let found = (mask.width(), mask.height());
        if found != size {
            return Err(Error::MaskSize { frame, found, expected: size });
        }
        said.insert(frame, Said { labels: Labels::whole(&mask), hash: hash_file(path)? });
    }
    Ok(said)
}

/// Strokes over footage: white is animal and is thickened; black, where the picture has
/// transparency to tell it from unsaid, is background.
fn stroke_labels(shot: &Shot, path: &Path, frame: usize, size: (usize, usize)) -> Result<Labels> {
    let read = strokes::read(path, frame, Some(size))?;
    let drawn = |said: Drawn| {
        Mask::from_fn(read.width, read.height, |x, y| read.said[y * read.width + x] == said)
    };
    let background = drawn(Drawn::Background);
    let thick = drawn(Drawn::Foreground).dilated(stroke_radius(shot, read.width, read.height));
    Ok(Labels { animal: thick.and_not(&background), background })
}
