//! Where clips whose motion changes are cut, beside where it was planted:
//! `cargo run --release --example segments -- [DATA]`, DATA the folder that holds `rigs/`. With folders of masks as
//! further arguments those are cut too.

#![allow(clippy::print_stdout, reason = "the table is what the program is for")]

use std::path::{Path, PathBuf};

use muybridge::mask::Mask;
use muybridge::pipeline::MaskAnalysis;
use muybridge::shot::SegmentChoice;
use muybridge::validate::{Shooting, Unsteady};

#[path = "support/acts.rs"]
mod acts;
use acts::Act::{self, Cycle, Hold, Once, Onward};

const GALLOP: &str = "AnimalArmature|Gallop";
const WALK: &str = "AnimalArmature|Walk";
const JUMP: &str = "AnimalArmature|Gallop_Jump";

/// What happens, on which rig (none: the built-in horse), act by act.
type Script = (&'static str, Option<&'static str>, Vec<Act<'static>>);

fn scripts() -> Vec<Script> {
    let jump = |frames| vec![Cycle(GALLOP, 56, 14.0), Once(JUMP, frames), Cycle(GALLOP, 56, 14.0)];
    let (run, leap) = ("Armature|Triceratops_Run", "Armature|Triceratops_Jump");
    let stop = |frames| vec![Cycle("walk", 60, 24.3), Hold(frames), Cycle("walk", 60, 24.3)];
    let halt = |gait, frames| vec![Cycle(gait, 66, 24.3), Hold(frames), Onward(gait, 66, 24.3)];
    vec![
        ("walk, stop, walk", None, stop(30)),
        ("walk, short stop, walk", None, stop(15)),
        ("walk, halt, walk on", None, halt("walk", 12)),
        ("gallop, halt, gallop on", None, halt("gallop", 15)),
        ("gallop, long halt, gallop on", None, halt("gallop", 30)),
        ("walk, gallop", None, vec![Cycle("walk", 75, 24.3), Cycle("gallop", 60, 14.0)]),
        ("walk, trot", None, vec![Cycle("walk", 75, 24.3), Cycle("trot", 60, 18.0)]),
        ("horse: gallop, jump, gallop", Some("quaternius_horse.glb"), jump(35)),
        ("husky: gallop, jump, gallop", Some("quaternius_husky.glb"), jump(24)),
        ("alpaca: gallop, jump, gallop", Some("quaternius_alpaca.glb"), jump(40)),
        (
            "horse: walk, gallop",
            Some("quaternius_horse.glb"),
            vec![Cycle(WALK, 75, 24.3), Cycle(GALLOP, 60, 14.0)],
        ),
        (
            "triceratops: run, jump, run",
            Some("quaternius_triceratops.glb"),
            vec![Cycle(run, 80, 20.0), Once(leap, 40), Cycle(run, 60, 20.0)],
        ),
        (
            "fox: walk, stop, run",
            Some("khronos_fox.glb"),
            vec![Cycle("Walk", 70, 18.0), Hold(30), Cycle("Run", 70, 16.0)],
        ),
        (
            "horse: idle, walk, eating",
            Some("quaternius_horse.glb"),
            vec![
                Cycle("AnimalArmature|Idle", 40, 80.0),
                Cycle(WALK, 80, 24.3),
                Cycle("AnimalArmature|Eating", 50, 150.0),
            ],
        ),
    ]
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let data = PathBuf::from(arguments.next().unwrap_or_else(|| "../shared/data".to_owned()));
    println!("| clip | planted | yaw 0 | yaw 20 |");
    println!("|---|---|---|---|");
    for (name, rig, acts) in scripts() {
        let rig = rig.map(|file| data.join("rigs").join(file));
        let truth = acts::truth(rig.as_deref(), &acts)?;
        let found = [0.0_f64, 20.0].map(|yaw_deg| -> anyhow::Result<String> {
            let shooting = Shooting {
                frames: truth.poses.len(),
                frames_per_cycle: 24.3,
                yaw_rad: yaw_deg.to_radians(),
                noise: 0.15,
                seed: 42,
                size_px: (320, 240),
                unsteady: Unsteady::default(),
            };
            Ok(words(&acts::segmented(&acts::masks(&truth, &shooting), SegmentChoice::Auto)?))
        });
        let [side, turned] = found;
        println!("| {name} | {} | {} | {} |", planted(&acts), side?, turned?);
    }
    for folder in arguments {
        let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)?
            .map(|entry| Ok(entry?.path()))
            .collect::<anyhow::Result<_>>()?;
        files.sort();
        let masks = files.iter().map(|file| read(file)).collect::<anyhow::Result<Vec<_>>>()?;
        println!("{folder}: {}", words(&acts::segmented(&masks, SegmentChoice::Auto)?));
    }
    Ok(())
}

fn read(file: &Path) -> anyhow::Result<Mask> {
    Ok(Mask::from_image_bytes(file, &std::fs::read(file)?)?)
}

fn words(found: &MaskAnalysis) -> String {
    let word = |s: &muybridge::pipeline::Segment| {
        let gait = s.gait.as_ref();
        format!("{}–{}{}", s.frames.start, s.frames.end, if gait.is_some() { "" } else { " x" })
    };
    found.segments.iter().map(word).collect::<Vec<_>>().join(", ")
}

fn planted(acts: &[Act]) -> String {
    let mut at = 0;
    acts.iter()
        .map(|act| {
            let first = at;
            at += act.frames();
            let none = !matches!(act, Cycle(clip, ..) | Onward(clip, ..) if !clip.contains("Idle") && !clip.contains("Eating"));
            format!("{first}–{at}{}", if none { " x" } else { "" })
        })
        .collect::<Vec<_>>()
        .join(", ")
}
