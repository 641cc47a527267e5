//! Killing a run at any moment and running again finishes with the same bytes, on any number of
//! threads.

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::shot_folder::Desk;

fn prepared(desk: &Desk) {
    desk.run("new shot --from synthetic:gallop").success();
}

#[test]
fn one_and_two_threads_give_the_same_bytes() {
    let (one, two) = (Desk::new(), Desk::new());
    for (desk, threads) in [(&one, 1), (&two, 2)] {
        desk.run(&format!("--threads {threads} -q demo --out demo")).success();
    }
    let (a, b) = (one.files("demo"), two.files("demo"));
    assert_eq!(a.len(), b.len());
    for ((name, left), (other, right)) in a.iter().zip(&b) {
        assert_eq!(name, other);
        assert!(left == right, "{name} differs");
    }
}

#[test]
fn killed_runs_are_finished_by_the_next_with_the_same_bytes() {
    let whole = Desk::new();
    prepared(&whole);
    whole.run("-q run shot").success();
    let expected = whole.files("shot");

    let killed = Desk::new();
    prepared(&killed);
    let program = assert_cmd::cargo::cargo_bin("muybridge");
    // Killed after ever longer times: in each of the stages sooner or later, whatever the speed of
    // the machine.
    for milliseconds in [20, 60, 120, 250, 400, 600, 800, 1000, 1300, 1600, 2000] {
        let mut child = Command::new(&program)
            .args(["-q", "run", "shot"])
            .current_dir(killed.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    killed.run("-q run shot").success();
    let found = killed.files("shot");
    let names = |files: &[(String, Vec<u8>)]| -> Vec<String> {
        files.iter().map(|f| f.0.clone()).collect()
    };
    assert_eq!(names(&expected), names(&found));
    for ((name, left), (_, right)) in expected.iter().zip(&found) {
        assert!(left == right, "{name} differs");
    }
}

#[test]
fn a_second_run_has_nothing_to_do() {
    let desk = Desk::new();
    prepared(&desk);
    desk.run("-q run shot").success();
    let times = |name: &str| fs::metadata(desk.path(name)).unwrap().modified().unwrap();
    let files = ["shot/masks/000000.png", "shot/keys/keys.json", "shot/report.html"];
    let before: Vec<_> = files.iter().map(|f| times(f)).collect();
    let again = desk.json("run shot");
    assert_eq!(again["segment"]["ran"], false);
    assert_eq!(before, files.iter().map(|f| times(f)).collect::<Vec<_>>());
}

#[test]
fn two_processes_do_not_work_in_one_shot() {
    let desk = Desk::new();
    prepared(&desk);
    let shot = muybridge::shot::Shot::open(&desk.path("shot")).unwrap();
    let lock = shot.lock().unwrap();
    let said = desk.complaint("run shot", 1);
    assert!(said.contains("another muybridge"), "{said}");
    drop(lock);
    desk.run("-q run shot").success();
}
