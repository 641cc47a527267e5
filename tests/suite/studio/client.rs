//! The program as a server on a temporary folder, and a small HTTP/1.1 client.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

/// An answer.
#[derive(Debug)]
pub(super) struct Answer {
    pub(super) status: u16,
    pub(super) headers: Vec<(String, String)>,
    pub(super) body: Vec<u8>,
}

impl Answer {
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, v)| v.as_str())
    }

    pub(super) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {}", self.text()))
    }

    pub(super) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    /// Checks the status and what every answer has to be like.
    pub(super) fn expect(self, status: u16) -> Self {
        assert_eq!(self.status, status, "{}", self.text());
        let policy = self.header("content-security-policy").expect("a content security policy");
        assert!(policy.contains("default-src 'none'"), "{policy}");
        assert_eq!(self.header("x-content-type-options"), Some("nosniff"));
        if status >= 400 {
            let error = self.json();
            assert!(error["error"].as_str().is_some_and(|s| !s.is_empty()), "{error}");
            for leak in ["panicked", "src/", ".rs:", "/tmp", "RUST_BACKTRACE"] {
                assert!(!self.text().contains(leak), "{leak} in {}", self.text());
            }
        }
        self
    }
}

/// A request under way.
pub(super) struct Call<'a> {
    server: &'a Server,
    method: &'static str,
    target: String,
    headers: Vec<(String, String)>,
    body: Vec<u8>,
}

impl Call<'_> {
    pub(super) fn header(mut self, name: &str, value: &str) -> Self {
        self.headers.retain(|(n, _)| !n.eq_ignore_ascii_case(name));
        self.headers.push((name.to_owned(), value.to_owned()));
        self
    }

    pub(super) fn without(mut self, name: &str) -> Self {
        self.headers.retain(|(n, _)| !n.eq_ignore_ascii_case(name));
        self
    }

    pub(super) fn body(mut self, body: impl Into<Vec<u8>>) -> Self {
        self.body = body.into();
        self
    }

    pub(super) fn json(self, body: &Value) -> Self {
        self.header("Content-Type", "application/json").body(body.to_string())
    }

    pub(super) fn send(self) -> Answer {
        let mut stream = self.server.connect();
        let mut head = format!("{} {} HTTP/1.1\r\n", self.method, self.target);
        for (name, value) in &self.headers {
            head.push_str(&format!("{name}: {value}\r\n"));
        }
        head.push_str(&format!("Content-Length: {}\r\nConnection: close\r\n\r\n", self.body.len()));
        stream.write_all(head.as_bytes()).unwrap();
        // A server that refuses may close before everything is sent.
        let _ = stream.write_all(&self.body);
        read_answer(stream)
    }
}

/// Reads an answer up to the end of the connection.
pub(super) fn read_answer(stream: TcpStream) -> Answer {
    let mut reader = BufReader::new(stream);
    let (status, headers) = read_head(&mut reader);
    let mut body = Vec::new();
    reader.read_to_end(&mut body).unwrap();
    if headers.iter().any(|(n, v)| n.eq_ignore_ascii_case("transfer-encoding") && v == "chunked") {
        body = unchunked(&body);
    }
    Answer { status, headers, body }
}

fn read_head(reader: &mut impl BufRead) -> (u16, Vec<(String, String)>) {
    let mut line = String::new();
    reader.read_line(&mut line).unwrap();
    let status = line.split(' ').nth(1).and_then(|s| s.parse().ok());
    let status = status.unwrap_or_else(|| panic!("not an answer: {line:?}"));
    let mut headers = Vec::new();
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).unwrap();
        match line.trim_end().split_once(": ") {
            Some((name, value)) => headers.push((name.to_owned(), value.to_owned())),
            None => return (status, headers),
        }
    }
}

fn unchunked(mut bytes: &[u8]) -> Vec<u8> {
    let mut whole = Vec::new();
    loop {
        let end = bytes.windows(2).position(|w| w == b"\r\n").unwrap();
        let length =
            usize::from_str_radix(std::str::from_utf8(&bytes[..end]).unwrap(), 16).unwrap();
        if length == 0 {
            return whole;
        }
        whole.extend_from_slice(&bytes[end + 2..end + 2 + length]);
        bytes = &bytes[end + 4 + length..];
    }
}

/// The running program. It is killed when dropped.
pub(super) struct Server {
    root: TempDir,
    child: Child,
    pub(super) address: String,
    /// The token in the printed address.
    pub(super) invitation: String,
    /// What the browser has for it.
    pub(super) token: String,
}

impl Server {
    pub(super) fn start() -> Self {
        Self::with(&[])
    }

    pub(super) fn with(arguments: &[&str]) -> Self {
        Self::begin(arguments, true)
    }

    /// A server with a shot of the built-in horse, of which nothing has run.
    pub(super) fn with_shot() -> Self {
        let server = Self::start();
        let shot = serde_json::json!({"shot": "shot", "from": "synthetic:gallop"});
        server.post("/api/shots", &shot).expect(201);
        server
    }

    /// Checks that the server answers.
    pub(super) fn lives(&self) {
        self.get("/api/session").expect(200);
    }

    /// A server whose printed address nobody has opened.
    pub(super) fn untouched() -> Self {
        Self::begin(&[], false)
    }

    fn begin(arguments: &[&str], enter: bool) -> Self {
        let root = tempfile::tempdir().unwrap();
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("muybridge"))
            .args(["studio", "--no-browser"])
            .args(arguments)
            .current_dir(root.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let (address, invitation) = line
            .trim()
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once("/?token="))
            .unwrap_or_else(|| panic!("no address: {line:?}"));
        let mut server = Self {
            root,
            child,
            address: address.to_owned(),
            invitation: invitation.to_owned(),
            token: String::new(),
        };
        if enter {
            let entered = server.open(&server.invitation).expect(303);
            let cookie = entered.header("set-cookie").unwrap();
            let value = cookie.split(';').next().unwrap().split_once('=').unwrap().1;
            server.token = value.to_owned();
        }
        server
    }

    /// Opens the address that carries an invitation, as a browser without cookies does.
    pub(super) fn open(&self, invitation: &str) -> Answer {
        let target = format!("/?token={invitation}");
        self.call("GET", &target).without("X-Muybridge-Token").send()
    }

    pub(super) fn path(&self, inside: &str) -> PathBuf {
        self.root.path().join(inside)
    }

    pub(super) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
        stream
    }

    /// A request as the page makes it.
    pub(super) fn call(&self, method: &'static str, target: &str) -> Call<'_> {
        let call = Call {
            server: self,
            method,
            target: target.to_owned(),
            headers: Vec::new(),
            body: Vec::new(),
        };
        let call = call.header("Host", &self.address).header("X-Muybridge-Token", &self.token);
        if method == "GET" { call } else { call.header("X-Muybridge", "1") }
    }

    pub(super) fn get(&self, target: &str) -> Answer {
        self.call("GET", target).send()
    }

    pub(super) fn post(&self, target: &str, body: &Value) -> Answer {
        self.call("POST", target).json(body).send()
    }

    /// The state of a shot.
    pub(super) fn shot(&self, shot: &str) -> Value {
        self.get(&format!("/api/shot?shot={shot}")).expect(200).json()
    }

    /// Listens to a shot; the first event has been read.
    pub(super) fn listen(&self, shot: &str) -> Events {
        let mut stream = self.connect();
        let head = format!(
            "GET /api/events?shot={shot} HTTP/1.1\r\nHost: {}\r\nX-Muybridge-Token: {}\r\n\r\n",
            self.address, self.token
        );
        stream.write_all(head.as_bytes()).unwrap();
        let mut reader = BufReader::new(stream);
        assert_eq!(read_head(&mut reader).0, 200);
        let mut events = Events { reader };
        assert_eq!(events.next().0, "hello");
        events
    }

    /// Runs a stage to its end; what was said at it.
    pub(super) fn run(&self, shot: &str, stage: &str) -> Value {
        let mut events = self.listen(shot);
        let order = serde_json::json!({"shot": shot, "stage": stage});
        self.post("/api/run", &order).expect(202);
        events.until(&["done", "failed", "cancelled"]).1
    }

    /// Ends the studio and gives what it said on standard error.
    pub(super) fn end(mut self) -> String {
        self.post("/api/shutdown", &Value::Null).expect(202);
        assert!(self.child.wait().unwrap().success());
        let mut said = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        said
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Server-sent events.
pub(super) struct Events {
    reader: BufReader<TcpStream>,
}

impl Events {
    /// The next event's name and data.
    pub(super) fn next(&mut self) -> (String, Value) {
        let (mut name, mut data) = (String::new(), None);
        loop {
            let mut line = String::new();
            assert!(self.reader.read_line(&mut line).unwrap() > 0, "the events ended");
            let line = line.trim_end();
            if let Some(event) = line.strip_prefix("event: ") {
                name = event.to_owned();
            } else if let Some(text) = line.strip_prefix("data: ") {
                data = Some(serde_json::from_str(text).unwrap());
            } else if line.is_empty()
                && let Some(data) = data.take()
            {
                return (name, data);
            }
        }
    }

    pub(super) fn until(&mut self, names: &[&str]) -> (String, Value) {
        loop {
            let event = self.next();
            if names.contains(&event.0.as_str()) {
                return event;
            }
        }
    }
}
