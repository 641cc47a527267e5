//! Plots, sheets and the page through the public interface, on a made-up clip.

mod clip;
mod page;
mod plots;
mod sheets;
mod stored;
