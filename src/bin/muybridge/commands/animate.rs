//! `muybridge animate`.

use std::path::Path;

use anyhow::Context;
use muybridge::pipeline::AnimationResult;
use muybridge::rig::{Moment, PoseSpec};
use muybridge::shot::{
    self, PoseOfKey, Shot, StoredAnimation, StoredFeet, StoredLoop, relative_to, write_atomically,
};
use muybridge::work;

use super::keys::mirroring;
use super::{open, options, shown};
use crate::Ending;
use crate::args::{Animate, Method, Root, Speed};
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Animate, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (mut shot, _lock) = open(&args.stage)?;
    take_flags(args, &mut shot)?;
    shot.save_settings()?;
    let result = work::animate(&shot, options(bars, args.stage.force))?;
    bars.finish();
    output.kept(&result.outcome.kept);
    let mut told = work::animate_document(&shot, &result.animation);
    if let Some(out) = &args.out {
        told.path = copy_out(&shot, &result, out, output)?;
    }
    output.result(&told, &text(&told))?;
    Ok(Ending::Done)
}

fn take_flags(args: &Animate, shot: &mut Shot) -> anyhow::Result<()> {
    let here = std::env::current_dir().context("the working folder is gone")?;
    if let Some(rig) = &args.rig {
        shot.settings.poses.rig = Some(relative_to(shot.folder(), &here, rig));
    }
    for pose in &args.pose {
        let spec: PoseSpec = pose.parse()?;
        let (frame, time) = match spec.at {
            Moment::Frame(frame) => (Some(frame), None),
            Moment::Time(time) => (None, Some(time)),
        };
        let named = &mut shot.settings.pose_of_key;
        named.retain(|p| p.key != spec.key);
        named.push(PoseOfKey { key: spec.key, clip: spec.clip, frame, time });
        named.sort_by_key(|p| p.key);
    }
    let animation = &mut shot.settings.animation;
    if let Some(method) = args.method {
        animation.method = match method {
            Method::Auto => shot::Method::Auto,
            Method::Phase => shot::Method::Phase,
            Method::Rbf => shot::Method::Rbf,
            Method::Switching => shot::Method::Switching,
        };
    }
    if let Some(mirror) = args.mirror {
        animation.mirror = mirroring(mirror);
    }
    if let Some(fps) = args.fps {
        animation.fps = fps;
    }
    if let Some(retime) = args.retime {
        animation.retime = retime;
    }
    if let Some(strides) = args.loop_strides {
        animation.loop_strides = strides;
    }
    let feet = &mut shot.settings.feet;
    if args.plant || args.no_plant {
        feet.plant = args.plant;
    }
    if let Some(root) = args.root {
        feet.root = match root {
            Root::InPlace => shot::Root::InPlace,
            Root::Travel => shot::Root::Travel,
        };
    }
    if let Some(speed) = args.speed {
        feet.speed = match speed {
            Speed::Auto => shot::SpeedFrom::Auto,
            Speed::Feet => shot::SpeedFrom::Feet,
            Speed::Pan => shot::SpeedFrom::Pan,
        };
    }
    animation.clamp |= args.clamp;
    animation.normalize |= args.normalize;
    Ok(())
}

/// Copies the animated rig to where `--out` wants it; the path as it is shown.
fn copy_out(
    shot: &Shot,
    result: &AnimationResult,
    out: &Path,
    output: &Output,
) -> anyhow::Result<String> {
    write_atomically(out, &shot::read(&shot.path(&result.animation.path))?)?;
    if !result.referenced_files.is_empty() {
        output.note("the rig refers to files beside it; copy them beside the animated file too");
    }
    Ok(shown(out))
}

fn feet_text(f: &StoredFeet) -> String {
    let mut text = format!(
        "{} feet, gait: {}; {} at {:.3} units a second (by the {})",
        f.feet.len(),
        f.gait.as_deref().unwrap_or("none that has a name"),
        f.root,
        f.ground_speed,
        f.ground_speed_from
    );
    if let (Some(s), Some(length)) = (f.stride_s, f.stride_length) {
        text.push_str(&format!(", strides of {length:.3} units in {s:.3} s"));
    }
    text.push('\n');
    if let Some(p) = &f.pan {
        text.push_str(&format!(
            "against the background: {:.2} body lengths a second, {:.3} units (feet {:.3})\n",
            p.body_lengths_a_second, p.ground_speed, f.feet_speed
        ));
    }
    if let Some(p) = &f.planted {
        text.push_str(&format!(
            "planted: feet slide {:.2} % of a leg (before {:.1} %), angular acceleration {:.0} degrees/s² rms (before {:.0})\n",
            100.0 * p.slide_leg_lengths[1],
            100.0 * p.slide_leg_lengths[0],
            p.rms_acceleration_deg_s2[1],
            p.rms_acceleration_deg_s2[0]
        ));
    }
    for warning in &f.warnings {
        text.push_str(&format!("look at the feet: {warning}\n"));
    }
    text
}

fn loop_text(l: &StoredLoop) -> String {
    format!(
        "loop of {} stride{}, {:.3} s, averaged over {:.1}; at its seam {:.1e} degrees, \
         turns change by {:.2} degrees a frame (median turn {:.2})\n",
        l.strides,
        if l.strides == 1 { "" } else { "s" },
        l.duration_s,
        l.strides_seen,
        l.seam.angle_deg,
        l.seam.angle_jump_deg,
        l.seam.median_turn_deg
    )
}

pub(crate) fn text(a: &StoredAnimation) -> String {
    let feet = a.feet.as_ref().map_or_else(String::new, feet_text);
    let looped = a.looped.as_ref().map_or_else(String::new, loop_text);
    let from = match a.first_frame {
        0 => String::new(),
        frame => format!(", from frame {frame} of the footage on"),
    };
    format!(
        "{}\nanimation «{}»: {} frames at {} frames a second, by {}{from}\n\
         weights {:.3} to {:.3}, their sums {:.3} to {:.3}\n\
         largest turn of a joint between frames: {:.1} degrees\n{looped}{feet}",
        a.path,
        a.animation,
        a.frames,
        a.fps,
        a.method,
        a.weight_range[0],
        a.weight_range[1],
        a.sum_range[0],
        a.sum_range[1],
        a.largest_step_deg
    )
}
