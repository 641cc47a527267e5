//! A working folder in which the program is run as a user would.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

/// An empty folder; gone at the end of the test.
pub(crate) struct Desk {
    dir: TempDir,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, inside: &str) -> PathBuf {
        self.dir.path().join(inside)
    }

    /// The program with arguments separated by spaces, in this folder.
    pub(crate) fn run(&self, arguments: &str) -> assert_cmd::assert::Assert {
        let mut command = Command::cargo_bin("muybridge").unwrap();
        command.current_dir(self.dir.path()).args(arguments.split_whitespace());
        command.assert()
    }

    /// Runs with `--json` and reads the document.
    pub(crate) fn json(&self, arguments: &str) -> Value {
        let done = self.run(&format!("--json -q {arguments}")).success();
        serde_json::from_slice(&done.get_output().stdout).unwrap()
    }

    /// Standard error of a run that has to fail with `code`.
    pub(crate) fn complaint(&self, arguments: &str, code: i32) -> String {
        let failed = self.run(arguments).code(code);
        String::from_utf8(failed.get_output().stderr.clone()).unwrap()
    }

    /// Every file of a shot but the records of its state, with its bytes.
    pub(crate) fn files(&self, shot: &str) -> Vec<(String, Vec<u8>)> {
        let root = self.path(shot);
        let mut found = Vec::new();
        collect(&root, &root, &mut found);
        found.sort();
        found
    }
}

fn collect(root: &Path, folder: &Path, found: &mut Vec<(String, Vec<u8>)>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
        if name == ".muybridge" {
            continue;
        }
        if path.is_dir() {
            collect(root, &path, found);
        } else {
            found.push((name, fs::read(&path).unwrap()));
        }
    }
}
