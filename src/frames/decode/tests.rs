use std::path::PathBuf;

use ::image::{
    ColorType, DynamicImage, GrayImage, ImageBuffer, Luma, Rgb, Rgb32FImage, RgbImage, Rgba,
    Rgba32FImage, RgbaImage,
};

use super::*;
use crate::image::Picture;

/// Colours that no codec finds easy, so that files are long enough to cut.
fn noisy(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let v = x.wrapping_mul(2_654_435_761).wrapping_add(y.wrapping_mul(40_503)) ^ (x * y * 977);
        Rgb([v as u8, (v >> 8) as u8, (v >> 16) as u8])
    })
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn on_disk(bytes: &[u8], name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn decoded(bytes: &[u8]) -> Result<DynamicImage> {
    let (_folder, path) = on_disk(bytes, "shot.0007.bin");
    decode(&path, 7)
}

fn refusal(bytes: &[u8]) -> Error {
    let error = decoded(bytes).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("shot.0007.bin") && text.contains("frame 7"), "{text}");
    assert!(error.remedy().is_some(), "{error:?}");
    error
}

#[test]
fn lossless_kinds_come_back_as_they_were() {
    let rgb = DynamicImage::from(noisy(13, 9));
    for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::WebP, ImageFormat::Bmp] {
        assert_eq!(decoded(&encoded(&rgb, format)).unwrap().to_rgb8(), rgb.to_rgb8(), "{format:?}");
    }
    let grey = DynamicImage::from(GrayImage::from_fn(5, 3, |x, y| Luma([(x * 40 + y) as u8])));
    for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::Gif] {
        let got = match format {
            ImageFormat::Gif => encoded(&grey.to_rgba8().into(), format),
            _ => encoded(&grey, format),
        };
        assert_eq!(decoded(&got).unwrap().to_luma8(), grey.to_luma8(), "{format:?}");
    }
    let alpha = DynamicImage::from(RgbaImage::from_fn(4, 4, |x, y| {
        Rgba([x as u8, y as u8, 200, (x * 60) as u8])
    }));
    for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::WebP] {
        assert_eq!(decoded(&encoded(&alpha, format)).unwrap().to_rgba8(), alpha.to_rgba8());
    }
    let deep = DynamicImage::from(ImageBuffer::from_fn(6, 2, |x, y| {
        Rgb([(x * 9_001) as u16, (y * 30_000) as u16, 65_535])
    }));
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        let got = decoded(&encoded(&deep, format)).unwrap();
        assert_eq!(got.color(), ColorType::Rgb16);
        assert_eq!(got.to_rgb16(), deep.to_rgb16());
    }
}

#[test]
fn floats_come_back_as_they_were() {
    let rgb = DynamicImage::from(Rgb32FImage::from_fn(6, 3, |x, y| {
        Rgb([x as f32 * 0.3, -(y as f32), 1.0e-3])
    }));
    for format in [ImageFormat::OpenExr, ImageFormat::Tiff] {
        assert_eq!(decoded(&encoded(&rgb, format)).unwrap().to_rgb32f(), rgb.to_rgb32f());
    }
    let rgba = DynamicImage::from(Rgba32FImage::from_fn(6, 3, |x, y| {
        Rgba([x as f32 * 0.3, y as f32, 1.0, x as f32 * 0.2])
    }));
    let got = decoded(&encoded(&rgba, ImageFormat::OpenExr)).unwrap();
    assert_eq!(got.to_rgba32f(), rgba.to_rgba32f());
}

#[test]
fn jpeg_comes_close() {
    let smooth = DynamicImage::from(RgbImage::from_fn(32, 24, |x, y| {
        Rgb([(x * 7) as u8, (y * 9) as u8, 128])
    }));
    let got = Picture::from_dynamic(&decoded(&encoded(&smooth, ImageFormat::Jpeg)).unwrap());
    let worst = got.rgb().iter().zip(smooth.to_rgb8().iter()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst.unwrap() < 40, "{worst:?}");
}

/// A file cut anywhere is an error, or it was cut behind its pixels and they are all there.
#[test]
fn half_pictures_are_never_given() {
    let image = DynamicImage::from(noisy(64, 48));
    let float = DynamicImage::from(image.to_rgb32f());
    for (format, image) in [
        (ImageFormat::Png, &image),
        (ImageFormat::Jpeg, &image),
        (ImageFormat::Tiff, &image),
        (ImageFormat::OpenExr, &float),
        (ImageFormat::WebP, &image),
        (ImageFormat::Bmp, &image),
        (ImageFormat::Gif, &image),
    ] {
        let whole = encoded(image, format);
        let right = decoded(&whole).unwrap();
        for cut in (1..40).map(|i| whole.len() * i / 40).chain([whole.len() - 1]) {
            match decoded(&whole[..cut]) {
                Ok(got) => assert!(got == right, "{format:?} cut at {cut} of {}", whole.len()),
                Err(
                    Error::PictureTruncated { frame: 7, .. }
                    | Error::PictureUndecodable { frame: 7, .. },
                ) => {}
                Err(other) => panic!("{format:?} cut at {cut}: {other:?}"),
            }
        }
        assert!(decoded(&whole[..whole.len() / 2]).is_err(), "{format:?}");
    }
}

#[test]
fn the_content_tells_the_kind() {
    let png = encoded(&noisy(4, 4).into(), ImageFormat::Png);
    let (_folder, path) = on_disk(&png, "wrong.jpg");
    assert_eq!(decode(&path, 0).unwrap().to_rgb8(), noisy(4, 4));
}

#[test]
fn empty_and_foreign_files_are_refused() {
    assert!(matches!(refusal(b""), Error::EmptyFile { frame: 7, .. }));
    assert!(matches!(refusal(b"not a picture at all"), Error::NotAPicture { frame: 7, .. }));
    // A kind the decoder library knows but this program does not read.
    assert!(matches!(refusal(b"P6\n1 1\n255\nabc"), Error::NotAPicture { .. }));
}

#[test]
fn damage_is_refused_with_the_decoders_reason() {
    let mut png = encoded(&noisy(32, 32).into(), ImageFormat::Png);
    let middle = png.len() / 2;
    png[middle] ^= 0xFF;
    assert!(matches!(refusal(&png), Error::PictureUndecodable { .. }));
}

#[test]
fn a_missing_file_is_named() {
    let error = decode(Path::new("nowhere/a.png"), 0).unwrap_err();
    assert!(matches!(&error, Error::Io { .. }));
    assert!(error.to_string().contains("nowhere/a.png"));
}

/// Headers of enormous pictures, with no pixels behind them: refused by what they say.
#[test]
fn enormous_pictures_are_refused_before_they_are_decoded() {
    let wide = DynamicImage::from(GrayImage::new(20_000, 1));
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tiff, ImageFormat::Bmp] {
        let error = refusal(&encoded(&wide, format));
        let Error::PictureTooLarge { width: 20_000, height: 1, .. } = &error else {
            panic!("{format:?}: {error:?}")
        };
        let text = error.to_string();
        assert!(text.contains("20000×1") && text.contains("16384"), "{text}");
        assert!(error.remedy().unwrap().contains("scale"), "{:?}", error.remedy());
    }
    let float = DynamicImage::from(Rgb32FImage::new(20_000, 1));
    let error = refusal(&encoded(&float, ImageFormat::OpenExr));
    assert!(matches!(error, Error::PictureTooLarge { width: 20_000, .. }));

    // A PNG of 16000 × 16000 by its header alone: within a side, beyond the pixels.
    let mut png = encoded(&GrayImage::new(1, 1).into(), ImageFormat::Png);
    png[16..24].copy_from_slice(&[0, 0, 0x3E, 0x80, 0, 0, 0x3E, 0x80]);
    let crc = png_crc(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(matches!(refusal(&png), Error::PictureTooLarge { width: 16_000, height: 16_000, .. }));
}

/// CRC-32 of a PNG chunk, bit by bit (PNG specification, annex D).
fn png_crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(
            crc ^ u32::from(byte),
            |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 },
        )
    })
}

#[test]
fn orientation_tags_turn_the_picture_upright() {
    let wide = noisy(8, 3);
    let jpeg = encoded(&wide.clone().into(), ImageFormat::Jpeg);
    // An EXIF segment behind the start marker: one entry, orientation 6 (turn 90° clockwise).
    let tiff = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
    let mut tagged = jpeg[..2].to_vec();
    tagged.extend([0xFF, 0xE1, 0, (2 + 6 + tiff.len()) as u8]);
    tagged.extend(b"Exif\0\0");
    tagged.extend(tiff);
    tagged.extend(&jpeg[2..]);
    let (plain, turned) = (decoded(&jpeg).unwrap(), decoded(&tagged).unwrap());
    assert_eq!((turned.width(), turned.height()), (3, 8));
    assert_eq!(turned.to_rgb8(), plain.rotate90().to_rgb8());
}

#[test]
fn rare_float_files_are_read_in_place_of_the_library() {
    use tiff::encoder::{TiffEncoder, colortype::Gray32Float};
    let mut grey = Cursor::new(Vec::new());
    TiffEncoder::new(&mut grey).unwrap().write_image::<Gray32Float>(2, 1, &[0.25, 3.0]).unwrap();
    let got = decoded(&grey.into_inner()).unwrap().to_rgb32f();
    assert_eq!(got.into_raw(), [0.25, 0.25, 0.25, 3.0, 3.0, 3.0]);
}
