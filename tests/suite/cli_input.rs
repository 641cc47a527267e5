//! Bad input: the message names the file and the frame, and nothing half-made stays behind.

use std::fs;

use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage};

use crate::shot_folder::Desk;

const RECTANGLES: &str = "--foreground 2,2,8,8 --background 20,2,8,8";

/// A folder of `count` small pictures.
fn pictures(desk: &Desk, folder: &str, count: u32) {
    fs::create_dir_all(desk.path(folder)).unwrap();
    for i in 0..count {
        let picture =
            RgbImage::from_fn(32, 24, |x, y| Rgb([(x * 8) as u8, (y * 10) as u8, i as u8]));
        picture.save(desk.path(&format!("{folder}/f_{i:03}.png"))).unwrap();
    }
}

#[test]
fn wrong_usage_ends_with_2() {
    let desk = Desk::new();
    pictures(&desk, "in", 3);
    desk.complaint("new shot", 2);
    desk.complaint("frobnicate", 2);
    let said = desk.complaint("new shot --from in --foreground 1,2,3", 2);
    assert!(said.contains("--foreground") && said.contains("left,top,width,height"), "{said}");
    desk.complaint("validate --keys x", 2);
    desk.complaint("validate --size 0x9", 2);
    assert!(!desk.path("shot").exists());
}

#[test]
fn sources_that_are_none() {
    let desk = Desk::new();
    let said = desk.complaint("new shot --from nowhere", 1);
    assert!(said.contains("nowhere"), "{said}");
    fs::create_dir(desk.path("empty")).unwrap();
    let said = desk.complaint("new shot --from empty", 1);
    assert!(said.contains("empty") && said.contains("hint:"), "{said}");
    let said = desk.complaint("new shot --from synthetic:hop", 1);
    assert!(said.contains("hop") && said.contains("gallop"), "{said}");
    let said = desk.complaint("run shot", 1);
    assert!(said.contains("shot") && said.contains("muybridge new"), "{said}");
    assert!(!desk.path("shot").exists());
}

#[test]
fn frame_rates_ranges_and_rectangles() {
    let desk = Desk::new();
    pictures(&desk, "in", 3);
    for rate in ["0", "NaN", "-5", "inf"] {
        let said = desk.complaint(&format!("new shot --from in --fps={rate} {RECTANGLES}"), 1);
        assert!(said.contains("frames a second"), "{rate}: {said}");
    }
    let said = desk.complaint("new shot --from in --frames 5-9", 1);
    assert!(said.contains('5') && said.contains('9') && said.contains('3'), "{said}");
    desk.complaint("new shot --from in --frames 9-5", 1);
    let said = desk.complaint("new shot --from in --foreground 30,2,8,8 --background 1,1,4,4", 1);
    assert!(said.contains("foreground") && said.contains("32 × 24"), "{said}");
    let said = desk.complaint("new shot --from in --foreground 2,2,8,8 --background 1,1,40,4", 1);
    assert!(said.contains("background"), "{said}");
    assert!(!desk.path("shot").exists());
}

#[test]
fn damaged_pictures_are_named_with_their_frame() {
    let desk = Desk::new();
    pictures(&desk, "in", 6);
    desk.run(&format!("new shot --from in --fps 25 {RECTANGLES}")).success();
    let good = fs::read(desk.path("in/f_004.png")).unwrap();
    let cases: [(&str, Vec<u8>); 3] = [
        ("truncated", good[..good.len() / 2].to_vec()),
        ("empty", Vec::new()),
        ("text", b"this is no picture".to_vec()),
    ];
    for (case, bytes) in cases {
        fs::write(desk.path("in/f_004.png"), bytes).unwrap();
        let said = desk.complaint("segment shot", 1);
        assert!(said.contains("f_004.png") && said.contains("frame 4"), "{case}: {said}");
        assert!(said.contains("hint:"), "{case}: {said}");
        assert!(!desk.path("shot/masks").exists(), "{case}");
    }
    // Another size.
    RgbImage::new(30, 24).save(desk.path("in/f_004.png")).unwrap();
    let said = desk.complaint("segment shot", 1);
    assert!(said.contains("f_004.png") && said.contains("frame 4"), "{said}");
    assert!(said.contains("30") && said.contains("32"), "{said}");
    // Mended, it goes on.
    fs::write(desk.path("in/f_004.png"), good).unwrap();
    desk.run("segment shot").success();
}

#[test]
fn a_picture_of_twenty_thousand_pixels_is_refused_before_it_is_decoded() {
    let desk = Desk::new();
    fs::create_dir(desk.path("in")).unwrap();
    DynamicImage::ImageLuma8(GrayImage::from_pixel(20_000, 2, Luma([9])))
        .save(desk.path("in/wide.png"))
        .unwrap();
    let said = desk.complaint("new shot --from in", 1);
    assert!(
        said.contains("wide.png") && said.contains("20000") && said.contains("16384"),
        "{said}"
    );
}

#[test]
fn footage_without_rectangles_and_masks_without_an_animal() {
    let desk = Desk::new();
    pictures(&desk, "in", 5);
    desk.run("new shot --from in --fps 25").success();
    let said = desk.complaint("run shot", 1);
    assert!(said.contains("rectangle") && said.contains("--foreground"), "{said}");

    fs::create_dir(desk.path("black")).unwrap();
    for i in 0..6 {
        GrayImage::new(20, 10).save(desk.path(&format!("black/{i}.png"))).unwrap();
    }
    desk.run("new dark --mattes black --fps 25").success();
    let said = desk.complaint("run dark", 1);
    assert!(said.contains("all 6 masks are empty"), "{said}");

    fs::create_dir(desk.path("still")).unwrap();
    let disc = GrayImage::from_fn(40, 40, |x, y| {
        Luma([if x.abs_diff(20) + y.abs_diff(20) < 9 { 255 } else { 0 }])
    });
    for i in 0..6 {
        disc.save(desk.path(&format!("still/{i}.png"))).unwrap();
    }
    desk.run("new stone --mattes still --fps 25").success();
    let said = desk.complaint("run stone", 1);
    assert!(said.contains("nothing moves"), "{said}");
}

#[test]
fn edited_files_that_make_no_sense() {
    let desk = Desk::new();
    desk.run("render --clip gallop --frames 40 --noise 0 --out mattes").success();
    desk.run("new shot --mattes mattes --fps 25").success();
    desk.run("run shot").success();
    let settings = fs::read_to_string(desk.path("shot/shot.toml")).unwrap();
    fs::write(desk.path("shot/shot.toml"), settings.replace("count = 4", "cuont = 4")).unwrap();
    let said = desk.complaint("run shot", 1);
    assert!(said.contains("shot.toml") && said.contains("cuont"), "{said}");
    fs::write(desk.path("shot/shot.toml"), &settings).unwrap();
    let keys = fs::read_to_string(desk.path("shot/keys/keys.json")).unwrap();
    let first = keys.find("\"frame\": ").unwrap() + "\"frame\": ".len();
    let end = first + keys[first..].find(',').unwrap();
    fs::write(desk.path("shot/keys/keys.json"), format!("{}999{}", &keys[..first], &keys[end..]))
        .unwrap();
    let said = desk.complaint("run shot", 1);
    assert!(said.contains("keys.json") && said.contains("999"), "{said}");
    fs::remove_file(desk.path("shot/masks/000007.png")).unwrap();
    fs::remove_file(desk.path("shot/keys/keys.json")).unwrap();
    // A missing mask is made again.
    desk.run("run shot").success();
    assert!(desk.path("shot/masks/000007.png").is_file());
}

#[test]
fn poses_that_are_missing_or_not_there() {
    let desk = Desk::new();
    desk.run("samples --out samples").success();
    desk.run("new shot --mattes samples/sequences/walk_mattes --fps 25").success();
    let said = desk.complaint("animate shot", 1);
    assert!(said.contains("no rig") && said.contains("--rig"), "{said}");
    let rig = "samples/poses/horse.glb";
    let said = desk.complaint(&format!("animate shot --rig {rig} --pose 1=Walk#0"), 1);
    assert!(said.contains("key 2, 3, 4"), "{said}");
    let poses = "--pose 2=Walk#1 --pose 3=Walk#2 --pose 4=Hop#3";
    let said = desk.complaint(&format!("animate shot --rig {rig} {poses}"), 1);
    assert!(said.contains("Hop") && said.contains("Gallop"), "{said}");
    let said = desk.complaint("animate shot --pose 4=Walk@99", 1);
    assert!(said.contains("99") && said.contains("Walk"), "{said}");
    fs::write(desk.path("broken.glb"), b"glTF\x02\0\0\0").unwrap();
    let said = desk.complaint("animate shot --rig broken.glb --pose 4=Walk#3", 1);
    assert!(said.contains("broken.glb"), "{said}");
    assert!(!desk.path("shot/animation.glb").exists());
}
