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
    if report::can_draw_sheets(&shot) {
        match report::draw_sheets(&shot, args.force) {
            Ok(_) => {}
            Err(muybridge::Error::Interrupted) => return Err(muybridge::Error::Interrupted.into()),
            // A page can be made of what is stored, even where the footage is not at hand.
            Err(error) => output.note(&format!("the sheets were not drawn again: {error}")),
        }
    }
    let kept = report::write_page(&shot, args.force)?;
    bars.finish();
    output.kept(&kept);
    let path = shown(&shot.path(paths::REPORT));
    output.result(&json!({"report": path}), &path)?;
    Ok(Ending::Done)
}
