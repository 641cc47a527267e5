//! The camera's motion over a clip.

use super::{Homography, Registration};

/// A camera whose picture moves by no more than this over the whole clip stands still, pixels of
/// the pictures it was estimated on: what is left is the estimate's own drift.
const STILL_PX: f64 = 0.75;

/// … while each single step is at most this: a step's own error is far below, and only drift adds
/// up.
const STILL_STEP_PX: f64 = 0.1;

/// The motion from one frame to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraStep {
    /// Takes coordinates of the frame before to those of this frame.
    pub from_previous: Homography,
    /// Share of the looked-at background that the motion explains; 0 of a step that was bridged.
    pub inliers: f64,
    /// Robust scale of what it leaves unexplained, grey values of 255.
    pub residual: f64,
}

/// The motion of a whole clip, frame by frame. The first frame's step is the identity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraPath {
    steps: Vec<CameraStep>,
}

impl CameraPath {
    /// Adds a frame. One that could not be registered (`None`) takes over the last motion, which is
    /// the best guess for a blank or torn frame in a steady pan.
    pub fn push(&mut self, registration: Option<Registration>) {
        let step = match (registration, self.steps.last()) {
            (None, None) => {
                CameraStep { from_previous: Homography::identity(), inliers: 1.0, residual: 0.0 }
            }
            (Some(r), _) => {
                CameraStep { from_previous: r.homography, inliers: r.inliers, residual: r.residual }
            }
            (None, Some(last)) => CameraStep { inliers: 0.0, ..*last },
        };
        self.steps.push(step);
    }

    /// Adds the steps of what follows.
    pub fn extend(&mut self, next: &Self) {
        self.steps.extend_from_slice(&next.steps);
    }

    /// A path from its steps, as they were written down.
    #[must_use]
    pub fn from_steps(steps: Vec<CameraStep>) -> Self {
        Self { steps }
    }

    /// One step a frame.
    #[must_use]
    pub fn steps(&self) -> &[CameraStep] {
        &self.steps
    }

    /// For each frame the mapping from the first frame's coordinates to its own.
    #[must_use]
    pub fn from_first(&self) -> Vec<Homography> {
        let mut at = Homography::identity();
        self.steps
            .iter()
            .map(|step| {
                at = at.then(&step.from_previous);
                at
            })
            .collect()
    }

    /// Whether the camera stands still, for pictures of `size` pixels.
    #[must_use]
    pub fn is_static(&self, size: (usize, usize)) -> bool {
        let (x, y) = (size.0 as f64 / 2.0, size.1 as f64 / 2.0);
        let shift = |h: &Homography| {
            let (u, v) = h.apply(x, y);
            (u - x).hypot(v - y)
        };
        self.steps.iter().all(|s| shift(&s.from_previous) <= STILL_STEP_PX)
            && self.from_first().iter().all(|h| shift(h) <= STILL_PX)
    }

    /// The path in pictures of another size; `scale` is the new width and height over the old.
    #[must_use]
    pub fn rescaled(&self, scale: (f64, f64)) -> Self {
        let steps = self
            .steps
            .iter()
            .map(|s| CameraStep { from_previous: s.from_previous.rescaled(scale), ..*s })
            .collect();
        Self { steps }
    }

    /// The path of a camera that never moves, of as many frames.
    #[must_use]
    pub fn stilled(&self) -> Self {
        let still = |s: &CameraStep| CameraStep { from_previous: Homography::identity(), ..*s };
        Self { steps: self.steps.iter().map(still).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(dx: f64) -> Option<Registration> {
        let homography = Homography::translation(dx, 0.0);
        Some(Registration { homography, inliers: 0.9, residual: 1.0 })
    }

    #[test]
    fn steps_add_up_and_gaps_are_bridged() {
        let mut path = CameraPath::default();
        for step in [None, moved(3.0), None, moved(1.0)] {
            path.push(step);
        }
        let x: Vec<f64> = path.from_first().iter().map(|h| h.apply(10.0, 5.0).0).collect();
        assert_eq!(x, [10.0, 13.0, 16.0, 17.0]);
        assert_eq!(path.steps()[2].inliers, 0.0);
        assert!(!path.is_static((100, 50)));
        let double = path.rescaled((2.0, 2.0)).from_first()[3].apply(0.0, 0.0);
        assert!((double.0 - 14.0).abs() < 1e-9);
    }

    #[test]
    fn a_trembling_estimate_is_a_camera_at_rest() {
        let mut path = CameraPath::default();
        for step in [0.0, 0.04, -0.03, 0.02, -0.05] {
            path.push(moved(step));
        }
        assert!(path.is_static((100, 50)));
        assert_eq!(path.stilled().from_first()[4], Homography::identity());
    }
}
