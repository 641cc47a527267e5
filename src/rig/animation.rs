//! The animations of a glTF document, and their value at a time (glTF 2.0 §3.11, appendix C).

use nalgebra::{UnitQuaternion, Vector3};
use serde_json::Value;

use super::file::File;
use super::nodes::unit_quaternion;
use super::{Clip, Driven, Pose, Skeleton};
use crate::error::{Error, Result};

/// Over an hour at 24 frames a second; what is longer is a corrupted time, and must not be
/// allocated.
const MOST_POSES: f64 = 100_000.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Property {
    Translation,
    Rotation,
    Scale,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Interpolation {
    Linear,
    Step,
    CubicSpline,
}

/// One property of one node over time. Vectors leave the fourth number at zero.
#[derive(Clone, Debug)]
struct Channel {
    node: usize,
    property: Property,
    interpolation: Interpolation,
    times_s: Vec<f64>,
    /// One value a time; for cubic splines in-tangent, value and out-tangent.
    values: Vec<[f64; 4]>,
}

/// An animation of a rig file. Channels that drive something else than translation, rotation or
/// scale of a node (morph weights, `KHR_animation_pointer`) are not part of it.
#[derive(Clone, Debug)]
pub struct Animation {
    name: String,
    channels: Vec<Channel>,
}

impl Animation {
    /// The full name in the file, or `animation N` for a nameless one.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Time of the last key, seconds; the animation begins at 0.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.channels.iter().filter_map(|c| c.times_s.last()).copied().fold(0.0, f64::max)
    }

    /// Times at which the animation has keys, seconds: those of all channels, ascending, each once.
    #[must_use]
    pub fn key_times_s(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.channels.iter().flat_map(|c| c.times_s.clone()).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// For each node of the skeleton, the channels that the animation drives.
    #[must_use]
    pub fn driven(&self, skeleton: &Skeleton) -> Vec<Driven> {
        let mut driven = vec![Driven::default(); skeleton.nodes.len()];
        for channel in &self.channels {
            let node = &mut driven[channel.node];
            match channel.property {
                Property::Translation => node.translation = true,
                Property::Rotation => node.rotation = true,
                Property::Scale => node.scale = true,
            }
        }
        driven
    }

    /// The pose at a time in seconds: driven channels from the animation, all others from the rest
    /// pose. Before the first key and after the last one the value stays. The time is rounded to
    /// f32 first, as the keys of the file are, so that i/fps hits the key written for frame i.
    ///
    /// # Panics
    /// When `skeleton` is not that of the animation's file.
    #[must_use]
    pub fn sample(&self, skeleton: &Skeleton, time_s: f64) -> Pose {
        let time_s = f64::from(time_s as f32);
        let mut pose = skeleton.rest_pose();
        for channel in &self.channels {
            let node = &mut pose.nodes[channel.node];
            match channel.property {
                Property::Translation => node.translation = channel.vector(time_s),
                Property::Scale => node.scale = channel.vector(time_s),
                Property::Rotation => node.rotation = channel.rotation(time_s, node.rotation),
            }
        }
        pose
    }

    /// The whole animation on an even grid: poses at i / fps from 0 to its end, at least one.
    ///
    /// # Errors
    /// [`Error::AnimationTooLong`] when that would be more than 100 000 poses.
    ///
    /// # Panics
    /// When `skeleton` is not that of the animation's file, or `fps` is not positive and finite.
    pub fn clip(&self, skeleton: &Skeleton, fps: f64) -> Result<Clip> {
        assert!(fps.is_finite() && fps > 0.0, "a frame rate is positive");
        // A thousandth of a frame forgives the rounding of the last key to f32.
        let last = (self.duration_s() * fps + 1e-3).floor();
        if last >= MOST_POSES {
            let (name, duration_s) = (self.name.clone(), self.duration_s());
            return Err(Error::AnimationTooLong { name, duration_s });
        }
        Ok(Clip {
            name: self.name.clone(),
            fps,
            poses: (0..=last as usize).map(|i| self.sample(skeleton, i as f64 / fps)).collect(),
            driven: self.driven(skeleton),
        })
    }
}

impl Channel {
    /// The key at or before a time and how far the time is on the way to the next, 0 to 1.
    fn place(&self, time_s: f64) -> (usize, f64) {
        let after = self.times_s.partition_point(|&t| t <= time_s);
        let Some(key) = after.checked_sub(1) else { return (0, 0.0) };
        match self.times_s.get(after) {
            None => (key, 0.0),
            Some(next) => (key, (time_s - self.times_s[key]) / (next - self.times_s[key])),
        }
    }

    /// The value of a key, without its tangents.
    fn value(&self, key: usize) -> [f64; 4] {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1],
            _ => self.values[key],
        }
    }

    fn vector(&self, time_s: f64) -> Vector3<f64> {
        let [x, y, z, _] = self.blended(time_s);
        Vector3::new(x, y, z)
    }

    fn rotation(&self, time_s: f64, rest: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let (key, u) = self.place(time_s);
        let from = unit_quaternion(self.value(key)).unwrap_or(rest);
        if u == 0.0 {
            return from;
        }
        match self.interpolation {
            Interpolation::Step => from,
            // A spline through opposite quaternions can pass zero, where it has no direction.
            Interpolation::CubicSpline => unit_quaternion(self.blended(time_s)).unwrap_or(from),
            Interpolation::Linear => {
                let to = unit_quaternion(self.value(key + 1)).unwrap_or(from);
                from * super::rotation_from_vector(
                    &(super::rotation_vector(&(from.inverse() * to)) * u),
                )
            }
        }
    }

    /// The value component by component.
    fn blended(&self, time_s: f64) -> [f64; 4] {
        let (key, u) = self.place(time_s);
        let from = self.value(key);
        if u == 0.0 || self.interpolation == Interpolation::Step {
            return from;
        }
        let to = self.value(key + 1);
        if self.interpolation == Interpolation::Linear {
            return std::array::from_fn(|i| from[i] + u * (to[i] - from[i]));
        }
        // Appendix C.5: Hermite basis, tangents scaled by the length of the interval.
        let span = self.times_s[key + 1] - self.times_s[key];
        let (leaving, arriving) = (self.values[3 * key + 2], self.values[3 * (key + 1)]);
        let (u2, u3) = (u * u, u * u * u);
        std::array::from_fn(|i| {
            (2.0 * u3 - 3.0 * u2 + 1.0) * from[i]
                + span * (u3 - 2.0 * u2 + u) * leaving[i]
                + (3.0 * u2 - 2.0 * u3) * to[i]
                + span * (u3 - u2) * arriving[i]
        })
    }
}

impl File {
    /// Names of the animations in the order of the file; `animation N` for a nameless one.
    #[must_use]
    pub fn animation_names(&self) -> Vec<String> {
        let list = self.document().get("animations").and_then(Value::as_array);
        let name = |(i, a): (usize, &Value)| match a.get("name").and_then(Value::as_str) {
            Some(name) if !name.is_empty() => name.to_owned(),
            _ => format!("animation {i}"),
        };
        list.into_iter().flatten().enumerate().map(name).collect()
    }

    /// Reads the animation with a name: the exact name, or else the part after the last `|`
    /// (exporters put the armature's name before it) when only one animation has it.
    ///
    /// # Errors
    /// [`Error::AnimationNotFound`], [`Error::AnimationAmbiguous`] (two of the same name, or the
    /// same ending), [`Error::MatrixNodeDriven`], [`Error::RigBroken`].
    pub fn animation(&self, name: &str) -> Result<Animation> {
        let names = self.animation_names();
        let matching = |same: &dyn Fn(&str) -> bool| -> Vec<usize> {
            (0..names.len()).filter(|&i| same(&names[i])).collect()
        };
        let mut found = matching(&|n| n == name);
        if found.is_empty() {
            found = matching(&|n| n.rsplit_once('|').is_some_and(|(_, tail)| tail == name));
        }
        let path = self.path().to_owned();
        match found[..] {
            [one] => self.read_animation(one, names[one].clone()),
            [] => Err(Error::AnimationNotFound { path, name: name.to_owned(), available: names }),
            _ => Err(Error::AnimationAmbiguous {
                path,
                name: name.to_owned(),
                matches: found.into_iter().map(|i| names[i].clone()).collect(),
            }),
        }
    }

    fn read_animation(&self, index: usize, name: String) -> Result<Animation> {
        let animation = &self.list("animations")?[index];
        let list = |member: &str| {
            animation.get(member).and_then(Value::as_array).map_or(&[][..], Vec::as_slice)
        };
        let mut channels: Vec<Channel> = Vec::new();
        for (i, channel) in list("channels").iter().enumerate() {
            let place = format!("animation {index} \"{name}\", channel {i}");
            let Some(channel) = self.channel(channel, list("samplers"), &place)? else { continue };
            if channels.iter().any(|c| (c.node, c.property) == (channel.node, channel.property)) {
                let reason = format!("node {} is driven twice", channel.node);
                return Err(self.fault(place, reason));
            }
            channels.push(channel);
        }
        Ok(Animation { name, channels })
    }

    fn channel(&self, channel: &Value, samplers: &[Value], place: &str) -> Result<Option<Channel>> {
        let Some(target) = channel.get("target") else { return Ok(None) };
        let property = match target.get("path").and_then(Value::as_str) {
            Some("translation") => Property::Translation,
            Some("rotation") => Property::Rotation,
            Some("scale") => Property::Scale,
            _ => return Ok(None),
        };
        let Some(node) = self.index(target, "node", place)? else { return Ok(None) };
        let nodes = &self.skeleton().nodes;
        let driven = nodes
            .get(node)
            .ok_or_else(|| self.fault(place, format!("node {node} does not exist")))?;
        if self.has_matrix(node) {
            let path = self.path().to_owned();
            return Err(Error::MatrixNodeDriven { path, node: driven.name.clone() });
        }
        let index = self.required(channel, "sampler", place)?;
        let sampler = samplers
            .get(index)
            .ok_or_else(|| self.fault(place, format!("sampler {index} does not exist")))?;
        self.sampled(sampler, node, property, place).map(Some)
    }

    fn sampled(
        &self,
        sampler: &Value,
        node: usize,
        property: Property,
        place: &str,
    ) -> Result<Channel> {
        let interpolation = match sampler.get("interpolation").and_then(Value::as_str) {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => return Err(self.fault(place, format!("interpolation \"{other}\""))),
        };
        let input = self.accessor::<1>(self.required(sampler, "input", place)?)?;
        let times_s: Vec<f64> = input.into_iter().map(|[t]| t).collect();
        let output = self.required(sampler, "output", place)?;
        let values: Vec<[f64; 4]> = match property {
            Property::Rotation => self.accessor::<4>(output)?,
            _ => self.accessor::<3>(output)?.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect(),
        };
        let needed = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if times_s.is_empty() || times_s.len().checked_mul(needed) != Some(values.len()) {
            let reason = format!("{} values for {} times", values.len(), times_s.len());
            return Err(self.fault(place, reason));
        }
        if times_s.windows(2).any(|w| w[1] <= w[0]) {
            return Err(self.fault(place, "its times do not increase"));
        }
        let channel = Channel { node, property, interpolation, times_s, values };
        let zero = |key: usize| unit_quaternion(channel.value(key)).is_none();
        match (0..channel.times_s.len()).find(|&k| property == Property::Rotation && zero(k)) {
            Some(key) => Err(self.fault(place, format!("key {key} is a zero quaternion"))),
            None => Ok(channel),
        }
    }
}
