//! The colours that plots, sheets and page share.
//!
//! Series colours are those of Okabe and Ito, *Color Universal Design* (2008), which stay apart
//! for every common kind of colour blindness. Yellow is left out: it cannot be read on white.

/// A display-referred colour: red, green, blue.
pub(super) type Rgb = [u8; 3];

pub(super) const PAPER: Rgb = [0xff, 0xff, 0xff];
pub(super) const INK: Rgb = [0x1f, 0x29, 0x33];
pub(super) const MUTED: Rgb = [0x5f, 0x6b, 0x7a];
pub(super) const GRID: Rgb = [0xe3, 0xe7, 0xec];
/// Ground of a shaded interval: the pass band, a flagged frame.
pub(super) const SHADE: Rgb = [0xf6, 0xe3, 0xd3];
/// What the eye should find first: keys, outlines of silhouettes.
pub(super) const ACCENT: Rgb = [0xd5, 0x5e, 0x00];
/// A thing worth a word that is not wrong.
pub(super) const NOTED: Rgb = [0x00, 0x72, 0xb2];
/// A thing in the background of a plot that still carries data.
pub(super) const FAINT: Rgb = [0xa9, 0xb4, 0xc0];

pub(super) const SERIES: [Rgb; 7] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x6b, 0x4f, 0x3a],
];

/// Colour of the `index`-th series; the palette repeats after seven.
pub(super) fn series(index: usize) -> Rgb {
    SERIES[index % SERIES.len()]
}
