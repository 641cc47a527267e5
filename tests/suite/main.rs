//! One integration binary: everything that is tested through the public interface or the
//! command line.

#![allow(clippy::unwrap_used, reason = "a test that fails may panic")]
#![allow(clippy::print_stderr, reason = "a skipped test says why")]

mod bvh;
mod cli;
mod cli_input;
mod corrections;
mod data;
mod davis;
mod decoding;
mod export;
mod feet;
mod flags;
mod frames;
mod gltf_fixture;
mod hard_footage;
mod horse_walk;
mod interpolate;
mod layers;
mod left_right;
mod loops;
mod mirror;
mod node_packages;
mod pan;
mod report;
mod resume;
mod rig;
mod samples;
mod segments;
mod shot_folder;
mod silhouette;
#[cfg(feature = "studio")]
mod studio;
mod validation;
