//! The sheets: same bytes on every run, and the picture for a person to look at when asked for.

use muybridge::image::Picture;
use muybridge::mask::Mask;
use muybridge::report::sheets::*;
use muybridge::report::{KeyMark, Png};
use muybridge::silhouette::{Flag, Flags};

use super::clip::{self, CYCLE, FPS, FRAMES};

/// Writes the picture to the folder in `MUYBRIDGE_LOOK`, for whoever changes a sheet.
pub(super) fn look(name: &str, bytes: &[u8]) {
    if let Some(folder) = std::env::var_os("MUYBRIDGE_LOOK") {
        std::fs::write(std::path::Path::new(&folder).join(name), bytes).unwrap();
    }
}

pub(super) fn contact(
    keys: &[KeyMark],
    (width, height): (usize, usize),
    with_footage: bool,
) -> Png {
    let masks: Vec<_> = keys.iter().map(|k| clip::mask(width, height, k.frame)).collect();
    let pictures: Vec<_> = keys.iter().map(|k| clip::picture(width, height, k.frame)).collect();
    let tile = |(i, &mark): (usize, &KeyMark)| KeyTile {
        mark,
        time_s: Some(mark.frame as f64 / FPS),
        picture: with_footage.then_some(&pictures[i]),
        mask: &masks[i],
    };
    let tiles: Vec<_> = keys.iter().enumerate().map(tile).collect();
    Png::encode(&contact_sheet("meadow horse: 4 keys and 2 partners", &tiles)).unwrap()
}

pub(super) fn overlay() -> Png {
    let frames = evenly_chosen(FRAMES, 12);
    let pictures: Vec<Picture> = frames.iter().map(|&t| clip::picture(960, 540, t)).collect();
    let masks: Vec<_> = frames
        .iter()
        .map(|&t| if t == 32 { Mask::new(960, 540) } else { clip::mask(960, 540, t) })
        .collect();
    let tiles: Vec<_> = (0..frames.len())
        .map(|i| FrameTile {
            frame: frames[i],
            time_s: Some(frames[i] as f64 / FPS),
            picture: Some(&pictures[i]),
            mask: &masks[i],
            confidence: Some(1.0 - i as f64 / 20.0),
            flags: match i {
                3 => Flag::AreaJump.into(),
                5 => Flags::from(Flag::Corrected).with(Flag::SeveralPieces),
                _ => Flags::NONE,
            },
        })
        .collect();
    Png::encode(&overlay_sheet("meadow horse: silhouettes", &tiles)).unwrap()
}

/// Mean of the masks, and the mean varied by the part that goes with the phase.
pub(super) fn eigen() -> Png {
    let (width, height) = (160_u32, 90_u32);
    let average = |weight: &dyn Fn(usize) -> f64| {
        let mut sum = vec![0.0; (width * height) as usize];
        for t in 0..FRAMES {
            let mask = clip::mask(width as usize, height as usize, t);
            for (i, s) in sum.iter_mut().enumerate() {
                if mask.get(i % width as usize, i / width as usize) {
                    *s += weight(t);
                }
            }
        }
        let bytes =
            sum.iter().map(|s| (255.0 * s / FRAMES as f64).clamp(0.0, 255.0) as u8).collect();
        ::image::GrayImage::from_raw(width, height, bytes).unwrap()
    };
    let mean = average(&|_| 1.0);
    let varied: Vec<_> = (1..4)
        .map(|c| {
            let wave = move |t: usize| (std::f64::consts::TAU * c as f64 * t as f64 / CYCLE).sin();
            (average(&|t| 1.0 - 1.4 * wave(t)), average(&|t| 1.0 + 1.4 * wave(t)))
        })
        .collect();
    let rows: Vec<_> = varied
        .iter()
        .enumerate()
        .map(|(i, (minus, plus))| EigenRow {
            component: i + 1,
            variance_share: [0.311, 0.199, 0.11][i],
            minus,
            plus,
        })
        .collect();
    Png::encode(&eigen_sheet("meadow horse: eigen-silhouettes", &mean, &rows, 2.0)).unwrap()
}

#[test]
fn sheets_are_the_same_on_every_run() {
    for (name, make) in [
        ("contact.png", (&|| contact(&clip::keys(), (960, 540), true)) as &dyn Fn() -> Png),
        ("overlay.png", &overlay),
        ("eigen.png", &eigen),
    ] {
        let first = make();
        assert!(first == make(), "{name}");
        look(name, first.bytes());
    }
}

#[test]
fn sheets_can_be_made_of_any_clip() {
    let many: Vec<KeyMark> =
        (1..=16).map(|key| KeyMark { key, frame: 3 * key, partner_of: None }).collect();
    for (name, keys, size, footage) in [
        ("contact_sixteen.png", &many[..], (640, 360), true),
        ("contact_tiny.png", &many[..4], (90, 34), true),
        ("contact_tall.png", &many[..5], (200, 900), true),
        ("contact_no_footage.png", &clip::keys(), (320, 180), false),
    ] {
        let png = contact(keys, size, footage);
        look(name, png.bytes());
        let sheet = ::image::load_from_memory(png.bytes()).unwrap();
        assert!(sheet.width() <= 2400 && sheet.height() <= 4000, "{name}");
    }
    let (picture, mask) = (clip::picture(960, 540, 5), clip::mask(480, 270, 5));
    let mark = KeyMark { key: 1, frame: 5, partner_of: None };
    let image = key_image(&KeyTile { mark, time_s: None, picture: Some(&picture), mask: &mask });
    look("key_image.png", Png::encode(&image).unwrap().bytes());
    assert_eq!((image.width(), image.height()), (960, 540));
}

/// Muybridge's camel: frames of 400 × 224 pixels, masks of 300 × 168.
#[test]
fn masks_of_another_size_lie_over_real_footage() {
    let data = std::env::var_os("MUYBRIDGE_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let folder = data.join("video/muybridge/camel_gallop");
    if !folder.is_dir() {
        eprintln!("skipped: no {}", folder.display());
        return;
    }
    let open = |name: String| ::image::open(folder.join(name)).unwrap();
    let frames = [0, 3, 6, 9];
    let pictures: Vec<Picture> = frames
        .iter()
        .map(|t| open(format!("frames/{t:05}.jpg")).to_rgb8())
        .map(|i| Picture::from_rgb(i.width() as usize, i.height() as usize, i.into_raw()).unwrap())
        .collect();
    let masks: Vec<_> = frames
        .iter()
        .map(|t| open(format!("masks/{t:05}.png")).to_luma8())
        .map(|i| {
            let inside = |x: usize, y: usize| i.get_pixel(x as u32, y as u32)[0] >= 128;
            Mask::from_fn(i.width() as usize, i.height() as usize, inside)
        })
        .collect();
    assert!(masks.iter().all(|m| m.area() > 500));
    let tiles: Vec<_> = (0..4)
        .map(|i| KeyTile {
            mark: KeyMark { key: i + 1, frame: frames[i], partner_of: None },
            time_s: None,
            picture: Some(&pictures[i]),
            mask: &masks[i],
        })
        .collect();
    let sheet = contact_sheet("camel", &tiles);
    look("contact_camel.png", Png::encode(&sheet).unwrap().bytes());
    let image = key_image(&tiles[0]);
    look("key_camel.png", Png::encode(&image).unwrap().bytes());
    // The footage is all greys: only the outline is bright and coloured.
    let lit = sheet.rgb().chunks(3).filter(|p| p[2] > 200 && p[0] < 80).count();
    assert!(lit > 4 * 500, "{lit}");
}
