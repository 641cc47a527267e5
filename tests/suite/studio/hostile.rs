//! Attempts to break the studio: requests bent at the level of HTTP, files bent at random, writes that
//! come together, connections that hold on. Whatever comes, the answer is below 500 and the server lives.

use std::fs;
use std::io::{Read, Write};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::client::{Server, read_answer};
use crate::gltf_fixture::Fixture;

/// Everything the server says to some bytes, up to the end of the connection.
fn raw(server: &Server, bytes: &[u8]) -> String {
    let mut stream = server.connect();
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    // A connection that is kept open is ended by the server when nothing more comes.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// A head as the page sends it, with more lines.
fn head(server: &Server, line: &str, more: &str) -> String {
    format!(
        "{line} HTTP/1.1\r\nHost: {}\r\nX-Muybridge-Token: {}\r\nX-Muybridge: 1\r\n{more}\r\n",
        server.address, server.token
    )
}

#[test]
fn requests_bent_at_the_level_of_http_are_no_way_in() {
    let server = Server::with_shot();
    let ask = |line: &str, more: &str| raw(&server, head(&server, line, more).as_bytes());
    let count = |text: &str| text.matches("HTTP/1.1 ").count();

    // Two lengths, a length that is no number, and chunks that are none.
    for more in [
        "Content-Length: 2\r\nContent-Length: 5\r\n",
        "Content-Length: -1\r\n",
        "Content-Length: 1e3\r\n",
        "Transfer-Encoding: chunked, identity\r\n",
        "Transfer-Encoding: xchunked\r\n",
    ] {
        let answer = ask("POST /api/cancel", more);
        assert!(answer.starts_with("HTTP/1.1 4"), "{more:?}: {answer}");
    }
    // A second request hidden in the body of the first, by a length that the chunks contradict.
    let hidden =
        format!("0\r\n\r\n{}", head(&server, "POST /api/shutdown", "Content-Length: 0\r\n"));
    let both = format!("Content-Length: {}\r\nTransfer-Encoding: chunked\r\n", hidden.len());
    let sent = head(&server, "POST /api/cancel", &both) + &hidden;
    let answer = raw(&server, sent.as_bytes());
    assert!(answer.starts_with("HTTP/1.1 4") && count(&answer) <= 1, "{answer}");
    server.lives();

    // The address of a proxied request is another name for this server.
    for line in ["GET http://evil.example/api/session", "GET //evil.example/api/session"] {
        let answer = ask(line, "Connection: close\r\n");
        assert!(answer.starts_with("HTTP/1.1 4"), "{line}: {answer}");
    }
    for line in ["CONNECT evil.example:443", "TRACE /", "PRI *", "GET api", "BREW /api/session"] {
        let answer = ask(line, "Connection: close\r\n");
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 4"), "{line}: {answer}");
    }
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n";
    let answer = ask("GET /api/events?shot=nowhere", upgrade);
    assert!(answer.starts_with("HTTP/1.1 404"), "{answer}");
    // HTTP/2 is not spoken; a line without its end is waited for and given up.
    let answer = raw(&server, b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n");
    assert!(!answer.contains("200"), "{answer}");
    let long = format!("/api/browse?path={}", "a".repeat(100_000));
    let answer = ask(&format!("GET {long}"), "Connection: close\r\n");
    assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 4"), "{answer}");
    let many: String = (0..500).map(|i| format!("X-{i}: 1\r\n")).collect();
    let answer = ask("GET /api/session", &many);
    assert!(answer.starts_with("HTTP/1.1 431"), "{answer}");
    server.lives();
}

#[test]
fn odd_paths_are_refused_or_not_found() {
    let server = Server::with_shot();
    let long = "a".repeat(5000);
    for path in [
        "%00",
        "shot%00",
        "shot/%00/..",
        "%5C%5Cserver%5Cshare",
        "C:%5C",
        "~",
        "%252e%252e%252f",
        "//etc//passwd",
        "shot//..//..",
        "....//....//",
        "%c0%ae%c0%ae/",
        "%ff%fe",
        "/proc/self/environ",
        "/dev/zero",
        "file:///etc/passwd",
        "con",
        "shot/.muybridge",
        &long,
    ] {
        for target in [
            format!("/api/browse?path={path}"),
            format!("/api/shot?shot={path}"),
            format!("/api/rig?path={path}"),
            format!("/api/rig/clips?path={path}"),
            format!("/api/file?shot=shot&name={path}"),
            format!("/api/file?shot={path}&name=shot.toml"),
            format!("/api/frame?shot={path}&frame=0"),
            format!("/assets/{path}"),
        ] {
            let answer = server.get(&target);
            let hidden = target.starts_with("/api/browse") && path == "shot/.muybridge";
            if !hidden {
                assert!((400..500).contains(&answer.status), "{target}: {}", answer.status);
            }
            assert!(!answer.text().contains("root:"), "{target}");
        }
        let shot = json!({"shot": path, "from": "synthetic:gallop"});
        let made = server.post("/api/shots", &shot).status;
        assert!(made < 500, "{path}: {made}");
    }
    server.lives();
}

#[test]
fn of_writes_that_come_together_one_is_taken() {
    let server = Server::with_shot();
    let state = server.shot("shot");
    let side = |name: &str| state[name].as_u64().unwrap() as usize;
    let mask = |column: usize| {
        let mut mask = muybridge::mask::Mask::new(side("width"), side("height"));
        mask.set(column, 0, true);
        mask.to_png().unwrap()
    };
    let target = "/api/file?shot=shot&name=masks/000004.png";
    let statuses: Vec<u16> = std::thread::scope(|scope| {
        let writers: Vec<_> = (0..8)
            .map(|column| {
                let (server, body) = (&server, mask(column));
                scope.spawn(move || {
                    server.call("PUT", target).header("If-Match", "\"\"").body(body).send().status
                })
            })
            .collect();
        writers.into_iter().map(|writer| writer.join().unwrap()).collect()
    });
    assert_eq!(statuses.iter().filter(|s| **s == 200).count(), 1, "{statuses:?}");
    assert!(statuses.iter().all(|s| [200, 409, 423].contains(s)), "{statuses:?}");
    let stored = fs::read(server.path("shot/masks/000004.png")).unwrap();
    assert!((0..8).any(|column| mask(column) == stored));

    // The same of settings. A change to what is set already leaves the version and would not keep the
    // next one out, so none of these is the number of keys that there are.
    let present = state["settings"]["keys"]["count"].as_u64().unwrap();
    let version = &state["settings_version"];
    let statuses: Vec<u16> = std::thread::scope(|scope| {
        let writers: Vec<_> = (present + 1..present + 7)
            .map(|count| {
                let server = &server;
                let change = json!({"version": version, "set": {"keys.count": count}});
                scope.spawn(move || {
                    server.call("PATCH", "/api/shot?shot=shot").json(&change).send().status
                })
            })
            .collect();
        writers.into_iter().map(|writer| writer.join().unwrap()).collect()
    });
    assert_eq!(statuses.iter().filter(|s| **s == 200).count(), 1, "{statuses:?}");
}

#[test]
fn connections_that_hold_on_after_an_answer_do_not_keep_others_out() {
    let server = Server::start();
    let request = format!("GET /api/session HTTP/1.1\r\nHost: {}\r\n\r\n", server.address);
    let begun = Instant::now();
    let holding: Vec<_> = (0..64)
        .map(|_| {
            let mut stream = server.connect();
            stream.write_all(request.as_bytes()).unwrap();
            stream
        })
        .collect();
    // A head that comes a byte at a time is given up as a whole, not byte by byte.
    server.lives();
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
    drop(holding);
}

/// Values that no setting or document expects.
fn wild() -> Vec<Value> {
    vec![
        Value::Null,
        json!(-1),
        json!(1e308),
        json!(u64::MAX),
        json!(0),
        json!("x".repeat(3000)),
        json!([]),
        json!([[[]]]),
        json!({"a": {}}),
        json!(true),
        json!([1e18, -5, 3, 0]),
        json!("../../../etc/passwd"),
    ]
}

/// Every member of a document that is no table, by its dotted name.
fn leaves(value: &Value, name: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                let full = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                leaves(member, &full, found);
            }
        }
        _ => found.push(name.to_owned()),
    }
}

#[test]
fn settings_of_wild_values_are_refused_or_harmless() {
    let server = Server::with_shot();
    let first = server.shot("shot");
    let original = fs::read(server.path("shot/shot.toml")).unwrap();
    let mut names = Vec::new();
    leaves(&first["settings"], "", &mut names);
    assert!(names.len() > 30, "{names:?}");
    for name in &names {
        for value in wild() {
            let version = server.shot("shot")["settings_version"].clone();
            let change = json!({"version": version, "set": {name.as_str(): value}});
            let answer = server.call("PATCH", "/api/shot?shot=shot").json(&change).send();
            assert!(answer.status < 500, "{name} = {value}: {}", answer.text());
            if answer.status == 200 {
                assert!(server.get("/api/shot?shot=shot").status < 500, "{name} = {value}");
                fs::write(server.path("shot/shot.toml"), &original).unwrap();
            }
        }
    }
    server.lives();
}

#[test]
fn documents_bent_at_random_never_break_the_server() {
    let server = Server::with_shot();
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let good = Fixture::two_bones();
    let mut pointers = Vec::new();
    pointers_of(&good.json, "", &mut pointers);
    let values = wild();
    for _ in 0..400 {
        let mut json = good.json.clone();
        for _ in 0..random.random_range(1..3) {
            let pointer = &pointers[random.random_range(0..pointers.len())];
            if let Some(place) = json.pointer_mut(pointer) {
                *place = values[random.random_range(0..values.len())].clone();
            }
        }
        fs::write(
            server.path("bent.glb"),
            Fixture { json: json.clone(), bin: good.bin.clone() }.glb(),
        )
        .unwrap();
        let answer = server.get("/api/rig/clips?path=bent.glb");
        assert!(answer.status < 500, "{json}: {}", answer.text());
    }
    // Bytes of the container.
    let whole = good.glb();
    for _ in 0..300 {
        let mut bytes = whole.clone();
        for _ in 0..random.random_range(1..6) {
            let at = random.random_range(0..bytes.len());
            bytes[at] = random.random();
        }
        bytes.truncate(random.random_range(0..=bytes.len()));
        fs::write(server.path("bent.glb"), &bytes).unwrap();
        let answer = server.get("/api/rig/clips?path=bent.glb");
        assert!(answer.status < 500, "{}", answer.text());
    }
    server.lives();
}

fn pointers_of(value: &Value, at: &str, found: &mut Vec<String>) {
    if !at.is_empty() {
        found.push(at.to_owned());
    }
    match value {
        Value::Object(members) => {
            members.iter().for_each(|(key, v)| pointers_of(v, &format!("{at}/{key}"), found));
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, v)| pointers_of(v, &format!("{at}/{i}"), found));
        }
        _ => {}
    }
}

#[test]
fn pictures_bent_at_random_never_break_the_server() {
    let server = Server::with_shot();
    let state = server.shot("shot");
    let side = |name: &str| state[name].as_u64().unwrap() as u32;
    let picture = image::RgbaImage::from_fn(side("width"), side("height"), |x, y| {
        image::Rgba([(x * 7) as u8, (y * 5) as u8, 200, if x % 3 == 0 { 0 } else { 255 }])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let good = bytes.into_inner();
    let mut random = ChaCha8Rng::seed_from_u64(60);
    for folder in ["masks", "strokes"] {
        let target = format!("/api/file?shot=shot&name={folder}/000002.png");
        for _ in 0..150 {
            let mut bent = good.clone();
            for _ in 0..random.random_range(1..8) {
                let at = random.random_range(0..bent.len().min(400));
                bent[at] = random.random();
            }
            bent.truncate(random.random_range(1..=bent.len()));
            let answer = server.call("PUT", &target).header("If-Match", "\"\"").body(bent).send();
            assert!(answer.status < 500, "{}", answer.text());
            if answer.status == 200 {
                let version = answer.json()["version"].as_str().unwrap().to_owned();
                let tag = format!("\"{version}\"");
                server.call("DELETE", &target).header("If-Match", &tag).send().expect(200);
            }
        }
    }
    server.lives();
}

#[test]
fn an_answer_that_nobody_reads_keeps_nobody_out() {
    let server = Server::with_shot();
    // Many pictures asked for on connections whose answers stay unread.
    let request = head(&server, "GET /api/frame?shot=shot&frame=1", "");
    let deaf: Vec<_> = (0..16)
        .map(|_| {
            let mut stream = server.connect();
            stream.write_all(request.repeat(20).as_bytes()).unwrap();
            stream
        })
        .collect();
    server.lives();
    drop(deaf);
    let mut broken = server.connect();
    broken.write_all(b"GET /\0 HTTP/1.1\r\n\r\n").unwrap();
    assert_eq!(read_answer(broken).status, 400);
    server.lives();
}
