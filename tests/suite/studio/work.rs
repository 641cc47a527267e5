//! Work through the studio leaves what the command line leaves.

use std::fs;

use serde_json::{Value, json};

use super::client::Server;
use crate::shot_folder::Desk;

const POSES: [(&str, f64); 4] =
    [("Gallop", 0.0), ("Gallop", 0.1), ("Gallop", 0.2), ("Gallop", 0.3)];

fn rig() -> Vec<u8> {
    fs::read("poses/horse.glb").unwrap()
}

/// Every file of the shot, `report.html` included.
fn files(desk: &Desk) -> Vec<(String, Vec<u8>)> {
    desk.files("shot")
}

#[test]
fn the_whole_way_gives_the_files_of_the_command_line() {
    let server = Server::start();
    let desk = Desk::new();
    fs::write(server.path("horse.glb"), rig()).unwrap();
    fs::write(desk.path("horse.glb"), rig()).unwrap();

    let shot = json!({"shot": "shot", "from": "synthetic:gallop", "frames": "0-59"});
    let made = server.post("/api/shots", &shot).expect(201).json();
    assert_eq!(made, desk.json("new shot --from synthetic:gallop --frames 0-59"));
    let ran = server.run("shot", "run");
    assert_eq!(ran["stage"], "run", "{ran}");
    let document = desk.json("run shot");
    assert_eq!(ran["result"], document);
    assert_eq!(compared(&server, &desk), Vec::<String>::new());

    // A key moved by hand, then poses, then the animation.
    let state = server.shot("shot");
    assert_eq!(state["stages"]["report"]["state"], "fresh", "{}", state["stages"]);
    assert_eq!(state["stages"]["weights"]["state"], "fresh", "{}", state["stages"]);
    assert_eq!(state["stages"]["animate"]["state"], "missing", "{}", state["stages"]);
    let mut keys = server.get("/api/file?shot=shot&name=keys/keys.json").expect(200).json();
    let moved = keys["keys"][1]["frame"].as_u64().unwrap() + 1;
    keys["keys"][1]["frame"] = json!(moved);
    let version = state["files"]["keys/keys.json"].as_str().unwrap();
    let target = "/api/file?shot=shot&name=keys/keys.json";
    let put = server.call("PUT", target).header("If-Match", &format!("\"{version}\""));
    put.json(&keys).send().expect(200);
    assert_eq!(server.shot("shot")["edited"], json!(["keys/keys.json"]));
    let text = fs::read_to_string(desk.path("shot/keys/keys.json")).unwrap();
    let was = format!("\"frame\": {}", moved - 1);
    assert!(text.contains(&was));
    fs::write(
        desk.path("shot/keys/keys.json"),
        text.replacen(&was, &format!("\"frame\": {moved}"), 1),
    )
    .unwrap();

    let poses: Vec<Value> = POSES
        .iter()
        .enumerate()
        .map(|(at, (clip, time))| json!({"key": at + 1, "clip": clip, "time": time}))
        .collect();
    let change = json!({
        "version": server.shot("shot")["settings_version"], "rig": "horse.glb", "set": {"poses.pose": poses},
    });
    server.call("PATCH", "/api/shot?shot=shot").json(&change).send().expect(200);
    let animated = server.run("shot", "animate");
    let flags: Vec<String> = POSES
        .iter()
        .enumerate()
        .map(|(at, (clip, time))| format!("--pose {}={clip}@{time}", at + 1))
        .collect();
    let document = desk.json(&format!("animate shot --rig horse.glb {}", flags.join(" ")));
    assert_eq!(animated["result"], document, "{animated}");
    server.run("shot", "report");
    desk.run("-q report shot").success();
    assert_eq!(compared(&server, &desk), Vec::<String>::new());

    let state = server.shot("shot");
    for stage in ["segment", "analyze", "keys", "weights", "animate", "report"] {
        assert_eq!(state["stages"][stage]["state"], "fresh", "{stage}");
    }
    let again = server.run("shot", "animate");
    assert_eq!(again["ran"], false);
    let sent = server.get("/api/file?shot=shot&name=animation.glb&download=1").expect(200);
    assert_eq!(sent.body, fs::read(desk.path("shot/animation.glb")).unwrap());
    let report = server.get("/api/file?shot=shot&name=report.html").expect(200);
    let policy = report.header("content-security-policy").unwrap();
    assert!(policy.contains("sandbox") && !policy.contains("allow-same-origin"), "{policy}");
}

/// Names of files that differ.
fn compared(server: &Server, desk: &Desk) -> Vec<String> {
    let theirs = files(desk);
    let mut differ: Vec<String> = theirs
        .iter()
        .filter(|(name, bytes)| {
            fs::read(server.path("shot").join(name)).ok().as_ref() != Some(bytes)
        })
        .map(|(name, _)| name.clone())
        .collect();
    let known = server.shot("shot")["files"].clone();
    let extra = known.as_object().unwrap().keys().filter(|n| !theirs.iter().any(|(t, _)| t == *n));
    differ.extend(extra.cloned());
    differ
}

#[test]
fn a_job_keeps_others_from_writing_can_be_cancelled_and_leaves_the_shot_as_it_was() {
    let server = Server::start();
    server.post("/api/shots", &json!({"shot": "shot", "from": "synthetic:gallop"})).expect(201);
    let state = server.shot("shot");
    let mut events = server.listen("shot");
    let order = json!({"shot": "shot", "stage": "run"});
    let job = server.post("/api/run", &order).expect(202).json()["job"].clone();
    let (_, progress) = events.until(&["progress"]);
    assert_eq!((&progress["job"], &progress["stage"]), (&job, &json!("segment")));

    assert_eq!(server.shot("shot")["job"]["job"], job);
    server.post("/api/run", &order).expect(423);
    let change = json!({"version": state["settings_version"], "set": {"keys.count": 5}});
    server.call("PATCH", "/api/shot?shot=shot").json(&change).send().expect(423);
    let (width, height) = (state["width"].as_u64().unwrap(), state["height"].as_u64().unwrap());
    let mask = muybridge::mask::Mask::new(width as usize, height as usize).to_png().unwrap();
    let put = server.call("PUT", "/api/file?shot=shot&name=masks/000000.png");
    put.header("If-Match", "\"\"").body(mask).send().expect(423);

    server.post("/api/cancel", &json!({"job": "999"})).expect(404);
    server.post("/api/cancel", &json!({"job": job})).expect(202);
    let (ended, _) = events.until(&["done", "failed", "cancelled"]);
    assert_eq!(ended, "cancelled");
    let after = server.shot("shot");
    assert_eq!((&after["job"], &after["files"]), (&Value::Null, &state["files"]));
    assert_eq!(server.end(), "");
}

#[test]
fn what_a_stage_fails_with_is_told_in_words() {
    let server = Server::start();
    server.post("/api/shots", &json!({"shot": "shot", "from": "synthetic:gallop"})).expect(201);
    let version = server.shot("shot")["settings_version"].clone();
    let change = json!({"version": version, "set": {"source.foreground": [9000, 0, 10, 10]}});
    server.call("PATCH", "/api/shot?shot=shot").json(&change).send().expect(200);
    let failed = server.run("shot", "segment");
    assert!(failed["error"].as_str().unwrap().contains("rectangle"), "{failed}");
    assert!(failed["hint"].is_string() && !failed.to_string().contains("/tmp"), "{failed}");
    server.post("/api/shots", &json!({"shot": "shot", "from": "synthetic:gallop"})).expect(422);
    server.post("/api/shots", &json!({"shot": "b", "from": "nowhere.mp4"})).expect(422);
    server.post("/api/shots", &json!({"shot": "b", "from": "synthetic:waltz"})).expect(422);
    server.post("/api/shots", &json!({"shot": "b"})).expect(422);
    server.post("/api/run", &json!({"shot": "nowhere", "stage": "run"})).expect(404);
    server.post("/api/run", &json!({"shot": "shot", "stage": "waltz"})).expect(400);
    assert!(!server.path("b").exists());
}
