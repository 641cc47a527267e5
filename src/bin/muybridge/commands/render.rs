//! `muybridge render`.

use muybridge::shot::write_atomically;
use muybridge::synthetic::{SyntheticFootage, SyntheticSettings};
use muybridge::validate::{Subject, Truth};
use serde_json::json;

use super::shown;
use super::validate::{shooting, subject};
use crate::Ending;
use crate::args::Render;
use crate::output::Output;
use crate::usage;

pub(crate) fn execute(args: &Render, output: &Output) -> anyhow::Result<Ending> {
    let subject = subject(&args.view)?;
    let shooting = shooting(&args.view)?;
    let write = |frame: usize, bytes: Vec<u8>| {
        write_atomically(&args.out.join(format!("{frame:06}.png")), &bytes)
    };
    if args.color {
        let Subject::Horse(gait) = subject else {
            return Err(usage::wrong("--color", "", "the built-in horse (no --model)").into());
        };
        let footage = SyntheticFootage::new(
            gait,
            SyntheticSettings {
                frames: shooting.frames,
                frames_per_stride: shooting.frames_per_cycle,
                width: shooting.size_px.0,
                height: shooting.size_px.1,
                yaw_rad: shooting.yaw_rad,
                seed: shooting.seed,
                ..SyntheticSettings::default()
            },
        );
        for frame in 0..shooting.frames {
            write(frame, footage.picture(frame).to_png_bytes()?)?;
        }
    } else {
        let truth = Truth::of(&subject, &shooting)?;
        for (frame, mask) in truth.masks(&shooting).iter().enumerate() {
            write(frame, mask.to_png()?)?;
        }
    }
    let folder = shown(&args.out);
    let text = format!("{} pictures in {folder}", shooting.frames);
    output.result(&json!({"folder": folder, "frames": shooting.frames}), &text)?;
    Ok(Ending::Done)
}
