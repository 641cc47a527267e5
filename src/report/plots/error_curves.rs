//! Error by number of components, one curve for each number of keys (figure 6 of the seed paper).

use super::figure::{Align, Drawn, Figure, Lettering, Stroke, Svg, draw};
use super::panel::{Panel, TICK_PX, heading, range, ticks, whole_ticks};
use crate::error::Result;
use crate::report::palette::{INK, MUTED, PAPER, Rgb, series};

/// The errors with one number of keys.
#[derive(Clone, Debug)]
pub struct ErrorCurve {
    /// Number of keys.
    pub keys: usize,
    /// Number of components and mean error in degrees, in order of components.
    pub points: Vec<(usize, f64)>,
}

/// A level to compare with: the error of the mean pose, the floor.
#[derive(Clone, Debug)]
pub struct ReferenceLevel {
    /// What it is, a few words.
    pub name: String,
    /// Error, degrees.
    pub error_deg: f64,
}

/// What [`error_curves`] draws.
#[derive(Clone, Copy, Debug)]
pub struct ErrorCurves<'a> {
    /// Name of the rig and clip, for the heading.
    pub clip: &'a str,
    /// What the error measures, for the axis: "mean joint error".
    pub measure: &'a str,
    /// One curve for each number of keys.
    pub curves: &'a [ErrorCurve],
    /// Dashed levels.
    pub levels: &'a [ReferenceLevel],
}

const LEFT_PX: f64 = 76.0;
const WIDTH_PX: f64 = 520.0;
const HEIGHT_PX: f64 = 330.0;
const TOP_PX: f64 = 64.0;
const NAMES_PX: f64 = 150.0;
/// Least distance between names at the right, pixels.
const NAME_STEP_PX: f64 = 15.0;

/// Mean error over the number of components, each curve named at its right end.
///
/// # Errors
/// [`Error::Drawing`](crate::Error::Drawing) when the drawing library refuses.
pub fn error_curves(input: &ErrorCurves) -> Result<Svg> {
    let values = input.curves.iter().flat_map(|c| c.points.iter().map(|p| p.1));
    let values = values.chain(input.levels.iter().map(|l| l.error_deg));
    let components: Vec<f64> =
        input.curves.iter().flat_map(|c| c.points.iter().map(|p| p.0 as f64)).collect();
    let (first, last) = range(components, &[], 0.0);
    let panel = Panel {
        left: LEFT_PX,
        top: TOP_PX,
        width: WIDTH_PX,
        height: HEIGHT_PX,
        x: (first - 0.2, last + 0.2),
        y: (0.0, range(values, &[0.0], 0.06).1),
    };
    let spoken = format!("Error by number of components and keys for {}", input.clip);
    let size = (LEFT_PX + WIDTH_PX + NAMES_PX, TOP_PX + HEIGHT_PX + 52.0);
    draw(size, &spoken, |figure| {
        let line = format!("{}, degrees; one curve for each number of keys.", input.measure);
        heading(figure, &format!("Error by components and keys: {}", input.clip), &line)?;
        panel.x_grid(figure, &whole_ticks(panel.x, 10))?;
        panel.y_axis(figure, "error (degrees)", &ticks(panel.y, 8))?;
        panel.x_axis(figure, "number of components", &whole_ticks(panel.x, 10))?;
        let mut names = Vec::new();
        for level in input.levels.iter().filter(|l| l.error_deg.is_finite()) {
            let y = panel.py(level.error_deg);
            figure.line(&[(panel.left, y), (panel.right(), y)], Stroke::dashed(MUTED, 1.2))?;
            names.push((y, level.name.clone(), MUTED));
        }
        for (i, curve) in input.curves.iter().enumerate() {
            names.extend(one_curve(figure, &panel, curve, series(i))?);
        }
        right_names(figure, panel.right() + 10.0, names)
    })
}

fn one_curve(
    figure: &Figure,
    panel: &Panel,
    curve: &ErrorCurve,
    colour: Rgb,
) -> Drawn<Option<(f64, String, Rgb)>> {
    let points: Vec<_> = curve.points.iter().map(|&(c, e)| panel.at(c as f64, e)).collect();
    figure.line(&points, Stroke::solid(colour, 2.0))?;
    for &p in &points {
        figure.disc(p, 3.4, PAPER, Stroke::solid(colour, 1.8))?;
    }
    let end = points.iter().rev().find(|p| p.1.is_finite());
    let keys = if curve.keys == 1 { "1 key".to_owned() } else { format!("{} keys", curve.keys) };
    Ok(end.map(|p| (p.1, keys, colour)))
}

/// Names from top to bottom, pushed apart where they would touch; a short line of the curve's
/// colour leads to each, so that a name is told by place and not by colour alone.
fn right_names(figure: &Figure, x: f64, mut names: Vec<(f64, String, Rgb)>) -> Drawn {
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lowest = f64::NEG_INFINITY;
    for (y, name, colour) in names {
        let place = y.max(lowest + NAME_STEP_PX);
        lowest = place;
        figure.line(&[(x - 8.0, y), (x + 4.0, place)], Stroke::solid(colour, 1.2))?;
        let lettering = Lettering::new(TICK_PX).colour(INK).align(Align::Left);
        figure.text(&name, (x + 8.0, place), lettering)?;
    }
    Ok(())
}
