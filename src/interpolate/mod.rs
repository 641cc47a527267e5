//! From coefficients to weights of the key poses (the Gaussian radial basis functions of section
//! 2.4 of the paper and the switching models of section 3.2), and from weights to poses.

mod blend;
mod kernel;
mod over_phase;
mod retime;
mod seam;
mod sides;
mod switching;
mod weights;

pub use blend::{LargestStep, blend, largest_step};
pub use kernel::{KernelSettings, Rbf};
pub use over_phase::{weights_over_drift, weights_over_mirrored, weights_over_phase};
pub use retime::{Loop, evened, loop_frames, resample, seamless};
pub use seam::{Seam, smoothest_start};
pub use sides::exchanged_sides;
pub use switching::{SwitchAt, Switching};
pub use weights::{Method, Weights, weights};
