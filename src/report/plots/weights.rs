//! Weight of every pose over time (figure 10 of the seed paper).

use super::figure::{Align, Drawn, Figure, Lettering, Stroke, Svg, draw};
use super::panel::{
    LABEL_PX, Panel, TICK_PX, frame_axis, heading, legend, legend_height, range, ticks, whole_ticks,
};
use super::scores::key_lines;
use crate::error::Result;
use crate::report::KeyMark;
use crate::report::palette::{FAINT, GRID, INK, MUTED, series};

/// The weight of one pose over time.
#[derive(Clone, Copy, Debug)]
pub struct WeightCurve<'a> {
    /// The key whose pose it weighs.
    pub mark: KeyMark,
    /// Whether it weighs that pose with left and right exchanged.
    pub mirrored: bool,
    /// One weight a frame; need not lie within [0, 1].
    pub values: &'a [f64],
}

/// What [`weights`] draws.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a> {
    /// Name of the shot, for the heading.
    pub shot: &'a str,
    /// One curve a pose.
    pub curves: &'a [WeightCurve<'a>],
    /// Sum of the weights at each frame.
    pub sum: &'a [f64],
    /// Number of the active model (from 1) at each frame; empty without switching.
    pub active_model: &'a [usize],
    /// Frames a second, for the labels in seconds.
    pub fps: Option<f64>,
}

const LEFT_PX: f64 = 84.0;
const WIDTH_PX: f64 = 760.0;
const HEIGHT_PX: f64 = 280.0;
const STRIP_PX: f64 = 20.0;

/// The weights over time, a partner's curve dashed in the colour of its key, their sum dashed in
/// dark; below, when models switch, a strip that names the active one.
///
/// # Errors
/// [`Error::Drawing`](crate::Error::Drawing) when the drawing library refuses.
pub fn weights(input: &Weights) -> Result<Svg> {
    let entries = entries(input);
    let sides = (LEFT_PX, LEFT_PX + WIDTH_PX);
    let top = 58.0 + legend_height(&entries, sides) + 26.0;
    let values = input.curves.iter().flat_map(|c| c.values).chain(input.sum).copied();
    let panel = Panel {
        left: LEFT_PX,
        top,
        width: WIDTH_PX,
        height: HEIGHT_PX,
        x: (0.0, frames(input).saturating_sub(1).max(1) as f64),
        y: range(values, &[0.0, 1.0], 0.05),
    };
    let strip = if input.active_model.is_empty() { 0.0 } else { STRIP_PX + 14.0 };
    let spoken = format!("Weights of {} poses of {} over time", input.curves.len(), input.shot);
    draw((LEFT_PX + WIDTH_PX + 24.0, top + HEIGHT_PX + 52.0 + strip), &spoken, |figure| {
        let line = "At each key its own pose has weight 1 and the others 0.";
        heading(figure, &format!("Weights of the poses: {}", input.shot), line)?;
        legend(figure, &entries, sides, 64.0)?;
        panel.x_grid(figure, &whole_ticks(panel.x, 10))?;
        panel.y_axis(figure, "weight", &ticks(panel.y, 7))?;
        let zero = panel.py(0.0);
        figure.line(&[(panel.left, zero), (panel.right(), zero)], Stroke::solid(MUTED, 1.0))?;
        let own = input.curves.iter().filter(|c| !c.mirrored);
        let marks: Vec<KeyMark> = own.map(|c| c.mark).collect();
        key_lines(figure, &panel, &marks, true)?;
        figure.line(&panel.curve(input.sum), Stroke::dashed(INK, 1.4))?;
        for (curve, (_, stroke)) in input.curves.iter().zip(&entries) {
            figure.line(&panel.curve(curve.values), *stroke)?;
        }
        frame_axis(figure, &panel, input.fps)?;
        model_strip(figure, &panel, input)
    })
}

fn frames(input: &Weights) -> usize {
    input.curves.iter().map(|c| c.values.len()).max().unwrap_or(0).max(input.sum.len())
}

fn entries(input: &Weights) -> Vec<(String, Stroke)> {
    let mut entries: Vec<_> = input
        .curves
        .iter()
        .map(|c| match c.mark.partner_of {
            None if c.mirrored => {
                let colour = series(c.mark.key.saturating_sub(1));
                (
                    format!("key {}, left and right exchanged", c.mark.key),
                    Stroke::dashed(colour, 2.0),
                )
            }
            None => {
                let colour = series(c.mark.key.saturating_sub(1));
                (format!("key {}", c.mark.key), Stroke::solid(colour, 2.0))
            }
            Some(of) => {
                let colour = series(of.saturating_sub(1));
                (format!("key {} (partner of {of})", c.mark.key), Stroke::dashed(colour, 2.0))
            }
        })
        .collect();
    entries.push(("sum".to_owned(), Stroke::dashed(INK, 1.4)));
    entries
}

/// One box for each run of frames with the same model.
fn model_strip(figure: &Figure, panel: &Panel, input: &Weights) -> Drawn {
    let Some(&first) = input.active_model.first() else { return Ok(()) };
    let top = panel.bottom() + 50.0;
    let name = Lettering::new(TICK_PX).align(Align::Right);
    figure.text("model", (panel.left - 22.0, top + 0.5 * STRIP_PX), name)?;
    let mut start = 0;
    let mut model = first;
    for t in 1..=input.active_model.len() {
        let next = input.active_model.get(t).copied();
        if next == Some(model) {
            continue;
        }
        let (left, right) = (
            panel.px(start as f64 - 0.5).max(panel.left),
            panel.px(t as f64 - 0.5).min(panel.right()),
        );
        // Grey in two shades: a model is not a key and must not look like one.
        let fill = if model % 2 == 1 { FAINT } else { GRID };
        figure.rectangle((left, top), ((right - left - 1.0).max(0.5), STRIP_PX), fill)?;
        if right - left > 14.0 {
            let middle = (0.5 * (left + right), top + 0.5 * STRIP_PX);
            let lettering = Lettering::new(LABEL_PX).bold().align(Align::Centre);
            figure.text(&model.to_string(), middle, lettering)?;
        }
        start = t;
        model = next.unwrap_or(model);
    }
    Ok(())
}
