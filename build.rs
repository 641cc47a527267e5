//! Checks that the studio's page is built before a program with the studio in it is.

use std::path::Path;

/// What `src/studio/page.rs` embeds.
const PAGE: [&str; 3] =
    ["studio/dist/index.html", "studio/dist/assets/studio.js", "studio/dist/assets/studio.css"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_STUDIO").is_none() {
        return;
    }
    for file in PAGE {
        println!("cargo::rerun-if-changed={file}");
    }
    if let Some(missing) = PAGE.iter().find(|file| !Path::new(file).is_file()) {
        println!(
            "cargo::error=the studio's page is not built ({missing} is missing): run `make studio`, \
             which builds page and program, or `make page` for the page alone"
        );
    }
}
