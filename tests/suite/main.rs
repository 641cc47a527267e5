//! One integration binary: everything that is tested through the public interface or the
//! command line.

#![allow(clippy::unwrap_used, reason = "a test that fails may panic")]

mod bvh;
mod data;
mod export;
mod frames;
mod gltf_fixture;
mod interpolate;
mod layers;
mod report;
mod rig;
mod silhouette;
