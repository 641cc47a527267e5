//! The animal's speed over the ground from footage: a rig that walks before a camera that pans, from
//! pictures to `animation.json`.

use std::path::Path;

use muybridge::image::Picture;
use muybridge::rig::{File, Pose};
use muybridge::synthetic::{Camera, Projection, View, rendering};
use serde_json::Value;

use crate::data::data_folder;
use crate::shot_folder::Desk;

const FRAMES: usize = 49;
const FPS: f64 = 24.0;
const FRAMES_A_CYCLE: f64 = 16.0;
const SIZE: (usize, usize) = (400, 300);

/// No coat has this colour.
const BLANK: [u8; 3] = [255, 0, 255];

/// Smooth random levels, 0 to 1, fixed in the world.
fn texture(x: f64, y: f64, seed: u64) -> f64 {
    let value = |i: i64, j: i64| {
        let mut z = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (j as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ seed;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (ease(x - x.floor()), ease(y - y.floor()));
    let row = |j: i64| value(i, j) * (1.0 - u) + value(i + 1, j) * u;
    row(j) * (1.0 - v) + row(j + 1) * v
}

fn background(x: f64, y: f64) -> [u8; 3] {
    let level = 0.6 * texture(x / 31.0, y / 23.0, 1) + 0.4 * texture(x / 6.0, y / 6.0, 2);
    [90.0 + 70.0 * level, 115.0 + 60.0 * level, 85.0 + 60.0 * level].map(|c| c as u8)
}

/// What of the ground's way shows in a row of the picture.
type Passing = fn(f64) -> f64;

/// A camera that turns: everything passes alike.
const TURNING: Passing = |_| 1.0;

/// A camera on rails: the distance, above row 70, passes at a third of the speed of the ground on which the animal
/// stands, in row 241, and what is nearer faster.
const ON_RAILS: Passing = |y| 0.33 + 0.67 * (y - 70.0).max(0.0) / 171.0;

/// Writes the pictures; `speed` in rig units a second, and the camera follows a little too slowly. The place of
/// the animal's middle in the first one.
fn shoot(folder: &Path, file: &File, clip: &str, speed: f64, passing: Passing) -> (usize, usize) {
    let model = file.model().unwrap();
    let animation = file.animation(clip).unwrap();
    let pose = |t: usize| -> Pose {
        let phase = (t as f64 / FRAMES_A_CYCLE).fract();
        animation.sample(file.skeleton(), phase * animation.duration_s())
    };
    let poses: Vec<Pose> = (0..FRAMES).map(pose).collect();
    let view =
        View { yaw_rad: 0.0, projection: Projection::Orthographic, width: SIZE.0, height: SIZE.1 };
    let camera = Camera::framing(&model, &poses, view);
    // The animal is drawn at a half of its size, so that it has room to move in the picture.
    let px_a_frame = speed * camera.pixels_per_unit() / 2.0 / FPS;
    let coat = |_: usize, _: usize| [120.0, 66.0, 40.0];
    let (mut sum, mut count) = ((0, 0), 0);
    for (t, pose) in poses.iter().enumerate() {
        let drawn = rendering(&model, pose, &camera, &coat, BLANK);
        let drift = 0.4 * t as f64;
        let left = 40.0 + drift;
        let mut rgb = Vec::new();
        for y in 0..SIZE.1 {
            for x in 0..SIZE.0 {
                let (u, v) = (2.0 * (x as f64 - left), 2.0 * (y as f64 - 100.0));
                let inside = u >= 0.0 && v >= 0.0 && u < SIZE.0 as f64 && v < SIZE.1 as f64;
                let animal = inside.then(|| drawn.pixel(u as usize, v as usize));
                let coat = animal.filter(|c| *c != BLANK);
                if t == 0 && coat.is_some() {
                    sum = (sum.0 + x, sum.1 + y);
                    count += 1;
                }
                // The camera's own way is what the animal's way over the ground leaves of its drift.
                let ground = x as f64 + passing(y as f64) * (px_a_frame * t as f64 - drift);
                rgb.extend(coat.unwrap_or_else(|| background(ground, y as f64)));
            }
        }
        let picture = Picture::from_rgb(SIZE.0, SIZE.1, rgb).unwrap();
        let path = folder.join(format!("{t:03}.png"));
        std::fs::write(path, picture.to_png_bytes().unwrap()).unwrap();
    }
    (sum.0 / count, sum.1 / count)
}

#[test]
fn the_ground_goes_at_the_speed_of_a_rendered_pan() {
    let Some(data) = data_folder() else { return };
    for (rig, clip, gait, passing) in [
        ("quaternius_horse.glb", "AnimalArmature|Walk", "walk", TURNING),
        ("khronos_fox.glb", "Run", "gallop", TURNING),
        ("quaternius_horse.glb", "AnimalArmature|Walk", "walk", ON_RAILS),
    ] {
        let desk = Desk::new();
        std::fs::create_dir(desk.path("footage")).unwrap();
        let path = data.join("rigs").join(rig);
        let file = File::read(&path).unwrap();
        // About what the feet of the clip push: a leg of this rig and a third, each stride.
        let feet = ground_by_feet(&file, clip);
        let speed = 0.9 * feet;
        let (x, y) = shoot(&desk.path("footage"), &file, clip, speed, passing);
        desk.run(&format!(
            "-q new shot --from footage --fps {FPS} --foreground {},{},20,10 --background 0,0,400,70",
            x - 10,
            y - 10
        ))
        .success();
        desk.run(&format!("-q analyze shot --gait {gait}")).success();
        let keys = desk.json("keys shot -m 8");
        let duration = file.animation(clip).unwrap().duration_s();
        let poses: String = (keys["keys"].as_array().unwrap().iter())
            .map(|key| {
                let phase = (key["frame"].as_f64().unwrap() / FRAMES_A_CYCLE).fract();
                format!(" --pose {}={clip}@{}", key["key"], phase * duration)
            })
            .collect();
        let told = |more: &str| -> Value {
            let rig = path.display();
            desk.json(&format!("animate shot --rig {rig}{poses} --root travel {more}"))["feet"]
                .clone()
        };
        let auto = told("");
        let value = |of: &Value| of.as_f64().unwrap();
        let share = value(&auto["pan"]["ground_speed"]) / speed;
        eprintln!("{rig}: {share:.3}");
        assert!((share - 1.0).abs() < 0.05, "{rig}: {share} of the truth, {auto}");
        assert_eq!(auto["ground_speed_from"], "pan", "{auto}");
        assert_eq!(auto["ground_speed"], auto["pan"]["ground_speed"]);
        assert!(value(&auto["planted"]["slide_leg_lengths"][1]) < 0.01, "{auto}");
        let by_feet = told("--speed feet");
        assert_eq!(by_feet["ground_speed"], by_feet["feet_speed"]);
        let twice = told("--speed pan --retime 2");
        let share = value(&twice["ground_speed"]) / value(&auto["ground_speed"]);
        assert!((share - 2.0).abs() < 0.05, "{share}");
    }
}

/// The built-in gallop fills the picture and passes a smooth wood and fine grass by a twentieth of the picture a frame:
/// the camera is followed, the four feet are found in an animation of four poses, and their gait is named.
#[test]
fn the_demo_is_followed_through_its_fast_pan() {
    let desk = Desk::new();
    desk.run("-q demo").success();
    let camera = std::fs::read_to_string(desk.path("muybridge-demo/analysis/camera.csv")).unwrap();
    let ways: Vec<f64> = (camera.lines().skip(2))
        .map(|line| line.split(',').nth(2).unwrap().parse().unwrap())
        .collect();
    let middle = muybridge::numeric::median(&ways);
    let astray = ways.iter().filter(|way| (*way - middle).abs() > 1.0).count();
    assert!(ways.len() == 99 && astray <= 5, "{astray} of {} steps: {ways:?}", ways.len());
    let animation = std::fs::read(desk.path("muybridge-demo/animation.json")).unwrap();
    let feet = &serde_json::from_slice::<Value>(&animation).unwrap()["feet"];
    // The demo shows a stride in 24.3 frames of 1/25 s.
    let gait = muybridge::synthetic::Gait::Gallop;
    let truth = gait.speed_m_s() * gait.stride_s() * 25.0 / 24.3;
    let share = feet["pan"]["ground_speed"].as_f64().unwrap() / truth;
    assert!((share - 1.0).abs() < 0.05, "{share} of the truth");
    assert_eq!(feet["ground_speed_from"], "pan");
    assert_eq!(
        (&feet["gait"], feet["feet"].as_array().unwrap().len()),
        (&"transverse gallop".into(), 4)
    );
    assert_eq!(feet["warnings"], serde_json::json!([]));
}

/// Speed of the ground at which the true clip's feet pass it, rig units a second of footage.
fn ground_by_feet(file: &File, clip: &str) -> f64 {
    use muybridge::feet::{find_feet, foot_tracks, footfalls};
    let animation = file.animation(clip).unwrap();
    let frames = FRAMES_A_CYCLE as usize;
    let pose = |t: usize| {
        let phase = (t % frames) as f64 / FRAMES_A_CYCLE;
        animation.sample(file.skeleton(), phase * animation.duration_s())
    };
    let poses: Vec<Pose> = (0..=frames).map(pose).collect();
    let feet = find_feet(&file.model().unwrap(), &poses, &[]);
    let tracks = foot_tracks(file.skeleton(), &poses, &feet);
    footfalls(&tracks, FPS, true).unwrap().speed
}
