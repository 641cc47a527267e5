//! `muybridge report`.

use muybridge::report;
use muybridge::shot::paths;
use serde_json::json;

use super::{open, shown};
use crate::Ending;
use crate::args::Stage;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Stage, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(args)?;
    report::draw_sheets(&shot, args.force)?;
    let kept = report::write_page(&shot, args.force)?;
    bars.finish();
    output.kept(&kept);
    let path = shown(&shot.path(paths::REPORT));
    output.result(&json!({"report": path}), &path)?;
    Ok(Ending::Done)
}
