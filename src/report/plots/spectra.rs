//! Amplitude spectra of the components with the fitted peak and the pass band (figure 9 of the
//! seed paper).

use super::figure::{Align, Drawn, Figure, Lettering, Point, Stroke, Svg, draw};
use super::panel::{Panel, TICK_PX, TickRow, heading, legend, legend_height, number, range, ticks};
use crate::error::Result;
use crate::report::palette::{INK, MUTED, SHADE, series};

/// The pass band and the peak it was derived from, all in Hz.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Band {
    /// f0: frequency of the largest amplitude of the first component.
    pub peak_hz: f64,
    /// f_b: the nearest frequency with half that amplitude.
    pub half_hz: f64,
    /// Lower end of the pass band.
    pub low_hz: f64,
    /// Upper end of the pass band.
    pub high_hz: f64,
}

/// What [`spectra`] draws.
#[derive(Clone, Copy, Debug)]
pub struct Spectra<'a> {
    /// Name of the shot, for the heading.
    pub shot: &'a str,
    /// Frequency of each bin, Hz, rising.
    pub frequencies_hz: &'a [f64],
    /// Amplitudes of each component at these frequencies, component 1 first, any unit.
    pub amplitudes: &'a [Vec<f64>],
    /// The fitted band, where one was found.
    pub band: Option<Band>,
    /// Frames a second: gives the second row of labels, frames a cycle.
    pub fps: Option<f64>,
}

const LEFT_PX: f64 = 100.0;
const WIDTH_PX: f64 = 640.0;
const HEIGHT_PX: f64 = 300.0;
/// Samples of the peak function's curve.
const PEAK_SAMPLES: usize = 240;

/// Spectra of the components; the peak function of equation 20,
/// 1 / (1 + ((f − f0)/(f_b − f0))²), at the height of the first component's peak, dashed; the
/// pass band shaded. Frequencies well beyond the band are cut off.
///
/// # Errors
/// [`Error::Drawing`](crate::Error::Drawing) when the drawing library refuses.
pub fn spectra(input: &Spectra) -> Result<Svg> {
    let entries = entries(input);
    let sides = (LEFT_PX, LEFT_PX + WIDTH_PX);
    let top = 58.0 + legend_height(&entries, sides) + 12.0;
    let x = (0.0, shown_hz(input));
    let seen = |values: &Vec<f64>| -> Vec<f64> {
        input
            .frequencies_hz
            .iter()
            .zip(values)
            .filter(|(f, _)| **f <= x.1)
            .map(|(_, a)| *a)
            .collect()
    };
    let high = range(input.amplitudes.iter().flat_map(seen), &[0.0], 0.08).1;
    let panel = Panel { left: LEFT_PX, top, width: WIDTH_PX, height: HEIGHT_PX, x, y: (0.0, high) };
    let spoken =
        format!("Spectra of the first {} components of {}", input.amplitudes.len(), input.shot);
    draw((LEFT_PX + WIDTH_PX + 24.0, top + HEIGHT_PX + 52.0), &spoken, |figure| {
        heading(figure, &format!("Spectra of the components: {}", input.shot), &band_line(input))?;
        legend(figure, &entries, sides, 64.0)?;
        shade(figure, &panel, input)?;
        panel.y_axis(figure, "amplitude (standard deviations)", &ticks(panel.y, 6))?;
        rows(figure, &panel, input.fps)?;
        for (i, values) in input.amplitudes.iter().enumerate().rev() {
            let curve = cut(&panel, input.frequencies_hz, values);
            figure.line(&curve, stroke(i))?;
        }
        peak(figure, &panel, input)
    })
}

fn stroke(component: usize) -> Stroke {
    let width = if component < 2 { 2.2 } else { 1.3 };
    Stroke::solid(series(component), width)
}

fn entries(input: &Spectra) -> Vec<(String, Stroke)> {
    let mut entries: Vec<_> =
        (0..input.amplitudes.len()).map(|i| (format!("PC{}", i + 1), stroke(i))).collect();
    if input.band.is_some() {
        entries.push(("peak function".to_owned(), Stroke::dashed(INK, 1.4)));
        entries.push(("pass band".to_owned(), Stroke::solid(SHADE, 10.0)));
    }
    entries
}

/// Upper end of the frequency axis: all frequencies, or twice what the band needs.
fn shown_hz(input: &Spectra) -> f64 {
    let last = input.frequencies_hz.last().copied().filter(|f| *f > 0.0).unwrap_or(1.0);
    match input.band {
        Some(band) => last.min((2.0 * band.high_hz).max(4.0 * band.peak_hz)).max(1e-6),
        None => last,
    }
}

fn band_line(input: &Spectra) -> String {
    match (input.band, input.fps) {
        (Some(b), Some(fps)) => format!(
            "Fundamental {:.2} Hz ({:.1} frames a cycle); pass band {:.2} to {:.2} Hz.",
            b.peak_hz,
            fps / b.peak_hz,
            b.low_hz,
            b.high_hz
        ),
        (Some(b), None) => format!(
            "Fundamental {:.2} Hz; pass band {:.2} to {:.2} Hz.",
            b.peak_hz, b.low_hz, b.high_hz
        ),
        (None, _) => "No peak was fitted.".to_owned(),
    }
}

fn shade(figure: &Figure, panel: &Panel, input: &Spectra) -> Drawn {
    let Some(band) = input.band else { return Ok(()) };
    panel.stripe(figure, band.low_hz, band.high_hz, SHADE)?;
    let x = panel.px(band.peak_hz);
    figure.line(&[(x, panel.top), (x, panel.bottom())], Stroke::solid(MUTED, 0.8))?;
    let lettering = Lettering::new(TICK_PX).colour(MUTED).align(Align::Left);
    figure.text("f₀", (x + 5.0, panel.top + 9.0), lettering)
}

fn rows(figure: &Figure, panel: &Panel, fps: Option<f64>) -> Drawn {
    let at = ticks(panel.x, 10);
    let hz = TickRow { name: "Hz", label: &|f| number(f, 2) };
    match fps.filter(|f| f.is_finite() && *f > 0.0) {
        None => panel.x_axis_rows(figure, &at, &[hz]),
        Some(fps) => {
            let label = |f: f64| if f > 0.0 { number(fps / f, 1) } else { "∞".to_owned() };
            let frames = TickRow { name: "frames/cycle", label: &label };
            panel.x_axis_rows(figure, &at, &[hz, frames])
        }
    }
}

/// The part of a curve within the panel, with the point where it leaves.
fn cut(panel: &Panel, frequencies_hz: &[f64], values: &[f64]) -> Vec<Point> {
    let end = panel.x.1;
    let mut curve = Vec::new();
    let mut before: Option<(f64, f64)> = None;
    for (&f, &a) in frequencies_hz.iter().zip(values) {
        if f > end {
            if let Some((f0, a0)) = before {
                curve.push(panel.at(end, a0 + (a - a0) * (end - f0) / (f - f0)));
            }
            break;
        }
        curve.push(panel.at(f, a));
        before = Some((f, a));
    }
    curve
}

fn peak(figure: &Figure, panel: &Panel, input: &Spectra) -> Drawn {
    let (Some(band), Some(first)) = (input.band, input.amplitudes.first()) else { return Ok(()) };
    let nearest = input
        .frequencies_hz
        .iter()
        .zip(first)
        .min_by(|a, b| (a.0 - band.peak_hz).abs().total_cmp(&(b.0 - band.peak_hz).abs()));
    let Some((_, &top)) = nearest else { return Ok(()) };
    let curve: Vec<_> = (0..=PEAK_SAMPLES)
        .map(|i| {
            let f = panel.x.0 + (panel.x.1 - panel.x.0) * i as f64 / PEAK_SAMPLES as f64;
            let u = (f - band.peak_hz) / (band.half_hz - band.peak_hz);
            panel.at(f, top / (1.0 + u * u))
        })
        .collect();
    figure.line(&curve, Stroke::dashed(INK, 1.4))
}
