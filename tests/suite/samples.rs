//! The samples in the project are what the generator makes; `MUYBRIDGE_REGENERATE=1` rewrites them.

use std::fs;
use std::path::Path;

use muybridge::synthetic::samples;

#[test]
fn the_committed_samples_are_what_the_generator_makes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let regenerate = std::env::var_os("MUYBRIDGE_REGENERATE").is_some_and(|v| v == "1");
    let mut total = 0;
    for sample in samples().unwrap() {
        let path = root.join(&sample.path);
        if regenerate {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, &sample.bytes).unwrap();
        }
        let stored = fs::read(&path).unwrap_or_default();
        assert!(stored == sample.bytes, "{} differs; see the head of this file", sample.path);
        assert!(sample.bytes.len() < 300_000, "{} is large", sample.path);
        total += sample.bytes.len();
    }
    assert!(total < 15_000_000, "{total}");
    for folder in ["sequences/gallop", "sequences/walk_mattes", "sequences/canter_strokes", "poses"]
    {
        let readme = fs::read_to_string(root.join(folder).join("README.md")).unwrap();
        assert!(readme.contains("Provenance") && readme.contains("Licence"), "{folder}");
    }
}
