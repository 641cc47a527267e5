//! `muybridge report`.

use muybridge::pipeline::Progress;
use muybridge::report;
use muybridge::shot::{Shot, Stage, paths};
use serde_json::json;

use super::{open, shown};
use crate::Ending;
use crate::args::Report;
use crate::output::Output;
use crate::terminal::Bars;

pub(crate) fn execute(args: &Report, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (shot, _lock) = open(&args.stage)?;
    draw_sheets(&shot, args.stage.force, output)?;
    let kept = report::write_page(&shot, args.stage.force)?;
    let movie = args.movie.as_ref().map(|file| match file {
        Some(file) => file.clone(),
        None => shot.path(paths::MOVIE),
    });
    if let Some(file) = &movie {
        let progress = |done: usize, total: usize| bars.step(Stage::Report, done, Some(total));
        report::write_movie(&shot, file, &progress)?;
    }
    bars.finish();
    output.kept(&kept);
    let page = shown(&shot.path(paths::REPORT));
    let movie = movie.map(|file| shown(&file));
    let text = movie.iter().fold(page.clone(), |text, movie| format!("{text}\n{movie}"));
    output.result(&json!({"report": page, "movie": movie}), &text)?;
    Ok(Ending::Done)
}

/// The sheets, as far as the shot has come. A page can be made of what is stored, even where the
/// footage is not at hand.
fn draw_sheets(shot: &Shot, force: bool, output: &Output) -> muybridge::Result<()> {
    if !report::can_draw_sheets(shot) {
        return Ok(());
    }
    match report::draw_sheets(shot, force) {
        Err(muybridge::Error::Interrupted) => Err(muybridge::Error::Interrupted),
        Err(error) => {
            output.note(&format!("the sheets were not drawn again: {error}"));
            Ok(())
        }
        Ok(_) => Ok(()),
    }
}
