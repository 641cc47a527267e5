//! `muybridge demo`.

use muybridge::pipeline;
use muybridge::report;
use muybridge::shot::paths;
use serde_json::json;

use super::{options, shown};
use crate::Ending;
use crate::args::Demo;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Demo, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, result) = pipeline::demo(&args.out, options(bars, args.force))?;
    report::draw_sheets(&shot, args.force)?;
    report::write_page(&shot, args.force)?;
    bars.finish();
    let places = [
        ("report", paths::REPORT, "begin here: verdict, plots, key images"),
        ("keys", paths::CONTACT_SHEET, "the frames an artist would pose"),
        ("animation", result.animation.path.as_str(), "the rig with its animation"),
        ("masks", "masks", "one silhouette a frame, editable"),
        ("settings", paths::SETTINGS, "every setting, with a comment"),
    ];
    let mut text = String::from("the synthetic gallop, from footage to an animated rig:\n");
    let mut document = serde_json::Map::new();
    for (name, place, about) in places {
        let path = shown(&shot.path(place));
        text.push_str(&format!("  {path:<44} {about}\n"));
        document.insert(name.to_owned(), json!(path));
    }
    output.result(&document, &text)?;
    Ok(Ending::Done)
}
