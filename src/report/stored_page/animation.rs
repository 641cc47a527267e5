//! The animation and the feet in words.

use crate::report::page::{AnimationSummary, FeetSummary, FootRow};
use crate::shot::{Shot, StoredAnimation, StoredFeet, StoredFoot, StoredLoop, paths};

pub(super) fn animation(shot: &Shot, stored: &StoredAnimation) -> AnimationSummary {
    let mut files = vec![stored.path.clone()];
    if shot.path(paths::BVH).is_file() {
        files.push(paths::BVH.to_owned());
    }
    AnimationSummary {
        files,
        name: stored.animation.clone(),
        fps: stored.fps,
        frames: stored.frames,
        nodes: stored.moved_nodes,
        largest_step_deg: stored.largest_step_deg,
        largest_step_frame: stored.largest_step_frame,
        looped: stored.looped.as_ref().map(loop_words),
        feet: stored.feet.as_ref().map(feet_summary),
    }
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
