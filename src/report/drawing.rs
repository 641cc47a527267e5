//! The sheets and the page of a shot, from its stored files.

use std::collections::BTreeMap;

use ::image::GrayImage;
use rayon::prelude::*;

use super::sheets::{
    EigenRow, FrameTile, KeyTile, contact_sheet, eigen_sheet, evenly_chosen, key_image,
    overlay_sheet,
};
use super::stored_page::{page_data, plots};
use super::{KeyMark, Png, page};
use crate::error::{Error, Result};
use crate::image::Picture;
use crate::mask::Mask;
use crate::shot::{
    Freshness, Reads, Shot, Stage, StoredKeys, hash_file, hash_files, hash_value, paths, read,
};

/// Frames on the sheet that shows the segmentation at a glance.
const OVERLAY_FRAMES: usize = 12;

/// Sheets in the shot besides the contact sheet of the keys.
pub(super) const OVERLAY_SHEET: &str = "analysis/segmentation.png";
pub(super) const EIGEN_SHEET: &str = "analysis/eigen-silhouettes.png";

/// Deviations shown on either side of the mean, as the analysis stored them.
const DEVIATIONS: f64 = 2.0;

/// Whether everything is there that [`draw_sheets`] draws, the footage aside.
#[must_use]
pub fn can_draw_sheets(shot: &Shot) -> bool {
    [paths::KEYS, paths::SILHOUETTES, paths::DIAGNOSIS].iter().all(|f| shot.path(f).is_file())
}

/// Draws the contact sheet, one picture a key, the segmentation at a glance and the
/// eigen-silhouettes, unless they are up to date. Returns files that were edited by hand and kept.
///
/// # Errors
/// When a stored file or the footage cannot be read.
pub fn draw_sheets(shot: &Shot, force: bool) -> Result<Vec<String>> {
    let frames = shot.mask_files()?.len();
    let keys = shot.keys(frames)?;
    let reports = shot.frame_reports()?;
    let reads = Reads::from([
        ("keys".to_owned(), hash_file(&shot.path(paths::KEYS))?),
        ("masks".to_owned(), hash_files(&shot.mask_files()?)?),
        ("analysis".to_owned(), hash_file(&shot.path(paths::DIAGNOSIS))?),
        ("source".to_owned(), shot.source_hash()?),
        ("settings".to_owned(), hash_value(&(&shot.settings.source, shot.name(), &reports))),
    ]);
    if !force && shot.freshness(Stage::Sheets, &reads) == Freshness::UpToDate {
        return Ok(Vec::new());
    }
    let glance = evenly_chosen(frames, OVERLAY_FRAMES);
    let wanted: Vec<usize> =
        keys.keys.iter().map(|k| k.frame).chain(glance.iter().copied()).collect();
    let masks = shot.some_masks(&wanted)?;
    let pictures = pictures(shot, &wanted)?;
    let mut writer = shot.begin(Stage::Sheets, reads, force)?;

    let tiles = key_tiles(shot, &keys, &masks, &pictures);
    let frames: Vec<FrameTile> = glance
        .iter()
        .map(|&frame| FrameTile {
            frame,
            time_s: Some(frame as f64 / shot.fps()),
            picture: pictures.get(&frame),
            mask: &masks[&frame],
            confidence: Some(reports[frame].confidence),
            flags: reports[frame].flags,
        })
        .collect();
    let mut sheets = vec![Sheet::Keys(&tiles), Sheet::Overlay(&frames), Sheet::Eigen];
    sheets.extend(tiles.iter().map(Sheet::Key));
    // Compression takes as long as drawing: both side by side, the files in order.
    let drawn: Vec<Png> =
        (sheets.par_iter()).map(|sheet| Png::encode(&sheet.draw(shot)?)).collect::<Result<_>>()?;
    for (sheet, png) in sheets.iter().zip(&drawn) {
        writer.put(&sheet.path(), png.bytes())?;
    }
    Ok(writer.commit()?.kept)
}

/// One of the pictures for people.
enum Sheet<'a> {
    /// All key images.
    Keys(&'a [KeyTile<'a>]),
    /// Silhouettes over footage.
    Overlay(&'a [FrameTile<'a>]),
    /// What the components stand for.
    Eigen,
    /// One key image.
    Key(&'a KeyTile<'a>),
}

impl Sheet<'_> {
    fn path(&self) -> String {
        match self {
            Self::Keys(_) => paths::CONTACT_SHEET.to_owned(),
            Self::Overlay(_) => OVERLAY_SHEET.to_owned(),
            Self::Eigen => EIGEN_SHEET.to_owned(),
            Self::Key(tile) => {
                format!("keys/key_{}_frame_{:04}.png", tile.mark.key, tile.mark.frame)
            }
        }
    }

    fn draw(&self, shot: &Shot) -> Result<Picture> {
        let title = |of: &str| format!("{}: {of}", shot.name());
        Ok(match self {
            Self::Keys(tiles) => contact_sheet(&title("key images"), tiles),
            Self::Overlay(frames) => overlay_sheet(&title("silhouettes"), frames),
            Self::Eigen => eigen(shot)?,
            Self::Key(tile) => key_image(tile),
        })
    }
}

fn key_tiles<'a>(
    shot: &Shot,
    keys: &StoredKeys,
    masks: &'a BTreeMap<usize, Mask>,
    pictures: &'a BTreeMap<usize, Picture>,
) -> Vec<KeyTile<'a>> {
    let tile = |key: &crate::shot::KeyImage| KeyTile {
        mark: KeyMark { key: key.key, frame: key.frame, partner_of: key.partner_of },
        time_s: Some(key.frame as f64 / shot.fps()),
        picture: pictures.get(&key.frame),
        mask: &masks[&key.frame],
    };
    keys.keys.iter().map(tile).collect()
}

/// Some frames of the footage, read front to back; none when the shot has no footage.
fn pictures(shot: &Shot, wanted: &[usize]) -> Result<BTreeMap<usize, Picture>> {
    let mut found = BTreeMap::new();
    let Some(mut footage) = shot.footage()? else { return Ok(found) };
    let last = wanted.iter().copied().max().unwrap_or(0);
    for frame in 0..=last {
        if !wanted.contains(&frame) {
            if !footage.skip_frame()? {
                break;
            }
            continue;
        }
        let Some(picture) = footage.next_frame()? else { break };
        found.insert(frame, picture);
    }
    Ok(found)
}

fn eigen(shot: &Shot) -> Result<Picture> {
    let grey = |name: &str| -> Result<GrayImage> {
        let path = shot.path(name);
        let decoded = ::image::load_from_memory(&read(&path)?);
        let undecodable = |e: ::image::ImageError| Error::Document { path, what: e.to_string() };
        Ok(decoded.map_err(undecodable)?.into_luma8())
    };
    let shares: Vec<f64> = shot.diagnosis()?.components.iter().map(|c| c.variance_share).collect();
    let mut images = Vec::new();
    for (c, share) in shares.iter().enumerate() {
        let name = |sign: &str| format!("analysis/component_{}_{sign}.png", c + 1);
        if shot.path(&name("minus")).is_file() {
            images.push((c + 1, *share, grey(&name("minus"))?, grey(&name("plus"))?));
        }
    }
    let rows: Vec<EigenRow> = images
        .iter()
        .map(|(component, variance_share, minus, plus)| EigenRow {
            component: *component,
            variance_share: *variance_share,
            minus,
            plus,
        })
        .collect();
    let title = format!("{}: what the components stand for", shot.name());
    Ok(eigen_sheet(&title, &grey("analysis/mean.png")?, &rows, DEVIATIONS))
}

/// Writes `report.html` and the plots, unless they are up to date. Returns files that were edited by
/// hand and kept.
///
/// # Errors
/// When a stored file cannot be read.
pub fn write_page(shot: &Shot, force: bool) -> Result<Vec<String>> {
    let mut reads = Reads::new();
    let stored = [
        paths::SETTINGS,
        paths::SILHOUETTES,
        paths::PROJECTIONS,
        paths::SPECTRUM,
        paths::DIAGNOSIS,
        paths::KEYS,
        paths::WEIGHTS,
        paths::ANIMATION,
        paths::CONTACT_SHEET,
        OVERLAY_SHEET,
        EIGEN_SHEET,
    ];
    for file in stored {
        let path = shot.path(file);
        if path.is_file() {
            reads.insert(file.to_owned(), hash_file(&path)?);
        }
    }
    let files = reads.clone();
    reads.extend(page_reads(shot)?);
    if !force && shot.freshness(Stage::Report, &reads) == Freshness::UpToDate {
        return Ok(Vec::new());
    }
    let plots = plots(shot)?;
    let mut writer = shot.begin(Stage::Report, reads, force)?;
    let named = [
        ("trajectory", &plots.trajectory),
        ("spectra", &plots.spectra),
        ("scores", &plots.scores),
        ("weights", &plots.weights),
        ("silhouettes", &plots.silhouettes),
    ];
    for (name, plot) in named {
        if let Some(svg) = plot {
            writer.put(&format!("analysis/{name}.svg"), svg.as_str().as_bytes())?;
        }
    }
    let data = page_data(shot, plots, &files)?;
    writer.put(paths::REPORT, page::page(&data)?.as_bytes())?;
    Ok(writer.commit()?.kept)
}

/// What the page depends on besides the files it lists: footage, silhouettes, rig and animation. What
/// is not there counts as absent, so that the page is made again once it is.
fn page_reads(shot: &Shot) -> Result<Reads> {
    let absent = |hash: Result<String>| hash.unwrap_or_else(|_| "absent".to_owned());
    let mut reads = Reads::from([("name".to_owned(), shot.name())]);
    reads.insert("source".to_owned(), absent(shot.source_hash()));
    if shot.path(&paths::mask(0)).is_file() {
        reads.insert("masks".to_owned(), hash_files(&shot.mask_files()?)?);
    }
    if let Some(rig) = &shot.settings.poses.rig {
        reads.insert("rig".to_owned(), absent(hash_file(&shot.path(rig))));
    }
    if shot.path(paths::ANIMATION).is_file() {
        let animated = shot.path(&shot.animation()?.path);
        reads.insert("animated rig".to_owned(), absent(hash_file(&animated)));
    }
    Ok(reads)
}
