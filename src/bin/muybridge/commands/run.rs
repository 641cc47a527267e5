//! `muybridge run`: every stage that can run, in order.

use muybridge::pipeline;
use muybridge::report;
use muybridge::shot::paths;
use serde_json::json;

use super::{analyze, animate, keys, open, options, segment, shown};
use crate::Ending;
use crate::args::Run;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Run, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(&args.stage)?;
    let force = args.stage.force;
    let run = options(bars, force);
    let masks = pipeline::segment(&shot, run)?;
    output.kept(&masks.kept);
    let analyzed = pipeline::analyze(&shot, run)?;
    output.kept(&analyzed.outcome.kept);
    let chosen = pipeline::keys(&shot, run)?;
    output.kept(&chosen.outcome.kept);
    pipeline::weights(&shot, run)?;
    report::draw_sheets(&shot, force)?;
    let animation = match &shot.settings.poses.rig {
        Some(_) => Some(pipeline::animate(&shot, run)?.animation),
        None => None,
    };
    output.kept(&report::write_page(&shot, force)?);
    bars.finish();

    let page = shown(&shot.path(paths::REPORT));
    let mut text = segment::text(&masks, &shot);
    text.push_str(&analyze::text(&analyzed.diagnosis));
    text.push_str(&keys::text(&chosen.keys, &shot));
    match &animation {
        Some(a) => {
            let mut told = a.clone();
            told.path = shown(&shot.path(&a.path));
            text.push_str(&animate::text(&told));
        }
        None => text.push_str(
            "no rig is named yet: pose it for the keys above, then `muybridge animate SHOT --rig FILE --pose 1=CLIP#FRAME …`\n",
        ),
    }
    text.push_str(&format!("report: {page}\n"));
    let document = json!({
        "segment": masks,
        "analyze": analyzed.diagnosis,
        "keys": chosen.keys,
        "animate": animation,
        "report": page,
    });
    output.result(&document, &text)?;
    Ok(analyze::ending(&analyzed.diagnosis, args.strict))
}
