//! The stages between masks and poses.

use super::analysis::{MaskAnalysis, MaskClip, Trends};
use super::choose::{
    KeyRequest, KeysOnPhase, OverPhase, choose, choose_by_phase, interpolation_weights,
    phase_weights, resolved_method,
};
use super::mirror;
use super::segment::segment;
use super::segments::{analyse_segments, segments_csv, stored_segments};
use super::{Options, Outcome};
use crate::error::{Error, Result};
use crate::image::Picture;
use crate::image_pca::{GreyImage, MaskBands};
use crate::keys::KeySettings;
use crate::shot::{
    Freshness, KeyImage, Method, Projections, Reads, Shot, Stage, StoredComponent, StoredDiagnosis,
    StoredDrift, StoredKeys, StoredStride, StoredTrend, WeightTable, hash_file, hash_files,
    hash_value, number, paths, read, table,
};
use crate::spectrum;

/// Components whose eigen-silhouettes are drawn, and deviations from the mean on either side.
const DRAWN_COMPONENTS: usize = 4;
const DRAWN_DEVIATIONS: f64 = 2.0;

/// What `analyze` found.
#[derive(Clone, Debug)]
pub struct AnalyzeResult {
    /// The verdict and its measurements.
    pub diagnosis: StoredDiagnosis,
    /// What was done to the folder.
    pub outcome: Outcome,
}

/// What `keys` chose.
#[derive(Clone, Debug)]
pub struct KeysResult {
    /// The keys.
    pub keys: StoredKeys,
    /// What was done to the folder.
    pub outcome: Outcome,
}

/// A hash over all mask files as they are now, edits by hand included.
///
/// # Errors
/// When a mask is missing or cannot be read.
pub fn stored_masks_hash(shot: &Shot) -> Result<String> {
    hash_files(&shot.mask_files()?)
}

/// Masks to coefficients, spectrum and verdict.
///
/// # Errors
/// As [`segment`] and [`analyse_segments`](super::analyse_segments).
pub fn analyze(shot: &Shot, options: Options) -> Result<AnalyzeResult> {
    segment(shot, options.for_earlier_stage())?;
    let reads = analyze_reads(shot)?;
    if !options.force && shot.freshness(Stage::Analyze, &reads) == Freshness::UpToDate {
        let outcome = Outcome { ran: false, kept: shot.edited_files(Stage::Analyze)? };
        return Ok(AnalyzeResult { diagnosis: shot.diagnosis()?, outcome });
    }
    step(options, Stage::Analyze, 0, 3)?;
    let masks = shot.masks()?;
    let reports = shot.frame_reports()?;
    step(options, Stage::Analyze, 1, 3)?;
    let wanted = spectrum::Settings {
        gait: shot.settings.analysis.gait,
        band_pass: shot.settings.analysis.band_pass,
    };
    let clip = MaskClip {
        masks: &masks,
        reports: &reports,
        flagged: shot.settings.analysis.flagged_frames,
        fps: shot.fps(),
        components: shot.settings.analysis.components,
        trends: Trends {
            scale: shot.settings.silhouette.scale_trend,
            shape: shot.settings.analysis.shape_drift,
        },
    };
    let found = analyse_segments(&clip, &wanted, shot.settings.analysis.segment)?;
    step(options, Stage::Analyze, 2, 3)?;
    let diagnosis = stored_diagnosis(&found, shot.fps());
    let mut writer = shot.begin(Stage::Analyze, reads, options.force)?;
    let projections = Projections {
        fps: shot.fps(),
        used: found.used.clone(),
        raw: found.scores.clone(),
        band_passed: found.spectral.band_passed.clone(),
    };
    writer.put(paths::PROJECTIONS, projections.to_csv().as_bytes())?;
    writer.put(paths::SPECTRUM, spectrum_csv(&found).as_bytes())?;
    writer.put(paths::SEGMENTS, segments_csv(&diagnosis.segments).as_bytes())?;
    if let Some(phase) = found.phase_table() {
        writer.put(paths::PHASE, phase.frames_csv(shot.fps()).as_bytes())?;
        writer.put(paths::CYCLE, phase.cycle_csv().as_bytes())?;
    }
    writer.put(paths::DIAGNOSIS, &json(&diagnosis)?)?;
    let images = found.pca.images_of_bands(&MaskBands::of(&found.analysed_masks())?);
    writer.put("analysis/mean.png", &grey(&images.mean)?)?;
    for c in 0..found.pca.eigenvalues.len().min(DRAWN_COMPONENTS) {
        for (sign, deviations) in [("minus", -DRAWN_DEVIATIONS), ("plus", DRAWN_DEVIATIONS)] {
            let image = images.along(c, deviations);
            writer.put(&format!("analysis/component_{}_{sign}.png", c + 1), &grey(&image)?)?;
        }
    }
    let written = writer.commit()?;
    step(options, Stage::Analyze, 3, 3)?;
    Ok(AnalyzeResult { diagnosis, outcome: Outcome { ran: true, kept: written.kept } })
}

/// What the analysis depends on.
pub(super) fn analyze_reads(shot: &Shot) -> Result<Reads> {
    let settings = (&shot.settings.analysis, shot.settings.silhouette.scale_trend, shot.fps());
    Ok(Reads::from([
        ("masks".to_owned(), stored_masks_hash(shot)?),
        ("reports".to_owned(), hash_value(&shot.frame_reports()?)),
        ("settings".to_owned(), hash_value(&settings)),
    ]))
}

fn grey(image: &GreyImage) -> Result<Vec<u8>> {
    let picture = Picture::from_grey(image.width, image.height, &image.to_bytes());
    picture.map_or_else(|| Ok(Vec::new()), |p| p.to_png_bytes())
}

fn stored_diagnosis(found: &MaskAnalysis, fps: f64) -> StoredDiagnosis {
    let spectral = &found.spectral;
    let rhythm = spectral.rhythm;
    let first = &found.windows.masks[0];
    StoredDiagnosis {
        verdict: spectral.diagnosis.verdict.to_string(),
        reasons: spectral.diagnosis.reasons.iter().map(ToString::to_string).collect(),
        advice: spectral.diagnosis.advice.iter().map(ToString::to_string).collect(),
        frames: found.used.len(),
        fps,
        cycles: spectral.diagnosis.cycles,
        step_hz: rhythm.step_hz,
        step_frames: rhythm.step_frames,
        stride_hz: rhythm.stride_hz,
        stride_frames: rhythm.stride_frames,
        stride_basis: rhythm.stride_basis.name().to_owned(),
        stride: found.gait.as_ref().map(|g| StoredStride {
            repeats: g.stride.repeats.name().to_owned(),
            odd_share: g.stride.odd_share,
            odd_over_noise: g.stride.odd_over_noise,
            contradicts_gait: g.stride.contradicts_gait,
            explained_share: g.explained_share,
            sweep: found.sweep(),
            amplitude_range: range(&g.amplitude[found.frames.clone()]),
        }),
        stride_candidates_hz: [rhythm.step_hz / 2.0, rhythm.step_hz],
        half_amplitude_hz: spectral.peak.fb_hz,
        peak_amplitude: spectral.peak.amplitude,
        band_hz: [spectral.peak.band_hz.0, spectral.peak.band_hz.1],
        quadrature_deg: spectral.quadrature_deg,
        components: spectral
            .components
            .iter()
            .map(|c| StoredComponent {
                variance_share: c.variance_share,
                r: c.r,
                peak_hz: c.peak_hz,
            })
            .collect(),
        window_px: [first.width(), first.height()],
        scale_trend: found
            .windows
            .trend
            .map(|t| StoredTrend { change: t.change, removed: t.removed }),
        shape_drift: found.drift.map(|d| StoredDrift {
            share: d.share,
            half_cycles: d.half_cycles,
            removed: d.removed,
        }),
        bad_frames: found.frames.clone().filter(|&t| !found.used[t]).collect(),
        segments: stored_segments(found),
    }
}

/// The least and the greatest value; of nothing 1 twice.
fn range(values: &[f64]) -> [f64; 2] {
    let wider = |ends: [f64; 2], v: &f64| [ends[0].min(*v), ends[1].max(*v)];
    let first = values.first().copied().unwrap_or(1.0);
    values.iter().fold([first; 2], wider)
}

fn spectrum_csv(found: &MaskAnalysis) -> String {
    let spectra = &found.spectral.spectra;
    let mut header = vec!["frequency_hz".to_owned()];
    header.extend((1..=spectra.len()).map(|c| format!("amplitude_pc{c}")));
    let points = spectra.first().map_or(0, |s| s.amplitudes.len());
    let rows = (0..points).map(|k| {
        let mut row = vec![number(spectra[0].frequency_hz(k))];
        row.extend(spectra.iter().map(|s| number(s.amplitudes[k])));
        row
    });
    table(&header, rows)
}

/// Coefficients to key frames.
///
/// # Errors
/// As [`analyze`] and [`choose`].
pub fn keys(shot: &Shot, options: Options) -> Result<KeysResult> {
    let analyzed = analyze(shot, options.for_earlier_stage())?;
    let projections = shot.projections()?;
    let frames = projections.used.len();
    let reads = keys_reads(shot)?;
    let mut outcome = Outcome { ran: false, kept: shot.edited_files(Stage::Keys)? };
    if options.force || shot.freshness(Stage::Keys, &reads) == Freshness::Stale {
        let stored = chosen_keys(shot, &projections, &analyzed.diagnosis, options)?;
        let mut writer = shot.begin(Stage::Keys, reads, options.force)?;
        writer.put(paths::KEYS, &json(&stored)?)?;
        outcome = Outcome { ran: true, kept: writer.commit()?.kept };
    }
    Ok(KeysResult { keys: shot.keys(frames)?, outcome })
}

/// What the choice of keys depends on.
pub(super) fn keys_reads(shot: &Shot) -> Result<Reads> {
    let mut reads = Reads::from([
        ("projections".to_owned(), hash_file(&shot.path(paths::PROJECTIONS))?),
        ("diagnosis".to_owned(), hash_file(&shot.path(paths::DIAGNOSIS))?),
        (
            "settings".to_owned(),
            hash_value(&(
                &shot.settings.keys,
                shot.settings.analysis.band_pass,
                shot.settings.animation.alpha,
                shot.settings.animation.method,
                shot.settings.animation.mirror,
            )),
        ),
    ]);
    reads.extend(phase_reads(shot)?);
    Ok(reads)
}

/// Hashes of the gait phase's tables, where there are any.
fn phase_reads(shot: &Shot) -> Result<Reads> {
    [("phase", paths::PHASE), ("cycle", paths::CYCLE)]
        .into_iter()
        .filter(|(_, path)| shot.path(path).is_file())
        .map(|(name, path)| Ok((name.to_owned(), hash_file(&shot.path(path))?)))
        .collect()
}

/// Chooses keys (and partners) for the interpolation that will use them.
fn chosen_keys(
    shot: &Shot,
    projections: &Projections,
    diagnosis: &StoredDiagnosis,
    options: Options,
) -> Result<StoredKeys> {
    let request = key_request(shot, projections, diagnosis.step_frames);
    let coefficients = used_coefficients(shot, projections);
    let phase = shot.phase(projections.used.len())?;
    let method =
        resolved_method(shot.settings.animation.method, request.partners, phase.is_some())?;
    if let (Method::Phase, Some(phase)) = (method, &phase) {
        let sweep = diagnosis.stride.as_ref().and_then(|s| s.sweep);
        let mirrored = !request.partners && mirror::counts_twice(shot, diagnosis, phase.drifts());
        let KeysOnPhase { chosen, expected_error_deg, budget, next_frame } =
            choose_by_phase(phase, &request.keys, sweep, mirrored)?;
        return Ok(StoredKeys {
            method: "phase".to_owned(),
            keys: key_images(&chosen.frames, &[], shot.fps()),
            components: coefficients.components(),
            mirrored,
            expected_error_share: Some(chosen.expected_error_share),
            expected_error_deg,
            budget,
            next_frame,
            condition: None,
            // Over a drift the sets are not all searched, with the mirror those of two circles.
            proven_optimal: !mirrored && !phase.drifts(),
            lower_bound: None,
        });
    }
    let progress = |done: usize, total: usize| {
        options.progress.step(Stage::Keys, done, Some(total).filter(|t| *t > 0))
    };
    let chosen = choose(&coefficients, &request, &progress)?;
    Ok(StoredKeys {
        method: "condition-number".to_owned(),
        keys: key_images(&chosen.choice.frames, &chosen.partner_frames(), shot.fps()),
        components: coefficients.components(),
        mirrored: false,
        expected_error_share: None,
        expected_error_deg: None,
        budget: Vec::new(),
        next_frame: None,
        condition: Some(chosen.choice.condition),
        proven_optimal: chosen.choice.proven_optimal,
        lower_bound: Some(chosen.choice.lower_bound),
    })
}

/// Keys and then their partners, numbered from 1.
fn key_images(keys: &[usize], partners: &[usize], fps: f64) -> Vec<KeyImage> {
    let keys = keys.iter().map(|&f| (f, None));
    let partners = partners.iter().enumerate().map(|(at, &f)| (f, Some(at + 1)));
    keys.chain(partners)
        .enumerate()
        .map(|(at, (frame, partner_of))| KeyImage {
            key: at + 1,
            frame,
            time_s: frame as f64 / fps,
            partner_of,
        })
        .collect()
}

fn key_request(shot: &Shot, projections: &Projections, step_frames: f64) -> KeyRequest {
    let settings = &shot.settings.keys;
    // A frame whose silhouette was left out has bridged coefficients: where it lies in the cycle is
    // a guess, and its picture may not show the whole animal. Whom the user names is posed anyway.
    let bad = (0..projections.used.len())
        .filter(|&t| !projections.used[t] && !settings.include.contains(&t));
    let mut exclude: Vec<usize> = settings.exclude.iter().copied().chain(bad).collect();
    exclude.sort_unstable();
    exclude.dedup();
    KeyRequest {
        keys: KeySettings {
            keys: settings.count,
            alpha: shot.settings.animation.alpha,
            exclude,
            force: settings.include.clone(),
            min_spacing_frames: settings.spacing,
            time_limit_s: settings.time_limit_s,
            ..KeySettings::default()
        },
        partners: settings.partners,
        partner_of: settings
            .partner_of
            .iter()
            .map(|&[key, frame]| (key.saturating_sub(1), frame))
            .collect(),
        step_frames,
    }
}

fn used_coefficients(shot: &Shot, projections: &Projections) -> crate::numeric::Coefficients {
    let all =
        if shot.settings.analysis.band_pass { &projections.band_passed } else { &projections.raw };
    all.leading(shot.settings.keys.components)
}

/// Key frames to `keys/weights.csv`.
///
/// # Errors
/// As [`keys`] and [`interpolation_weights`].
pub fn weights(shot: &Shot, options: Options) -> Result<(StoredKeys, WeightTable)> {
    let chosen = keys(shot, options.for_earlier_stage())?.keys;
    let diagnosis = shot.diagnosis()?;
    let reads = weights_reads(shot)?;
    if options.force || shot.freshness(Stage::Weights, &reads) == Freshness::Stale {
        let coefficients = used_coefficients(shot, &shot.projections()?);
        let phase = shot.phase(coefficients.frames())?;
        let (keys, partners) = (chosen.key_frames(), chosen.partner_frames());
        let settings = &shot.settings.animation;
        let by_phase = phase.as_ref().filter(|_| {
            resolved_method(settings.method, !partners.is_empty(), true)
                .is_ok_and(|method| method == Method::Phase)
        });
        let found = if let Some(phase) = by_phase {
            let poses: Vec<usize> = keys.iter().chain(&partners).copied().collect();
            let mirrored = partners.is_empty()
                && mirror::counts_twice(shot, &diagnosis, phase.drifts())
                && mirror::rig_has_one(shot)?;
            let how = OverPhase { ridge: settings.ridge, mirrored, amplitude: settings.amplitude };
            phase_weights(phase, &poses, how)?
        } else {
            let step = diagnosis.step_frames;
            interpolation_weights(&coefficients, &keys, &partners, step, settings)?
        };
        for &frame in found.phase_conflicts() {
            tracing::warn!(
                frame,
                "this key or partner shows the other half of the stride than the motion around it says; choose another partner if the animation jumps there"
            );
        }
        let mut writer = shot.begin(Stage::Weights, reads, options.force)?;
        writer.put(paths::WEIGHTS, WeightTable::of(&found).to_csv(shot.fps()).as_bytes())?;
        writer.commit()?;
    }
    let path = shot.path(paths::WEIGHTS);
    Ok((chosen, WeightTable::from_csv(&path, &read(&path)?)?))
}

/// What the weights depend on.
pub(super) fn weights_reads(shot: &Shot) -> Result<Reads> {
    let diagnosis = shot.diagnosis()?;
    let mut reads = Reads::from([
        ("projections".to_owned(), hash_file(&shot.path(paths::PROJECTIONS))?),
        ("keys".to_owned(), hash_file(&shot.path(paths::KEYS))?),
        ("step".to_owned(), number(diagnosis.step_frames)),
        (
            "settings".to_owned(),
            hash_value(&(
                shot.settings.keys.components,
                shot.settings.analysis.band_pass,
                weight_settings(shot),
            )),
        ),
    ]);
    reads.extend(phase_reads(shot)?);
    if mirror::counts_twice(shot, &diagnosis, false) {
        mirror::reads(shot, &mut reads)?;
    }
    Ok(reads)
}

/// The settings of `[animation]` that weights depend on.
fn weight_settings(shot: &Shot) -> impl serde::Serialize + use<> {
    let a = &shot.settings.animation;
    (a.method, a.mirror, a.amplitude, a.alpha, a.ridge, a.clamp, a.normalize, a.start_model)
}

fn step(options: Options, stage: Stage, done: usize, total: usize) -> Result<()> {
    if options.progress.step(stage, done, Some(total)) { Ok(()) } else { Err(Error::Interrupted) }
}

/// A document as indented JSON with a final line feed.
pub(super) fn json<T: serde::Serialize>(value: &T) -> Result<Vec<u8>> {
    let mut text = serde_json::to_vec_pretty(value).map_err(|e| Error::Document {
        path: std::path::PathBuf::from("(new document)"),
        what: e.to_string(),
    })?;
    text.push(b'\n');
    Ok(text)
}
