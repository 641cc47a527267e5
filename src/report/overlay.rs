//! `analysis/overlay.png`: the outlines over the footage, to judge a segmentation by.

use super::Png;
use super::sheets::{FrameTile, evenly_chosen, overlay_sheet, reduced};
use crate::error::Result;
use crate::image::Picture;
use crate::shot::{Freshness, Reads, Shot, Stage, hash_files, hash_value, paths};
use crate::silhouette::FrameReport;

/// Frames evenly spread over the clip.
const EVEN_FRAMES: usize = 24;

/// Flagged frames besides: a sheet of more can hardly be looked through.
const FLAGGED_FRAMES: usize = 36;

/// What is on the sheet.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct OverlayDrawn {
    /// The frames on it, ascending.
    pub frames: Vec<usize>,
    /// Flagged frames for which there was no room.
    pub flagged_left_out: usize,
}

/// Draws the outlines of 24 frames evenly spread over the clip and of all flagged ones, up to 36
/// more, as `analysis/overlay.png`, unless it is up to date.
///
/// # Errors
/// When a stored file or the footage cannot be read.
pub fn draw_overlay(shot: &Shot, force: bool) -> Result<OverlayDrawn> {
    let reports = shot.frame_reports()?;
    let drawn = chosen(&reports);
    let reads = Reads::from([
        ("masks".to_owned(), hash_files(&shot.mask_files()?)?),
        ("source".to_owned(), shot.source_hash()?),
        ("settings".to_owned(), hash_value(&(&shot.settings.source, shot.name(), &reports))),
    ]);
    if !force && shot.freshness(Stage::Overlay, &reads) == Freshness::UpToDate {
        return Ok(drawn);
    }
    let masks = shot.some_masks(&drawn.frames)?;
    let pictures = small_pictures(shot, &drawn.frames)?;
    let tile = |(at, &frame): (usize, &usize)| FrameTile {
        frame,
        time_s: Some(frame as f64 / shot.fps()),
        picture: pictures.get(at),
        mask: &masks[&frame],
        confidence: Some(reports[frame].confidence),
        flags: reports[frame].flags,
    };
    let tiles: Vec<FrameTile> = drawn.frames.iter().enumerate().map(tile).collect();
    let mut title = format!("{}: {} of {} frames", shot.name(), tiles.len(), reports.len());
    if drawn.flagged_left_out > 0 {
        title.push_str(&format!(", {} flagged ones not shown", drawn.flagged_left_out));
    }
    let mut writer = shot.begin(Stage::Overlay, reads, force)?;
    writer.put(paths::OVERLAY, Png::encode(&overlay_sheet(&title, &tiles))?.bytes())?;
    writer.commit()?;
    Ok(drawn)
}

/// The frames of the sheet. Of flagged frames that are too many, those that are left out of the PCA
/// come first, and each kind is thinned evenly.
fn chosen(reports: &[FrameReport]) -> OverlayDrawn {
    let mut frames = evenly_chosen(reports.len(), EVEN_FRAMES);
    let more = |excluded: bool| -> Vec<usize> {
        reports
            .iter()
            .filter(|r| !r.flags.is_empty() && r.is_excluded() == excluded)
            .map(|r| r.frame)
            .filter(|frame| !frames.contains(frame))
            .collect()
    };
    let kinds = [more(true), more(false)];
    let (mut room, mut left_out) = (FLAGGED_FRAMES, 0);
    for kind in kinds {
        let picked = evenly_chosen(kind.len(), room);
        room -= picked.len();
        left_out += kind.len() - picked.len();
        frames.extend(picked.iter().map(|&at| kind[at]));
    }
    frames.sort_unstable();
    OverlayDrawn { frames, flagged_left_out: left_out }
}

/// The frames of the footage at the size of a tile, so that sixty of them fit into memory; none
/// when the shot has no footage.
fn small_pictures(shot: &Shot, wanted: &[usize]) -> Result<Vec<Picture>> {
    let mut found = Vec::new();
    let Some(mut footage) = shot.footage()? else { return Ok(found) };
    for frame in 0..=wanted.last().copied().unwrap_or(0) {
        if !wanted.contains(&frame) {
            if !footage.skip_frame()? {
                break;
            }
            continue;
        }
        let Some(picture) = footage.next_frame()? else { break };
        found.push(reduced(&picture));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouette::{Flag, Flags};

    fn clip(frames: usize, flag: impl Fn(usize) -> Option<Flag>) -> Vec<FrameReport> {
        (0..frames)
            .map(|frame| FrameReport {
                frame,
                area_px: 1,
                centre_px: None,
                confidence: 1.0,
                flags: flag(frame).into_iter().collect::<Flags>(),
            })
            .collect()
    }

    #[test]
    fn every_flagged_frame_is_on_the_sheet_while_there_is_room() {
        let found = chosen(&clip(200, |t| (50..70).contains(&t).then_some(Flag::Occluded)));
        assert!((50..70).all(|t| found.frames.contains(&t)) && found.flagged_left_out == 0);
        assert!(found.frames.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(chosen(&clip(5, |_| Some(Flag::Lost))).frames, [0, 1, 2, 3, 4]);
        assert_eq!(chosen(&[]), OverlayDrawn::default());
    }

    #[test]
    fn too_many_are_thinned_and_counted_and_the_grave_ones_come_first() {
        let flag = |t: usize| match t {
            100..120 => Some(Flag::Lost),
            200..300 => Some(Flag::Corrected),
            _ => None,
        };
        let found = chosen(&clip(400, flag));
        assert!((100..120).all(|t| found.frames.contains(&t)));
        assert_eq!(found.frames.len(), EVEN_FRAMES + FLAGGED_FRAMES);
        let shown = found.frames.iter().filter(|t| flag(**t).is_some()).count();
        assert_eq!(shown + found.flagged_left_out, 120);
    }
}
