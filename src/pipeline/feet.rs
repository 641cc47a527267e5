//! The feet of an animated rig: found, held on the ground, and the root let go.

use serde_json::{Value, json};

use super::pan::Pan;
use crate::error::{Error, Result};
use crate::feet::{
    Foot, Footfalls, GaitReport, Limb, Planted, common_root, find_feet, foot_tracks, footfalls,
    gait_report, plant, travel,
};
use crate::rig::{Clip, File, Model};
use crate::shot::{
    Root, Shot, SpeedFrom, StoredContact, StoredFeet, StoredFoot, StoredPan, StoredPlanting,
};

/// Planting that raises the angular acceleration of the legs by more than this factor is worth a look: of the rigs'
/// own cycles, some of which slide by a quarter of a leg, it is 1.6 at most.
const ROUGHER: f64 = 2.0;

/// The ground goes at the footage's speed where the feet's is within this share of it. Four poses a stride give
/// the feet's to a quarter; farther off, the scale or the background is wrong (grass hides the legs, a camera
/// on rails sees mostly a distance that passes slowly).
const SPEEDS_AGREE: f64 = 0.3;

/// A pan whose steps vary by more than this share was not followed from frame to frame, and is not believed unless
/// the user says so.
const MOST_UNEVEN: f64 = 0.3;

/// The feet of a clip and what they do.
pub(super) struct Ground {
    feet: Vec<Foot>,
    falls: Footfalls,
    gait: Option<GaitReport>,
    planted: Option<Planted>,
    /// Speed of the ground by the feet alone, rig units a second.
    feet_speed: f64,
    pan: Option<StoredPan>,
}

/// Finds the feet and, when the settings say so, plants them. `None` when no feet are found on the ground.
/// `pan` is what the footage says of the speed; the animation plays `faster` times as fast.
///
/// # Errors
/// [`Error::Setting`] for a foot that is named and is no node of the rig, and for the pan's speed where there
/// is none.
pub(super) fn stand(
    shot: &Shot,
    file: &File,
    clip: &mut Clip,
    looped: bool,
    pan: Option<Pan>,
    faster: f64,
) -> Result<Option<Ground>> {
    let settings = &shot.settings.feet;
    let skeleton = file.skeleton();
    // What cannot be drawn can be animated all the same; the ends of its chains stand for its feet.
    let bare = || Model { skeleton: skeleton.clone(), meshes: Vec::new(), skins: Vec::new() };
    let model = file.model().unwrap_or_else(|_| bare());
    let feet = find_feet(&model, &clip.poses, &named_nodes(shot, file)?);
    let can_turn =
        |f: &Foot| !f.joints.iter().chain([&f.node]).chain(&f.loose).any(|&n| file.has_matrix(n));
    let feet: Vec<Foot> = feet.into_iter().filter(can_turn).collect();
    let tracks = foot_tracks(skeleton, &clip.poses, &feet);
    let Some(mut falls) = footfalls(&tracks, clip.fps, looped) else { return Ok(None) };
    let gait = gait_report(&tracks, &falls);
    let pan = pan.zip(mean_height(&model, clip)).map(|(pan, height)| pan.on_rig(height, faster));
    let feet_speed = falls.speed;
    falls.speed = ground_speed(settings.speed, feet_speed, pan.as_ref())?;
    let planted = settings.plant.then(|| plant(skeleton, clip, &feet, &falls));
    if let Some(planted) = &planted {
        falls.contacts.clone_from(&planted.contacts);
    }
    Ok(Some(Ground { feet, falls, gait, planted, feet_speed, pan }))
}

/// The speed that the ground is to have, rig units a second.
fn ground_speed(wanted: SpeedFrom, feet: f64, pan: Option<&StoredPan>) -> Result<f64> {
    let even = pan.is_some_and(|p| p.unevenness <= MOST_UNEVEN);
    match (wanted, pan.map(|p| p.ground_speed)) {
        (SpeedFrom::Pan, Some(pan)) => Ok(pan),
        (SpeedFrom::Pan, None) => Err(Error::setting(
            "feet.speed",
            "is not «pan» where the camera's motion (analysis/camera.csv, of footage) or the rig's height is unknown",
        )),
        (SpeedFrom::Auto, Some(pan)) if even && agree(feet, pan) => Ok(pan),
        _ => Ok(feet),
    }
}

fn agree(feet: f64, pan: f64) -> bool {
    (feet - pan).abs() <= SPEEDS_AGREE * pan
}

/// Mean height of what can be seen of the rig over the poses; `None` of a rig that cannot be drawn.
fn mean_height(model: &Model, clip: &Clip) -> Option<f64> {
    let height = |pose| {
        let ends = (model.posed_vertices(pose).iter().flatten())
            .fold((f64::MAX, f64::MIN), |e, v| (e.0.min(v.y), e.1.max(v.y)));
        ends.1 - ends.0
    };
    let sum: f64 = clip.poses.iter().map(height).sum();
    let mean = sum / clip.poses.len() as f64;
    (mean.is_finite() && mean > 0.0).then_some(mean)
}

fn named_nodes(shot: &Shot, file: &File) -> Result<Vec<usize>> {
    let nodes = &file.skeleton().nodes;
    let find = |name: &String| {
        let at = nodes.iter().position(|n| n.name == *name);
        at.ok_or_else(|| {
            Error::setting("feet.nodes", &format!("names nodes of the rig; it has no «{name}»"))
        })
    };
    shot.settings.feet.nodes.iter().map(find).collect()
}

impl Ground {
    /// Follows a loop that now begins with another frame.
    pub(super) fn begin_at(&mut self, start: usize) {
        let n = self.falls.frames;
        for contact in self.falls.contacts.iter_mut().flatten() {
            let first = (contact.first + n - start % n) % n;
            let moved = first as f64 - contact.first as f64;
            contact.last = first + (contact.last - contact.first);
            contact.first = first;
            contact.down_frame += moved;
            contact.up_frame += moved;
        }
        for contacts in &mut self.falls.contacts {
            contacts.sort_by_key(|c| c.first);
        }
    }

    /// Lets the root travel, if it should, and says what is to be stored.
    pub(super) fn finish(self, shot: &Shot, file: &File, clip: &mut Clip) -> StoredFeet {
        let skeleton = file.skeleton();
        let root = (shot.settings.feet.root == Root::Travel)
            .then(|| common_root(skeleton, &self.feet))
            .flatten()
            .and_then(|node| {
                let up = std::iter::successors(Some(node), |&n| skeleton.nodes[n].parent);
                up.into_iter().find(|&n| !file.has_matrix(n))
            });
        if let Some(root) = root {
            travel(skeleton, clip, root, &self.falls);
        }
        let legs: f64 = self.feet.iter().map(|f| f.leg_length).sum();
        let mean_leg = legs / self.feet.len().max(1) as f64;
        let stride_s = self.gait.as_ref().map(|g| g.stride_frames / clip.fps);
        let forward = self.falls.forward;
        StoredFeet {
            gait: self.gait.as_ref().and_then(|g| g.name.clone()),
            warnings: self.warnings(shot, root),
            ground_speed: self.falls.speed,
            ground_speed_from: self.speed_from().to_owned(),
            feet_speed: self.feet_speed,
            pan: self.pan,
            ground_speed_leg_lengths: self.falls.speed / mean_leg,
            forward: [forward.x, forward.y, forward.z],
            stride_s,
            stride_length: stride_s.map(|s| s * self.falls.speed),
            root: if root.is_some() { Root::Travel } else { Root::InPlace }.name().to_owned(),
            root_node: root.map(|r| skeleton.nodes[r].name.clone()),
            planted: self.planted.as_ref().map(|p| StoredPlanting {
                slide_leg_lengths: p.slide,
                peak_acceleration_deg_s2: p.acceleration_deg_s2,
                rms_acceleration_deg_s2: p.rms_acceleration_deg_s2,
                largest_shift_leg_lengths: p.largest_shift,
            }),
            feet: (0..self.feet.len()).map(|at| self.stored_foot(at, file, clip.fps)).collect(),
        }
    }

    fn speed_from(&self) -> &'static str {
        let by_pan = self.pan.is_some_and(|p| p.ground_speed == self.falls.speed);
        if by_pan { SpeedFrom::Pan } else { SpeedFrom::Feet }.name()
    }

    fn warnings(&self, shot: &Shot, root: Option<usize>) -> Vec<String> {
        let mut all: Vec<String> = self.gait.iter().filter_map(|g| g.warning.clone()).collect();
        let rougher =
            |p: &&Planted| p.rms_acceleration_deg_s2[1] > ROUGHER * p.rms_acceleration_deg_s2[0];
        if let Some(p) = self.planted.as_ref().filter(rougher) {
            all.push(format!(
                "planting raises the angular acceleration of the legs {:.1} times; name the feet (feet.nodes) or leave them (--no-plant) if it looks wrong",
                p.rms_acceleration_deg_s2[1] / p.rms_acceleration_deg_s2[0]
            ));
        }
        if self.pan.is_some_and(|p| p.unevenness > MOST_UNEVEN) {
            all.push(
                "the background could not be followed evenly: the speed against it is doubtful"
                    .to_owned(),
            );
        } else if let Some(pan) = self.pan.filter(|p| !agree(self.feet_speed, p.ground_speed)) {
            all.push(format!(
                "the feet push the ground by {:.3} units a second, the footage shows {:.3}; --speed feet or pan says which counts (now: {})",
                self.feet_speed,
                pan.ground_speed,
                self.speed_from()
            ));
        }
        if shot.settings.feet.root == Root::Travel && root.is_none() {
            all.push("no node carries all feet, so the animal stays in its place".to_owned());
        }
        all
    }

    fn stored_foot(&self, at: usize, file: &File, fps: f64) -> StoredFoot {
        let foot = &self.feet[at];
        let limb = self.gait.as_ref().and_then(|g| g.limbs.get(at));
        StoredFoot {
            node: file.skeleton().nodes[foot.node].name.clone(),
            limb: limb.map_or(Limb::Other, |l| l.limb),
            sole: [foot.sole.x, foot.sole.y, foot.sole.z],
            leg_length: foot.leg_length,
            duty_factor: limb.and_then(|l| l.duty_factor),
            phase: limb.and_then(|l| l.phase),
            contacts: (self.falls.contacts[at].iter())
                .map(|c| StoredContact {
                    first_frame: c.first,
                    last_frame: c.last,
                    down_s: c.down_frame / fps,
                    up_s: c.up_frame / fps,
                })
                .collect(),
        }
    }
}

/// The contacts as they stand on the animation in the glTF file.
pub(super) fn extras(feet: &StoredFeet) -> Value {
    let contacts: Vec<Value> = (feet.feet.iter())
        .map(|f| {
            let times: Vec<[f64; 2]> = f.contacts.iter().map(|c| [c.down_s, c.up_s]).collect();
            json!({ "node": f.node, "limb": f.limb, "down_up_s": times })
        })
        .collect();
    json!({ "muybridge": {
        "gait": feet.gait,
        "ground_speed": feet.ground_speed,
        "forward": feet.forward,
        "root": feet.root,
        "contacts": contacts,
    } })
}
