//! From the stored files of a shot to what the page and the plots take.

use super::drawing::{EIGEN_SHEET, OVERLAY_SHEET};
use super::page::{
    AnimationSummary, ComponentRow, FeetSummary, FileHash, Finding, FootRow, Footage, Grade,
    KeyRow, KeySummary, PageData, Pictures, Plots, Setting, VerdictSummary, WeightSummary,
};
use super::plots::{
    Band, Scores, SilhouetteMeasures, Spectra, Trajectory, WeightCurve, Weights, scores,
    silhouette_measures, spectra, trajectory, weights,
};
use super::{KeyMark, Png};
use crate::error::Result;
use crate::numeric::Coefficients;
use crate::shot::{
    Input, PoseOfKey, Reads, SYNTHETIC_PREFIX, Shot, ShotFile, StoredDiagnosis, StoredFeet,
    StoredFoot, StoredKeys, StoredLoop, WeightTable, paths, read,
};
use crate::silhouette::{Flag, FrameReport};

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
    let curves: Vec<WeightCurve> =
        marks.iter().zip(&values).map(|(&mark, values)| WeightCurve { mark, values }).collect();
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
    let picture = |file: &str| -> Result<Option<Png>> {
        has(shot, file).then(|| Ok(Png::from_bytes(read(&shot.path(file))?))).transpose()
    };
    Ok(PageData {
        shot: shot.name(),
        folder: shot.name(),
        made_by: concat!("muybridge ", env!("CARGO_PKG_VERSION")).to_owned(),
        footage: footage(shot)?,
        verdict: diagnosis.as_ref().map(verdict),
        components: diagnosis.as_ref().map(component_rows).unwrap_or_default(),
        band: diagnosis.as_ref().map(band),
        keys: keys.as_ref().map(|k| key_summary(shot, k)),
        weights: stored_weights(shot)?.as_ref().map(weight_summary),
        animation: has(shot, paths::ANIMATION).then(|| animation(shot)).transpose()?,
        findings: has(shot, paths::SILHOUETTES).then(|| findings(shot)).transpose()?,
        settings: settings(&shot.settings),
        plots,
        pictures: Pictures {
            contact_sheet: picture(paths::CONTACT_SHEET)?,
            overlay_sheet: picture(OVERLAY_SHEET)?,
            eigen_sheet: picture(EIGEN_SHEET)?,
        },
        files: files
            .iter()
            .map(|(path, hash)| FileHash { path: path.clone(), hash: hash.clone() })
            .collect(),
    })
}

fn footage(shot: &Shot) -> Result<Option<Footage>> {
    if !has(shot, &paths::mask(0)) {
        return Ok(None);
    }
    let files = shot.mask_files()?;
    let first = crate::mask::Mask::from_image_bytes(&files[0], &read(&files[0])?)?;
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
            None => keys.method.clone(),
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

fn animation(shot: &Shot) -> Result<AnimationSummary> {
    let stored = shot.animation()?;
    let mut files = vec![stored.path.clone()];
    if has(shot, paths::BVH) {
        files.push(paths::BVH.to_owned());
    }
    Ok(AnimationSummary {
        files,
        name: stored.animation,
        fps: stored.fps,
        frames: stored.frames,
        nodes: stored.moved_nodes,
        largest_step_deg: stored.largest_step_deg,
        largest_step_frame: stored.largest_step_frame,
        looped: stored.looped.as_ref().map(loop_words),
        feet: stored.feet.as_ref().map(feet_summary),
    })
}

fn loop_words(l: &StoredLoop) -> String {
    format!(
        "A loop of {} stride(s), averaged over {:.1}. At its seam poses differ by {:.0e}°, and turns change by {:.2}° a frame (median turn {:.2}°).",
        l.strides, l.strides_seen, l.seam.angle_deg, l.seam.angle_jump_deg, l.seam.median_turn_deg
    )
}

fn feet_summary(f: &StoredFeet) -> FeetSummary {
    let planting = f.planted.as_ref().map(|p| {
        format!(
            "Feet that are down are held: they slide by up to {:.2} % of a leg ({:.1} % before). Angular acceleration of the legs' joints: {:.0} degrees/s² rms ({:.0} before), at most {:.0} ({:.0} before).",
            100.0 * p.slide_leg_lengths[1],
            100.0 * p.slide_leg_lengths[0],
            p.rms_acceleration_deg_s2[1],
            p.rms_acceleration_deg_s2[0],
            p.peak_acceleration_deg_s2[1],
            p.peak_acceleration_deg_s2[0]
        )
    });
    let row = |foot: &StoredFoot| FootRow {
        node: foot.node.clone(),
        limb: foot.limb.words().to_owned(),
        duty_factor: foot.duty_factor,
        phase: foot.phase,
        contacts: (foot.contacts.iter())
            .map(|c| format!("{:.2}–{:.2}", c.down_s, c.up_s))
            .collect::<Vec<_>>()
            .join(", "),
    };
    FeetSummary {
        gait: f.gait.clone(),
        warnings: f.warnings.clone(),
        ground_speed: f.ground_speed,
        stride_s: f.stride_s,
        stride_length: f.stride_length,
        root: f.root.clone(),
        planting,
        rows: f.feet.iter().map(row).collect(),
    }
}

/// Runs of frames with the same flags.
fn findings(shot: &Shot) -> Result<Vec<Finding>> {
    let reports = shot.frame_reports()?;
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
    Ok(reports.chunk_by(|a, b| a.flags == b.flags).filter_map(finding).collect())
}

/// Every setting in the order of the file, marked where it differs from its default.
fn settings(now: &ShotFile) -> Vec<Setting> {
    let table = |file: &ShotFile| toml::Table::try_from(file).unwrap_or_default();
    let mut defaults = Vec::new();
    flatten("", &table(&ShotFile::default()), &mut defaults);
    let mut values = Vec::new();
    flatten("", &table(now), &mut values);
    values
        .into_iter()
        .map(|(name, value)| {
            let changed = !defaults.contains(&(name.clone(), value.clone()));
            Setting { name, value, changed }
        })
        .collect()
}

fn flatten(prefix: &str, table: &toml::Table, into: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            toml::Value::Table(inner) => flatten(&name, inner, into),
            // The poses of the keys stand in the table of keys.
            toml::Value::Array(_) if key == "pose" => {}
            other => {
                into.push((name, other.to_string()));
            }
        }
    }
}
