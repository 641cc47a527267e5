//! `muybridge validate`.

use muybridge::pipeline::Progress;
use muybridge::report::plots::{ErrorCurve, ErrorCurves, ReferenceLevel, error_curves};
use muybridge::shot::{self, Stage, write_atomically};
use muybridge::synthetic::Gait;
use muybridge::validate::{Settings, Shooting, Subject, Unsteady, Validation, validate};

use super::analyze::named_gait;
use super::keys::mirroring;
use crate::Ending;
use crate::args::{Method, Validate, View};
use crate::output::Output;
use crate::terminal::Bars;
use crate::usage;

pub(crate) fn execute(args: &Validate, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let settings = Settings {
        subject: subject(&args.view)?,
        shooting: shooting(&args.view)?,
        keys: usage::list("--keys", &args.keys)?,
        components: usage::list("--components", &args.components)?,
        partners: args.partners,
        gait: named_gait(args.gait),
        method: match args.method {
            Method::Auto => shot::Method::Auto,
            Method::Phase => shot::Method::Phase,
            Method::Rbf => shot::Method::Rbf,
            Method::Switching => shot::Method::Switching,
        },
        amplitude: true,
        mirror: args.mirror.map_or(shot::Mirroring::Auto, mirroring),
        band_pass: !args.raw,
        time_limit_s: 30.0,
    };
    let progress = |done: usize, total: usize| bars.step(Stage::Keys, done, Some(total));
    let found = validate(&settings, &progress)?;
    bars.finish();
    if let Some(folder) = &args.out {
        write_atomically(&folder.join("errors.csv"), found.errors_csv().as_bytes())?;
        write_atomically(&folder.join("components.csv"), found.components_csv().as_bytes())?;
        write_atomically(&folder.join("errors.svg"), plot(&found)?.as_bytes())?;
    }
    output.result(&found, &found.to_text())?;
    Ok(Ending::Done)
}

fn plot(found: &Validation) -> anyhow::Result<String> {
    let curves: Vec<ErrorCurve> = found
        .rows
        .iter()
        .map(|r| ErrorCurve { keys: r.keys, points: Validation::curve(r) })
        .collect();
    let level =
        ReferenceLevel { name: "mean pose".to_owned(), error_deg: found.mean_pose.mean_deg };
    let measure = "mean geodesic angle over frames and joints";
    let input = ErrorCurves { clip: &found.subject, measure, curves: &curves, levels: &[level] };
    Ok(error_curves(&input)?.as_str().to_owned())
}

/// The rig and clip, or the built-in horse in the gait that `--clip` names.
pub(crate) fn subject(view: &View) -> anyhow::Result<Subject> {
    match (&view.model, &view.clip) {
        (Some(file), Some(clip)) => Ok(Subject::Rig { file: file.clone(), clip: clip.clone() }),
        (Some(_), None) => Err(usage::wrong("--clip", "", "the name of a clip of --model").into()),
        (None, Some(gait)) => Ok(Subject::Horse(gait.parse()?)),
        (None, None) => Ok(Subject::Horse(Gait::Gallop)),
    }
}

/// The flags of the camera.
pub(crate) fn shooting(view: &View) -> anyhow::Result<Shooting> {
    Ok(Shooting {
        frames: view.frames,
        frames_per_cycle: view.frames_per_cycle,
        yaw_rad: view.yaw.to_radians(),
        noise: view.noise,
        seed: view.seed,
        size_px: usage::size("--size", &view.size)?,
        unsteady: Unsteady {
            speed_drift: view.speed_drift,
            stride_variation: view.stride_variation,
            amplitude_drift: view.amplitude_drift,
            amplitude_variation: view.amplitude_variation,
            broken_masks: view.broken_masks,
        },
    })
}
