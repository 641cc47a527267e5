//! The eigen-silhouettes: what each component stands for (figures 7 and 8 of the seed paper).

use ::image::imageops::{FilterType, resize};
use ::image::{GrayImage, RgbImage};

use super::outline::{Outline, draw_outline};
use super::tile::{shown_size, silhouette};
use crate::image::Picture;
use crate::report::canvas::{Canvas, Face};
use crate::report::palette::{INK, MUTED, PAPER};

/// One component on the sheet. Both images have the size of the mean image; 0 is certainly
/// ground and 255 certainly animal, values beyond were cut off when they were stored.
#[derive(Clone, Copy, Debug)]
pub struct EigenRow<'a> {
    /// Number of the component, from 1.
    pub component: usize,
    /// Its share of the variance, from 0 to 1.
    pub variance_share: f64,
    /// Mean minus the stated number of standard deviations along the component.
    pub minus: &'a GrayImage,
    /// Mean plus the same.
    pub plus: &'a GrayImage,
}

const MARGIN_PX: u32 = 24;
const HEAD_PX: u32 = 86;
const NAMES_PX: u32 = 130;
const GAP_PX: u32 = 10;
const ROOM: (u32, u32) = (340, 260);
const THINNEST_PX: u32 = 120;

/// A sheet with a row a component: mean − kσ, mean, mean + kσ, with k = `deviations`. The
/// outline of the mean shape lies over the outer columns, to show what moves.
#[must_use]
pub fn eigen_sheet(title: &str, mean: &GrayImage, rows: &[EigenRow], deviations: f64) -> Picture {
    let shown = shown_size((mean.width() as usize, mean.height() as usize), ROOM);
    let cell = (shown.0.max(THINNEST_PX), shown.1);
    let width = 2 * MARGIN_PX + NAMES_PX + 3 * (cell.0 + GAP_PX) - GAP_PX;
    let height = HEAD_PX + rows.len() as u32 * (cell.1 + GAP_PX) + MARGIN_PX;
    let mut canvas = Canvas::new(width, height, PAPER);
    let title = Face::Title.cut(title, width - 2 * MARGIN_PX);
    canvas.text(&title, (MARGIN_PX, 20), Face::Title, INK);
    let names =
        [format!("mean - {deviations} sd"), "mean".to_owned(), format!("mean + {deviations} sd")];
    let column = |i: u32| MARGIN_PX + NAMES_PX + i * (cell.0 + GAP_PX);
    for (i, name) in (0..).zip(&names) {
        let middle = column(i) + (cell.0.saturating_sub(Face::Plain.width(name))) / 2;
        canvas.text(name, (middle, HEAD_PX - 24), Face::Plain, MUTED);
    }
    let mean = scaled(mean, shown);
    for (r, row) in (0..).zip(rows) {
        let y = HEAD_PX + r * (cell.1 + GAP_PX);
        let middle = y + cell.1 / 2;
        canvas.text(
            &format!("PC{}", row.component),
            (MARGIN_PX, middle.saturating_sub(22)),
            Face::Strong,
            INK,
        );
        let share = format!("{:.1} % of", 100.0 * row.variance_share);
        canvas.text(&share, (MARGIN_PX, middle), Face::Plain, MUTED);
        canvas.text("the variance", (MARGIN_PX, middle + 16), Face::Plain, MUTED);
        let images = [varied(row.minus, &mean), silhouette(&mean), varied(row.plus, &mean)];
        for (i, image) in (0..).zip(&images) {
            canvas.paste(image, (column(i) + (cell.0 - shown.0) / 2, y));
        }
    }
    canvas.into_picture()
}

/// Unlike masks and footage these are smooth by nature, and are magnified smoothly.
fn scaled(image: &GrayImage, shown: (u32, u32)) -> GrayImage {
    resize(image, shown.0, shown.1, FilterType::Triangle)
}

fn varied(image: &GrayImage, mean: &GrayImage) -> RgbImage {
    let mut drawn = silhouette(&scaled(image, mean.dimensions()));
    draw_outline(&mut drawn, mean, Outline::over_greys());
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_hold_the_images_they_name() {
        let flat = |value: u8| GrayImage::from_pixel(300, 200, ::image::Luma([value]));
        let (mean, minus, plus) = (flat(0), flat(255), flat(0));
        let row = EigenRow { component: 1, variance_share: 0.337, minus: &minus, plus: &plus };
        let sheet = eigen_sheet("shot", &mean, &[row, EigenRow { component: 2, ..row }], 2.0);
        let middle = |column: u32, row: u32| {
            let x = MARGIN_PX + NAMES_PX + column * (300 + GAP_PX) + 150;
            sheet.pixel(x as usize, (HEAD_PX + row * (200 + GAP_PX) + 100) as usize)
        };
        for row in 0..2 {
            assert_eq!(middle(0, row), INK);
            assert_eq!(middle(1, row), super::super::tile::SILHOUETTE_GROUND);
            assert_eq!(middle(2, row), super::super::tile::SILHOUETTE_GROUND);
        }
    }
}
