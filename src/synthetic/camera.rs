//! Where the camera stands, and which pixel sees which point.

use nalgebra::{Point3, Rotation3, Vector3};

use crate::rig::{Model, Pose};

/// Share of the picture left free on every side of the clip's extent.
const MARGIN: f64 = 0.06;

/// How space becomes a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Parallel rays.
    Orthographic,
    /// Rays through one point, this many times the clip's largest extent away from its middle.
    Perspective {
        /// Distance over extent, over 1.
        distance: f64,
    },
}

/// What a picture should show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Turn of the camera about the vertical axis, radians; 0 is the pure side view with the animal
    /// (which faces +Z, Y up) heading to the right; a positive yaw shows more of its front.
    pub yaw_rad: f64,
    /// The projection.
    pub projection: Projection,
    /// Picture width, pixels.
    pub width: usize,
    /// Picture height, pixels.
    pub height: usize,
}

/// A camera framed on a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    view: View,
    rotation: Rotation3<f64>,
    middle: Point3<f64>,
    extent: f64,
    pixels_per_unit: f64,
    /// Where the middle is seen, pixels.
    centre_px: (f64, f64),
}

impl Camera {
    /// A camera that stands still and shows every pose of a clip whole, with a margin of 6 %.
    #[must_use]
    pub fn framing(model: &Model, poses: &[Pose], view: View) -> Self {
        let rotation = side_view(view.yaw_rad);
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for pose in poses {
            for point in model.posed_vertices(pose).iter().flatten() {
                let seen = rotation * point.coords;
                low = low.inf(&seen);
                high = high.sup(&seen);
            }
        }
        if !(low.x.is_finite() && high.x.is_finite()) {
            (low, high) = (Vector3::repeat(-0.5), Vector3::repeat(0.5));
        }
        let size = high - low;
        let extent = size.x.max(size.y).max(size.z).max(1e-9);
        let free = 1.0 - 2.0 * MARGIN;
        let fit = |pixels: usize, length: f64| free * pixels as f64 / length.max(1e-9);
        let mut pixels_per_unit = fit(view.width, size.x).min(fit(view.height, size.y));
        if let Projection::Perspective { distance } = view.projection {
            // What is nearer than the middle shows larger; the nearest it can be is half the depth.
            pixels_per_unit *= 1.0 - 0.5 * size.z / (distance.max(1.01) * extent);
        }
        let middle = rotation.inverse() * Point3::from((low + high) / 2.0);
        let centre_px = (0.5 * view.width as f64, 0.5 * view.height as f64);
        Self { view, rotation, middle, extent, pixels_per_unit, centre_px }
    }

    /// The same view `zoom` times as large in a picture of another size, with its middle at
    /// `centre_px` there, inside or outside of the picture.
    #[must_use]
    pub fn within(&self, width: usize, height: usize, centre_px: (f64, f64), zoom: f64) -> Self {
        Self {
            view: View { width, height, ..self.view },
            pixels_per_unit: zoom * self.pixels_per_unit,
            centre_px,
            ..self.clone()
        }
    }

    /// Picture width, pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.view.width
    }

    /// Picture height, pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.view.height
    }

    /// Pixels a unit of length in the middle of the clip.
    #[must_use]
    pub fn pixels_per_unit(&self) -> f64 {
        self.pixels_per_unit
    }

    /// Where a point is seen: column and row in pixels (x to the right, y down), and its depth
    /// towards the viewer in units (larger is nearer).
    #[must_use]
    pub fn project(&self, point: &Point3<f64>) -> Vector3<f64> {
        let seen = self.rotation * (point - self.middle);
        let scale = match self.view.projection {
            Projection::Orthographic => 1.0,
            Projection::Perspective { distance } => {
                let away = distance.max(1.01) * self.extent;
                away / (away - seen.z).max(0.01 * away)
            }
        } * self.pixels_per_unit;
        Vector3::new(self.centre_px.0 + scale * seen.x, self.centre_px.1 - scale * seen.y, seen.z)
    }
}

/// From rig space (Y up, animal facing +Z) to camera space (x right, y up, z towards the viewer):
/// at yaw 0 the viewer stands on the −X side, so +Z is to the right.
fn side_view(yaw_rad: f64) -> Rotation3<f64> {
    let turned = -std::f64::consts::FRAC_PI_2 + yaw_rad;
    Rotation3::from_axis_angle(&Vector3::y_axis(), turned).inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_yaw_zero_forward_is_right_and_positive_yaw_shows_the_front() {
        let side = side_view(0.0);
        assert!((side * Vector3::z() - Vector3::x()).norm() < 1e-12);
        assert!((side * Vector3::y() - Vector3::y()).norm() < 1e-12);
        assert!((side * -Vector3::x() - Vector3::z()).norm() < 1e-12);
        // The front points towards the viewer.
        assert!((side_view(0.3) * Vector3::z()).z > 0.0);
    }
}
