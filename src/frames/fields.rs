//! Stills of interlaced video: told by their combs, and read as the first of the two fields.
//!
//! The even rows of an interlaced frame show one moment and the odd rows another. What moved between
//! them has a comb for an outline: rows that go to and fro.

use std::path::PathBuf;

use super::decode;
use crate::image::Picture;

/// Pictures of a sequence that are looked at, evenly spread.
const LOOKED_AT: usize = 5;

/// A tooth is at least this high, levels of 255, and the rows of one field differ by less than this
/// share of it.
const TOOTH: i32 = 16;
const FIELD_SHARE: f64 = 0.4;

/// A picture is combed when so many of its pixels are in combs …
const COMBED_SHARE: f64 = 5e-4;

/// … and so many times as many as in combs that lie on their side, which only texture and noise
/// make.
const OVER_SIDEWAYS: f64 = 6.0;

/// Whether most of some pictures of the sequence are combed. One that cannot be read says nothing
/// here: the reader says what is wrong with it.
pub(super) fn are_interlaced(files: &[PathBuf]) -> bool {
    let looked_at = LOOKED_AT.min(files.len());
    let combed = (0..looked_at)
        .map(|i| (2 * i + 1) * files.len() / (2 * looked_at))
        .filter_map(|at| decode::decode(&files[at], at).ok())
        .filter(|image| is_combed(&Picture::from_dynamic(image)))
        .count();
    2 * combed > looked_at
}

fn is_combed(picture: &Picture) -> bool {
    let (w, h) = (picture.width(), picture.height());
    let luma: Vec<i32> = picture
        .rgb()
        .chunks_exact(3)
        .map(|p| (2 * i32::from(p[0]) + 5 * i32::from(p[1]) + i32::from(p[2])) / 8)
        .collect();
    let (mut upright, mut sideways) = (0_usize, 0_usize);
    for y in 0..h {
        for x in 0..w {
            let at = y * w + x;
            if y + 4 < h {
                upright += usize::from(is_comb(std::array::from_fn(|i| luma[at + i * w])));
            }
            if x + 4 < w {
                sideways += usize::from(is_comb(std::array::from_fn(|i| luma[at + i])));
            }
        }
    }
    upright as f64 > COMBED_SHARE * (w * h) as f64
        && upright as f64 > OVER_SIDEWAYS * sideways as f64
}

/// Whether five values in a row go to and fro between two levels.
fn is_comb(values: [i32; 5]) -> bool {
    let [a, b, c, d, e] = values;
    let teeth = [b - a, b - c, d - c, d - e];
    let least = teeth.iter().map(|t| t.abs()).min().unwrap_or(0);
    let same_way = teeth.iter().all(|t| *t > 0) || teeth.iter().all(|t| *t < 0);
    let within = [a - c, c - e, b - d].iter().map(|d| d.abs()).max().unwrap_or(0);
    same_way && least >= TOOTH && f64::from(within) < FIELD_SHARE * f64::from(least)
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
