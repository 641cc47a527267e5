//! From the stored files of a shot to what the page and the plots take.

mod animation;
mod asked;
mod player;
mod settings;

pub(super) use player::heading;

use super::drawing::EIGEN_SHEET;
use super::embedded::Embedded;
use super::film::film;
use super::page::{
    ComponentRow, FileHash, Finding, Footage, Grade, KeyRow, KeySummary, PageData, Pictures, Plots,
    VerdictSummary, WeightSummary,
};
use super::plots::{
    Band, Scores, SilhouetteMeasures, Spectra, Trajectory, WeightCurve, Weights, scores,
    silhouette_measures, spectra, trajectory, weights,
};
use super::{KeyMark, Png};
use crate::error::Result;
use crate::numeric::Coefficients;
use crate::shot::{
    Input, PoseOfKey, Reads, SYNTHETIC_PREFIX, Shot, StoredAnimation, StoredDiagnosis, StoredKeys,
    WeightTable, paths, read,
};
use crate::silhouette::{Flag, FrameReport};

/// What the page may be large: 8 MB, so that mail servers take it.
const PAGE_LETTERS: usize = 8_000_000;
/// Room kept for what is not counted: text, tables, styles, scripts, outlines of the strip.
const TEXT_LETTERS: usize = 300_000;
/// The footage's share of what sheets and plots leave, per cent; the strip and the rig get the rest.
const FILM_SHARE: usize = 55;

/// Components that are drawn: PC1 and PC2 carry the gait, one more shows what does not.
const DRAWN_COMPONENTS: usize = 3;

fn has(shot: &Shot, file: &str) -> bool {
    shot.path(file).is_file()
}

fn stored_keys(shot: &Shot) -> Result<Option<StoredKeys>> {
    if !(has(shot, paths::KEYS) && has(shot, paths::PROJECTIONS)) {
        return Ok(None);
    }
    Ok(Some(shot.keys(shot.projections()?.used.len())?))
}

fn marks(keys: Option<&StoredKeys>) -> Vec<KeyMark> {
    let mark = |k: &crate::shot::KeyImage| KeyMark {
        key: k.key,
        frame: k.frame,
        partner_of: k.partner_of,
    };
    keys.map(|k| k.keys.iter().map(mark).collect()).unwrap_or_default()
}

fn stored_weights(shot: &Shot) -> Result<Option<WeightTable>> {
    let path = shot.path(paths::WEIGHTS);
    if !path.is_file() {
        return Ok(None);
    }
    Ok(Some(WeightTable::from_csv(&path, &read(&path)?)?))
}

fn band(d: &StoredDiagnosis) -> Band {
    Band {
        peak_hz: d.step_hz,
        half_hz: d.half_amplitude_hz,
        low_hz: d.band_hz[0],
        high_hz: d.band_hz[1],
    }
}

/// The plots that the stored files allow.
pub(super) fn plots(shot: &Shot) -> Result<Plots> {
    let name = shot.name();
    let fps = Some(shot.fps());
    let keys = stored_keys(shot)?;
    let marks = marks(keys.as_ref());
    let mut made = Plots::default();
    if has(shot, paths::SILHOUETTES) {
        made.silhouettes = Some(silhouette_plot(shot, &name, fps)?);
    }
    if has(shot, paths::PROJECTIONS) && has(shot, paths::DIAGNOSIS) {
        let (projections, diagnosis) = (shot.projections()?, shot.diagnosis()?);
        let used = if shot.settings.analysis.band_pass {
            &projections.band_passed
        } else {
            &projections.raw
        };
        if used.components() >= 2 {
            let points: Vec<[f64; 2]> =
                (0..used.frames()).map(|t| [used.point(t)[0], used.point(t)[1]]).collect();
            made.trajectory = Some(trajectory(&Trajectory {
                shot: &name,
                points: &points,
                keys: &marks,
                cycle_frames: Some(diagnosis.step_frames),
            })?);
        }
        let (raw, passed) = (columns(&projections.raw), columns(&projections.band_passed));
        made.scores = Some(scores(&Scores {
            shot: &name,
            raw: &raw,
            band_passed: &passed,
            keys: &marks,
            fps,
        })?);
        made.spectra = Some(spectrum_plot(shot, &name, &diagnosis)?);
    }
    if let (Some(table), Some(_)) = (stored_weights(shot)?, &keys) {
        made.weights = Some(weight_plot(&name, fps, &table, &marks)?);
    }
    Ok(made)
}

fn columns(all: &Coefficients) -> Vec<Vec<f64>> {
    (0..all.components().min(DRAWN_COMPONENTS)).map(|c| all.column(c)).collect()
}

fn weight_plot(
    name: &str,
    fps: Option<f64>,
    table: &WeightTable,
    marks: &[KeyMark],
) -> Result<super::plots::Svg> {
    let frames = table.frames();
    let values: Vec<Vec<f64>> =
        (0..table.poses).map(|k| (0..frames).map(|t| table.row(t)[k]).collect()).collect();
    let own = marks.iter().take(table.posed()).map(|&mark| (mark, false));
    let exchanged = marks.iter().take(table.mirrored).map(|&mark| (mark, true));
    let curves: Vec<WeightCurve> = (own.chain(exchanged).zip(&values))
        .map(|((mark, mirrored), values)| WeightCurve { mark, mirrored, values })
        .collect();
    let sum: Vec<f64> = (0..frames).map(|t| table.sum(t)).collect();
    let models: Vec<usize> = table.models.iter().filter_map(|m| m.map(|m| m + 1)).collect();
    let active_model = if models.len() == frames { &models[..] } else { &[] };
    weights(&Weights { shot: name, curves: &curves, sum: &sum, active_model, fps })
}

fn spectrum_plot(shot: &Shot, name: &str, d: &StoredDiagnosis) -> Result<super::plots::Svg> {
    let rows = number_rows(shot, paths::SPECTRUM)?;
    let frequencies: Vec<f64> = rows.iter().filter_map(|r| r.first().copied().flatten()).collect();
    let components = rows.first().map_or(0, |r| r.len().saturating_sub(1)).min(DRAWN_COMPONENTS);
    let amplitudes: Vec<Vec<f64>> = (0..components)
        .map(|c| rows.iter().map(|r| r.get(c + 1).copied().flatten().unwrap_or(0.0)).collect())
        .collect();
    spectra(&Spectra {
        shot: name,
        frequencies_hz: &frequencies,
        amplitudes: &amplitudes,
        band: Some(band(d)),
        fps: Some(shot.fps()),
    })
}

fn silhouette_plot(shot: &Shot, name: &str, fps: Option<f64>) -> Result<super::plots::Svg> {
    let reports = shot.frame_reports()?;
    let area: Vec<f64> = reports.iter().map(|r| r.area_px as f64).collect();
    let centre: Vec<[f64; 2]> =
        reports.iter().map(|r| r.centre_px.map_or([f64::NAN; 2], |(x, y)| [x, y])).collect();
    let confidence: Vec<f64> = reports.iter().map(|r| r.confidence).collect();
    let flagged: Vec<usize> = reports.iter().filter(|r| r.is_excluded()).map(|r| r.frame).collect();
    silhouette_measures(&SilhouetteMeasures {
        shot: name,
        area_px: &area,
        centre_px: &centre,
        confidence: &confidence,
        flagged: &flagged,
        fps,
    })
}

/// The cells of a stored table after its header; what is no number is `None`.
fn number_rows(shot: &Shot, file: &str) -> Result<Vec<Vec<Option<f64>>>> {
    let text = String::from_utf8_lossy(&read(&shot.path(file))?).into_owned();
    Ok(text.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().ok()).collect()).collect())
}

/// Everything the page shows.
pub(super) fn page_data(shot: &Shot, plots: Plots, files: &Reads) -> Result<PageData> {
    let keys = stored_keys(shot)?;
    let diagnosis = has(shot, paths::DIAGNOSIS).then(|| shot.diagnosis()).transpose()?;
    let stored = has(shot, paths::ANIMATION).then(|| shot.animation()).transpose()?;
    let reports = if has(shot, paths::SILHOUETTES) { shot.frame_reports()? } else { Vec::new() };
    let mut warnings = asked::warnings(shot, &reports, stored.as_ref())?;
    let inputs = asked::inputs(shot, &mut warnings)?;
    let mut data = PageData {
        shot: shot.name(),
        folder: shot.name(),
        made_by: concat!("muybridge ", env!("CARGO_PKG_VERSION")).to_owned(),
        asked: asked::asked(shot)?,
        warnings,
        footage: footage(shot)?,
        verdict: diagnosis.as_ref().map(verdict),
        components: diagnosis.as_ref().map(component_rows).unwrap_or_default(),
        band: diagnosis.as_ref().map(band),
        keys: keys.as_ref().map(|k| key_summary(shot, k)),
        weights: stored_weights(shot)?.as_ref().map(weight_summary),
        animation: stored.as_ref().map(|a| animation::animation(shot, a)),
        findings: has(shot, paths::SILHOUETTES).then(|| findings(&reports)),
        settings: settings::settings(&shot.settings),
        plots,
        pictures: Pictures {
            contact_sheet: sheet(shot, paths::CONTACT_SHEET)?,
            eigen_sheet: sheet(shot, EIGEN_SHEET)?,
        },
        strip: Vec::new(),
        player: None,
        inputs,
        files: files
            .iter()
            .map(|(path, hash)| FileHash { path: path.clone(), hash: hash.clone() })
            .collect(),
    };
    add_film(shot, &reports, stored.as_ref(), keys.as_ref(), &mut data)?;
    Ok(data)
}

fn sheet(shot: &Shot, file: &str) -> Result<Option<Embedded>> {
    let embedded = || Ok(Embedded::sheet(&Png::from_bytes(read(&shot.path(file))?)));
    has(shot, file).then(embedded).transpose()
}

/// Puts the footage and the rig into what room the rest of the page leaves.
fn add_film(
    shot: &Shot,
    reports: &[FrameReport],
    stored: Option<&StoredAnimation>,
    keys: Option<&StoredKeys>,
    data: &mut PageData,
) -> Result<()> {
    if !has(shot, &paths::mask(0)) {
        return Ok(());
    }
    let room = PAGE_LETTERS.saturating_sub(TEXT_LETTERS + data.plots.size() + data.pictures.size());
    let film = film(shot, room * FILM_SHARE / 100)?;
    data.strip = player::strip(&film, reports, shot.fps());
    let strip: usize =
        data.strip.iter().map(|s| s.picture.as_ref().map_or(0, Embedded::size)).sum();
    let left = room.saturating_sub(film.letters() + strip);
    let rig = stored.map(|a| player::rig(shot, a, left)).transpose()?;
    let marks: Vec<(usize, usize)> =
        keys.iter().flat_map(|k| &k.keys).map(|k| (k.frame, k.key)).collect();
    data.player = player::player(shot, &film, &marks, stored, rig)?;
    Ok(())
}

fn footage(shot: &Shot) -> Result<Option<Footage>> {
    if !has(shot, &paths::mask(0)) {
        return Ok(None);
    }
    let files = shot.mask_files()?;
    let first = shot.first_mask()?;
    let source = &shot.settings.source;
    let (name, kind) = match shot.input()? {
        Input::Mattes => (source.mattes.clone(), "mattes"),
        Input::Strokes => (source.strokes.clone().or(Some("strokes".to_owned())), "strokes"),
        Input::Footage => {
            let synthetic = source.from.as_deref().is_some_and(|f| f.starts_with(SYNTHETIC_PREFIX));
            (source.from.clone(), if synthetic { "synthetic" } else { "footage" })
        }
    };
    Ok(Some(Footage {
        source: name.unwrap_or_default(),
        kind: kind.to_owned(),
        frames: files.len(),
        fps: shot.fps(),
        width: first.width(),
        height: first.height(),
    }))
}

fn verdict(d: &StoredDiagnosis) -> VerdictSummary {
    VerdictSummary {
        grade: match d.verdict.as_str() {
            "usable" => Grade::Usable,
            "doubtful" => Grade::Doubtful,
            _ => Grade::Unusable,
        },
        reasons: d.reasons.clone(),
        advice: d.advice.clone(),
        step_hz: Some(d.step_hz),
        stride_hz: d.stride_hz,
    }
}

fn component_rows(d: &StoredDiagnosis) -> Vec<ComponentRow> {
    let row = |(c, line): (usize, &crate::shot::StoredComponent)| ComponentRow {
        component: c + 1,
        variance_share: line.variance_share,
        r: Some(line.r),
        peak_hz: Some(line.peak_hz),
    };
    d.components.iter().enumerate().map(row).collect()
}

fn key_summary(shot: &Shot, keys: &StoredKeys) -> KeySummary {
    let pose = |key: usize| shot.settings.pose_of_key.iter().find(|p| p.key == key).map(pose_text);
    KeySummary {
        method: match keys.expected_error_share {
            Some(share) => format!(
                "Spread over the gait phase; error to expect: {:.0} % of the motion",
                100.0 * share
            ),
            None => "Chosen for the smallest condition number".to_owned(),
        },
        condition: keys.condition.unwrap_or(0.0),
        proven_optimal: keys.proven_optimal,
        lower_bound: keys.lower_bound.unwrap_or(0.0),
        rows: keys
            .keys
            .iter()
            .map(|k| KeyRow {
                key: k.key,
                frame: k.frame,
                time_s: k.time_s,
                partner_of: k.partner_of,
                pose: pose(k.key),
            })
            .collect(),
    }
}

fn pose_text(pose: &PoseOfKey) -> String {
    match (pose.frame, pose.time) {
        (Some(frame), _) => format!("{} #{frame}", pose.clip),
        (None, Some(time)) => format!("{} @{time} s", pose.clip),
        (None, None) => pose.clip.clone(),
    }
}

fn weight_summary(table: &WeightTable) -> WeightSummary {
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let used: Vec<usize> = table.models.iter().flatten().copied().collect();
    let mut distinct = used.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let switches = used.windows(2).filter(|w| w[0] != w[1]).count();
    WeightSummary {
        weight: range(&mut table.values.iter().copied()),
        sum: range(&mut (0..table.frames()).map(|t| table.sum(t))),
        models: (!used.is_empty()).then_some([distinct.len(), switches]),
    }
}

/// Runs of frames with the same flags.
fn findings(reports: &[FrameReport]) -> Vec<Finding> {
    let finding = |run: &[FrameReport]| {
        let (first, last) = (run.first()?, run.last()?);
        let words: Vec<&str> = first.flags.iter().map(Flag::sentence).collect();
        let least = run.iter().map(|r| r.confidence).fold(f64::INFINITY, f64::min);
        (!words.is_empty()).then(|| Finding {
            first_frame: first.frame,
            last_frame: last.frame,
            what: words.join("; "),
            confidence: Some(least),
            excludes: first.is_excluded(),
        })
    };
    reports.chunk_by(|a, b| a.flags == b.flags).filter_map(finding).collect()
}
