//! Every line of what the studio promises about strangers, broken files and full hands.

use std::fs;
use std::io::Write;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::client::{Server, read_answer};
use crate::gltf_fixture::Fixture;

#[test]
fn nobody_comes_in_without_the_token() {
    let server = Server::start();
    for target in ["/", "/assets/studio.js", "/api/session", "/api/browse?path=", "/nothing"] {
        server.call("GET", target).without("X-Muybridge-Token").send().expect(401);
        let wrong = "0".repeat(server.token.len());
        server.call("GET", target).header("X-Muybridge-Token", &wrong).send().expect(401);
        let part = &server.token[..10];
        server.call("GET", target).header("X-Muybridge-Token", part).send().expect(401);
    }
    let write = server.call("POST", "/api/shutdown").without("X-Muybridge-Token");
    write.send().expect(401);
    server.call("GET", "/?token=wrong").without("X-Muybridge-Token").send().expect(401);
    server.lives();
}

#[test]
fn the_printed_address_opens_the_page_once() {
    let server = Server::untouched();
    let target = format!("/?token={}", server.invitation);
    let entered = server.open(&server.invitation).expect(303);
    assert_eq!(entered.header("location"), Some("/"));
    assert_eq!(entered.header("referrer-policy"), Some("no-referrer"));
    let cookie = entered.header("set-cookie").unwrap().to_owned();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    assert!(!cookie.contains(&server.invitation), "{cookie}");
    let cookie = cookie.split(';').next().unwrap();
    let with_cookie = |method, target: &str| {
        server.call(method, target).without("X-Muybridge-Token").header("Cookie", cookie)
    };
    let page = with_cookie("GET", "/").send().expect(200);
    assert!(page.header("content-type").unwrap().starts_with("text/html"));
    let policy = page.header("content-security-policy").unwrap();
    for part in
        ["script-src 'self';", "frame-ancestors 'none'", "base-uri 'none'", "form-action 'none'"]
    {
        assert!(policy.contains(part), "{policy}");
    }
    assert!(!policy.contains("unsafe"), "{policy}");

    // Whoever finds the address afterwards comes too late; the browser that has the cookie may reload.
    server.open(&server.invitation).expect(401);
    server.call("GET", "/").header("X-Muybridge-Token", &server.invitation).send().expect(401);
    with_cookie("GET", &target).send().expect(303);

    // Another browser needs an address of its own, which the page gives.
    let given = with_cookie("POST", "/api/invitation").send().expect(201).json();
    let other = given["url"].as_str().unwrap().split_once("?token=").unwrap().1.to_owned();
    server.call("POST", "/api/invitation").send().expect(401);
    server.open(&other).expect(303);
    server.open(&other).expect(401);
}

#[test]
fn other_hosts_and_origins_are_refused() {
    let server = Server::start();
    let port = server.address.rsplit(':').next().unwrap();
    for host in
        [format!("evil.example:{port}"), "127.0.0.1:1".into(), "evil.example".into(), String::new()]
    {
        server.call("GET", "/api/session").header("Host", &host).send().expect(403);
    }
    for host in [format!("localhost:{port}"), format!("[::1]:{port}")] {
        server.call("GET", "/api/session").header("Host", &host).send().expect(200);
    }
    for origin in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"] {
        server.call("POST", "/api/shutdown").header("Origin", origin).send().expect(403);
        server.call("GET", "/api/session").header("Origin", origin).send().expect(403);
    }
    let own = format!("http://{}", server.address);
    server.call("GET", "/api/session").header("Origin", &own).send().expect(200);
}

#[test]
fn writes_need_the_header_of_the_page() {
    let server = Server::with_shot();
    for (method, target) in [
        ("POST", "/api/run"),
        ("POST", "/api/shutdown"),
        ("PUT", "/api/file?shot=shot&name=masks/000000.png"),
        ("PATCH", "/api/shot?shot=shot"),
        ("DELETE", "/api/file?shot=shot&name=masks/000000.png"),
    ] {
        server.call(method, target).without("X-Muybridge").send().expect(403);
    }
    server.call("OPTIONS", "/api/shot?shot=shot").send().expect(405);
    server.call("POST", "/api/session").send().expect(405);
    server.get("/api/nothing").expect(404);
}

#[test]
fn paths_cannot_leave_the_folder() {
    let server = Server::with_shot();
    for escape in
        ["..", "../..", "/etc", "shot/../..", "%2e%2e", "..%2f..", "%2Fetc%2Fpasswd", "..%5C.."]
    {
        server.get(&format!("/api/browse?path={escape}")).expect(403);
        server.get(&format!("/api/shot?shot={escape}")).expect(403);
        server.get(&format!("/api/rig?path={escape}")).expect(403);
        server.get(&format!("/api/rig/clips?path={escape}")).expect(403);
        server.get(&format!("/api/events?shot={escape}")).expect(403);
    }
    for escape in [
        "../secret",
        "masks/../../secret",
        "/etc/passwd",
        "..%2Fsecret",
        "%2e%2e/secret",
        "masks/..%5c..%5cx",
    ] {
        let target = format!("/api/file?shot=shot&name={escape}");
        server.get(&target).expect(403);
        server.call("PUT", &target).header("If-Match", "\"\"").send().expect(403);
        server.call("DELETE", &target).header("If-Match", "\"\"").send().expect(403);
    }
    for hidden in
        [".muybridge/segment.json", ".muybridge/lock", "masks/.hidden.png", "other.txt", "masks"]
    {
        server.get(&format!("/api/file?shot=shot&name={hidden}")).expect(404);
    }
    for from in ["../clip.mp4", "/etc", "../*.png"] {
        server.post("/api/shots", &json!({"shot": "new", "from": from})).expect(403);
    }
    server.post("/api/shots", &json!({"shot": "../new", "from": "synthetic:gallop"})).expect(403);
    let version = server.shot("shot")["settings_version"].clone();
    for (name, path) in [
        ("source.from", "../../clip.mp4"),
        ("source.mattes", "/etc"),
        ("source.strokes", "../.."),
        ("poses.rig", "/etc/passwd"),
    ] {
        let change = json!({"version": version, "set": {name: path}});
        server.call("PATCH", "/api/shot?shot=shot").json(&change).send().expect(403);
    }
    let change = json!({"version": version, "rig": "../rig.glb"});
    server.call("PATCH", "/api/shot?shot=shot").json(&change).send().expect(403);
    assert_eq!(server.shot("shot")["settings_version"], version);
    server.lives();
}

#[cfg(unix)]
#[test]
fn links_that_lead_out_are_not_followed() {
    use std::os::unix::fs::symlink;
    let server = Server::with_shot();
    let outside = tempfile::tempdir().unwrap();
    fs::write(outside.path().join("shot.toml"), "").unwrap();
    fs::write(outside.path().join("secret.png"), "secret").unwrap();
    fs::write(outside.path().join("rig.glb"), Fixture::two_bones().glb()).unwrap();
    symlink(outside.path(), server.path("out")).unwrap();
    fs::create_dir_all(server.path("shot/masks")).unwrap();
    symlink(outside.path().join("secret.png"), server.path("shot/masks/000000.png")).unwrap();
    symlink(outside.path(), server.path("shot/analysis")).unwrap();
    fs::create_dir(server.path("frames")).unwrap();
    symlink(outside.path().join("secret.png"), server.path("frames/1.png")).unwrap();

    for target in [
        "/api/browse?path=out",
        "/api/shot?shot=out",
        "/api/rig?path=out/rig.glb",
        "/api/rig/clips?path=out/rig.glb",
        "/api/file?shot=shot&name=masks/000000.png",
        "/api/file?shot=shot&name=analysis/secret.png",
    ] {
        let refused = server.get(target).expect(403);
        assert!(!refused.text().contains("secret\n"), "{target}");
    }
    let put = server.call("PUT", "/api/file?shot=shot&name=masks/000000.png");
    put.header("If-Match", "\"\"").send().expect(403);
    assert_eq!(fs::read(outside.path().join("secret.png")).unwrap(), b"secret");
    server.post("/api/shots", &json!({"shot": "new", "from": "frames"})).expect(403);
    let listing = server.get("/api/browse?path=").expect(200).json();
    assert!(!listing.to_string().contains("\"out\""), "{listing}");
    let files = server.shot("shot")["files"].clone();
    assert_eq!(files.as_object().unwrap().keys().collect::<Vec<_>>(), ["shot.toml"]);
}

/// A PNG of one colour, made by the mask encoder's own format: 1-bit grey.
fn png(width: u32, height: u32) -> Vec<u8> {
    let picture = image::GrayImage::from_pixel(width, height, image::Luma([255]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn broken_pictures_are_refused_and_change_nothing() {
    let server = Server::with_shot();
    let state = server.shot("shot");
    let (width, height) =
        (state["width"].as_u64().unwrap() as u32, state["height"].as_u64().unwrap() as u32);
    let good = png(width, height);
    let mut bomb = good.clone();
    bomb[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
    bomb[20..24].copy_from_slice(&60_000_u32.to_be_bytes());
    let cases: [(&str, Vec<u8>, u16); 7] = [
        ("nothing", Vec::new(), 415),
        ("no PNG", b"GIF89a not a png at all".to_vec(), 415),
        ("cut in its header", good[..20].to_vec(), 400),
        ("cut in its pixels", good[..good.len() / 2].to_vec(), 400),
        ("of another size", png(width + 1, height), 422),
        ("a bomb", bomb, 413),
        ("lying about its size", zip_bomb(width, height), 400),
    ];
    for folder in ["masks", "strokes"] {
        let target = format!("/api/file?shot=shot&name={folder}/000003.png");
        let put = |body: &[u8], version: &str| {
            let tag = format!("\"{version}\"");
            server.call("PUT", &target).header("If-Match", &tag).body(body).send()
        };
        let stored = put(&good, "").expect(200).json()["version"].as_str().unwrap().to_owned();
        let before = fs::read(server.path("shot").join(folder).join("000003.png")).unwrap();
        for (what, bytes, status) in &cases {
            let refused = put(bytes, &stored);
            assert_eq!(refused.status, *status, "{folder}, {what}: {}", refused.text());
            refused.expect(*status);
            let now = fs::read(server.path("shot").join(folder).join("000003.png")).unwrap();
            assert_eq!(now, before, "{what}");
        }
    }
    server.lives();
}

/// A PNG of the right size whose compressed pixels go on for ever: 60 MB of zeros in 60 kB.
fn zip_bomb(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 60_000, 1_000);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_filter(png::Filter::Sub);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![7; 60_000_000]).unwrap();
    writer.finish().unwrap();
    // Only the size in the header is changed; its checksum, too, so that nothing but the pixels lies.
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    bytes
}

#[test]
fn requests_that_are_too_large_or_broken_are_refused() {
    let server = Server::with_shot();
    let large = format!("{{\"shot\": \"{}\"}}", "x".repeat(2 << 20));
    for target in ["/api/shots", "/api/run", "/api/cancel"] {
        server.call("POST", target).body(large.clone()).send().expect(413);
        for broken in ["", "{", "[]", "{\"shot\": 3}", "\u{fffd}", "{\"unknown\": true}"] {
            server.call("POST", target).body(broken).send().expect(400);
        }
    }
    server.call("PATCH", "/api/shot?shot=shot").body(large).send().expect(413);
    server.call("PATCH", "/api/shot?shot=shot").body("{").send().expect(400);
    let deep = format!("{}{}", "[".repeat(200_000), "]".repeat(200_000));
    server.call("POST", "/api/run").body(deep).send().expect(400);
    let picture = server.call("PUT", "/api/file?shot=shot&name=masks/000000.png");
    picture.header("If-Match", "\"\"").body(vec![0; 33 << 20]).send().expect(413);
    for target in [
        "/api/shot",
        "/api/frame?shot=shot",
        "/api/frame?shot=shot&frame=-1",
        "/api/frame?shot=shot&frame=x",
    ] {
        server.get(target).expect(400);
    }
    server.get("/api/frame?shot=shot&frame=99999").expect(404);
    server.get("/api/frame?shot=shot&frame=18446744073709551615").expect(404);
    server.lives();
}

#[test]
fn rigs_with_wild_indices_are_refused() {
    let server = Server::with_shot();
    let mut rigs: Vec<(String, Value)> = Vec::new();
    let good = Fixture::two_bones();
    for (pointer, wild) in [
        ("/accessors/0/bufferView", json!(4_000_000_000_u64)),
        ("/accessors/0/count", json!(u64::MAX)),
        ("/accessors/0/byteOffset", json!(1e18)),
        ("/bufferViews/0/byteLength", json!(1_000_000)),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(77)),
        ("/animations/0/channels/0/sampler", json!(9)),
        ("/animations/0/samplers/0/input", json!(-1)),
        ("/nodes/1/children", json!([999])),
        ("/skins/0/joints", json!([5000])),
    ] {
        let mut rig = good.json.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match rig.pointer_mut(parent).unwrap() {
            Value::Object(members) => drop(members.insert(key.to_owned(), wild)),
            Value::Array(items) => items[key.parse::<usize>().unwrap()] = wild,
            _ => panic!("{pointer}"),
        }
        rigs.push((pointer.to_owned(), rig));
    }
    for (what, rig) in rigs {
        let wild = Fixture { json: rig, bin: good.bin.clone() };
        fs::write(server.path("wild.glb"), wild.glb()).unwrap();
        let refused = server.get("/api/rig/clips?path=wild.glb");
        assert_eq!(refused.status, 422, "{what}: {}", refused.text());
        refused.expect(422);
    }
    fs::write(server.path("cut.glb"), &good.glb()[..100]).unwrap();
    fs::write(server.path("text.gltf"), "no rig").unwrap();
    for broken in ["cut.glb", "text.gltf"] {
        server.get(&format!("/api/rig/clips?path={broken}")).expect(422);
        let version = server.shot("shot")["settings_version"].clone();
        let change = json!({"version": version, "rig": broken});
        server.call("PATCH", "/api/shot?shot=shot").json(&change).send().expect(422);
    }
    server.lives();
}

#[test]
fn a_rig_brings_only_its_own_files() {
    let server = Server::start();
    let rig = Fixture::two_bones();
    fs::create_dir(server.path("rig")).unwrap();
    fs::write(server.path("rig/horse.gltf"), rig.text("horse.bin")).unwrap();
    fs::write(server.path("rig/horse.bin"), &rig.bin).unwrap();
    fs::write(server.path("rig/other.bin"), "private").unwrap();
    server.get("/api/rig?path=rig/horse.bin").expect(403);
    server.get("/api/rig?path=rig/horse.gltf").expect(200);
    assert_eq!(server.get("/api/rig?path=rig/horse.bin").expect(200).body, rig.bin);
    server.get("/api/rig?path=rig/other.bin").expect(403);
    let clips = server.get("/api/rig/clips?path=rig/horse.gltf").expect(200).json();
    assert!(clips["clips"].as_array().unwrap().iter().any(|c| c["name"] == "Rig|Bend"), "{clips}");

    // Neither does a rig reach for files elsewhere: reading this one would never end.
    fs::write(server.path("rig/hostile.gltf"), rig.text("../../../../../../dev/zero")).unwrap();
    server.get("/api/rig/clips?path=rig/hostile.gltf").expect(403);
    server.lives();
}

#[test]
fn slow_and_silent_connections_do_not_keep_others_out() {
    let server = Server::start();
    let begun = Instant::now();
    let silent: Vec<_> = (0..63).map(|_| server.connect()).collect();
    server.lives();
    // With every place taken the next waits until the silent ones are sent away.
    let full = server.connect();
    server.lives();
    assert!(begun.elapsed() < Duration::from_secs(60));
    drop((silent, full));
    let mut broken = server.connect();
    broken.write_all(b"NONSENSE\r\n\r\n").unwrap();
    let answer = read_answer(broken);
    assert_eq!(answer.status, 400);
    server.lives();
}

#[test]
fn listening_beyond_loopback_is_said_loudly() {
    let server = Server::with(&["--bind", "0.0.0.0"]);
    server.lives();
    assert!(server.end().contains("WARNING"));
    let quiet = Server::start();
    assert_eq!(quiet.end(), "");
}
