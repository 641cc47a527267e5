//! The seed's segmentation, one frame after the other: classify by colour, clean, follow.

use serde::{Deserialize, Serialize};

use super::colour::{ColourModels, ColourSettings};
use super::frame_report::{Flag, FrameReport, report_of_mask};
use super::lab_image::LabImage;
use super::scale_trend::TrendRemoval;
use super::track::{GateSettings, Tracker};
use crate::error::Result;
use crate::image::{Frame, Picture, Rectangle};
use crate::mask::{Component, Mask, linked_components};

/// Components under this share of the picture are never the animal.
const LEAST_AREA_SHARE: f64 = 2e-4;

/// How silhouettes are found in footage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// From colour, background plate and place together, over the whole clip
    /// ([`ClipSegmenter`](super::ClipSegmenter)).
    #[default]
    Plate,
    /// By colour alone, frame by frame, as the seed does it ([`Segmenter`]): faster, and worse on
    /// most footage.
    Colour,
}

/// All settings of this room.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// How silhouettes are found.
    pub method: Method,
    /// The colour models.
    pub colour: ColourSettings,
    /// The clean-up.
    pub clean: CleanSettings,
    /// The tracker's gate.
    pub gate: GateSettings,
    /// Removal of a slow trend of scale.
    pub scale_trend: TrendRemoval,
    /// Radius by which sketched strokes are thickened, pixels; 0 for 1 % of the picture's diagonal.
    pub stroke_radius_px: usize,
}

/// Settings of the clean-up. Sizes of 0 are tied to the picture: its diagonal times the share given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CleanSettings {
    /// Radius of the opening, as a share of the picture's diagonal, 0 to 0.1: removes specks.
    pub opening: f64,
    /// Radius of the closing, as a share of the diagonal, 0 to 0.1: bridges gaps.
    pub closing: f64,
    /// Parts of the animal's colour that lie at most this share of the diagonal away from one
    /// another count as one animal, 0 to 0.1: a harness, a stripe or a thin leg in front of grass
    /// may cut the silhouette into pieces.
    pub link: f64,
    /// Largest hole that is filled, as a share of the silhouette's area, 0 to 1. Larger ones stay:
    /// the ground seen between legs is a hole when the feet touch.
    pub holes: f64,
}

impl Default for CleanSettings {
    fn default() -> Self {
        Self { opening: 0.0024, closing: 0.004, link: 0.01, holes: 0.03 }
    }
}

/// Turns pictures into silhouettes by their colours, front to back.
#[derive(Clone, Debug)]
pub struct Segmenter {
    models: ColourModels,
    clean: CleanSettings,
    tracker: Tracker,
    foreground: Rectangle,
    frame: usize,
}

impl Segmenter {
    /// A segmenter whose colours come from the two rectangles on the first picture (which still
    /// has to be pushed).
    ///
    /// # Errors
    /// As [`ColourModels::fit`].
    pub fn new(
        first: &Picture,
        foreground: Rectangle,
        background: Rectangle,
        settings: &Settings,
    ) -> Result<Self> {
        Ok(Self {
            models: ColourModels::fit(first, foreground, background, &settings.colour)?,
            clean: settings.clean.clone(),
            tracker: Tracker::new(settings.gate.clone()),
            foreground,
            frame: 0,
        })
    }

    /// The same segmenter for pictures reduced to `size`: the colours stay, the first place of the
    /// animal is scaled.
    #[must_use]
    pub(super) fn on_size(mut self, size: (usize, usize), from: (usize, usize)) -> Self {
        let x = |v: usize| v * size.0 / from.0;
        let y = |v: usize| v * size.1 / from.1;
        let r = self.foreground;
        self.foreground = Rectangle {
            x: x(r.x),
            y: y(r.y),
            width: x(r.width).max(1),
            height: y(r.height).max(1),
        };
        self
    }

    /// The colour models in use.
    #[must_use]
    pub fn models(&self) -> &ColourModels {
        &self.models
    }

    /// The same as [`parts`](Self::parts) for a first guess, whose colours are told apart less finely.
    #[must_use]
    pub(super) fn rough_parts(&self, picture: &Picture) -> Parts {
        self.parts_of(&cleaned(&self.models.classify_roughly(picture), &self.clean))
    }

    /// The same of a picture in L*a*b*.
    pub(super) fn rough_parts_of_lab(&self, image: &LabImage) -> Parts {
        self.parts_of(&cleaned(&self.models.classify_lab_roughly(image), &self.clean))
    }

    /// The parts of a frame that have the animal's colours and may be it: the work that is done for
    /// several frames side by side.
    #[must_use]
    pub fn parts(&self, frame: &Frame) -> Parts {
        self.parts_of(&cleaned(&self.models.classify(frame), &self.clean))
    }

    fn parts_of(&self, cleaned: &Mask) -> Parts {
        let size = (cleaned.width(), cleaned.height());
        let least = (LEAST_AREA_SHARE * (size.0 * size.1) as f64).ceil() as usize;
        let diagonal = (size.0 as f64).hypot(size.1 as f64);
        let gap = (self.clean.link.clamp(0.0, 0.1) * diagonal).round() as usize;
        let mut components = linked_components(cleaned, gap);
        components.retain(|c| c.area_px >= least);
        Parts { components, size }
    }

    /// Which of the next frame's parts is the animal: frames in order, one after the other.
    pub fn choose(&mut self, parts: Parts) -> Chosen {
        let Parts { components, size } = parts;
        let found = if self.frame == 0 {
            self.tracker.first(&components, self.foreground, size)
        } else {
            self.tracker.next(&components, size)
        };
        let frame = self.frame;
        self.frame += 1;
        Chosen { frame, component: found.cloned(), any: !components.is_empty(), size }
    }

    /// The silhouette of what was chosen, its small holes filled, and what is known of it; frames in
    /// any order and side by side.
    #[must_use]
    pub fn silhouette(&self, chosen: &Chosen) -> (Mask, FrameReport) {
        let Chosen { frame, size: (width, height), .. } = *chosen;
        let mask = match &chosen.component {
            Some(component) => {
                let largest_hole = (self.clean.holes * component.area_px as f64) as usize;
                component.to_mask(width, height).holes_filled(largest_hole)
            }
            None => Mask::new(width, height),
        };
        let mut report = report_of_mask(frame, &mask);
        if mask.is_empty() && chosen.any {
            report.flags.remove(Flag::Empty);
            report.flags.insert(Flag::Lost);
        }
        (mask, report)
    }
}

/// Parts of one frame that may be the animal.
#[derive(Clone, Debug)]
pub struct Parts {
    components: Vec<Component>,
    size: (usize, usize),
}

/// The part of one frame that is the animal.
#[derive(Clone, Debug)]
pub struct Chosen {
    frame: usize,
    component: Option<Component>,
    /// Whether there was anything to choose from.
    any: bool,
    size: (usize, usize),
}

fn cleaned(raw: &Mask, settings: &CleanSettings) -> Mask {
    let diagonal = (raw.width() as f64).hypot(raw.height() as f64);
    let radius = |share: f64| (share.clamp(0.0, 0.1) * diagonal).round() as usize;
    raw.opened(radius(settings.opening)).closed(radius(settings.closing))
}
