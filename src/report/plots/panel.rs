//! One pair of axes on a figure.

use plotters::coord::ranged1d::{BoldPoints, Ranged};
use plotters::coord::types::RangedCoordf64;

use super::figure::{Align, Drawn, Figure, Lettering, Point, Stroke};
use crate::report::palette::{GRID, INK, MUTED, Rgb};

pub(super) const TITLE_PX: f64 = 15.0;
pub(super) const LABEL_PX: f64 = 12.0;
pub(super) const TICK_PX: f64 = 11.0;

/// A rectangle of the figure (pixels) and the data ranges it shows.
pub(super) struct Panel {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
}

/// Smallest interval that holds all finite values and those of `including`, widened by `margin`
/// of its length at both ends. An empty or constant set gives an interval of length one or more.
pub(super) fn range(
    values: impl IntoIterator<Item = f64>,
    including: &[f64],
    margin: f64,
) -> (f64, f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in values.into_iter().chain(including.iter().copied()).filter(|v| v.is_finite()) {
        low = low.min(v);
        high = high.max(v);
    }
    if low > high {
        return (0.0, 1.0);
    }
    if high - low < 1e-9 * high.abs().max(low.abs()).max(1e-9) {
        let half = 0.5 * high.abs().max(1.0);
        return (low - half, high + half);
    }
    let pad = margin * (high - low);
    (low - pad, high + pad)
}

/// About `count` round numbers within the interval.
pub(super) fn ticks((low, high): (f64, f64), count: usize) -> Vec<f64> {
    RangedCoordf64::from(low..high).key_points(BoldPoints(count))
}

/// The same, whole numbers only.
pub(super) fn whole_ticks(interval: (f64, f64), count: usize) -> Vec<f64> {
    ticks(interval, count).into_iter().filter(|v| (v - v.round()).abs() < 1e-9).collect()
}

/// A number with as few decimals as it needs, at most `decimals`, and a true minus sign.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let mut text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    match text.strip_prefix('-') {
        Some("0") => "0".to_owned(),
        Some(positive) => format!("−{positive}"),
        None => text,
    }
}

/// One line of tick labels below a panel.
pub(super) struct TickRow<'a> {
    pub(super) name: &'a str,
    pub(super) label: &'a dyn Fn(f64) -> String,
}

impl Panel {
    pub(super) fn px(&self, x: f64) -> f64 {
        self.left + (x - self.x.0) / (self.x.1 - self.x.0) * self.width
    }

    pub(super) fn py(&self, y: f64) -> f64 {
        self.top + (self.y.1 - y) / (self.y.1 - self.y.0) * self.height
    }

    pub(super) fn at(&self, x: f64, y: f64) -> Point {
        (self.px(x), self.py(y))
    }

    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Equally spaced values against their index.
    pub(super) fn curve(&self, values: &[f64]) -> Vec<Point> {
        values.iter().enumerate().map(|(i, &v)| self.at(i as f64, v)).collect()
    }

    /// A vertical stripe from `from` to `to` in x, cut at the panel's sides.
    pub(super) fn stripe(&self, figure: &Figure, from: f64, to: f64, fill: Rgb) -> Drawn {
        let left = self.px(from).max(self.left);
        let right = self.px(to).min(self.right());
        if right > left {
            figure.rectangle((left, self.top), (right - left, self.height), fill)?;
        }
        Ok(())
    }

    /// Horizontal grid lines with their labels, and the upward name of the axis.
    pub(super) fn y_axis(&self, figure: &Figure, name: &str, at: &[f64]) -> Drawn {
        let step = at.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        let decimals = decimals_for(step);
        for &y in at {
            let py = self.py(y);
            figure.line(&[(self.left, py), (self.right(), py)], Stroke::solid(GRID, 1.0))?;
            let lettering = Lettering::new(TICK_PX).colour(MUTED).align(Align::Right);
            figure.text(&number(y, decimals), (self.left - 7.0, py), lettering)?;
        }
        let middle = (self.left - 46.0, self.top + 0.5 * self.height);
        let lettering = Lettering::new(LABEL_PX).align(Align::Centre);
        figure.upward_text(name, middle, lettering)
    }

    /// Vertical grid lines.
    pub(super) fn x_grid(&self, figure: &Figure, at: &[f64]) -> Drawn {
        for &x in at {
            let px = self.px(x);
            figure.line(&[(px, self.top), (px, self.bottom())], Stroke::solid(GRID, 1.0))?;
        }
        Ok(())
    }

    /// The base line with one row of labels, the name of the axis centred below.
    pub(super) fn x_axis(&self, figure: &Figure, name: &str, at: &[f64]) -> Drawn {
        let step = at.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        let decimals = decimals_for(step);
        self.base_line(figure)?;
        self.tick_row(figure, at, 15.0, INK, &|v| number(v, decimals))?;
        let middle = (self.left + 0.5 * self.width, self.bottom() + 36.0);
        figure.text(name, middle, Lettering::new(LABEL_PX).align(Align::Centre))
    }

    /// The base line with several rows of labels, each named in the left margin.
    pub(super) fn x_axis_rows(&self, figure: &Figure, at: &[f64], rows: &[TickRow]) -> Drawn {
        self.base_line(figure)?;
        for (i, row) in rows.iter().enumerate() {
            let below = 16.0 + 17.0 * i as f64;
            let colour = if i == 0 { INK } else { MUTED };
            self.tick_row(figure, at, below, colour, row.label)?;
            let lettering = Lettering::new(TICK_PX).colour(colour).align(Align::Right);
            figure.text(row.name, (self.left - 22.0, self.bottom() + below), lettering)?;
        }
        Ok(())
    }

    fn base_line(&self, figure: &Figure) -> Drawn {
        let y = self.bottom();
        figure.line(&[(self.left, y), (self.right(), y)], Stroke::solid(MUTED, 1.0))
    }

    fn tick_row(
        &self,
        figure: &Figure,
        at: &[f64],
        below: f64,
        colour: Rgb,
        label: &dyn Fn(f64) -> String,
    ) -> Drawn {
        let lettering = Lettering::new(TICK_PX).colour(colour).align(Align::Centre);
        for &x in at {
            figure.text(&label(x), (self.px(x), self.bottom() + below), lettering)?;
        }
        Ok(())
    }
}

/// Decimals that tell ticks `step` apart.
fn decimals_for(step: f64) -> usize {
    if step.is_finite() && step > 0.0 {
        (-step.log10().floor()).clamp(0.0, 6.0) as usize
    } else {
        2
    }
}

/// Frames below a panel whose x is the frame number, and seconds below these where the rate is
/// known.
pub(super) fn frame_axis(figure: &Figure, panel: &Panel, fps: Option<f64>) -> Drawn {
    let at = whole_ticks(panel.x, 10);
    let frames = TickRow { name: "frame", label: &|v| number(v, 0) };
    match fps.filter(|f| f.is_finite() && *f > 0.0) {
        None => panel.x_axis_rows(figure, &at, &[frames]),
        Some(fps) => {
            let seconds = TickRow { name: "seconds", label: &|v| number(v / fps, 2) };
            panel.x_axis_rows(figure, &at, &[frames, seconds])
        }
    }
}

/// The plot's name, large, and what it says in a second, muted line.
pub(super) fn heading(figure: &Figure, title: &str, line: &str) -> Drawn {
    let room = figure.width_px() - 2.0 * 20.0;
    let (large, small) = (Lettering::new(TITLE_PX).bold(), Lettering::new(LABEL_PX).colour(MUTED));
    figure.text(&large.cut(title, room), (20.0, 22.0), large)?;
    figure.text(&small.cut(line, room), (20.0, 42.0), small)
}

/// A sample of each stroke with its name, in rows that wrap at `right`. `top` is the middle of
/// the first row; [`legend_height`] says how tall it comes out.
pub(super) fn legend(
    figure: &Figure,
    entries: &[(String, Stroke)],
    (left, right): (f64, f64),
    top: f64,
) -> Drawn {
    for ((name, stroke), (x, row)) in entries.iter().zip(legend_places(entries, left, right)) {
        let y = top + LEGEND_ROW_PX * row as f64;
        figure.line(&[(x, y), (x + SAMPLE_PX, y)], *stroke)?;
        figure.text(name, (x + SAMPLE_PX + NAME_GAP_PX, y), Lettering::new(TICK_PX))?;
    }
    Ok(())
}

const LEGEND_ROW_PX: f64 = 18.0;
const SAMPLE_PX: f64 = 24.0;
/// Holds the round end of a wide sample.
const NAME_GAP_PX: f64 = 9.0;

/// Height of the rows that [`legend`] needs, pixels.
pub(super) fn legend_height(entries: &[(String, Stroke)], (left, right): (f64, f64)) -> f64 {
    let rows = legend_places(entries, left, right).last().map_or(0, |(_, row)| row + 1);
    LEGEND_ROW_PX * rows as f64
}

fn legend_places(entries: &[(String, Stroke)], left: f64, right: f64) -> Vec<(f64, usize)> {
    let (mut x, mut row) = (left, 0);
    let mut places = Vec::with_capacity(entries.len());
    for (name, _) in entries {
        let wide = SAMPLE_PX + NAME_GAP_PX + Lettering::new(TICK_PX).width_px(name) + 14.0;
        if x > left && x + wide > right {
            (x, row) = (left, row + 1);
        }
        places.push((x, row));
        x += wide;
    }
    places
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_are_short_and_have_a_true_minus() {
        let cases = [(1.0, 2, "1"), (0.25, 2, "0.25"), (-0.5, 1, "−0.5"), (-0.001, 2, "0")];
        for (value, decimals, text) in cases {
            assert_eq!(number(value, decimals), text);
        }
        assert_eq!(number(1200.0, 0), "1200");
    }

    #[test]
    fn a_range_without_numbers_or_extent_can_still_be_drawn() {
        assert_eq!(range([], &[], 0.1), (0.0, 1.0));
        assert_eq!(range([f64::NAN, f64::INFINITY], &[], 0.1), (0.0, 1.0));
        assert_eq!(range([3.0, 3.0], &[], 0.1), (1.5, 4.5));
        assert_eq!(range([0.0], &[], 0.1), (-0.5, 0.5));
    }

    #[test]
    fn a_legend_wraps_before_its_right_end() {
        let entries: Vec<(String, Stroke)> =
            (1..=16).map(|k| (format!("key {k}"), Stroke::solid(INK, 1.0))).collect();
        let places = legend_places(&entries, 80.0, 400.0);
        assert!(places.iter().all(|&(x, _)| (80.0..400.0 - 24.0).contains(&x)));
        assert!(places.windows(2).all(|w| w[1].1 > w[0].1 || w[1].0 > w[0].0 + 40.0));
        assert_eq!(legend_height(&entries, (80.0, 400.0)), 18.0 * (places[15].1 + 1) as f64);
    }

    proptest! {
        #[test]
        fn a_range_holds_every_finite_value(
            values in prop::collection::vec(-1e6..1e6_f64, 1..20),
            margin in 0.0..0.3_f64,
        ) {
            let (low, high) = range(values.iter().copied(), &[0.0], margin);
            prop_assert!(low < high && low <= 0.0 && high >= 0.0);
            prop_assert!(values.iter().all(|v| (low..=high).contains(v)));
        }

        #[test]
        fn ticks_lie_within_and_are_not_too_many(low in -1e3..1e3_f64, length in 1e-3..1e4_f64) {
            let interval = (low, low + length);
            let found = ticks(interval, 10);
            prop_assert!(found.len() <= 11);
            let slack = 1e-9 * length;
            prop_assert!(found.iter().all(|t| *t >= low - slack && *t <= interval.1 + slack));
        }
    }
}
