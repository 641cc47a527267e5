//! `muybridge run`: every stage that can run, in order.

use muybridge::work;

use super::{analyze, animate, keys, open, options, segment};
use crate::Ending;
use crate::args::Run;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Run, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(&args.stage)?;
    let (document, kept) = work::run(&shot, options(bars, args.stage.force))?;
    output.kept(&kept);
    bars.finish();

    let mut text = segment::text(&document.segment, &shot);
    text.push_str(&analyze::text(&document.analyze));
    text.push_str(&keys::text(&document.keys, &shot));
    match &document.animate {
        Some(animation) => {
            text.push_str(&animate::text(&work::animate_document(&shot, animation)));
        }
        None => text.push_str(
            "no rig is named yet: pose it for the keys above, then `muybridge animate SHOT --rig FILE --pose 1=CLIP#FRAME …`\n",
        ),
    }
    text.push_str(&format!("report: {}\n", document.report));
    output.result(&document, &text)?;
    Ok(analyze::ending(&document.analyze, args.strict))
}
