//! How the camera moved between frames, estimated from the background.
//!
//! [`Pyramid`] holds a grey picture at several sizes, [`register`] lays one picture over another, [`follow`] every
//! picture of a clip over the one before, and [`CameraPath`] collects the motion of a whole clip.

mod follow;
mod path;
mod pyramid;
mod register;

pub use follow::follow;
pub use path::{CameraPath, CameraStep};
pub use pyramid::Pyramid;
pub use register::{Registration, register, register_near};

use nalgebra::{Matrix3, Vector3};

/// A mapping of the plane by a 3 × 3 matrix on homogeneous pixel coordinates (x right, y down,
/// pixel centres at whole numbers): what a turning or zooming camera does to a far or flat scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography(Matrix3<f64>);

impl Homography {
    /// Leaves every point where it is.
    #[must_use]
    pub fn identity() -> Self {
        Self(Matrix3::identity())
    }

    /// From a matrix; `None` unless it is finite and can be inverted. It is scaled so that its last
    /// entry is 1 where that is not zero.
    #[must_use]
    pub fn from_matrix(matrix: Matrix3<f64>) -> Option<Self> {
        let last = matrix[(2, 2)];
        let matrix = if last.abs() > 1e-12 { matrix / last } else { matrix };
        let usable = matrix.iter().all(|v| v.is_finite()) && matrix.determinant().abs() > 1e-9;
        usable.then_some(Self(matrix))
    }

    /// Moves every point by (`dx`, `dy`) pixels.
    #[must_use]
    pub fn translation(dx: f64, dy: f64) -> Self {
        Self(Matrix3::new(1.0, 0.0, dx, 0.0, 1.0, dy, 0.0, 0.0, 1.0))
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.0
    }

    /// Where the point (`x`, `y`) goes.
    #[must_use]
    pub fn apply(&self, x: f64, y: f64) -> (f64, f64) {
        let p = self.0 * Vector3::new(x, y, 1.0);
        (p.x / p.z, p.y / p.z)
    }

    /// First this mapping, then `next`; the identity when the product cannot be inverted.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        Self::from_matrix(next.0 * self.0).unwrap_or_else(Self::identity)
    }

    /// The mapping back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        self.0.try_inverse().and_then(Self::from_matrix).unwrap_or_else(Self::identity)
    }

    /// The same motion of the same scene in pictures of another size: `scale` is the new width and
    /// height over the old ones. Pixel centres lie at whole numbers, so corners are at −½.
    #[must_use]
    pub fn rescaled(&self, scale: (f64, f64)) -> Self {
        let half = |s: f64| (s - 1.0) / 2.0;
        let to =
            Matrix3::new(scale.0, 0.0, half(scale.0), 0.0, scale.1, half(scale.1), 0.0, 0.0, 1.0);
        to.try_inverse().and_then(|back| Self::from_matrix(to * self.0 * back)).unwrap_or(*self)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn there_and_back_is_nowhere(
            a in -0.1_f64..0.1, b in -0.1_f64..0.1, dx in -50.0_f64..50.0, dy in -50.0_f64..50.0,
            px in -1e-4_f64..1e-4, x in 0.0_f64..800.0, y in 0.0_f64..400.0
        ) {
            let h = Homography::from_matrix(
                Matrix3::new(1.0 + a, b, dx, -b, 1.0 + a, dy, px, 0.0, 1.0)).unwrap();
            let (u, v) = h.apply(x, y);
            let (s, t) = h.inverse().apply(u, v);
            prop_assert!((s - x).abs() < 1e-6 && (t - y).abs() < 1e-6);
            // In a picture half the size, everything happens at half the distance.
            let small = h.rescaled((0.5, 0.5));
            let down = |v: f64| (v + 0.5) / 2.0 - 0.5;
            let (su, sv) = small.apply(down(x), down(y));
            prop_assert!((su - down(u)).abs() < 1e-6 && (sv - down(v)).abs() < 1e-6);
        }
    }

    #[test]
    fn what_cannot_be_inverted_is_refused() {
        assert!(Homography::from_matrix(Matrix3::zeros()).is_none());
        assert!(Homography::from_matrix(Matrix3::from_element(f64::NAN)).is_none());
    }
}
