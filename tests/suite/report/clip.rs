//! A made-up clip: 60 frames, 12 a cycle, two clean components and noisy ones.

use std::f64::consts::TAU;

use muybridge::image::Picture;
use muybridge::mask::Mask;
use muybridge::report::KeyMark;

pub(super) const FRAMES: usize = 60;
pub(super) const CYCLE: f64 = 12.4;
pub(super) const FPS: f64 = 25.0;

/// Noise that is the same on every machine: a fixed hash of the frame and the component.
fn noise(t: usize, component: usize) -> f64 {
    let word = (t as u64 * 2_654_435_761 + component as u64 * 40_503) % 1_000_003;
    ((word * 7919) % 1000) as f64 / 500.0 - 1.0
}

pub(super) fn clean(component: usize) -> Vec<f64> {
    let phase = [0.0, 0.25, 0.1, 0.4, 0.6][component];
    let turns = [1.0, 1.0, 2.0, 3.0, 0.3][component];
    let value = |t: usize| 2.0_f64.sqrt() * (TAU * (turns * t as f64 / CYCLE + phase)).cos();
    (0..FRAMES).map(value).collect()
}

pub(super) fn raw(component: usize) -> Vec<f64> {
    let share = [0.12, 0.2, 0.7, 0.8, 0.9][component];
    let mix = |(t, v): (usize, &f64)| v * (1.0 - share) + 1.6 * share * noise(t, component);
    clean(component).iter().enumerate().map(mix).collect()
}

pub(super) fn keys() -> Vec<KeyMark> {
    [(1, 2, None), (2, 17, None), (3, 21, None), (4, 50, None), (5, 27, Some(1)), (6, 42, Some(2))]
        .map(|(key, frame, partner_of)| KeyMark { key, frame, partner_of })
        .to_vec()
}

/// A four-legged shape that swings its legs.
pub(super) fn mask(width: usize, height: usize, t: usize) -> Mask {
    let (w, h) = (width as f64, height as f64);
    let swing = (TAU * t as f64 / CYCLE).sin();
    let centre = (0.42 + 0.002 * t as f64) * w;
    Mask::from_fn(width, height, |x, y| {
        let (x, y) = ((x as f64 - centre) / h, y as f64 / h);
        let body = (x / 0.3).powi(2) + ((y - 0.45) / 0.12).powi(2) < 1.0;
        let head = ((x - 0.36) / 0.09).powi(2) + ((y - 0.33) / 0.06).powi(2) < 1.0;
        let leg = |hip: f64, angle: f64| {
            let down = (y - 0.45) / 0.4;
            (0.0..1.0).contains(&down) && (x - hip - angle * down * 0.22).abs() < 0.03
        };
        body || head
            || leg(-0.2, swing)
            || leg(-0.17, -swing)
            || leg(0.2, -swing)
            || leg(0.17, swing)
    })
}

/// A meadow with the animal on it.
pub(super) fn picture(width: usize, height: usize, t: usize) -> Picture {
    let mask = mask(width, height, t);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            let grain = ((x * 31 + y * 17 + (x * y) % 13) % 23) as u8;
            rgb.extend(if mask.get(x, y) {
                [110 + grain, 70 + grain, 40]
            } else if y * 5 < height * 3 {
                [160, 190 + grain, 225]
            } else {
                [100 + 2 * grain, 140 + grain, 60]
            });
        }
    }
    Picture::from_rgb(width, height, rgb).unwrap()
}
