//! Frames whose silhouette is flagged, from the masks to the page.

use std::fs;

use serde_json::{Value, json};

use crate::shot_folder::Desk;

/// A gallop as mattes, frames 12 to 17 of which reach the left border.
fn cut_gallop() -> Desk {
    let desk = Desk::new();
    desk.run("render --clip gallop --frames 60 --noise 0 --out mattes").success();
    let mut files: Vec<_> =
        fs::read_dir(desk.path("mattes")).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    for file in &files[12..=17] {
        let mut matte = image::open(file).unwrap().to_luma8();
        for y in 60..160 {
            matte.put_pixel(0, y, image::Luma([255]));
        }
        matte.save(file).unwrap();
    }
    desk.run("new shot --mattes mattes --fps 25").success();
    desk
}

fn frames(value: &Value) -> Vec<u64> {
    value.as_array().unwrap().iter().map(|f| f.as_u64().unwrap()).collect()
}

#[test]
fn segment_says_what_is_known_of_each_frame() {
    let desk = cut_gallop();
    let document = desk.json("segment shot");
    let keys: Vec<&String> = document.as_object().unwrap().keys().collect();
    let shape =
        ["frames", "silhouettes", "flagged", "correct_next", "kept", "ran", "made", "overlay"];
    assert_eq!(keys, shape);
    assert_eq!((&document["frames"], &document["made"]), (&json!(60), &json!(60)));
    let lines = document["silhouettes"].as_array().unwrap();
    assert_eq!(lines.len(), 60);
    let keys: Vec<&String> = lines[0].as_object().unwrap().keys().collect();
    let shape = ["frame", "time_s", "area_px", "centre_px", "confidence", "flags", "words"];
    assert_eq!(keys, shape);
    assert_eq!((&lines[3]["flags"], &lines[3]["words"]), (&json!([]), &json!("")));
    assert_eq!(lines[3]["confidence"], 1.0);
    assert_eq!(lines[3]["time_s"], 0.12);
    assert_eq!(lines[12]["flags"], json!(["at_border"]));
    assert!(lines[12]["words"].as_str().unwrap().contains("border"));
    assert_eq!(document["flagged"][0]["flag"], "at_border");
    assert_eq!(document["flagged"][0]["excludes"], true);
    assert_eq!(frames(&document["flagged"][0]["frames"]), (12..=17).collect::<Vec<_>>());
    // Nothing a correction could mend: what is outside of the picture cannot be drawn.
    assert!(document["correct_next"].is_null() && document["overlay"].is_null());

    let done = desk.run("segment shot").success();
    let text = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    assert!(text.contains("12–17: the silhouette reaches the picture's border"), "{text}");
    let table = fs::read_to_string(desk.path("shot/analysis/silhouettes.csv")).unwrap();
    assert!(table.lines().next().unwrap().ends_with(",confidence,flags"), "{table}");
    assert!(table.lines().nth(13).unwrap().ends_with(",1,at_border"), "{table}");
}

#[test]
fn flagged_frames_are_bridged_and_never_keys_unless_the_user_says_so() {
    let desk = cut_gallop();
    let verdict = desk.json("analyze shot");
    assert_eq!(frames(&verdict["bad_frames"]), (12..=17).collect::<Vec<_>>());
    let table = fs::read_to_string(desk.path("shot/analysis/projections.csv")).unwrap();
    let cell = |frame: usize, column: usize| -> f64 {
        table.lines().nth(frame + 1).unwrap().split(',').nth(column).unwrap().parse().unwrap()
    };
    let step = (cell(18, 3) - cell(11, 3)) / 7.0;
    for frame in 12..=17 {
        assert_eq!(cell(frame, 2), 0.0);
        let expected = cell(11, 3) + step * (frame - 11) as f64;
        assert!((cell(frame, 3) - expected).abs() < 1e-9, "{frame}");
    }
    let keys = desk.json("keys shot -m 8 --partners");
    for key in keys["keys"].as_array().unwrap() {
        assert!(!(12..=17).contains(&key["frame"].as_u64().unwrap()), "{keys}");
    }
    let weights = fs::read_to_string(desk.path("shot/keys/weights.csv"));
    assert!(weights.is_err() || weights.unwrap().lines().count() == 61);

    let all = desk.json("analyze shot --flagged use");
    assert_eq!(all["bad_frames"], json!([]));
    assert_ne!(all["components"], verdict["components"]);
    let settings = fs::read_to_string(desk.path("shot/shot.toml")).unwrap();
    assert!(settings.contains("flagged_frames = \"use\""), "{settings}");
    assert_eq!(desk.json("analyze shot --flagged leave-out"), verdict);
}

#[test]
fn what_a_hand_did_to_a_mask_or_the_table_counts() {
    let desk = cut_gallop();
    desk.json("analyze shot");
    // Repainted, still at the border: whoever painted it has seen that.
    let painted = image::open(desk.path("shot/masks/000014.png")).unwrap().to_luma8();
    let mut painted = painted.clone();
    painted.put_pixel(0, 160, image::Luma([255]));
    painted.save(desk.path("shot/masks/000014.png")).unwrap();
    assert_eq!(frames(&desk.json("analyze shot")["bad_frames"]), [12, 13, 15, 16, 17]);
    let document = desk.json("segment shot");
    assert_eq!(document["silhouettes"][14]["flags"], json!(["corrected"]));
    assert_eq!(document["silhouettes"][14]["confidence"], 1.0);

    let table = fs::read_to_string(desk.path("shot/analysis/silhouettes.csv")).unwrap();
    let edited: Vec<String> = table
        .lines()
        .map(|l| if l.starts_with("30,") { format!("{l}occluded") } else { l.to_owned() })
        .collect();
    fs::write(desk.path("shot/analysis/silhouettes.csv"), edited.join("\n")).unwrap();
    assert_eq!(frames(&desk.json("analyze shot")["bad_frames"]), [12, 13, 15, 16, 17, 30]);
    fs::write(desk.path("shot/analysis/silhouettes.csv"), table.replace("at_border", "tired"))
        .unwrap();
    let said = desk.complaint("analyze shot", 1);
    assert!(said.contains("silhouettes.csv") && said.contains("tired"), "{said}");
}

#[test]
fn a_close_shot_is_used_as_it_is_and_that_is_said() {
    let desk = Desk::new();
    desk.run("render --clip gallop --frames 50 --noise 0 --out mattes").success();
    for entry in fs::read_dir(desk.path("mattes")).unwrap() {
        let file = entry.unwrap().path();
        let mut matte = image::open(&file).unwrap().to_luma8();
        matte.put_pixel(0, 120, image::Luma([255]));
        matte.save(&file).unwrap();
    }
    desk.run("new close --mattes mattes --fps 25").success();
    let verdict = desk.json("analyze close");
    assert_eq!(verdict["bad_frames"], json!([]));
    let reasons = verdict["reasons"].to_string();
    assert!(reasons.contains("50 of 50 masks are flagged"), "{reasons}");
}

#[test]
fn the_overlay_shows_flagged_frames_with_and_without_footage() {
    let desk = cut_gallop();
    let document = desk.json("segment shot --overlay");
    let shown = frames(&document["overlay"]["frames"]);
    assert!((12..=17).all(|f| shown.contains(&f)) && shown.len() > 24, "{shown:?}");
    assert_eq!(document["overlay"]["flagged_left_out"], 0);
    let path = desk.path(document["overlay"]["path"].as_str().unwrap());
    let sheet = image::open(&path).unwrap().to_rgb8();
    // The border of the six flagged tiles, which are 320 × 240 pixels.
    let orange = sheet.pixels().filter(|p| p.0 == [0xd5, 0x5e, 0x00]).count();
    assert!(orange > 6 * 4 * 2 * (320 + 240), "{orange}");
    let before = fs::metadata(&path).unwrap().modified().unwrap();
    desk.run("segment shot --overlay").success();
    assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), before);

    desk.run("new film --from synthetic:walk --frames 0-9").success();
    desk.run("segment film --overlay").success();
    let sheet = image::open(desk.path("film/analysis/overlay.png")).unwrap().to_rgb8();
    assert!(sheet.width() > 1000 && sheet.pixels().any(|p| p.0 == [0x19, 0xe0, 0xff]));
}

#[test]
fn the_page_lists_flagged_frames_with_their_reason() {
    let desk = cut_gallop();
    desk.run("run shot").success();
    let page = fs::read_to_string(desk.path("shot/report.html")).unwrap();
    assert!(page.contains("12 to 17"), "the run of frames");
    assert!(page.contains("reaches the picture&#x27;s border"), "the reason");
}
