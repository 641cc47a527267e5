//! `muybridge report`.

use muybridge::shot::paths;
use muybridge::work;

use super::{open, options};
use crate::Ending;
use crate::args::Report;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Report, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(&args.stage)?;
    let movie = args.movie.as_ref().map(|file| match file {
        Some(file) => file.clone(),
        None => shot.path(paths::MOVIE),
    });
    let done = work::report(&shot, movie.as_deref(), options(bars, args.stage.force))?;
    bars.finish();
    if let Some(error) = &done.sheets_left {
        output.note(&format!("the sheets were not drawn again: {error}"));
    }
    output.kept(&done.kept);
    let text = match &done.document.movie {
        Some(movie) => format!("{}\n{movie}", done.document.report),
        None => done.document.report.clone(),
    };
    output.result(&done.document, &text)?;
    Ok(Ending::Done)
}
