//! The sheet of paper a plot is drawn on: pixels to the right and down, text, strokes and marks.

use std::io;

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::{Error, Result};
use crate::report::palette::{INK, PAPER, Rgb};

/// The SVG backend of plotters takes whole numbers only: all is drawn this many times larger and
/// scaled back by the view box, so that curves are smooth.
const SUBPIXELS: f64 = 10.0;
/// plotters divides a text's size by this before it writes it (`plotters-svg`, `draw_text`).
const PLOTTERS_FONT_RATIO: f64 = 1.24;
const FONTS: &str = "Inter, Helvetica Neue, Helvetica, Arial, sans-serif";

/// A finished plot: a complete SVG document.
///
/// Only the functions of [`plots`](super) make one, so its text is escaped and it holds no
/// script: it can stand inside a page as it is.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(transparent)]
pub struct Svg(String);

impl Svg {
    /// The document, UTF-8.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

pub(super) type Drawn<T = ()> = std::result::Result<T, DrawingAreaErrorKind<io::Error>>;
pub(super) type Point = (f64, f64);

pub(super) struct Figure<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// Where a text's anchor lies within it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Centre,
    Right,
}

#[derive(Clone, Copy)]
pub(super) struct Lettering {
    pub(super) size_px: f64,
    pub(super) colour: Rgb,
    pub(super) bold: bool,
    pub(super) align: Align,
}

impl Lettering {
    pub(super) fn new(size_px: f64) -> Self {
        Self { size_px, colour: INK, bold: false, align: Align::Left }
    }

    pub(super) fn colour(self, colour: Rgb) -> Self {
        Self { colour, ..self }
    }

    pub(super) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(super) fn align(self, align: Align) -> Self {
        Self { align, ..self }
    }

    /// `text`, its end replaced by an ellipsis where it is wider than `room_px`.
    pub(super) fn cut(&self, text: &str, room_px: f64) -> String {
        let signs = (room_px / self.width_px("m")).max(1.0) as usize;
        if text.chars().count() <= signs {
            return text.to_owned();
        }
        text.chars().take(signs - 1).chain("…".chars()).collect()
    }

    /// Width of `text`, pixels: an estimate from the mean advance of common sans-serif faces,
    /// on the wide side, as the reader's fonts are not known.
    pub(super) fn width_px(&self, text: &str) -> f64 {
        0.58 * self.size_px * text.chars().count() as f64
    }
}

/// How a line is drawn.
#[derive(Clone, Copy)]
pub(super) struct Stroke {
    pub(super) colour: Rgb,
    pub(super) width_px: f64,
    /// Lengths of dash and gap, pixels.
    pub(super) dash_px: Option<(f64, f64)>,
}

impl Stroke {
    pub(super) fn solid(colour: Rgb, width_px: f64) -> Self {
        Self { colour, width_px, dash_px: None }
    }

    pub(super) fn dashed(colour: Rgb, width_px: f64) -> Self {
        Self { colour, width_px, dash_px: Some((5.0, 4.0)) }
    }
}

/// Draws a plot of `width` × `height` pixels; `spoken` is what a screen reader says of it.
///
/// # Errors
/// [`Error::Drawing`] when the drawing library refuses.
pub(super) fn draw(
    (width, height): (f64, f64),
    spoken: &str,
    paint: impl FnOnce(&Figure) -> Drawn,
) -> Result<Svg> {
    let mut text = String::new();
    {
        let size = (scaled(width).unsigned_abs(), scaled(height).unsigned_abs());
        let figure = Figure { area: SVGBackend::with_string(&mut text, size).into_drawing_area() };
        figure
            .rectangle((0.0, 0.0), (width, height), PAPER)
            .and_then(|()| paint(&figure))
            .and_then(|()| figure.area.present())
            .map_err(|reason| Error::Drawing {
                what: spoken.to_owned(),
                reason: reason.to_string(),
            })?;
    }
    Ok(Svg(with_own_head(&text, (width, height), spoken)))
}

/// Replaces the root tag that plotters writes by one that is scaled, speaks, and has round joins.
fn with_own_head(text: &str, (width, height): (f64, f64), spoken: &str) -> String {
    let body = text.split_once('>').map_or("", |(_, body)| body);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\" stroke-linejoin=\"round\" \
         stroke-linecap=\"round\">{body}",
        scaled(width),
        scaled(height),
        escaped(spoken),
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Pixels to the backend's grid. The cast saturates, which keeps a wild value merely off the page.
fn scaled(px: f64) -> i32 {
    (px * SUBPIXELS).round() as i32
}

fn at((x, y): Point) -> (i32, i32) {
    (scaled(x), scaled(y))
}

fn style(colour: Rgb) -> RGBColor {
    RGBColor(colour[0], colour[1], colour[2])
}

impl Figure<'_> {
    /// Width of the whole figure, pixels.
    pub(super) fn width_px(&self) -> f64 {
        f64::from(self.area.dim_in_pixel().0) / SUBPIXELS
    }

    pub(super) fn rectangle(&self, (x, y): Point, (width, height): Point, fill: Rgb) -> Drawn {
        let corners = [at((x, y)), at((x + width, y + height))];
        self.area.draw(&Rectangle::new(corners, style(fill).filled()))
    }

    /// A polyline; it breaks where a coordinate is not finite.
    pub(super) fn line(&self, points: &[Point], stroke: Stroke) -> Drawn {
        let width = scaled(stroke.width_px).unsigned_abs();
        let drawn = style(stroke.colour).stroke_width(width);
        for run in points.split(|(x, y)| !x.is_finite() || !y.is_finite()) {
            if run.len() < 2 {
                continue;
            }
            let run: Vec<_> = run.iter().map(|&p| at(p)).collect();
            match stroke.dash_px {
                None => self.area.draw(&PathElement::new(run, drawn))?,
                Some((dash, gap)) => self.area.draw(&DashedPathElement::new(
                    run,
                    scaled(dash),
                    scaled(gap),
                    drawn,
                ))?,
            }
        }
        Ok(())
    }

    /// A filled disc with a rim of `rim`.
    pub(super) fn disc(&self, centre: Point, radius_px: f64, fill: Rgb, rim: Stroke) -> Drawn {
        if !centre.0.is_finite() || !centre.1.is_finite() {
            return Ok(());
        }
        let radius = scaled(radius_px);
        self.area.draw(&Circle::new(at(centre), radius, style(fill).filled()))?;
        let width = scaled(rim.width_px).unsigned_abs();
        if width == 0 {
            return Ok(());
        }
        self.area.draw(&Circle::new(at(centre), radius, style(rim.colour).stroke_width(width)))
    }

    /// A filled square of half side `half_px` with a rim.
    pub(super) fn square(&self, (x, y): Point, half_px: f64, fill: Rgb, rim: Stroke) -> Drawn {
        if !x.is_finite() || !y.is_finite() {
            return Ok(());
        }
        let h = half_px;
        self.rectangle((x - h, y - h), (2.0 * h, 2.0 * h), fill)?;
        let corners =
            [(x - h, y - h), (x + h, y - h), (x + h, y + h), (x - h, y + h), (x - h, y - h)];
        self.line(&corners, rim)
    }

    /// One line of text, its middle at the height of `anchor`.
    pub(super) fn text(&self, text: &str, anchor: Point, lettering: Lettering) -> Drawn {
        self.lettered(text, anchor, lettering, FontTransform::None)
    }

    /// The same turned to read upwards.
    pub(super) fn upward_text(&self, text: &str, anchor: Point, lettering: Lettering) -> Drawn {
        self.lettered(text, anchor, lettering, FontTransform::Rotate270)
    }

    fn lettered(
        &self,
        text: &str,
        anchor: Point,
        lettering: Lettering,
        turn: FontTransform,
    ) -> Drawn {
        if !anchor.0.is_finite() || !anchor.1.is_finite() {
            return Ok(());
        }
        let horizontal = match lettering.align {
            Align::Left => HPos::Left,
            Align::Centre => HPos::Center,
            Align::Right => HPos::Right,
        };
        let weight = if lettering.bold { FontStyle::Bold } else { FontStyle::Normal };
        let font = (FONTS, lettering.size_px * SUBPIXELS * PLOTTERS_FONT_RATIO)
            .into_font()
            .style(weight)
            .transform(turn)
            .color(&style(lettering.colour))
            .pos(Pos::new(horizontal, VPos::Center));
        self.area.draw(&Text::new(text.to_owned(), at(anchor), font))
    }
}
