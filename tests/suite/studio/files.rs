//! Files of a shot through the studio: versions, conflicts, pictures, settings.

use std::fs;

use serde_json::{Value, json};

use super::client::Server;

fn with_shot() -> Server {
    let server = Server::start();
    let shot = json!({"shot": "shots/a b", "from": "synthetic:gallop"});
    fs::create_dir(server.path("shots")).unwrap();
    server.post("/api/shots", &shot).expect(201);
    server
}

const SHOT: &str = "shots%2Fa%20b";

fn picture(width: u32, height: u32, shade: impl Fn(u32) -> [u8; 4]) -> Vec<u8> {
    let picture = image::RgbaImage::from_fn(width, height, |x, _| image::Rgba(shade(x)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn size(server: &Server) -> (u32, u32) {
    let state = server.shot(SHOT);
    (state["width"].as_u64().unwrap() as u32, state["height"].as_u64().unwrap() as u32)
}

#[test]
fn folders_are_listed_with_what_they_hold() {
    let server = with_shot();
    fs::create_dir(server.path("frames")).unwrap();
    for name in ["2.png", "10.png"] {
        fs::write(server.path("frames").join(name), picture(4, 4, |_| [0; 4])).unwrap();
    }
    for name in ["clip10.mp4", "clip2.mp4", "rig.glb", "notes.txt", ".hidden"] {
        fs::write(server.path(name), "x").unwrap();
    }
    let listing = server.get("/api/browse?path=").expect(200).json();
    let kinds: Vec<(&str, &str)> = listing["entries"]
        .as_array()
        .unwrap()
        .iter()
        .map(|e| (e["name"].as_str().unwrap(), e["kind"].as_str().unwrap()))
        .collect();
    assert_eq!(
        kinds,
        [
            ("frames", "images"),
            ("shots", "folder"),
            ("clip2.mp4", "video"),
            ("clip10.mp4", "video"),
            ("notes.txt", "file"),
            ("rig.glb", "rig"),
        ]
    );
    assert_eq!(listing["parent"], Value::Null);
    assert_eq!(listing["entries"][0]["count"], 2);
    let inside = server.get("/api/browse?path=shots").expect(200).json();
    assert_eq!((&inside["parent"], &inside["entries"][0]["kind"]), (&json!(""), &json!("shot")));
    assert_eq!(inside["entries"][0]["path"], "shots/a b");
    server.get("/api/browse?path=nowhere").expect(404);
}

#[test]
fn a_mask_is_stored_as_the_pipeline_does_and_changes_are_based_on_versions() {
    let server = with_shot();
    let (width, height) = size(&server);
    let target = format!("/api/file?shot={SHOT}&name=masks/000003.png");
    let grey =
        picture(width, height, |x| if x < 50 { [250, 250, 250, 255] } else { [9, 9, 9, 255] });

    server.get(&target).expect(404);
    server.call("PUT", &target).body(grey.clone()).send().expect(428);
    server.call("DELETE", &target).send().expect(428);
    let put = |version: &str, body: &[u8]| {
        server.call("PUT", &target).header("If-Match", &format!("\"{version}\"")).body(body).send()
    };
    let version = put("", &grey).expect(200).json()["version"].as_str().unwrap().to_owned();
    let stored = fs::read(server.path("shots/a b/masks/000003.png")).unwrap();
    assert_eq!(blake3::hash(&stored).to_hex().to_string(), version);
    let mask = muybridge::mask::Mask::from_image_bytes("m".as_ref(), &stored).unwrap();
    assert_eq!(mask.area(), 50 * height as usize);
    assert_eq!(mask.to_png().unwrap(), stored);

    // The other tab has not seen this yet.
    let conflict = put("", &picture(width, height, |_| [0, 0, 0, 255])).expect(409).json();
    assert_eq!(conflict["version"], version.as_str());
    assert_eq!(fs::read(server.path("shots/a b/masks/000003.png")).unwrap(), stored);

    let got = server.get(&target).expect(200);
    assert_eq!((got.body, got.headers.len() > 3), (stored, true));
    let tag = format!("\"{version}\"");
    let unchanged = server.call("GET", &target).header("If-None-Match", &tag).send().expect(304);
    assert!(unchanged.body.is_empty());
    let saved = server.get(&format!("{target}&download=1")).expect(200);
    assert!(saved.header("content-disposition").unwrap().contains("000003.png"));

    server.call("DELETE", &target).header("If-Match", "\"0\"").send().expect(409);
    server.call("DELETE", &target).header("If-Match", &tag).send().expect(200);
    server.get(&target).expect(404);
}

#[test]
fn only_what_a_person_makes_can_be_written() {
    let server = with_shot();
    for name in
        ["shot.toml", "report.html", "animation.glb", "analysis/diagnosis.json", "masks/3.png"]
    {
        let target = format!("/api/file?shot={SHOT}&name={name}");
        server.call("PUT", &target).header("If-Match", "\"\"").send().expect(403);
        server.call("DELETE", &target).header("If-Match", "\"\"").send().expect(403);
    }
    let keys = format!("/api/file?shot={SHOT}&name=keys/keys.json");
    server.call("PUT", &keys).header("If-Match", "\"\"").body("{").send().expect(400);
    server.call("PUT", &keys).header("If-Match", "\"\"").body("{}").send().expect(422);
    server.call("DELETE", &keys).header("If-Match", "\"\"").send().expect(403);
}

#[test]
fn settings_are_changed_by_name_and_their_comments_stay() {
    let server = with_shot();
    let state = server.shot(SHOT);
    assert_eq!(state["settings"]["keys"]["count"], 4);
    assert!(state["settings"]["source"]["foreground"].is_array());
    assert_eq!(state["stages"]["segment"]["state"], "missing");
    let version = state["settings_version"].clone();
    let target = format!("/api/shot?shot={SHOT}");
    let patch = |change: &Value| server.call("PATCH", &target).json(change).send();

    fs::write(server.path("horse.glb"), fs::read("poses/horse.glb").unwrap()).unwrap();
    let change = json!({"version": version, "rig": "horse.glb", "set": {
        "keys.count": 6, "silhouette.colour.seed": 9,
        "poses.pose": [{"key": 1, "clip": "Walk", "time": 0.25}, {"key": 2, "clip": "Walk", "frame": 3}],
    }});
    let changed = patch(&change).expect(200).json();
    assert_eq!(changed["settings"]["keys"]["count"], 6);
    assert_eq!(changed["settings"]["poses"]["rig"], "../../horse.glb");
    assert_eq!(changed["settings"]["poses"]["pose"][1]["frame"], 3);
    let text = fs::read_to_string(server.path("shots/a b/shot.toml")).unwrap();
    assert!(text.contains("# Number of key images") && text.contains("\ncount = 6\n"), "{text}");

    let stale = patch(&json!({"version": version, "set": {"keys.count": 5}})).expect(409).json();
    assert_eq!(stale["version"], changed["settings_version"]);
    let version = changed["settings_version"].clone();
    for wrong in [
        json!({"keys.count": 0}),
        json!({"keys.count": "many"}),
        json!({"keys.cuont": 4}),
        json!({"analysis.gait": "waltz"}),
        json!({"source.fps": -3}),
    ] {
        patch(&json!({"version": version, "set": wrong})).expect(422);
    }
    let back = patch(&json!({"version": version, "set": {"keys.count": null}})).expect(200).json();
    assert_eq!(back["settings"]["keys"]["count"], 4);
}

#[test]
fn frames_come_as_pictures_that_a_browser_may_keep() {
    let server = with_shot();
    let state = server.shot(SHOT);
    let (width, height) = size(&server);
    let version = state["footage_version"].as_str().unwrap();
    assert_eq!(
        (state["footage"].clone(), state["frames_known"].clone()),
        (json!(true), json!(true))
    );
    let last = state["frames"].as_u64().unwrap() - 1;
    for frame in [last, 0, 7] {
        let got =
            server.get(&format!("/api/frame?shot={SHOT}&frame={frame}&v={version}")).expect(200);
        assert_eq!(got.header("content-type"), Some("image/jpeg"));
        assert!(got.header("cache-control").unwrap().contains("immutable"));
        let shown = image::load_from_memory(&got.body).unwrap().into_rgb8();
        assert_eq!(shown.dimensions(), (width, height));
        let truth = muybridge::synthetic::SyntheticFootage::new(
            muybridge::synthetic::Gait::Gallop,
            muybridge::synthetic::SyntheticSettings::default(),
        )
        .picture(frame as usize);
        let difference: u64 =
            shown.as_raw().iter().zip(truth.rgb()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        assert!(difference < 6 * truth.rgb().len() as u64, "frame {frame}: {difference}");
    }
    let narrow =
        server.get(&format!("/api/frame?shot={SHOT}&frame=3&width=80&v={version}")).expect(200);
    assert_eq!(image::load_from_memory(&narrow.body).unwrap().width(), 80);
    let tag = narrow.header("etag").unwrap().to_owned();
    let again = format!("/api/frame?shot={SHOT}&frame=3&width=80");
    let unchanged = server.call("GET", &again).header("If-None-Match", &tag).send().expect(304);
    assert_eq!(unchanged.header("cache-control"), Some("no-cache"));
}

#[test]
fn changes_on_disk_are_told() {
    let server = with_shot();
    let mut events = server.listen(SHOT);
    let masks = server.path("shots/a b/strokes");
    fs::create_dir(&masks).unwrap();
    fs::write(masks.join("000002.png"), picture(4, 4, |_| [255; 4])).unwrap();
    let (_, told) = events.until(&["changed"]);
    assert!(told["files"]["strokes/000002.png"].as_str().is_some_and(|v| v.len() == 64), "{told}");
    fs::remove_file(masks.join("000002.png")).unwrap();
    let (_, told) = events.until(&["changed"]);
    assert_eq!(told["files"]["strokes/000002.png"], "");
}
