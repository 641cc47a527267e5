//! What the fast ways through footage must not change, and what a farm asks of a command.

use std::fs;
use std::path::Path;
use std::process::Command as Process;

use assert_cmd::Command;
use muybridge::frames::{self, Ffmpeg, FrameSource as _, SourceSpec};

use crate::shot_folder::Desk;

/// A disc that rolls through noise, as video of 4:2:0; `None` without ffmpeg.
fn video(desk: &Desk) -> Option<()> {
    let Ok(ffmpeg) = Ffmpeg::find(Path::new("test")) else {
        eprintln!("skipped: no ffmpeg");
        return None;
    };
    let disc = "hypot(X-60-4*N,Y-70)";
    let source = format!(
        "color=gray:s=240x150:r=25:d=0.8,format=rgb24,geq=r='if(lt({disc},30),190,90)+30*random(0)'\
         :g='if(lt({disc},30),120,110)+30*random(1)':b='if(lt({disc},30),60,80)+30*random(2)'"
    );
    let status = Process::new(ffmpeg.program())
        .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i", &source])
        .args(["-pix_fmt", "yuv420p", "-c:v", "ffv1"])
        .arg(desk.path("clip.mkv"))
        .status()
        .unwrap();
    assert!(status.success());
    Some(())
}

fn shot_by_colour(desk: &Desk, name: &str, from: &str) {
    let rectangles = "--foreground 45,55,30,30 --background 130,0,110,150";
    desk.run(&format!("-q new {name} --from {from} --fps 25 {rectangles}")).success();
    let settings = desk.path(&format!("{name}/shot.toml"));
    let text = fs::read_to_string(&settings).unwrap();
    let changed = text.replace("method = \"plate\"", "method = \"colour\"");
    assert_ne!(text, changed);
    fs::write(settings, changed).unwrap();
}

/// Colours looked up as they are stored against the same colours converted, written out as pictures
/// and read back; and on one thread, where nothing is read ahead.
#[test]
fn stored_colours_give_the_masks_of_converted_ones() {
    let desk = Desk::new();
    if video(&desk).is_none() {
        return;
    }
    fs::create_dir(desk.path("stills")).unwrap();
    let spec = SourceSpec { as_stored: true, ..SourceSpec::new(desk.path("clip.mkv")) };
    let mut footage = frames::open(&spec).unwrap();
    let mut count = 0;
    while let Some(frame) = footage.next_stored().unwrap() {
        assert!(matches!(frame, muybridge::image::Frame::Yuv(_)));
        let png = frame.into_rgb().to_png_bytes().unwrap();
        fs::write(desk.path(&format!("stills/{count:04}.png")), png).unwrap();
        count += 1;
    }
    assert_eq!(count, 20);
    for (name, from, threads) in
        [("video", "clip.mkv", 2), ("stills_shot", "stills", 2), ("alone", "clip.mkv", 1)]
    {
        shot_by_colour(&desk, name, from);
        desk.run(&format!("-q --threads {threads} segment {name}")).success();
    }
    let masks = desk.files("video/masks");
    assert_eq!(masks.len(), count);
    assert!(masks == desk.files("stills_shot/masks"));
    assert!(masks == desk.files("alone/masks"));
    let table = fs::read_to_string(desk.path("video/analysis/silhouettes.csv")).unwrap();
    let area = |line: &str| line.split(',').nth(2).unwrap().parse::<f64>().unwrap();
    let disc = std::f64::consts::PI * 900.0;
    assert!(table.lines().skip(1).all(|l| (area(l) / disc - 1.0).abs() < 0.1), "{table}");
}

/// No home, no environment at all, no temporary folder, and a working folder that is not the shot's:
/// nothing but the shot is written to.
#[test]
fn a_run_needs_no_home_and_writes_into_the_shot_only() {
    let (desk, elsewhere) = (Desk::new(), Desk::new());
    desk.run("new shot --from synthetic:gallop").success();
    let listing = |desk: &Desk| -> Vec<String> {
        desk.files(".").into_iter().map(|f| f.0).filter(|f| !f.starts_with("shot/")).collect()
    };
    let (before, there) = (listing(&desk), listing(&elsewhere));
    let temporary = elsewhere.path("no-such-folder");
    Command::cargo_bin("muybridge")
        .unwrap()
        .env_clear()
        .env("TMPDIR", temporary)
        .current_dir(elsewhere.path("."))
        .args(["-q", "run"])
        .arg(desk.path("shot"))
        .assert()
        .success();
    assert!(desk.path("shot/report.html").is_file());
    assert_eq!(listing(&desk), before);
    assert_eq!(listing(&elsewhere), there);
}
