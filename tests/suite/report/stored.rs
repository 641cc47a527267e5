//! The page and the movie of real shot folders, by the command line.

use std::fs;
use std::process::Command;

use gltf::Gltf;
use serde_json::Value;

use crate::shot_folder::Desk;

/// What mail servers take, and the page promises.
const LARGEST_PAGE: usize = 8_000_000;

fn page(desk: &Desk, shot: &str) -> String {
    fs::read_to_string(desk.path(&format!("{shot}/report.html"))).unwrap()
}

/// The data of the page's player.
fn player(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"player-data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// Bytes of base64 text, by the table of RFC 4648.
fn decoded(text: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u32> =
        text.trim_end_matches('=').bytes().map(|c| u32::from(value(c))).collect();
    let bits = |i: usize| digits[i / 6] >> (5 - i % 6) & 1;
    (0..digits.len() * 6 / 8)
        .map(|b| (0..8).fold(0, |v, i| v << 1 | bits(8 * b + i) as u8))
        .collect()
}

/// Width, height, frames a second and frames of a movie, by ffprobe.
fn probed(file: &std::path::Path) -> Option<String> {
    let entries = "stream=width,height,r_frame_rate,nb_read_frames";
    let answer = Command::new("ffprobe")
        .args(["-v", "error", "-count_frames", "-select_streams", "v", "-of", "csv=p=0"])
        .args(["-show_entries", entries])
        .arg(file)
        .output()
        .ok()?;
    Some(String::from_utf8(answer.stdout).unwrap().trim().to_owned())
}

#[test]
fn the_demos_page_plays_footage_and_rig_and_its_movie_shows_both() {
    let desk = Desk::new();
    desk.run("-q demo --out demo").success();
    let made = page(&desk, "demo");
    assert!(made.len() < LARGEST_PAGE, "{} bytes", made.len());
    let data = player(&made);
    assert_eq!(data["frames"], 100);
    assert_eq!(data["pictures"].as_array().unwrap().len(), 100);
    let first = data["pictures"][0].as_str().unwrap();
    let jpeg = decoded(first.strip_prefix("data:image/jpeg;base64,").unwrap());
    let picture = image::load_from_memory(&jpeg).unwrap();
    assert_eq!([picture.width(), picture.height()], [320, 240]);
    assert!(data["outlines"].as_array().unwrap().iter().all(|o| o.as_str().unwrap().len() > 50));
    assert_eq!(data["animation"]["retime"], 1.0);
    assert_eq!(data["heading"], Value::Null);

    // The rig is the animated one, made light: the same nodes, one animation, a valid file.
    let copy = Gltf::from_slice(&decoded(data["rig"]["glb"].as_str().unwrap())).unwrap();
    let whole = Gltf::open(desk.path("demo/animation.glb")).unwrap();
    assert_eq!(copy.animations().count(), 1);
    let names = |g: &Gltf| -> Vec<String> {
        g.nodes().filter_map(|n| n.name().map(str::to_owned)).collect()
    };
    assert_eq!(names(&copy), names(&whole));
    assert_eq!(copy.skins().count(), whole.skins().count());

    // Up to date, it is not written again.
    let path = desk.path("demo/report.html");
    let before = fs::metadata(&path).unwrap().modified().unwrap();
    desk.run("-q report demo").success();
    assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), before);

    let written = desk.json("report demo --movie");
    assert!(written["movie"].as_str().unwrap().ends_with("animation.mp4"));
    let movie = desk.path("demo/animation.mp4");
    if let Some(line) = probed(&movie) {
        assert_eq!(line, "1280,480,25/1,100");
    }
    // The right half is a rig on a plain ground, the left one a meadow.
    let still = desk.path("still.png");
    let shot = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(&movie)
        .args(["-frames:v", "1"])
        .arg(&still)
        .status()
        .unwrap();
    assert!(shot.success());
    let still = image::open(&still).unwrap().into_rgb8();
    let plain =
        |p: &image::Rgb<u8>| p.0.iter().zip([0xee, 0xf1, 0xf4]).all(|(a, b)| a.abs_diff(b) < 6);
    let share = |from: u32| {
        let count = (from..from + 640).flat_map(|x| (0..480).map(move |y| (x, y)));
        count.filter(|&(x, y)| plain(still.get_pixel(x, y))).count() as f64 / (640.0 * 480.0)
    };
    assert!(share(0) < 0.02, "{}", share(0));
    assert!((0.6..0.97).contains(&share(640)), "{}", share(640));
}

#[test]
fn a_shot_just_begun_has_a_page_that_says_what_to_do() {
    let desk = Desk::new();
    desk.run("-q new shot --from synthetic:walk --frames 0-5").success();
    desk.run("-q report shot").success();
    let made = page(&desk, "shot");
    for command in ["segment", "analyze", "keys", "animate"] {
        assert!(made.contains(&format!("muybridge {command} shot")), "{command}");
    }
    assert!(made.contains("<dt>Frames</dt><dd>0-5 of the source</dd>"));
    assert!(!made.contains("<script"));
}

#[test]
fn without_its_footage_the_page_shows_silhouettes_and_says_so() {
    let desk = Desk::new();
    desk.run("-q render --clip walk --frames 12 --size 160x120 --out mattes").success();
    desk.run("-q new shot --mattes mattes --fps 25").success();
    desk.run("-q segment shot").success();
    desk.run("-q report shot").success();
    let made = page(&desk, "shot");
    assert!(made.contains("without footage"));
    assert!(player(&made)["pictures"].as_array().unwrap().is_empty());
    assert_eq!(made.matches("class=\"alone\"").count(), 12);

    fs::remove_dir_all(desk.path("mattes")).unwrap();
    desk.run("-q report shot").success();
    let made = page(&desk, "shot");
    assert!(made.contains("The source was not there when this page was made"));
    assert_eq!(player(&made)["outlines"].as_array().unwrap().len(), 12);
}

#[test]
fn a_movie_needs_ffmpeg_and_a_name_it_can_write() {
    let desk = Desk::new();
    desk.run("-q render --clip walk --frames 4 --size 64x48 --out mattes").success();
    desk.run("-q new shot --mattes mattes --fps 25").success();
    desk.run("-q segment shot").success();
    let complaint = desk.complaint("report shot --movie out.avi", 1);
    assert!(complaint.contains(".mp4 or .gif"), "{complaint}");
    let complaint = assert_cmd::Command::cargo_bin("muybridge")
        .unwrap()
        .current_dir(desk.path(""))
        .env("MUYBRIDGE_FFMPEG", "no-such-ffmpeg")
        .args(["report", "shot", "--movie"])
        .assert()
        .code(1);
    let complaint = String::from_utf8(complaint.get_output().stderr.clone()).unwrap();
    assert!(complaint.contains("install ffmpeg"), "{complaint}");
    assert!(!desk.path("shot/animation.mp4").exists());
    desk.run("-q report shot --movie out.gif").success();
    assert!(fs::read(desk.path("out.gif")).unwrap().starts_with(b"GIF89a"));
}
