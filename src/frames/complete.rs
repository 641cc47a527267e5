//! Does a JPEG or GIF file reach its own end?
//!
//! Decoders of these formats fill what is missing with grey or stop early without a word, so a
//! file that was cut off while copying would pass as a picture. Both formats say where they end;
//! walking their blocks, without decoding, tells whether the file gets there.

/// Whether the marker segments of a JPEG file (ITU-T T.81, annex B) lead to the end-of-image
/// marker. Bytes behind it do not matter.
pub(super) fn jpeg_is_complete(bytes: &[u8]) -> bool {
    walk_jpeg(bytes).is_some()
}

fn walk_jpeg(bytes: &[u8]) -> Option<()> {
    const END_OF_IMAGE: u8 = 0xD9;
    let mut at = 2; // behind the start-of-image marker
    loop {
        let marker = loop {
            // Fill bytes 0xFF may stand before any marker; stray bytes are skipped as decoders do.
            let byte = *bytes.get(at)?;
            at += 1;
            if byte == 0xFF {
                match *bytes.get(at)? {
                    0x00 => at += 1,
                    0xFF => {}
                    marker => {
                        at += 1;
                        break marker;
                    }
                }
            }
        };
        match marker {
            END_OF_IMAGE => return Some(()),
            0x01 | 0xD0..=0xD8 => {}
            _ => {
                let length = u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]);
                // After a start of scan the coded data follow; the search above runs through them,
                // because in them 0xFF is always followed by 0x00 or is a restart marker.
                at += usize::from(length).max(2);
            }
        }
    }
}

/// Display times of a GIF's frames in hundredths of a second, one a frame, or `None` when the file
/// ends before its trailer (GIF89a specification, section 27).
pub(super) fn gif_delays_cs(bytes: &[u8]) -> Option<Vec<u16>> {
    let mut walk = GifWalk { bytes, at: 6 };
    walk.skip(4)?; // size of the canvas
    let flags = walk.byte()?;
    walk.skip(2)?;
    walk.skip_color_table(flags)?;
    let mut delays = Vec::new();
    let mut delay = 0;
    loop {
        match walk.byte()? {
            0x3B => return Some(delays),
            0x2C => {
                walk.skip(8)?;
                let flags = walk.byte()?;
                walk.skip_color_table(flags)?;
                walk.skip(1)?;
                walk.skip_blocks()?;
                delays.push(std::mem::take(&mut delay));
            }
            0x21 => {
                if walk.byte()? == 0xF9 {
                    let block = bytes.get(walk.at..walk.at + 4)?;
                    delay = u16::from_le_bytes([block[2], block[3]]);
                }
                walk.skip_blocks()?;
            }
            _ => {} // padding between blocks; decoders skip it too
        }
    }
}

struct GifWalk<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl GifWalk<'_> {
    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.at += count;
        (self.at <= self.bytes.len()).then_some(())
    }

    fn skip_color_table(&mut self, flags: u8) -> Option<()> {
        if flags & 0x80 == 0 { Some(()) } else { self.skip(3 << ((flags & 7) + 1)) }
    }

    fn skip_blocks(&mut self) -> Option<()> {
        loop {
            match self.byte()? {
                0 => return Some(()),
                length => self.skip(usize::from(length))?,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use ::image::codecs::{gif::GifEncoder, jpeg::JpegEncoder};
    use ::image::{Delay, Frame, RgbImage, RgbaImage};

    use super::*;

    #[test]
    fn a_jpeg_cut_anywhere_is_incomplete() {
        let mut bytes = Vec::new();
        let image = RgbImage::from_fn(40, 30, |x, y| ::image::Rgb([x as u8 * 6, y as u8 * 8, 77]));
        JpegEncoder::new(&mut bytes).encode_image(&image).unwrap();
        assert!(jpeg_is_complete(&bytes));
        for length in 0..bytes.len() {
            assert!(!jpeg_is_complete(&bytes[..length]), "cut at {length} of {}", bytes.len());
        }
        bytes.extend([1, 2, 3]);
        assert!(jpeg_is_complete(&bytes));
    }

    #[test]
    fn a_gif_cut_anywhere_is_incomplete() {
        let mut bytes = Vec::new();
        {
            let mut encoder = GifEncoder::new(&mut bytes);
            for i in 0..3 {
                let frame = RgbaImage::from_pixel(9, 7, ::image::Rgba([i * 50, 9, 9, 255]));
                let delay = Delay::from_numer_denom_ms(40 + 10 * u32::from(i), 1);
                encoder.encode_frame(Frame::from_parts(frame, 0, 0, delay)).unwrap();
            }
        }
        assert_eq!(gif_delays_cs(&bytes), Some(vec![4, 5, 6]));
        for length in 0..bytes.len() {
            assert_eq!(gif_delays_cs(&bytes[..length]), None, "cut at {length}");
        }
    }
}
