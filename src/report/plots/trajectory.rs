//! The path of the silhouettes in the plane of the first two components (figure 3 of the seed
//! paper).

use super::figure::{Align, Drawn, Figure, Lettering, Point, Stroke, Svg, draw};
use super::panel::{LABEL_PX, Panel, TICK_PX, heading, ticks};
use crate::error::Result;
use crate::report::KeyMark;
use crate::report::palette::{ACCENT, FAINT, INK, MUTED, PAPER, SERIES};

/// What [`trajectory`] draws.
#[derive(Clone, Copy, Debug)]
pub struct Trajectory<'a> {
    /// Name of the shot, for the heading.
    pub shot: &'a str,
    /// One point a frame: coefficients on the first and second component, in unit deviations.
    pub points: &'a [[f64; 2]],
    /// Keys as circles, partners as squares.
    pub keys: &'a [KeyMark],
    /// Length of one turn in frames (the period of the fundamental frequency): the frames of the
    /// first turn are numbered. `None` numbers them all, as far as there is room.
    pub cycle_frames: Option<f64>,
}

const SIDE_PX: f64 = 520.0;
const LEFT_PX: f64 = 70.0;
const TOP_PX: f64 = 62.0;
const MARK_PX: f64 = 9.0;
/// Directions in which a key's number is tried, from the one away from the origin.
const KEY_NUMBER_TURNS_RAD: [f64; 8] = [0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 3.1];

/// The trajectory PC1 × PC2 with equal scales on both axes, frames joined in time. Frames that
/// `keys` names but `points` does not hold are left out.
///
/// # Errors
/// [`Error::Drawing`](crate::Error::Drawing) when the drawing library refuses.
pub fn trajectory(input: &Trajectory) -> Result<Svg> {
    let reach = input.points.iter().flatten().filter(|v| v.is_finite()).fold(1.0, f64_max) * 1.14;
    let panel = Panel {
        left: LEFT_PX,
        top: TOP_PX,
        width: SIDE_PX,
        height: SIDE_PX,
        x: (-reach, reach),
        y: (-reach, reach),
    };
    let size = (LEFT_PX + SIDE_PX + 22.0, TOP_PX + SIDE_PX + 76.0);
    let spoken = format!(
        "Trajectory of {} in the plane of the first two principal components, {} frames, {} keys",
        input.shot,
        input.points.len(),
        input.keys.len()
    );
    draw(size, &spoken, |figure| {
        heading(figure, &format!("Trajectory PC1 × PC2: {}", input.shot), &turn_line(input))?;
        let at = ticks(panel.x, 8);
        panel.x_grid(figure, &at)?;
        panel.y_axis(figure, "PC2 (standard deviations)", &at)?;
        panel.x_axis(figure, "PC1 (standard deviations)", &at)?;
        paths(figure, &panel, input)?;
        let taken = marks(figure, &panel, input)?;
        numbers(figure, &panel, input, taken)?;
        mark_legend(figure, &panel, input)
    })
}

fn f64_max(so_far: f64, value: &f64) -> f64 {
    so_far.max(value.abs())
}

fn first_turn(input: &Trajectory) -> usize {
    let all = input.points.len();
    match input.cycle_frames.filter(|c| c.is_finite() && *c >= 1.0) {
        Some(cycle) => (cycle.ceil() as usize).min(all),
        None => all,
    }
}

fn turn_line(input: &Trajectory) -> String {
    match input.cycle_frames.filter(|c| c.is_finite() && *c >= 1.0) {
        Some(cycle) => format!("One turn is {cycle:.1} frames; those of the first are numbered."),
        None => "Frames in order of time.".to_owned(),
    }
}

fn paths(figure: &Figure, panel: &Panel, input: &Trajectory) -> Drawn {
    let path: Vec<Point> = input.points.iter().map(|p| panel.at(p[0], p[1])).collect();
    let turn = first_turn(input);
    let none = Stroke::solid(FAINT, 0.0);
    figure.line(&path, Stroke::solid(FAINT, 1.0))?;
    for &p in path.iter().skip(turn) {
        figure.disc(p, 2.2, FAINT, none)?;
    }
    figure.line(&path[..turn.min(path.len())], Stroke::solid(SERIES[0], 1.8))?;
    for &p in path.iter().take(turn) {
        figure.disc(p, 3.0, SERIES[0], none)?;
    }
    Ok(())
}

/// Draws keys and partners; gives back the discs they cover.
fn marks(figure: &Figure, panel: &Panel, input: &Trajectory) -> Drawn<Vec<(Point, f64)>> {
    let mut taken = Vec::new();
    for mark in input.keys {
        let Some(p) = input.points.get(mark.frame) else { continue };
        let centre = panel.at(p[0], p[1]);
        let rim = Stroke::solid(ACCENT, 2.2);
        if mark.partner_of.is_some() {
            figure.square(centre, MARK_PX - 1.0, PAPER, rim)?;
        } else {
            figure.disc(centre, MARK_PX, PAPER, rim)?;
        }
        let lettering = Lettering::new(TICK_PX).bold().align(Align::Centre);
        figure.text(&mark.key.to_string(), centre, lettering)?;
        taken.push((centre, MARK_PX));
    }
    Ok(taken)
}

/// Frame numbers, keys first: outside the loop where there is room, a key's number else to
/// either side or within. A number for which no place is free is left out.
fn numbers(
    figure: &Figure,
    panel: &Panel,
    input: &Trajectory,
    mut taken: Vec<(Point, f64)>,
) -> Drawn {
    let keys: Vec<usize> = input.keys.iter().map(|k| k.frame).collect();
    let dots = input.points.iter().take(first_turn(input));
    taken.extend(dots.map(|p| (panel.at(p[0], p[1]), 3.0)));
    let turn = (0..first_turn(input)).filter(|t| !keys.contains(t));
    for t in keys.iter().copied().chain(turn) {
        let Some(p) = input.points.get(t) else { continue };
        let key = keys.contains(&t);
        let (distance, turns, lettering) = if key {
            let lettering = Lettering::new(TICK_PX).bold().colour(ACCENT);
            (MARK_PX + 11.0, &KEY_NUMBER_TURNS_RAD[..], lettering)
        } else {
            (12.0, &KEY_NUMBER_TURNS_RAD[..1], Lettering::new(10.0).colour(MUTED))
        };
        let text = t.to_string();
        let half = 0.5 * lettering.width_px(&text).max(lettering.size_px);
        let outward = p[1].atan2(p[0]);
        let (x, y) = panel.at(p[0], p[1]);
        let place = turns
            .iter()
            .map(|turn| (outward + turn).sin_cos())
            .map(|(sin, cos)| (x + distance * cos, y - distance * sin))
            .find(|q| taken.iter().all(|&((cx, cy), r)| (cx - q.0).hypot(cy - q.1) >= r + half));
        if let Some(place) = place {
            figure.text(&text, place, lettering.align(Align::Centre))?;
            taken.push((place, half));
        }
    }
    Ok(())
}

fn mark_legend(figure: &Figure, panel: &Panel, input: &Trajectory) -> Drawn {
    let y = panel.bottom() + 60.0;
    let lettering = Lettering::new(LABEL_PX).colour(INK);
    let rim = Stroke::solid(ACCENT, 2.2);
    let mut x = panel.left + 6.0;
    if input.keys.iter().any(|k| k.partner_of.is_none()) {
        figure.disc((x, y), 6.0, PAPER, rim)?;
        figure.text("key (its frame beside it)", (x + 13.0, y), lettering)?;
        x += 190.0;
    }
    if input.keys.iter().any(|k| k.partner_of.is_some()) {
        figure.square((x, y), 5.5, PAPER, rim)?;
        figure.text("partner: like silhouette, other pose", (x + 13.0, y), lettering)?;
    }
    Ok(())
}
