//! Footage to masks: read once to draft the silhouettes of a stretch, and once more to outline
//! them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::Options;
use super::segment::{Work, stroke_radius};
use crate::error::{Error, Result};
use crate::frames::strokes::{self, Said};
use crate::frames::{FrameSource, read_ahead};
use crate::image::{Picture, Rectangle};
use crate::mask::Mask;
use crate::numeric::GridCut;
use crate::shot::{CameraTable, Shot, Stage, paths, read};
use crate::silhouette::{
    ClipSegmenter, FrameReport, Labels, Method, STRETCH_FRAMES, Segmenter, flag_area_jumps,
    flag_occlusions, report_of_corrected_mask,
};

/// Pictures that are worked on side by side, and those decoded meanwhile: bounds the pixels in
/// memory.
const BATCH: usize = 8;
const AHEAD: usize = 4;

/// The masks that a person repainted, by their files. Forced work overwrites them, so they say
/// nothing then.
pub(super) fn corrected_masks(shot: &Shot, options: Options) -> Result<Vec<PathBuf>> {
    if options.force {
        return Ok(Vec::new());
    }
    let edited = shot.edited_files(Stage::Segment)?;
    Ok(edited.iter().filter(|f| frame_of(f).is_some()).map(|f| shot.path(f)).collect())
}

/// The frame whose mask a file of the shot is.
fn frame_of(file: &str) -> Option<usize> {
    file.strip_prefix("masks/")?.strip_suffix(".png")?.parse().ok()
}

/// Segments the shot's footage; `corrected` are the masks a person repainted.
pub(super) fn from_footage(shot: &Shot, corrected: &[PathBuf], work: &mut Work) -> Result<()> {
    let mut seen = open(shot)?;
    let rectangles = rectangles(shot)?;
    work.total = seen.frame_count();
    if shot.settings.silhouette.method == Method::Colour {
        return by_colour(shot, corrected, seen, rectangles, work);
    }
    let mut again = open(shot)?;
    let mut segmenter: Option<ClipSegmenter> = None;
    let mut observed = 0;
    loop {
        let start = observed;
        while observed < start + STRETCH_FRAMES {
            let pictures =
                next_pictures(seen.as_mut(), BATCH.min(start + STRETCH_FRAMES - observed))?;
            let Some(first) = pictures.first() else { break };
            let segmenter = match &mut segmenter {
                Some(segmenter) => segmenter,
                none => none.insert(ClipSegmenter::new(
                    first,
                    rectangles.0,
                    rectangles.1,
                    shot.fps(),
                    &shot.settings.silhouette,
                    labels(shot, corrected, (first.width(), first.height()))?,
                )?),
            };
            segmenter.observe(&pictures);
            observed += pictures.len();
            // Every frame is read twice.
            work.step((start + observed) / 2)?;
        }
        let Some(segmenter) = segmenter.as_mut().filter(|_| observed > start) else { break };
        let middle = (start + observed) / 2;
        if !segmenter.draft(&|_, _| work.step(middle).is_ok()) {
            return Err(Error::Interrupted);
        }
        outline(segmenter, again.as_mut(), start..observed, work)?;
    }
    // Masks from a person are not doubted; the segmenter's own may have slipped for some frames.
    flag_occlusions(&mut work.reports);
    flag_area_jumps(&mut work.reports);
    if let Some(segmenter) = segmenter {
        let table = CameraTable { path: segmenter.camera().clone() };
        let size = (seen.width(), seen.height());
        work.writer.put(paths::CAMERA, table.to_csv(shot.fps(), size).as_bytes())?;
    }
    Ok(())
}

/// The seed's method: one reading, frame by frame. What a person said holds where it was said.
fn by_colour(
    shot: &Shot,
    corrected: &[PathBuf],
    mut footage: Box<dyn FrameSource>,
    rectangles: (Rectangle, Rectangle),
    work: &mut Work,
) -> Result<()> {
    let settings = &shot.settings.silhouette;
    let mut started: Option<(Segmenter, BTreeMap<usize, Labels>)> = None;
    loop {
        let pictures = next_pictures(footage.as_mut(), BATCH)?;
        let Some(first) = pictures.first() else { break };
        let (segmenter, labels) = match &mut started {
            Some(started) => started,
            none => none.insert((
                Segmenter::new(first, rectangles.0, rectangles.1, settings)?,
                labels(shot, corrected, (first.width(), first.height()))?,
            )),
        };
        let candidates: Vec<Mask> =
            pictures.par_iter().map(|picture| segmenter.candidates(picture)).collect();
        for candidates in &candidates {
            let frame = work.reports.len();
            let (mut mask, mut report) = segmenter.follow(candidates);
            if let Some(labels) = labels.get(&frame) {
                mask = labels.applied_to(&mask);
                report = report_of_corrected_mask(frame, &mask);
            }
            work.store(&mask.to_png()?, report)?;
            work.step(frame + 1)?;
        }
    }
    flag_occlusions(&mut work.reports);
    flag_area_jumps(&mut work.reports);
    Ok(())
}

/// The second reading of a stretch.
fn outline(
    segmenter: &ClipSegmenter,
    footage: &mut dyn FrameSource,
    stretch: std::ops::Range<usize>,
    work: &mut Work,
) -> Result<()> {
    let mut next = stretch.start;
    while next < stretch.end {
        let wanted = BATCH.min(stretch.end - next);
        let pictures = next_pictures(footage, wanted)?;
        if pictures.len() < wanted {
            // It ended sooner the second time, so it was changed meanwhile.
            return Err(Error::SourceChanged { frame: next + pictures.len() });
        }
        let outlined: Vec<(Vec<u8>, FrameReport)> = pictures
            .par_iter()
            .enumerate()
            .map_init(GridCut::new, |cut, (at, picture)| {
                let (mask, report) = segmenter.outline(next + at, picture, cut);
                Ok((mask.to_png()?, report))
            })
            .collect::<Result<_>>()?;
        next += wanted;
        for (png, report) in outlined {
            work.store(&png, report)?;
        }
        work.step((stretch.end + next).div_ceil(2))?;
    }
    Ok(())
}

fn open(shot: &Shot) -> Result<Box<dyn FrameSource>> {
    let shot = shot.clone();
    let footage = move || {
        let footage = shot.footage()?;
        footage.ok_or_else(|| Error::NoSource { folder: shot.folder().to_owned() })
    };
    // With one thread there is none to read ahead with.
    if rayon::current_num_threads() > 1 { read_ahead(footage, AHEAD) } else { footage() }
}

/// Up to `wanted` more pictures, fewer at the source's end.
fn next_pictures(footage: &mut dyn FrameSource, wanted: usize) -> Result<Vec<Picture>> {
    let mut pictures = Vec::with_capacity(wanted);
    while pictures.len() < wanted {
        let Some(picture) = footage.next_frame()? else { break };
        pictures.push(picture);
    }
    Ok(pictures)
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

/// What a person said of some frames: repainted masks, and strokes where the mask was not
/// repainted. A mask painted empty says that the animal is not there, which is kept but teaches
/// nothing.
fn labels(
    shot: &Shot,
    corrected: &[PathBuf],
    size: (usize, usize),
) -> Result<BTreeMap<usize, Labels>> {
    let mut labels = BTreeMap::new();
    let offset = shot.range()?.map_or(0, |r| r.first());
    for (number, path) in shot.strokes()? {
        if let Some(frame) = number.checked_sub(offset) {
            labels.insert(frame, stroke_labels(shot, &path, number, size)?);
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
        labels.insert(frame, Labels::whole(&mask));
    }
    Ok(labels)
}

/// Strokes over footage: white is animal and is thickened; black, where the picture has
/// transparency to tell it from unsaid, is background.
fn stroke_labels(shot: &Shot, path: &Path, frame: usize, size: (usize, usize)) -> Result<Labels> {
    let read = strokes::read(path, frame, Some(size))?;
    let drawn = |said: Said| {
        Mask::from_fn(read.width, read.height, |x, y| read.said[y * read.width + x] == said)
    };
    let background = drawn(Said::Background);
    let thick = drawn(Said::Foreground).dilated(stroke_radius(shot, read.width, read.height));
    Ok(Labels { animal: thick.and_not(&background), background })
}
