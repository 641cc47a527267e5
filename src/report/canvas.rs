//! A raster to letter and paste on.

use std::convert::Infallible;

use ::image::RgbImage;
use embedded_graphics::Pixel;
use embedded_graphics::mono_font::iso_8859_1::{
    FONT_9X15, FONT_9X15_BOLD, FONT_9X18_BOLD, FONT_10X20,
};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};

use super::palette::Rgb;
use crate::image::Picture;

/// The faces in use: bitmap fonts of fixed width that cover Latin-1; other signs show as "?".
#[derive(Clone, Copy)]
pub(super) enum Face {
    Title,
    Strong,
    Bold,
    Plain,
}

impl Face {
    fn font(self) -> &'static MonoFont<'static> {
        match self {
            Face::Title => &FONT_10X20,
            Face::Strong => &FONT_9X18_BOLD,
            Face::Bold => &FONT_9X15_BOLD,
            Face::Plain => &FONT_9X15,
        }
    }

    pub(super) fn height(self) -> u32 {
        self.font().character_size.height
    }

    pub(super) fn width(self, text: &str) -> u32 {
        let signs = u32::try_from(text.chars().count()).unwrap_or(u32::MAX);
        signs.saturating_mul(self.font().character_size.width)
    }

    /// `text` cut to `width` pixels, with two dots where it was cut.
    pub(super) fn cut(self, text: &str, width: u32) -> String {
        if self.width(text) <= width {
            return text.to_owned();
        }
        let room = (width / self.font().character_size.width).saturating_sub(2) as usize;
        text.chars().take(room).chain("..".chars()).collect()
    }
}

pub(super) struct Canvas {
    pixels: RgbImage,
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32, ground: Rgb) -> Self {
        Self { pixels: RgbImage::from_pixel(width, height, ::image::Rgb(ground)) }
    }

    /// Letters `text` with its top left corner at `(x, y)`; what falls outside is not drawn.
    pub(super) fn text(&mut self, text: &str, (x, y): (u32, u32), face: Face, colour: Rgb) {
        let style = MonoTextStyle::new(face.font(), Rgb888::new(colour[0], colour[1], colour[2]));
        let at = Point::new(x.cast_signed(), y.cast_signed());
        match Text::with_baseline(text, at, style, Baseline::Top).draw(self) {
            Ok(_) => (),
            Err(never) => match never {},
        }
    }

    pub(super) fn paste(&mut self, image: &RgbImage, (x, y): (u32, u32)) {
        ::image::imageops::replace(&mut self.pixels, image, i64::from(x), i64::from(y));
    }

    /// Fills a rectangle, cut at the canvas.
    pub(super) fn fill(&mut self, (x, y): (u32, u32), (width, height): (u32, u32), colour: Rgb) {
        for row in y..y.saturating_add(height).min(self.pixels.height()) {
            for column in x..x.saturating_add(width).min(self.pixels.width()) {
                self.pixels.put_pixel(column, row, ::image::Rgb(colour));
            }
        }
    }

    pub(super) fn into_picture(self) -> Picture {
        picture(self.pixels)
    }
}

/// The project's picture type from the image crate's.
pub(super) fn picture(pixels: RgbImage) -> Picture {
    let (width, height) = (pixels.width() as usize, pixels.height() as usize);
    match Picture::from_rgb(width, height, pixels.into_raw()) {
        Some(picture) => picture,
        None => unreachable!("an RGB raster has three bytes a pixel"),
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.pixels.width(), self.pixels.height())
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = Pixel<Rgb888>>,
    {
        for Pixel(at, colour) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(at.x), u32::try_from(at.y)) else { continue };
            if let Some(pixel) = self.pixels.get_pixel_mut_checked(x, y) {
                *pixel = ::image::Rgb([colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_stay_within_the_width_that_is_promised() {
        let mut canvas = Canvas::new(200, 40, [255; 3]);
        canvas.text("key 12 · ±é", (10, 5), Face::Strong, [0; 3]);
        let picture = canvas.into_picture();
        let dark: Vec<(usize, usize)> = (0..40)
            .flat_map(|y| (0..200).map(move |x| (x, y)))
            .filter(|&(x, y)| picture.pixel(x, y) == [0; 3])
            .collect();
        assert!(dark.len() > 60);
        let right = 10 + Face::Strong.width("key 12 · ±é") as usize;
        assert!(dark.iter().all(|&(x, y)| (10..right).contains(&x) && (5..23).contains(&y)));
    }

    #[test]
    fn drawing_off_the_canvas_is_cut() {
        let mut canvas = Canvas::new(8, 8, [9; 3]);
        canvas.fill((4, 4), (100, 100), [1; 3]);
        canvas.text("wide text", (2, 2), Face::Title, [2; 3]);
        canvas.paste(&RgbImage::from_pixel(50, 50, ::image::Rgb([3; 3])), (6, 6));
        let picture = canvas.into_picture();
        assert_eq!(picture.pixel(0, 0), [9; 3]);
        assert_eq!(picture.pixel(7, 7), [3; 3]);
    }

    #[test]
    fn a_long_text_is_cut_to_its_room() {
        assert_eq!(Face::Plain.cut("abcdefgh", 45), "abc..");
        assert_eq!(Face::Plain.cut("abcde", 45), "abcde");
    }
}
