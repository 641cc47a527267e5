//! The weights of the footage's frames on the time grid of the animation.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::interpolate::{evened, loop_frames, resample, seamless};
use crate::numeric::CyclePhase;
use crate::shot::{Reads, Shot, StoredDiagnosis, WeightTable, hash_file, paths};

/// Loops of more frames than this are not meant.
const MOST_FRAMES: f64 = 100_000.0;

/// Weights on the animation's time grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Timed {
    /// Frames × poses, row by row.
    pub(super) values: Vec<f64>,
    /// Frames a second.
    pub(super) fps: f64,
    /// The loop, when one is wanted.
    pub(super) looped: Option<LoopTiming>,
}

/// What a loop was made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LoopTiming {
    /// Strides of the loop.
    pub(super) strides: usize,
    /// Strides of the clip.
    pub(super) strides_seen: f64,
    /// Duration of the loop over that of its strides in the footage, after retiming.
    pub(super) stretch: f64,
}

/// What the timing reads beyond weights and settings.
pub(super) fn reads(shot: &Shot, reads: &mut Reads) -> Result<()> {
    if shot.settings.animation.loop_strides > 0 {
        for (name, file) in [("projections", paths::PROJECTIONS), ("diagnosis", paths::DIAGNOSIS)] {
            reads.insert(name.to_owned(), hash_file(&shot.path(file))?);
        }
    }
    Ok(())
}

/// Brings some frames of a table of weights to the wanted rate, speed and, if asked for, to a loop.
pub(super) fn timed(shot: &Shot, all: &WeightTable, frames: Range<usize>) -> Result<Timed> {
    let table = &all.rows(frames.clone());
    let settings = &shot.settings.animation;
    let fps = if settings.fps > 0.0 { settings.fps } else { shot.fps() };
    // Source frames from one frame of the animation to the next.
    let step_frames = shot.fps() * settings.retime / fps;
    if table.frames() as f64 / step_frames > MOST_FRAMES {
        return Err(Error::setting(
            "animation.fps, animation.retime",
            "leave a clip of 100000 frames or fewer",
        ));
    }
    if settings.loop_strides == 0 {
        let values = if step_frames == 1.0 {
            table.values.clone()
        } else {
            limited(shot, table, resample(&table.values, table.poses, step_frames))
        };
        return Ok(Timed { values, fps, looped: None });
    }
    let strides = settings.loop_strides;
    let phase = evened(&stride_phase_cycles(shot, all)?[frames]);
    let length = loop_frames(&phase, strides).ok_or(Error::LoopTooShort { strides, seen: 0.0 })?
        / step_frames;
    let intervals = length.round().max(2.0);
    let made = seamless(&table.values, table.poses, &phase, strides, intervals as usize)?;
    Ok(Timed {
        values: limited(shot, table, made.values),
        fps,
        looped: Some(LoopTiming {
            strides,
            strides_seen: made.strides_seen,
            stretch: intervals / length,
        }),
    })
}

/// Keeps what the settings promise of every frame's weights.
fn limited(shot: &Shot, table: &WeightTable, mut values: Vec<f64>) -> Vec<f64> {
    let settings = &shot.settings.animation;
    if settings.clamp {
        values.iter_mut().for_each(|w| *w = w.clamp(0.0, 1.0));
    }
    if settings.normalize {
        for row in values.chunks_mut(table.poses) {
            let sum: f64 = row.iter().sum();
            if sum != 0.0 {
                row.iter_mut().for_each(|w| *w /= sum);
            }
        }
    }
    values
}

/// The phase of every frame in strides: the measured one where there is one, else one taken from the
/// scores.
///
/// The silhouette's phase counts its repeats. A stride is two of them when the diagnosis says so or
/// the weights switch between halves of the stride; where the stride is not known and the weights
/// follow the silhouette alone, they repeat with it, and one repeat is as good a loop as two.
pub(super) fn stride_phase_cycles(shot: &Shot, table: &WeightTable) -> Result<Vec<f64>> {
    if let Some(measured) = shot.phase(table.frames())? {
        return Ok(measured.stride_cycles);
    }
    let projections = shot.projections()?;
    let diagnosis = shot.diagnosis()?;
    let coefficients = &projections.band_passed;
    if coefficients.frames() != table.frames() {
        let path = shot.path(paths::WEIGHTS);
        let what = format!("{} frames of a clip of {}", table.frames(), coefficients.frames());
        return Err(Error::table(&path, 1, &what));
    }
    let phase = CyclePhase::measure(coefficients, Some(diagnosis.step_frames));
    let repeats = repeats_per_stride(&diagnosis, table);
    Ok(phase.unwrapped_rad().iter().map(|p| p / std::f64::consts::TAU / repeats).collect())
}

fn repeats_per_stride(diagnosis: &StoredDiagnosis, table: &WeightTable) -> f64 {
    let switching = table.models.iter().any(Option::is_some);
    match diagnosis.stride_frames {
        Some(stride) => (stride / diagnosis.step_frames).round().clamp(1.0, 2.0),
        None if switching => 2.0,
        None => 1.0,
    }
}
