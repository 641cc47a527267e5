//! `muybridge report`.

use muybridge::work;

use super::open;
use crate::Ending;
use crate::args::Stage;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Stage, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(args)?;
    let (document, kept) = work::report(&shot, args.force)?;
    bars.finish();
    output.kept(&kept);
    output.result(&document, &document.report)?;
    Ok(Ending::Done)
}
