//! Coefficients over time, before and after the band-pass.

use super::figure::{Align, Drawn, Figure, Lettering, Stroke, Svg, draw};
use super::panel::{Panel, TICK_PX, frame_axis, heading, legend, range, ticks, whole_ticks};
use crate::error::Result;
use crate::report::KeyMark;
use crate::report::palette::{ACCENT, FAINT, INK, PAPER, series};

/// What [`scores`] draws.
#[derive(Clone, Copy, Debug)]
pub struct Scores<'a> {
    /// Name of the shot, for the heading.
    pub shot: &'a str,
    /// Coefficients of each component over time, unit deviations, component 1 first.
    pub raw: &'a [Vec<f64>],
    /// The same after the band-pass; may be empty.
    pub band_passed: &'a [Vec<f64>],
    /// Key frames and partners to mark.
    pub keys: &'a [KeyMark],
    /// Frames a second, for the labels in seconds.
    pub fps: Option<f64>,
}

const LEFT_PX: f64 = 84.0;
const WIDTH_PX: f64 = 760.0;
const PANEL_PX: f64 = 112.0;
const GAP_PX: f64 = 18.0;
const TOP_PX: f64 = 104.0;

/// One panel a component: raw coefficients thin, band-passed thick, keys as vertical lines.
///
/// # Errors
/// [`Error::Drawing`](crate::Error::Drawing) when the drawing library refuses.
pub fn scores(input: &Scores) -> Result<Svg> {
    let frames = input.raw.first().map_or(0, Vec::len);
    let shown = input.raw.len().max(1) as f64;
    let height = TOP_PX + shown * PANEL_PX + (shown - 1.0) * GAP_PX + 52.0;
    let spoken =
        format!("Coefficients of {} components of {} over time", input.raw.len(), input.shot);
    draw((LEFT_PX + WIDTH_PX + 24.0, height), &spoken, |figure| {
        let line = "Coefficients in standard deviations; keys are chosen on the thick curves.";
        heading(figure, &format!("Coefficients over time: {}", input.shot), line)?;
        let samples = [
            ("as projected".to_owned(), Stroke::solid(FAINT, 1.2)),
            ("band-passed".to_owned(), Stroke::solid(INK, 2.4)),
        ];
        let sides = (LEFT_PX, LEFT_PX + WIDTH_PX);
        legend(figure, &samples[..if input.band_passed.is_empty() { 1 } else { 2 }], sides, 64.0)?;
        for (i, raw) in input.raw.iter().enumerate() {
            let passed = input.band_passed.get(i).map_or(&[][..], Vec::as_slice);
            let both = raw.iter().chain(passed).copied();
            let panel = Panel {
                left: LEFT_PX,
                top: TOP_PX + i as f64 * (PANEL_PX + GAP_PX),
                width: WIDTH_PX,
                height: PANEL_PX,
                x: (0.0, frames.saturating_sub(1).max(1) as f64),
                y: range(both, &[-1.0, 1.0], 0.06),
            };
            panel.x_grid(figure, &whole_ticks(panel.x, 10))?;
            panel.y_axis(figure, &format!("PC{}", i + 1), &ticks(panel.y, 5))?;
            key_lines(figure, &panel, input.keys, i == 0)?;
            figure.line(&panel.curve(raw), Stroke::solid(FAINT, 1.2))?;
            figure.line(&panel.curve(passed), Stroke::solid(series(i), 2.4))?;
            if i + 1 == input.raw.len() {
                frame_axis(figure, &panel, input.fps)?;
            }
        }
        Ok(())
    })
}

/// A vertical line through the panel at each key; with `numbered`, a mark with its number on top
/// (disc: key, square: partner).
pub(super) fn key_lines(figure: &Figure, panel: &Panel, keys: &[KeyMark], numbered: bool) -> Drawn {
    for mark in keys {
        let x = panel.px(mark.frame as f64);
        if x > panel.right() + 0.5 {
            continue;
        }
        let stroke = if mark.partner_of.is_some() {
            Stroke::dashed(ACCENT, 1.0)
        } else {
            Stroke::solid(ACCENT, 1.0)
        };
        figure.line(&[(x, panel.top - 2.0), (x, panel.bottom())], stroke)?;
        if numbered {
            key_badge(figure, (x, panel.top - 11.0), mark)?;
        }
    }
    Ok(())
}

pub(super) fn key_badge(figure: &Figure, centre: (f64, f64), mark: &KeyMark) -> Drawn {
    let rim = Stroke::solid(ACCENT, 1.6);
    if mark.partner_of.is_some() {
        figure.square(centre, 7.5, PAPER, rim)?;
    } else {
        figure.disc(centre, 8.5, PAPER, rim)?;
    }
    let lettering = Lettering::new(TICK_PX - 0.5).bold().colour(INK).align(Align::Centre);
    figure.text(&mark.key.to_string(), centre, lettering)
}
