//! The component that is the animal, from frame to frame.

use serde::{Deserialize, Serialize};

use super::frame_report::touches_border;
use crate::image::Rectangle;
use crate::mask::{Component, Mask};

/// Settings of the gate: what the animal may do from one frame to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GateSettings {
    /// How far the centre of mass may be from where it is expected, in units of the square root
    /// of the silhouette's area, over 0.
    pub distance: f64,
    /// By what factor the area may grow or shrink, over 1.
    pub area_factor: f64,
}

impl Default for GateSettings {
    fn default() -> Self {
        Self { distance: 0.9, area_factor: 3.0 }
    }
}

/// Follows the animal's component.
#[derive(Clone, Debug)]
pub(super) struct Tracker {
    settings: GateSettings,
    last: Option<Seen>,
}

#[derive(Clone, Debug)]
struct Seen {
    /// The area it has when nothing hides it and nothing touches it, pixels.
    usual_px: f64,
    /// Where it was seen, or where it has to be while it is not seen whole and alone.
    centre_px: (f64, f64),
    /// Movement of the centre a frame, pixels, while it was whole and alone.
    velocity_px: (f64, f64),
    at_border: bool,
    /// Frames since it was seen.
    age: usize,
    /// Frames for which it was seen, but not as large as usual.
    unusual: usize,
    /// Steps that the velocity is from.
    steps: usize,
}

/// Between these shares of the usual area it is the animal, whole and alone. Under the first
/// something hides a part of it, over the second another one of its colour touches it; the centre of
/// what is seen says little about where it goes then.
const PARTLY: f64 = 0.6;
const JOINED: f64 = 1.5;

/// Between these shares it is whole and alone again. Nearer to the usual area than the others: two
/// animals of a size that pass one another show as little more than one for a moment.
const WHOLE: f64 = 0.8;
const ALONE: f64 = 1.2;

/// After so many frames what is seen counts as usual.
const USUAL_AFTER: usize = 30;

/// Least share of the newest frame in the usual area and in the velocity, which are means of all
/// frames at first.
const NEWEST: f64 = 0.1;

impl Tracker {
    pub(super) fn new(settings: GateSettings) -> Self {
        Self { settings, last: None }
    }

    /// The component of the first frame: the one that covers most of the foreground rectangle.
    pub(super) fn first<'a>(
        &mut self,
        candidates: &'a [Component],
        rectangle: Rectangle,
        size: (usize, usize),
    ) -> Option<&'a Component> {
        let inside = Mask::from_fn(size.0, size.1, |x, y| {
            (rectangle.x..rectangle.x + rectangle.width).contains(&x)
                && (rectangle.y..rectangle.y + rectangle.height).contains(&y)
        });
        let best = candidates
            .iter()
            .map(|c| (c.common_area(&inside), c))
            .filter(|(common, _)| *common > 0)
            .max_by_key(|(common, _)| *common)
            .map(|(_, c)| c)?;
        self.remember(best, size);
        Some(best)
    }

    /// The component of a later frame: of those that pass the gate, the one of the largest area
    /// nearest to the expected place (area over one plus squared relative distance).
    pub(super) fn next<'a>(
        &mut self,
        candidates: &'a [Component],
        size: (usize, usize),
    ) -> Option<&'a Component> {
        let Some(last) = self.last.clone() else {
            // Never seen so far: the largest component is the best guess there is.
            let largest = candidates.iter().max_by_key(|c| c.area_px)?;
            self.remember(largest, size);
            return Some(largest);
        };
        let score = |c: &Component| {
            let distance = self.distance(&last, c);
            // Larger than usual is not more like it.
            let area = (c.area_px as f64).min(last.usual_px);
            area / (1.0 + (distance / self.settings.distance).powi(2))
        };
        let best = candidates
            .iter()
            .filter(|c| self.passes(&last, c, size))
            .max_by(|a, b| score(a).total_cmp(&score(b)));
        match best {
            Some(component) => {
                self.remember(component, size);
                Some(component)
            }
            None => {
                if let Some(last) = &mut self.last {
                    last.age += 1;
                }
                None
            }
        }
    }

    /// Distance of a component from where the animal is expected, in animal lengths (root of
    /// area). The expectation moves on with the last velocity while the animal is lost.
    fn distance(&self, last: &Seen, component: &Component) -> f64 {
        let steps = (last.age + 1) as f64;
        let expected_x = last.centre_px.0 + steps * last.velocity_px.0;
        let expected_y = last.centre_px.1 + steps * last.velocity_px.1;
        let moved = |from: (f64, f64)| {
            (component.centre_px.0 - from.0).hypot(component.centre_px.1 - from.1)
        };
        let from_expected = moved((expected_x, expected_y));
        from_expected.min(moved(last.centre_px)) / last.usual_px.sqrt()
    }

    fn passes(&self, last: &Seen, component: &Component, size: (usize, usize)) -> bool {
        // The longer it is lost, the less is known of where it is and how large it shows.
        let slack = ((last.age + 1) as f64).sqrt();
        let at_border = last.at_border || touches_border(&component.bounds, size.0, size.1);
        // What enters or leaves the picture changes its area freely.
        let factor = self.settings.area_factor * slack * if at_border { 2.0 } else { 1.0 };
        let ratio = component.area_px as f64 / last.usual_px;
        self.distance(last, component) <= self.settings.distance * slack
            && ratio <= factor
            && ratio >= 1.0 / factor
    }

    fn remember(&mut self, component: &Component, size: (usize, usize)) {
        let area_px = component.area_px as f64;
        let at_border = touches_border(&component.bounds, size.0, size.1);
        let first = Seen {
            usual_px: area_px,
            centre_px: component.centre_px,
            velocity_px: (0.0, 0.0),
            at_border,
            age: 0,
            unusual: 0,
            steps: 0,
        };
        let Some(last) = &self.last else {
            self.last = Some(first);
            return;
        };
        let steps = (last.age + 1) as f64;
        let share = area_px / last.usual_px;
        let cut = at_border || last.at_border;
        let alone = if last.unusual > 0 { WHOLE..=ALONE } else { PARTLY..=JOINED };
        let usual = cut || alone.contains(&share) || last.unusual >= USUAL_AFTER;
        if !usual {
            let b = &component.bounds;
            let along = |at: f64, velocity: f64, low: usize, high: usize| {
                (at + steps * velocity).clamp(low as f64, high as f64)
            };
            let (at, velocity) = (last.centre_px, last.velocity_px);
            self.last = Some(Seen {
                usual_px: last.usual_px,
                centre_px: (
                    along(at.0, velocity.0, b.left, b.right),
                    along(at.1, velocity.1, b.top, b.bottom),
                ),
                velocity_px: velocity,
                unusual: last.unusual + 1,
                steps: last.steps,
                ..first
            });
            return;
        }
        let newest = NEWEST.max(1.0 / (last.steps + 1) as f64);
        let mixed = |old: f64, new: f64| old + newest * (new - old);
        let moved = |old: f64, from: f64, to: f64| mixed(old, (to - from) / steps);
        let (velocity, from, to) = (last.velocity_px, last.centre_px, component.centre_px);
        // What enters, leaves or was taken for it all along has no usual area before.
        let anew = cut || last.unusual >= USUAL_AFTER;
        self.last = Some(Seen {
            usual_px: if anew { area_px } else { mixed(last.usual_px, area_px) },
            velocity_px: (moved(velocity.0, from.0, to.0), moved(velocity.1, from.1, to.1)),
            steps: last.steps + 1,
            ..first
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mask::{Connectivity, components};

    const SIZE: (usize, usize) = (200, 100);
    const FIRST: Rectangle = Rectangle { x: 25, y: 45, width: 10, height: 10 };

    fn discs(centres: &[(f64, f64, f64)]) -> Vec<Component> {
        let mask = Mask::from_fn(SIZE.0, SIZE.1, |x, y| {
            centres.iter().any(|&(cx, cy, r)| (x as f64 - cx).hypot(y as f64 - cy) <= r)
        });
        components(&mask, Connectivity::Eight)
    }

    fn tracker_on(first: &[(f64, f64, f64)]) -> Tracker {
        let mut tracker = Tracker::new(GateSettings::default());
        assert!(tracker.first(&discs(first), FIRST, SIZE).is_some());
        tracker
    }

    #[test]
    fn the_animal_is_followed_past_another_of_its_size() {
        let mut tracker = tracker_on(&[(30.0, 50.0, 12.0), (150.0, 50.0, 12.0)]);
        for step in 1..20 {
            let x = 30.0 + 5.0 * f64::from(step);
            let seen = discs(&[(x, 50.0, 12.0), (150.0, 80.0, 12.0)]);
            let found = tracker.next(&seen, SIZE).unwrap();
            assert!((found.centre_px.0 - x).abs() < 1.0 && found.centre_px.1 < 60.0, "{step}");
        }
    }

    #[test]
    fn a_jump_to_another_object_is_reported_and_not_followed() {
        let mut tracker = tracker_on(&[(30.0, 50.0, 12.0)]);
        assert!(tracker.next(&discs(&[(160.0, 50.0, 12.0)]), SIZE).is_none());
        assert!(tracker.next(&discs(&[(32.0, 50.0, 3.0)]), SIZE).is_none());
        // It is found again where it was lost.
        assert!(tracker.next(&discs(&[(31.0, 50.0, 12.0), (160.0, 50.0, 12.0)]), SIZE).is_some());
    }

    #[test]
    fn one_that_enters_the_picture_may_grow() {
        let mut tracker = Tracker::new(GateSettings::default());
        let rectangle = Rectangle { x: 0, y: 45, width: 8, height: 10 };
        assert!(tracker.first(&discs(&[(0.0, 50.0, 14.0)]), rectangle, SIZE).is_some());
        for x in [4.0, 9.0, 14.0, 19.0, 24.0] {
            assert!(tracker.next(&discs(&[(x, 50.0, 18.0)]), SIZE).is_some(), "{x}");
        }
    }
}
