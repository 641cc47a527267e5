//! Where pictures come from: image sequences, video through ffmpeg, mattes and strokes.

use crate::error::Result;
use crate::image::Picture;

/// Footage read front to back, one frame in memory at a time.
pub trait FrameSource {
    /// Width of every frame, pixels.
    fn width(&self) -> usize;
    /// Height of every frame, pixels.
    fn height(&self) -> usize;
    /// Frames a second, where the source says so (video, GIF); `None` for plain image sequences.
    fn fps(&self) -> Option<f64>;
    /// Number of frames, where it is known before reading.
    fn frame_count(&self) -> Option<usize>;
    /// The next frame, or `None` after the last.
    ///
    /// # Errors
    /// When the frame cannot be read, is damaged, or has another size than the first.
    fn next_frame(&mut self) -> Result<Option<Picture>>;
}
