//! Holds the ranks of the house: a module uses modules of a lower rank only, and never a sibling
//! of its own rank.

use std::fs;
use std::path::{Path, PathBuf};

const RANKS: &[(&str, u8)] = &[
    ("error", 0),
    ("image", 1),
    ("numeric", 1),
    ("mask", 2),
    ("motion", 2),
    ("rig", 2),
    ("frames", 2),
    ("silhouette", 3),
    ("image_pca", 3),
    ("spectrum", 3),
    ("gait", 3),
    ("keys", 3),
    ("interpolate", 3),
    ("export", 3),
    ("feet", 3),
    ("synthetic", 3),
    ("library", 4),
    ("graph", 4),
    ("shot", 5),
    ("pipeline", 6),
    ("report", 6),
    ("validate", 7),
    ("work", 7),
    ("studio", 8),
];

fn rank(module: &str) -> Option<u8> {
    RANKS.iter().find(|(name, _)| *name == module).map(|(_, rank)| *rank)
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Names of the crate's modules that a source text reaches by `crate::…` or, grouped,
/// `crate::{a::…, b}`.
fn modules_used(text: &str) -> Vec<String> {
    let name = |s: &str| -> String {
        s.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect()
    };
    let mut used = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 1_usize;
            let mut item = String::new();
            for c in group.chars() {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    ',' if depth == 1 => {
                        used.push(name(item.trim()));
                        item.clear();
                        continue;
                    }
                    _ => {}
                }
                if depth == 0 {
                    break;
                }
                item.push(c);
            }
            used.push(name(item.trim()));
        } else {
            used.push(name(rest));
        }
    }
    used.retain(|m| !m.is_empty());
    used
}

fn violations(module: &str, text: &str) -> Vec<String> {
    let own = rank(module).unwrap_or_else(|| panic!("module {module} has no rank in the table"));
    modules_used(text)
        .into_iter()
        .filter(|used| used != module)
        // `crate::Error` and `crate::Result` are the root's re-exports of rank 0.
        .filter(|used| used != "Error" && used != "Result")
        .filter(|used| rank(used).is_none_or(|r| r >= own))
        .map(|used| format!("{module} (rank {own}) uses {used}"))
        .collect()
}

#[test]
fn modules_use_lower_ranks_only() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    let mut found = Vec::new();
    for file in &files {
        let inside = file.strip_prefix(&src).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_str().unwrap();
        let module = first.strip_suffix(".rs").unwrap_or(first);
        if module == "lib" || module == "bin" {
            continue;
        }
        let text = fs::read_to_string(file).unwrap();
        for line in violations(module, &text) {
            found.push(format!("{}: {line}", inside.display()));
        }
    }
    assert!(found.is_empty(), "rank broken:\n{}", found.join("\n"));
}

#[test]
fn arguments_import_nothing_of_ours() {
    let args = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bin/muybridge/args.rs");
    let text = fs::read_to_string(args).unwrap();
    assert!(!text.contains("muybridge::"), "args.rs must not use the library");
}

#[test]
fn the_check_sees_an_upward_use() {
    assert_eq!(violations("mask", "use crate::silhouette::track;").len(), 1);
    assert_eq!(violations("mask", "use crate::{error::Result, rig::Pose};").len(), 1);
    assert_eq!(violations("keys", "let x = crate::spectrum::peak();").len(), 1);
    assert!(violations("keys", "use crate::{numeric::{a, b}, error};").is_empty());
}
