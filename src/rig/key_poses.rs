//! The poses an artist made for the key images, named by clip and moment.

use std::str::FromStr;

use super::{Driven, File, Mirror, Pose};
use crate::error::{Error, Result};

/// A moment of a clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Moment {
    /// A frame, from 0, at the shot's frame rate: frame / fps seconds.
    Frame(u32),
    /// Seconds from the clip's beginning, finite and not negative.
    Time(f64),
}

/// Which pose of the rig belongs to a key image.
///
/// As text `KEY=CLIP#FRAME` or `KEY=CLIP@SECONDS`, for example `1=KeyPoses#1`, `2=Walk@0.25`;
/// `KEY=CLIP` is frame 0, for rigs with a clip a pose. Only the last `#` or `@` counts, and only
/// when a number follows, so clip names may contain either.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseSpec {
    /// Number of the key image, from 1.
    pub key: usize,
    /// Name of the animation, as [`File::animation`] takes it.
    pub clip: String,
    /// The moment of the clip.
    pub at: Moment,
}

impl FromStr for PoseSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || Error::PoseForm { text: text.to_owned() };
        let (key, pose) = text.split_once('=').ok_or_else(bad)?;
        let key = key.trim().parse().ok().filter(|&k| k > 0).ok_or_else(bad)?;
        let (clip, at) = match pose.rfind(['#', '@']) {
            Some(i) => match moment(&pose[i..]) {
                Some(at) => (&pose[..i], at),
                None if looks_numeric(&pose[i + 1..]) => return Err(bad()),
                None => (pose, Moment::Frame(0)),
            },
            None => (pose, Moment::Frame(0)),
        };
        if clip.is_empty() {
            return Err(bad());
        }
        Ok(Self { key, clip: clip.to_owned(), at })
    }
}

fn moment(text: &str) -> Option<Moment> {
    if let Some(frame) = text.strip_prefix('#') {
        return frame.parse().ok().map(Moment::Frame);
    }
    let seconds: f64 = text.strip_prefix('@')?.parse().ok()?;
    (seconds.is_finite() && seconds >= 0.0).then_some(Moment::Time(seconds))
}

/// Whether a text was meant as a number (`-1`, `2.5`, `nan`) rather than as part of a name.
fn looks_numeric(text: &str) -> bool {
    text.is_empty() || text.parse::<f64>().is_ok()
}

/// The poses of all key images.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyPoses {
    /// One pose a key image, key 1 first.
    pub poses: Vec<Pose>,
    /// For each node of the skeleton the channels that any of the named clips drives.
    pub driven: Vec<Driven>,
}

impl KeyPoses {
    /// Reads the poses of the keys 1 to K from a rig file, in any order of `specs`. `fps` is the
    /// shot's frame rate, positive and finite. A moment up to half a frame past the clip's end
    /// counts as its end.
    ///
    /// # Errors
    /// [`Error::PoseKeys`] unless each key from 1 to K has exactly one pose,
    /// [`Error::PoseOutsideClip`], and those of [`File::animation`].
    pub fn read(file: &File, specs: &[PoseSpec], fps: f64) -> Result<Self> {
        let skeleton = file.skeleton();
        let mut driven = vec![Driven::default(); skeleton.nodes.len()];
        let mut poses = Vec::with_capacity(specs.len());
        for spec in in_order(specs)? {
            let animation = file.animation(&spec.clip)?;
            let time_s = match spec.at {
                Moment::Frame(frame) => f64::from(frame) / fps,
                Moment::Time(seconds) => seconds,
            };
            let duration_s = animation.duration_s();
            if !(0.0..=duration_s + 0.5 / fps).contains(&time_s) {
                return Err(Error::PoseOutsideClip {
                    key: spec.key,
                    clip: animation.name().to_owned(),
                    time_s,
                    duration_s,
                });
            }
            poses.push(animation.sample(skeleton, time_s));
            for (all, one) in driven.iter_mut().zip(animation.driven(skeleton)) {
                all.translation |= one.translation;
                all.rotation |= one.rotation;
                all.scale |= one.scale;
            }
        }
        Ok(Self { poses, driven })
    }

    /// Adds the same poses with left and right exchanged, in the same order.
    ///
    /// # Panics
    /// When `mirror` is of another rig.
    pub fn add_mirrored(&mut self, mirror: &Mirror) {
        let made: Vec<Pose> = self.poses.iter().map(|p| mirror.pose(p, &self.driven)).collect();
        self.poses.extend(made);
    }
}

/// The specs by key, when each key from 1 to K has exactly one.
fn in_order(specs: &[PoseSpec]) -> Result<Vec<&PoseSpec>> {
    let keys = specs.len();
    (1..=keys)
        .map(|key| {
            let mut matching = specs.iter().filter(|s| s.key == key);
            match (matching.next(), matching.count()) {
                (Some(spec), 0) => Ok(spec),
                (first, more) => {
                    Err(Error::PoseKeys { keys, key, count: more + usize::from(first.is_some()) })
                }
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(key: usize, clip: &str, at: Moment) -> PoseSpec {
        PoseSpec { key, clip: clip.to_owned(), at }
    }

    #[test]
    fn the_flag_form_names_key_clip_and_moment() {
        for (text, expected) in [
            ("1=KeyPoses#1", spec(1, "KeyPoses", Moment::Frame(1))),
            ("2=Walk@0.25", spec(2, "Walk", Moment::Time(0.25))),
            ("12=Armature|Walk@2", spec(12, "Armature|Walk", Moment::Time(2.0))),
            ("3=Pose 3", spec(3, "Pose 3", Moment::Frame(0))),
            ("3=Horse@Walk", spec(3, "Horse@Walk", Moment::Frame(0))),
            ("3=Horse@Walk#7", spec(3, "Horse@Walk", Moment::Frame(7))),
            ("3=a=b#7", spec(3, "a=b", Moment::Frame(7))),
        ] {
            assert_eq!(text.parse::<PoseSpec>().unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn other_forms_are_refused() {
        let bad = [
            "", "Walk#1", "0=Walk#1", "-1=Walk", "x=Walk", "1=", "1=#3", "1=W#-1", "1=W#1.5",
            "1=W@-1", "1=W@nan", "1=W@inf", "1=W#",
        ];
        for text in bad {
            assert!(matches!(text.parse::<PoseSpec>(), Err(Error::PoseForm { .. })), "{text}");
        }
    }

    #[test]
    fn every_key_needs_exactly_one_pose() {
        let a = spec(1, "a", Moment::Frame(0));
        let b = spec(2, "b", Moment::Frame(0));
        assert_eq!(in_order(&[b.clone(), a.clone()]).unwrap(), [&a, &b]);
        assert!(matches!(
            in_order(&[a.clone(), a.clone()]),
            Err(Error::PoseKeys { key: 1, count: 2, .. })
        ));
        assert!(matches!(in_order(&[b]), Err(Error::PoseKeys { key: 1, count: 0, .. })));
    }
}
