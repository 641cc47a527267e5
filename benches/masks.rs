//! Time of what is done to a frame between decoding and its mask file, at one size after the other:
//! colours looked up, morphology, components, holes, PNG.

#[path = "support/walker.rs"]
mod walker;

use divan::Bencher;
use muybridge::image::{Frame, Picture, Rectangle, YuvMatrix, YuvPicture};
use muybridge::mask::{Mask, linked_components};
use muybridge::silhouette::{ColourModels, ColourSettings};
use walker::walker;

fn main() {
    divan::main();
}

const SIZES: [(usize, usize); 5] =
    [(320, 240), (960, 540), (1920, 1080), (2560, 1440), (3840, 2160)];

/// The walker before noise, 4:2:0: the animal bright and reddish, what is about it dark and bluish.
fn frame((width, height): (usize, usize)) -> (YuvPicture, Rectangle, Rectangle) {
    let mask = &walker(1, width, height)[0];
    let mut state = 1_u32;
    let mut noise = |about: u8, spread: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        about.wrapping_add((state >> 16).wrapping_rem(spread) as u8)
    };
    let mut bytes = Vec::with_capacity(width * height * 3 / 2);
    for at in 0..width * height {
        bytes.push(noise(if mask.get(at % width, at / width) { 120 } else { 80 }, 45));
    }
    for row in 0..height / 2 {
        for [inside, outside] in [[115, 125], [140, 128]] {
            for x in 0..width / 2 {
                bytes.push(noise(if mask.get(2 * x, 2 * row) { inside } else { outside }, 12));
            }
        }
    }
    let (w, h) = (width / 12, height / 12);
    let foreground = Rectangle { x: width / 2 - w / 2, y: height / 2 - h / 2, width: w, height: h };
    let background = Rectangle { x: 0, y: 0, width: width / 6, height: height / 2 };
    let picture = YuvPicture::new(width, height, YuvMatrix::Bt709, bytes);
    (picture.unwrap_or_else(|| unreachable!("even sides")), foreground, background)
}

fn models(picture: &Picture, foreground: Rectangle, background: Rectangle) -> ColourModels {
    ColourModels::fit(picture, foreground, background, &ColourSettings::default())
        .unwrap_or_else(|_| unreachable!("rectangles inside"))
}

/// Of colours that are known already, as in all frames but the first.
#[divan::bench(args = SIZES)]
fn classify_stored(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let (picture, foreground, background) = frame(size);
    let models = models(&picture.to_rgb(), foreground, background);
    let frame = Frame::Yuv(picture);
    bencher.bench(|| models.classify(&frame));
}

#[divan::bench(args = SIZES)]
fn classify_rgb(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let (picture, foreground, background) = frame(size);
    let picture = picture.to_rgb();
    let models = models(&picture, foreground, background);
    let frame = Frame::Rgb(picture);
    bencher.bench(|| models.classify(&frame));
}

/// Every colour of the frame met for the first time.
#[divan::bench(args = [(960, 540), (1920, 1080)], sample_count = 5)]
fn learn_colours(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let (picture, foreground, background) = frame(size);
    let models = models(&picture.to_rgb(), foreground, background);
    let frame = Frame::Yuv(picture);
    // A clone has forgotten what it knew.
    bencher.with_inputs(|| models.clone()).bench_values(|models| models.classify(&frame));
}

#[divan::bench(args = SIZES)]
fn convert(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let (picture, _, _) = frame(size);
    bencher.bench(|| picture.to_rgb());
}

fn classified(size: (usize, usize)) -> (Mask, usize, usize, usize) {
    let (picture, foreground, background) = frame(size);
    let mask = models(&picture.to_rgb(), foreground, background).classify(&Frame::Yuv(picture));
    let diagonal = (size.0 as f64).hypot(size.1 as f64);
    let radius = |share: f64| (share * diagonal).round() as usize;
    (mask, radius(0.0024), radius(0.004), radius(0.01))
}

/// Opening and closing by the discs of the default settings.
#[divan::bench(args = SIZES)]
fn morphology(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let (mask, opening, closing, _) = classified(size);
    bencher.bench(|| mask.opened(opening).closed(closing));
}

#[divan::bench(args = SIZES)]
fn components(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let (mask, opening, closing, link) = classified(size);
    let mask = mask.opened(opening).closed(closing);
    bencher.bench(|| linked_components(&mask, link));
}

#[divan::bench(args = SIZES)]
fn holes(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let mask = walker(1, size.0, size.1).remove(0);
    bencher.bench(|| mask.holes_filled(500));
}

#[divan::bench(args = SIZES)]
fn write_png(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let mask = walker(1, size.0, size.1).remove(0);
    bencher.bench(|| mask.to_png());
}

#[divan::bench(args = SIZES)]
fn read_png(bencher: Bencher<'_, '_>, size: (usize, usize)) {
    let png = walker(1, size.0, size.1).remove(0).to_png().unwrap_or_default();
    bencher.bench(|| Mask::from_image_bytes("mask.png".as_ref(), &png));
}
