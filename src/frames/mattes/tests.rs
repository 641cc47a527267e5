use std::fs;

use ::image::{
    GrayAlphaImage, GrayImage, ImageBuffer, Luma, LumaA, Rgb, Rgb32FImage, RgbImage, Rgba,
    Rgba32FImage, RgbaImage,
};
use proptest::prelude::*;

use super::*;
use crate::error::Error;

fn spec(location: &Path) -> MatteSpec {
    MatteSpec { location: location.to_owned(), frames: None, invert: false, size: None }
}

/// Every alpha and colour rule on one row of pixels.
#[test]
fn half_of_full_is_inside_at_every_depth() {
    let rows: [(DynamicImage, &[bool]); 8] = [
        (GrayImage::from_vec(3, 1, vec![127, 128, 255]).unwrap().into(), &[false, true, true]),
        (
            ImageBuffer::<Luma<u16>, _>::from_vec(3, 1, vec![32_767, 32_768, 0]).unwrap().into(),
            &[false, true, false],
        ),
        (
            Rgb32FImage::from_fn(4, 1, |x, _| Rgb([[0.499, 0.5, 7.0, f32::NAN][x as usize]; 3]))
                .into(),
            &[false, true, true, false],
        ),
        // Alpha that says something wins over colour.
        (
            RgbaImage::from_fn(2, 1, |x, _| Rgba([255, 255, 255, [127, 128][x as usize]])).into(),
            &[false, true],
        ),
        (
            Rgba32FImage::from_fn(2, 1, |x, _| Rgba([0.0, 0.0, 0.0, [0.4, 0.5][x as usize]]))
                .into(),
            &[false, true],
        ),
        (
            ImageBuffer::<LumaA<u16>, _>::from_fn(2, 1, |x, _| {
                LumaA([0, [32_767, 32_768][x as usize]])
            })
            .into(),
            &[false, true],
        ),
        // Alpha opaque everywhere says nothing.
        (
            GrayAlphaImage::from_fn(2, 1, |x, _| LumaA([[10, 200][x as usize], 255])).into(),
            &[false, true],
        ),
        // Alpha transparent everywhere is an empty silhouette, whatever the hidden colour.
        (RgbaImage::from_pixel(2, 1, Rgba([255, 255, 255, 0])).into(), &[false, false]),
    ];
    for (image, inside) in rows {
        assert_eq!(coverage(&image), inside, "{:?}", image.color());
    }
}

#[test]
fn luminance_weighs_colours_by_rec_709() {
    // Green alone is bright, red and blue alone or together are not.
    let image = RgbImage::from_vec(4, 1, vec![0, 255, 0, 255, 0, 0, 0, 0, 255, 255, 0, 255]);
    assert_eq!(coverage(&image.unwrap().into()), [true, false, false, false]);
}

#[test]
fn one_bit_and_palette_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    // A 1-bit grey PNG and a 2-colour palette BMP of 9 × 2 pixels: first row 101010101, then black.
    let png = one_bit_png(9, &[0b1010_1010, 0b1000_0000, 0, 0]);
    fs::write(folder.path().join("a1.png"), png).unwrap();
    fs::write(folder.path().join("a2.bmp"), one_bit_bmp()).unwrap();
    let expected: Vec<bool> = (0..18).map(|i| i < 9 && i % 2 == 0).collect();
    for matte in open(&spec(folder.path())).unwrap() {
        let matte = matte.unwrap();
        assert_eq!((matte.width, matte.height), (9, 2));
        assert_eq!(matte.inside, expected, "{}", matte.file.display());
    }
}

/// A PNG of bit depth 1 with stored (uncompressed) data, assembled by hand.
fn one_bit_png(width: u8, rows: &[u8]) -> Vec<u8> {
    let crc =
        |bytes: &[u8]| -> u32 {
            !bytes.iter().fold(!0_u32, |crc, &b| {
                (0..8).fold(crc ^ u32::from(b), |c, _| {
                    if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 }
                })
            })
        };
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8], data: &[u8]| {
        png.extend((data.len() as u32).to_be_bytes());
        let body = [kind, data].concat();
        png.extend(&body);
        png.extend(crc(&body).to_be_bytes());
    };
    let height = (rows.len() / 2) as u8;
    chunk(b"IHDR", &[0, 0, 0, width, 0, 0, 0, height, 1, 0, 0, 0, 0]);
    let raw: Vec<u8> = rows.chunks(2).flat_map(|row| [0, row[0], row[1]]).collect();
    let length = raw.len() as u16;
    let mut zlib = vec![0x78, 0x01, 1];
    zlib.extend(length.to_le_bytes());
    zlib.extend((!length).to_le_bytes());
    zlib.extend(&raw);
    let (a, b) = raw.iter().fold((1_u32, 0_u32), |(a, b), &v| {
        let a = (a + u32::from(v)) % 65_521;
        (a, (b + a) % 65_521)
    });
    zlib.extend((b << 16 | a).to_be_bytes());
    chunk(b"IDAT", &zlib);
    chunk(b"IEND", &[]);
    png
}

fn one_bit_bmp() -> Vec<u8> {
    let mut bmp = b"BM".to_vec();
    bmp.extend(70_u32.to_le_bytes());
    bmp.extend([0; 4]);
    bmp.extend(62_u32.to_le_bytes());
    bmp.extend(40_u32.to_le_bytes());
    bmp.extend(9_u32.to_le_bytes());
    bmp.extend(2_u32.to_le_bytes());
    bmp.extend([1, 0, 1, 0]);
    bmp.extend([0; 24]);
    bmp.extend([0, 0, 0, 0, 255, 255, 255, 0]);
    // Rows from the bottom up, padded to four bytes.
    bmp.extend([0, 0, 0, 0, 0b1010_1010, 0b1000_0000, 0, 0]);
    bmp
}

#[test]
fn mattes_come_in_natural_order_with_their_place_as_frame() {
    let folder = tempfile::tempdir().unwrap();
    for (name, value) in [("m10.png", 255), ("m9.png", 0), ("m2.png", 255)] {
        GrayImage::from_pixel(2, 2, Luma([value])).save(folder.path().join(name)).unwrap();
    }
    let mattes: Vec<Matte> = open(&spec(folder.path())).unwrap().collect::<Result<_>>().unwrap();
    let seen: Vec<_> = mattes.iter().map(|m| (m.frame, m.inside[0])).collect();
    assert_eq!(seen, [(0, true), (1, false), (2, true)]);
    assert!(mattes[0].file.ends_with("m2.png"));

    let range = Some(FrameRange::new(1, 2).unwrap());
    let part: Vec<Matte> = open(&MatteSpec { frames: range, invert: true, ..spec(folder.path()) })
        .unwrap()
        .collect::<Result<_>>()
        .unwrap();
    let seen: Vec<_> = part.iter().map(|m| (m.frame, m.inside[0])).collect();
    assert_eq!(seen, [(1, true), (2, false)]);
}

#[test]
fn mattes_of_another_size_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    GrayImage::new(4, 3).save(folder.path().join("a1.png")).unwrap();
    GrayImage::new(3, 4).save(folder.path().join("a2.png")).unwrap();
    let results: Vec<_> = open(&spec(folder.path())).unwrap().collect();
    assert!(results[0].is_ok());
    let text = results[1].as_ref().unwrap_err().to_string();
    assert!(matches!(results[1], Err(Error::SizeMismatch { frame: 1, .. })));
    assert!(text.contains("a2.png") && text.contains("3×4") && text.contains("4×3"), "{text}");

    let of_footage = MatteSpec { size: Some((3, 4)), ..spec(folder.path()) };
    let first = open(&of_footage).unwrap().next().unwrap();
    assert!(matches!(first, Err(Error::SizeMismatch { frame: 0, .. })));
}

proptest! {
    #[test]
    fn invert_swaps_every_pixel(values in prop::collection::vec(any::<u8>(), 12)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.png");
        GrayImage::from_vec(4, 3, values).unwrap().save(&path).unwrap();
        let plain = open(&spec(&path)).unwrap().next().unwrap().unwrap().inside;
        let inverted = MatteSpec { invert: true, ..spec(&path) };
        let swapped = open(&inverted).unwrap().next().unwrap().unwrap().inside;
        prop_assert!(plain.iter().zip(&swapped).all(|(a, b)| a != b));
    }
}
