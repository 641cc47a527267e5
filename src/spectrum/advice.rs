//! What to try when a clip is doubted.

use std::fmt;

/// What to try; `Display` says it in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Advice {
    /// Look at the masks.
    CheckMasks,
    /// Use only the frames of the steady gait.
    CropToGait,
    /// Label the footage with strokes.
    DrawStrokes,
    /// Give distances more components.
    MoreComponents,
    /// A longer piece of the clip.
    MoreFrames,
    /// Footage with more frames a second.
    HigherFrameRate,
    /// Another clip.
    OtherClip,
    /// Name the gait.
    NameGait,
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Advice::CheckMasks => {
                "look at the masks (report.html, masks/) and repaint the wrong ones or move the rectangles"
            }
            Advice::CropToGait => "keep only the frames of the steady gait (frames = \"A-B\")",
            Advice::DrawStrokes => "draw rough strokes over the frames (strokes/) instead of segmenting",
            Advice::MoreComponents => "let the keys use more components (components = 3)",
            Advice::MoreFrames => "take a longer piece of the clip, at least two cycles",
            Advice::HigherFrameRate => "take footage with more frames a second",
            Advice::OtherClip => "take another clip, seen from the side",
            Advice::NameGait => "name the gait anew (analyze --gait), or look at the contact sheet for legs that change sides",
        })
    }
}
