//! Strokes on footage and repainted masks: what they hold, how far they reach, and that what they
//! cannot reach is not made again, with the same bytes as if all were.

use std::fs;
use std::path::Path;

use image::{Rgba, RgbaImage};
use muybridge::mask::Mask;
use muybridge::synthetic::{Gait, SyntheticFootage, SyntheticSettings};

use crate::shot_folder::Desk;

const WHITE: Rgba<u8> = Rgba([255; 4]);
const BLACK: Rgba<u8> = Rgba([0, 0, 0, 255]);

fn shot(desk: &Desk, name: &str) {
    desk.run(&format!("-q new {name} --from synthetic:gallop --frames 0-39")).success();
}

fn mask(desk: &Desk, shot: &str, frame: usize) -> Mask {
    let path = desk.path(&format!("{shot}/masks/{frame:06}.png"));
    Mask::from_image_bytes(&path, &fs::read(&path).unwrap()).unwrap()
}

/// A white stroke inside the animal and a black one above it, on a transparent picture.
fn stroke(desk: &Desk, shot: &str, frame: usize, like: &Mask) {
    let bounds = like.bounds().unwrap();
    let middle = (bounds.top + bounds.bottom) / 2;
    let mut picture = RgbaImage::new(like.width() as u32, like.height() as u32);
    for x in bounds.left..=bounds.right {
        picture.put_pixel(x as u32, bounds.top.saturating_sub(9) as u32, BLACK);
        if like.get(x, middle) {
            picture.put_pixel(x as u32, middle as u32, WHITE);
        }
    }
    let folder = desk.path(&format!("{shot}/strokes"));
    fs::create_dir_all(&folder).unwrap();
    picture.save(folder.join(format!("{frame:06}.png"))).unwrap();
}

fn masks_and_tables(desk: &Desk, shot: &str) -> Vec<(String, Vec<u8>)> {
    let mut files = desk.files(shot);
    files.retain(|(name, _)| name.starts_with("masks") || name.starts_with("analysis"));
    files
}

fn same(desk: &Desk, one: &str, other: &str) {
    let (a, b) = (masks_and_tables(desk, one), masks_and_tables(desk, other));
    assert!(a.len() > 40 && a.len() == b.len(), "{} and {} files", a.len(), b.len());
    for ((name, left), (_, right)) in a.iter().zip(&b) {
        assert!(left == right, "{name} differs between {one} and {other}");
    }
}

fn changed(before: &[(String, Vec<u8>)], after: &[(String, Vec<u8>)]) -> Vec<usize> {
    let frame = |name: &str| Path::new(name).file_stem()?.to_str()?.parse().ok();
    let differ = before.iter().zip(after).filter(|(a, b)| a != b);
    differ.filter_map(|(a, _)| frame(&a.0)).collect()
}

#[test]
fn a_stroke_holds_where_it_is_and_changes_no_frame_beyond_the_next_one() {
    let desk = Desk::new();
    shot(&desk, "shot");
    assert_eq!(desk.json("segment shot")["made"], 40);
    let like = mask(&desk, "shot", 12);
    let plain = masks_and_tables(&desk, "shot");

    stroke(&desk, "shot", 12, &like);
    assert_eq!(desk.json("segment shot")["made"], 40);
    let first = masks_and_tables(&desk, "shot");
    let held = mask(&desk, "shot", 12);
    let bounds = like.bounds().unwrap();
    let middle = (bounds.top + bounds.bottom) / 2;
    for x in bounds.left..=bounds.right {
        assert!(!held.get(x, bounds.top.saturating_sub(9)), "drawn as background");
        assert!(held.get(x, middle) || !like.get(x, middle), "drawn as animal");
    }

    stroke(&desk, "shot", 30, &mask(&desk, "shot", 30));
    let summary = desk.json("segment shot");
    assert_eq!(summary["made"], 27, "from behind the first stroke on");
    let second = masks_and_tables(&desk, "shot");
    let reached = changed(&first, &second);
    assert!(reached.iter().all(|&t| t > 12), "{reached:?}");
    assert!(summary["silhouettes"][30]["flags"].as_array().unwrap().contains(&"corrected".into()));

    // The same in a shot where nothing was kept.
    shot(&desk, "fresh");
    fs::create_dir(desk.path("fresh/strokes")).unwrap();
    for frame in [12, 30] {
        let name = format!("strokes/{frame:06}.png");
        fs::copy(desk.path("shot").join(&name), desk.path("fresh").join(&name)).unwrap();
    }
    assert_eq!(desk.json("segment fresh")["made"], 40);
    same(&desk, "shot", "fresh");

    // Taken back, nothing is left of them.
    for frame in [12, 30] {
        fs::remove_file(desk.path(&format!("shot/strokes/{frame:06}.png"))).unwrap();
    }
    desk.run("-q segment shot").success();
    assert!(masks_and_tables(&desk, "shot") == plain);
}

#[test]
fn a_repainted_mask_is_kept_and_what_was_lost_meanwhile_is_made_again() {
    let desk = Desk::new();
    shot(&desk, "shot");
    desk.run("-q segment shot").success();
    let paint = |shot: &str| {
        let bounds = mask(&desk, shot, 20).bounds().unwrap();
        let painted = Mask::from_fn(320, 240, |x, y| {
            (bounds.left..=bounds.right).contains(&x) && (bounds.top..=bounds.bottom).contains(&y)
        });
        let path = desk.path(&format!("{shot}/masks/000020.png"));
        fs::write(path, painted.to_png().unwrap()).unwrap();
        painted
    };
    let painted = paint("shot");
    let summary = desk.json("segment shot");
    assert_eq!(summary["kept"][0], "masks/000020.png");
    assert_eq!(mask(&desk, "shot", 20), painted);
    assert_eq!(desk.json("segment shot")["ran"], false, "the painted mask is still known as such");
    assert_eq!(desk.json("segment shot")["kept"][0], "masks/000020.png");
    shot(&desk, "fresh");
    desk.run("-q segment fresh").success();
    paint("fresh");
    desk.run("-q segment fresh").success();
    same(&desk, "shot", "fresh");

    fs::remove_file(desk.path("shot/masks/000003.png")).unwrap();
    let summary = desk.json("segment shot");
    // Frame 3 itself, and frame 20, which was painted and costs nothing.
    assert!(summary["made"].as_u64().unwrap() <= 2, "{}", summary["made"]);
    same(&desk, "shot", "fresh");

    fs::remove_dir_all(desk.path("shot/.muybridge/drafts")).unwrap();
    assert_eq!(desk.json("segment shot")["made"], 40);
    same(&desk, "shot", "fresh");
}

/// Overlap with the truth of one frame.
fn overlap(desk: &Desk, shot: &str, frame: usize) -> f64 {
    let truth = SyntheticFootage::new(Gait::Gallop, SyntheticSettings::default());
    mask(desk, shot, frame).jaccard(&truth.true_mask(frame))
}

#[test]
fn the_true_mask_of_the_worst_frame_holds_and_makes_no_frame_worse() {
    let desk = Desk::new();
    shot(&desk, "shot");
    desk.run("-q segment shot").success();
    let each = || -> Vec<f64> { (0..40).map(|t| overlap(&desk, "shot", t)).collect() };
    let before = each();
    let worst = (0..40).min_by(|&a, &b| before[a].total_cmp(&before[b])).unwrap();
    assert!(before[worst] < 1.0, "the footage is too easy to correct anything");
    let truth = SyntheticFootage::new(Gait::Gallop, SyntheticSettings::default()).true_mask(worst);
    let file = format!("shot/masks/{worst:06}.png");
    fs::write(desk.path(&file), truth.to_png().unwrap()).unwrap();
    assert_eq!(desk.json("segment shot")["made"], 40, "one correction reaches all");
    let after = each();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    eprintln!(
        "mean overlap {:.4}, with frame {worst} ({:.4}) true {:.4}",
        mean(&before),
        before[worst],
        mean(&after)
    );
    assert_eq!(after[worst], 1.0);
    for (t, (before, after)) in before.iter().zip(&after).enumerate() {
        assert!(*after > before - 0.03, "frame {t}: {before:.3} to {after:.3}");
    }
}

#[test]
fn strokes_are_numbered_as_the_footage_is_and_those_beyond_the_range_say_nothing() {
    let desk = Desk::new();
    desk.run("-q new shot --from synthetic:gallop --frames 10-29").success();
    desk.run("-q segment shot").success();
    let plain = masks_and_tables(&desk, "shot");
    let like = mask(&desk, "shot", 5);
    for beyond in [3, 30, 300] {
        stroke(&desk, "shot", beyond, &like);
    }
    desk.run("-q segment shot").success();
    assert!(masks_and_tables(&desk, "shot") == plain);
    stroke(&desk, "shot", 15, &like);
    let lines = desk.json("segment shot")["silhouettes"].clone();
    let corrected = |t: usize| lines[t]["flags"].as_array().unwrap().contains(&"corrected".into());
    assert_eq!((0..20).filter(|t| corrected(*t)).collect::<Vec<_>>(), [5]);
    let (bounds, held) = (like.bounds().unwrap(), mask(&desk, "shot", 5));
    assert!(!held.get(bounds.left, bounds.top.saturating_sub(9)));
}

#[test]
fn strokes_of_another_size_are_refused_by_name() {
    let desk = Desk::new();
    shot(&desk, "shot");
    stroke(&desk, "shot", 12, &Mask::from_fn(64, 48, |x, y| x > 20 && y > 20));
    let said = desk.complaint("segment shot", 1);
    assert!(said.contains("000012.png") && said.contains("64") && said.contains("320"), "{said}");
    assert!(!desk.path("shot/masks/000000.png").exists(), "nothing is made of half a reading");
}

#[test]
fn a_mask_painted_empty_takes_its_frame_out_and_no_other() {
    let desk = Desk::new();
    shot(&desk, "shot");
    desk.run("-q segment shot").success();
    let plain = masks_and_tables(&desk, "shot");
    let nothing = Mask::new(320, 240).to_png().unwrap();
    fs::write(desk.path("shot/masks/000007.png"), nothing).unwrap();
    let summary = desk.json("segment shot");
    let flags = &summary["silhouettes"][7]["flags"];
    assert!(flags.as_array().unwrap().contains(&"empty".into()), "{flags}");
    let masks_only = |all: &[(String, Vec<u8>)]| -> Vec<(String, Vec<u8>)> {
        all.iter().filter(|f| f.0.starts_with("masks")).cloned().collect()
    };
    let now = masks_and_tables(&desk, "shot");
    assert_eq!(changed(&masks_only(&plain), &masks_only(&now)), [7]);
    assert_eq!(desk.json("analyze shot")["bad_frames"], serde_json::json!([7]));
}

#[test]
fn by_colour_alone_a_stroke_holds_on_its_frame_and_changes_no_other() {
    let desk = Desk::new();
    shot(&desk, "shot");
    let settings = fs::read_to_string(desk.path("shot/shot.toml")).unwrap();
    assert!(settings.contains("method = \"plate\""), "{settings}");
    fs::write(
        desk.path("shot/shot.toml"),
        settings.replace("method = \"plate\"", "method = \"colour\""),
    )
    .unwrap();
    desk.run("-q segment shot").success();
    let plain = masks_and_tables(&desk, "shot");
    let like = mask(&desk, "shot", 12);
    stroke(&desk, "shot", 12, &like);
    let lines = desk.json("segment shot")["silhouettes"].clone();
    assert!(lines[12]["flags"].as_array().unwrap().contains(&"corrected".into()));
    let bounds = like.bounds().unwrap();
    let held = mask(&desk, "shot", 12);
    assert!(!held.get(bounds.left, bounds.top.saturating_sub(9)));
    let masks_only = |all: Vec<(String, Vec<u8>)>| -> Vec<(String, Vec<u8>)> {
        all.into_iter().filter(|f| f.0.starts_with("masks")).collect()
    };
    let reached = changed(&masks_only(plain), &masks_only(masks_and_tables(&desk, "shot")));
    assert!(reached.iter().all(|t| *t == 12), "{reached:?}");
}
