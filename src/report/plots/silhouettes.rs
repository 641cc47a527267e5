//! Size and place of the silhouette over time: what a lost or wrong animal shows in.

use super::figure::{Stroke, Svg, draw};
use super::panel::{Panel, frame_axis, heading, legend, range, ticks, whole_ticks};
use crate::error::Result;
use crate::report::palette::{SHADE, series};

/// What [`silhouette_measures`] draws.
#[derive(Clone, Copy, Debug)]
pub struct SilhouetteMeasures<'a> {
    /// Name of the shot, for the heading.
    pub shot: &'a str,
    /// Pixels of the silhouette at each frame.
    pub area_px: &'a [f64],
    /// Centre of mass at each frame, pixels from the left and from the top; NaN where there is
    /// no silhouette.
    pub centre_px: &'a [[f64; 2]],
    /// How sure the outline of each frame is, 0 to 1; empty where that is not known.
    pub confidence: &'a [f64],
    /// Frames with a flag that keeps them out of the PCA (lost, jumped, cut by the border), rising.
    pub flagged: &'a [usize],
    /// Frames a second, for the labels in seconds.
    pub fps: Option<f64>,
}

const LEFT_PX: f64 = 84.0;
const WIDTH_PX: f64 = 760.0;
const PANEL_PX: f64 = 110.0;
const GAP_PX: f64 = 20.0;
const TOP_PX: f64 = 92.0;
/// Areas from here on are written in thousands.
const THOUSANDS_FROM_PX: f64 = 100_000.0;

/// Area, centre of mass from the left and from the top, and confidence over time; flagged frames
/// shaded.
///
/// # Errors
/// [`Error::Drawing`](crate::Error::Drawing) when the drawing library refuses.
pub fn silhouette_measures(input: &SilhouetteMeasures) -> Result<Svg> {
    let across: Vec<f64> = input.centre_px.iter().map(|c| c[0]).collect();
    let down: Vec<f64> = input.centre_px.iter().map(|c| c[1]).collect();
    // Six digits would not fit beside the axis.
    let large = input.area_px.iter().copied().fold(0.0, f64::max) >= THOUSANDS_FROM_PX;
    let thousands: Vec<f64> = input.area_px.iter().map(|a| a / 1000.0).collect();
    let mut curves: Vec<(&str, &[f64], &[f64])> = vec![
        if large {
            ("area (1000 px²)", &thousands, &[0.0])
        } else {
            ("area (px²)", input.area_px, &[0.0])
        },
        ("centre x (px)", &across, &[]),
        ("centre y (px)", &down, &[]),
    ];
    if !input.confidence.is_empty() {
        curves.push(("confidence (0–1)", input.confidence, &[0.0, 1.0]));
    }
    let panels = curves.len() as f64;
    let frames = input.area_px.len().max(input.centre_px.len());
    let height = TOP_PX + panels * PANEL_PX + (panels - 1.0) * GAP_PX + 52.0;
    let spoken = format!(
        "Area, centre and confidence of the silhouette of {} over {frames} frames, {} of them flagged",
        input.shot,
        input.flagged.len()
    );
    draw((LEFT_PX + WIDTH_PX + 24.0, height), &spoken, |figure| {
        let line = match input.flagged.len() {
            0 => "No frame is flagged.".to_owned(),
            1 => "One frame is flagged.".to_owned(),
            n => format!("{n} frames are flagged."),
        };
        heading(figure, &format!("Silhouette over time: {}", input.shot), &line)?;
        if !input.flagged.is_empty() {
            let sample = [("flagged frame".to_owned(), Stroke::solid(SHADE, 10.0))];
            legend(figure, &sample, (LEFT_PX, LEFT_PX + WIDTH_PX), 66.0)?;
        }
        for (i, (name, values, including)) in curves.iter().enumerate() {
            let panel = Panel {
                left: LEFT_PX,
                top: TOP_PX + i as f64 * (PANEL_PX + GAP_PX),
                width: WIDTH_PX,
                height: PANEL_PX,
                x: (0.0, frames.saturating_sub(1).max(1) as f64),
                y: range(values.iter().copied(), including, 0.08),
            };
            for run in input.flagged.chunk_by(|a, b| *b == a + 1) {
                let (first, last) = (run[0] as f64, run[run.len() - 1] as f64);
                panel.stripe(figure, first - 0.5, last + 0.5, SHADE)?;
            }
            panel.x_grid(figure, &whole_ticks(panel.x, 10))?;
            panel.y_axis(figure, name, &ticks(panel.y, 5))?;
            figure.line(&panel.curve(values), Stroke::solid(series(i), 1.8))?;
            if i + 1 == curves.len() {
                frame_axis(figure, &panel, input.fps)?;
            }
        }
        Ok(())
    })
}
