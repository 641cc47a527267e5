//! Whether the poses of a shot count twice: once as they are and once, half a stride later, with left and right exchanged.

use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::gait::Repeats;
use crate::interpolate::exchanged_sides;
use crate::rig::{File, KeyPoses, Mirror};
use crate::shot::{Mirroring, Reads, Shot, StoredDiagnosis, WeightTable, hash_file};
use crate::spectrum::Gait;

/// Whether left does what right does half a stride later, as far as setting, gait and footage say. `drifts`: the view
/// turns over the clip, which the mirror would turn the other way.
#[must_use]
pub fn halves_alike(setting: Mirroring, gait: Gait, repeats: Repeats, drifts: bool) -> bool {
    match setting {
        Mirroring::On => true,
        Mirroring::Off => false,
        // Named so, or seen to do every step alike but for its side. A back that bobs twice a stride tells the stride of an
        // unnamed gait, not that its steps are alike: a fast gallop's does too, in both of its flights.
        Mirroring::Auto => {
            let alike = gait.is_symmetric().unwrap_or(repeats == Repeats::EveryStep);
            alike && !drifts
        }
    }
}

/// The same of a shot whose phase is stored.
pub(super) fn counts_twice(shot: &Shot, diagnosis: &StoredDiagnosis, drifts: bool) -> bool {
    let repeats = diagnosis.stride.as_ref().map_or("", |s| s.repeats.as_str());
    let repeats = [Repeats::EveryStep, Repeats::EveryStride]
        .into_iter()
        .find(|r| r.name() == repeats)
        .unwrap_or(Repeats::Unknown);
    let settings = &shot.settings;
    halves_alike(settings.animation.mirror, settings.analysis.gait, repeats, drifts)
}

/// The file of the shot's rig, where one is named and there.
fn named_rig(shot: &Shot) -> Option<PathBuf> {
    shot.settings.poses.rig.as_ref().map(|rig| shot.path(rig)).filter(|rig| rig.is_file())
}

/// What the mirror of a shot's rig depends on.
pub(super) fn reads(shot: &Shot, reads: &mut Reads) -> Result<()> {
    if let Some(rig) = named_rig(shot) {
        reads.insert("rig".to_owned(), hash_file(&rig)?);
    }
    Ok(())
}

/// Whether the shot's rig can be seen in a mirror; not while no rig is named. A rig that cannot is told of.
///
/// # Errors
/// As the reading of the rig; [`Error::Setting`] when the mirror was asked for and the rig has none.
pub(super) fn rig_has_one(shot: &Shot) -> Result<bool> {
    let Some(rig) = named_rig(shot) else { return Ok(false) };
    match Mirror::of_file(&File::read(&rig)?)? {
        Ok(_) => Ok(true),
        Err(why) if shot.settings.animation.mirror == Mirroring::On => Err(refused(&why)),
        Err(why) => {
            tracing::warn!(
                rig = %rig.display(),
                "poses are not used with left and right exchanged: {why}; choose keys with `--mirror off` for such a rig"
            );
            Ok(false)
        }
    }
}

/// Adds to the poses the same with left and right exchanged, in the same order. Returns the keys (from 1) whose pose was
/// probably made the wrong way round; each is told of.
///
/// # Errors
/// As [`rig_has_one`], and for keys that cannot be read.
pub(super) fn exchanged(
    shot: &Shot,
    file: &File,
    table: &WeightTable,
    poses: &mut KeyPoses,
) -> Result<Vec<usize>> {
    let mirror = Mirror::of_file(file)?.map_err(|why| refused(&why))?;
    let doubted = doubted(shot, file, table, poses, &mirror)?;
    poses.add_mirrored(&mirror);
    Ok(doubted)
}

fn doubted(
    shot: &Shot,
    file: &File,
    table: &WeightTable,
    poses: &KeyPoses,
    mirror: &Mirror,
) -> Result<Vec<usize>> {
    let Some(phase) = shot.phase(table.frames())? else { return Ok(Vec::new()) };
    let frames = shot.keys(table.frames())?.key_frames();
    if frames.len() != poses.poses.len() {
        return Ok(Vec::new());
    }
    let cycles: Vec<f64> = frames.iter().map(|&f| phase.stride_cycles[f]).collect();
    let found = exchanged_sides(&cycles, poses, file.skeleton(), mirror)?;
    for &key in &found {
        tracing::warn!(
            key = key + 1,
            frame = frames[key],
            "this pose fits the others far better with left and right exchanged: look which leg is in front"
        );
    }
    Ok(found.into_iter().map(|key| key + 1).collect())
}

fn refused(why: &crate::rig::NoMirror) -> Error {
    Error::setting("animation.mirror", &format!("is «off» for this rig: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gait_named_or_seen_symmetric_counts_twice_unless_the_view_turns() {
        let auto = |gait, repeats, drifts| halves_alike(Mirroring::Auto, gait, repeats, drifts);
        assert!(auto(Gait::Walk, Repeats::EveryStride, false));
        assert!(auto(Gait::Unknown, Repeats::EveryStep, false));
        assert!(!auto(Gait::Unknown, Repeats::Unknown, false));
        assert!(!auto(Gait::Unknown, Repeats::EveryStride, false));
        assert!(!auto(Gait::Gallop, Repeats::EveryStep, false));
        assert!(!auto(Gait::Trot, Repeats::EveryStep, true));
        assert!(halves_alike(Mirroring::On, Gait::Gallop, Repeats::Unknown, true));
        assert!(!halves_alike(Mirroring::Off, Gait::Walk, Repeats::EveryStep, false));
    }
}
