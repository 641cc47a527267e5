//! Stills of interlaced video: told by their combs, and read as the first of the two fields.
//!
//! The even rows of an interlaced frame show one moment and the odd rows another. What moved between
//! them has a comb for an outline: rows that go to and fro.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rayon::prelude::*;

use super::decode;
use crate::image::Picture;

/// Pictures of a sequence that are looked at, evenly spread.
const LOOKED_AT: usize = 5;

/// A tooth is at least this high, levels of 255, and the rows of one field differ by less than so many
/// fifths of it.
const TOOTH: i16 = 16;
const FIELD_FIFTHS: i16 = 2;

/// A picture is combed when so many of its pixels are in combs …
const COMBED_SHARE: f64 = 5e-4;

/// … and so many times as many as in combs that lie on their side, which only texture and noise
/// make.
const OVER_SIDEWAYS: f64 = 6.0;

/// Pictures that were looked at are kept for the reader when they have at most so many pixels.
const KEPT_PIXELS: usize = 1 << 20;

/// What looking at some pictures of a sequence told.
pub(super) struct LookedAt {
    /// Whether most of them are combed.
    pub(super) interlaced: bool,
    /// Small ones, by their numbers, so that the reader need not decode them again.
    pub(super) pictures: BTreeMap<usize, Picture>,
}

/// Looks at some pictures of a sequence. One that cannot be read says nothing here: the reader says what is
/// wrong with it.
pub(super) fn look(files: &[PathBuf]) -> LookedAt {
    let looked_at = LOOKED_AT.min(files.len());
    // Before the first frame can be read nothing else is done, so they are looked at side by side.
    let seen: Vec<(usize, Picture, bool)> = (0..looked_at)
        .into_par_iter()
        .map(|i| (2 * i + 1) * files.len() / (2 * looked_at))
        .filter_map(|at| {
            let picture = Picture::from_dynamic(&decode::decode(&files[at], at).ok()?);
            let combed = is_combed(&picture);
            Some((at, picture, combed))
        })
        .collect();
    let interlaced = 2 * seen.iter().filter(|(.., combed)| *combed).count() > looked_at;
    let small = |picture: &Picture| picture.width() * picture.height() <= KEPT_PIXELS;
    let pictures = seen.into_iter().filter(|(_, picture, _)| small(picture));
    LookedAt { interlaced, pictures: pictures.map(|(at, picture, _)| (at, picture)).collect() }
}

fn is_combed(picture: &Picture) -> bool {
    let (w, h) = (picture.width(), picture.height());
    let luma: Vec<i16> = picture
        .rgb()
        .chunks_exact(3)
        .map(|p| (2 * i16::from(p[0]) + 5 * i16::from(p[1]) + i16::from(p[2])) / 8)
        .collect();
    // Where five values lie one behind the other, so many places apart.
    let combs = |at: usize, step: usize, length: usize| -> usize {
        if length == 0 {
            return 0;
        }
        let line = |i: usize| &luma[at + i * step..at + i * step + length];
        let [a, b, c, d, e] = [line(0), line(1), line(2), line(3), line(4)];
        (0..length).map(|x| usize::from(is_comb([a[x], b[x], c[x], d[x], e[x]]))).sum()
    };
    let upright: usize = (0..h.saturating_sub(4)).map(|y| combs(y * w, w, w)).sum();
    let sideways: usize = (0..h).map(|y| combs(y * w, 1, w.saturating_sub(4))).sum();
    upright as f64 > COMBED_SHARE * (w * h) as f64
        && upright as f64 > OVER_SIDEWAYS * sideways as f64
}

/// Whether five values in a row go to and fro between two levels. Without a jump, so that a line is looked at as vectors.
fn is_comb([a, b, c, d, e]: [i16; 5]) -> bool {
    let teeth = [b - a, b - c, d - c, d - e];
    let [least, up, down] = teeth.iter().fold([i16::MAX, 1, 1], |[least, up, down], t| {
        [least.min(t.abs()), up & i16::from(*t > 0), down & i16::from(*t < 0)]
    });
    let within = (a - c).abs().max((c - e).abs()).max((b - d).abs());
    ((up | down) == 1) & (least >= TOOTH) & (5 * within < FIELD_FIFTHS * least)
}

/// The picture of the first field: each odd row's pixel is the median of itself and the pixels above
/// and below, so that what stands still keeps its rows and the teeth of combs go.
pub(super) fn first_field(picture: &Picture) -> Option<Picture> {
    let (w, h) = (picture.width(), picture.height());
    let mut rgb = picture.rgb().to_vec();
    let row = 3 * w;
    for y in (1..h).step_by(2) {
        let above = (y - 1) * row;
        // Under the last row there is none.
        let below = if y + 1 < h { (y + 1) * row } else { above };
        for x in 0..row {
            let (a, b, c) = (rgb[above + x], rgb[y * row + x], rgb[below + x]);
            rgb[y * row + x] = b.clamp(a.min(c), a.max(c));
        }
    }
    Picture::from_rgb(w, h, rgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey picture of a bright block whose odd rows lie `apart` pixels to the right.
    fn block(apart: usize, noise: usize) -> Picture {
        let (w, h) = (80, 60);
        let value = |at: usize| {
            let (x, y) = (at % w, at / w);
            let left = 20 + apart * (y % 2);
            let inside = (left..left + 30).contains(&x) && (10..49).contains(&y);
            let grain = (at * 7919 + at / 7 * 104_729) % (noise + 1);
            (if inside { 180 } else { 60 } + grain) as u8
        };
        let grey: Vec<u8> = (0..w * h).map(value).collect();
        Picture::from_grey(w, h, &grey).unwrap()
    }

    #[test]
    fn combs_are_told_from_plain_pictures_texture_and_noise() {
        assert!(is_combed(&block(2, 0)) && is_combed(&block(1, 6)));
        assert!(!is_combed(&block(0, 0)) && !is_combed(&block(0, 90)));
        // A weave of single pixels goes to and fro both ways.
        let weave: Vec<u8> = (0..80 * 60).map(|at| ((at % 80 + at / 80) % 2 * 120) as u8).collect();
        assert!(!is_combed(&Picture::from_grey(80, 60, &weave).unwrap()));
        assert!(!is_combed(&Picture::from_grey(3, 2, &[0; 6]).unwrap()));
    }

    #[test]
    fn the_first_field_shows_its_own_moment_and_what_stands_still_stays() {
        let field = first_field(&block(3, 0)).unwrap();
        assert_eq!(field, block(0, 0));
        assert_eq!(first_field(&block(0, 0)).unwrap(), block(0, 0));
        assert!(!is_combed(&first_field(&block(2, 6)).unwrap()));
    }
}
