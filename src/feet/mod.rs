//! Feet on the ground: which parts of a rig are feet, when they are down, how fast the ground passes,
//! which gait that is, and poses in which a foot that is down stays where it is.
//!
//! Up is +Y, as in glTF. An animation is taken to be in place: the body stays, and feet that are down
//! move backwards at the speed of the ground.

mod contacts;
mod find;
mod gait;
mod ik;
mod pan;
mod plant;
mod travel;

pub use contacts::{Contact, Footfalls, footfalls};
pub use find::{Foot, FootTrack, find_feet, foot_tracks};
pub use gait::{GaitReport, Limb, LimbReport, gait_report};
pub use ik::{Reached, reach, reach_bending};
pub use pan::ground_speed_from_pan;
pub use plant::{Planted, plant};
pub use travel::{common_root, travel};
