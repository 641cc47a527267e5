//! Triangles to pixels. A pixel is covered when its centre lies inside a triangle; a centre on an
//! edge belongs to the triangle whose top or left edge it is, so that neighbours share no pixel and
//! leave no gap. No anti-aliasing: a silhouette is binary.

use nalgebra::Vector3;

use super::camera::Camera;
use crate::mask::Mask;
use crate::rig::{Model, Pose};

/// The silhouette of a model in a pose.
#[must_use]
pub fn silhouette(model: &Model, pose: &Pose, camera: &Camera) -> Mask {
    let mut mask = Mask::new(camera.width(), camera.height());
    for (mesh, vertices) in model.meshes.iter().zip(model.posed_vertices(pose)) {
        let seen: Vec<Vector3<f64>> = vertices.iter().map(|v| camera.project(v)).collect();
        for triangle in &mesh.triangles {
            let corners = triangle.map(|v| seen[v]);
            cover(&corners, camera.width(), camera.height(), |x, y, _| mask.set(x, y, true));
        }
    }
    mask
}

/// Calls `paint(x, y, depth)` for every pixel a projected triangle covers; both orientations are
/// drawn.
pub(super) fn cover(
    corners: &[Vector3<f64>; 3],
    width: usize,
    height: usize,
    mut paint: impl FnMut(usize, usize, f64),
) {
    let [a, mut b, mut c] = *corners;
    let mut doubled = edge(&a, &b, c.x, c.y);
    if doubled < 0.0 {
        std::mem::swap(&mut b, &mut c);
        doubled = -doubled;
    }
    // A triangle seen edge-on, or with a corner that is no number, covers nothing.
    if doubled.is_nan() || doubled <= 0.0 || doubled.is_infinite() {
        return;
    }
    let span = |values: [f64; 3], size: usize| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let first = (low - 0.5).ceil().max(0.0) as usize;
        let last = (high - 0.5).floor().min(size as f64 - 1.0);
        if last < 0.0 { 0..0 } else { first..last as usize + 1 }
    };
    let columns = span([a.x, b.x, c.x], width);
    // A share must exceed this: nothing is between it and zero, which an edge that is owned may have.
    let limits = [(&b, &c), (&c, &a), (&a, &b)]
        .map(|(from, to)| if owns_edge(from, to) { -f64::from_bits(1) } else { 0.0 });
    for y in span([a.y, b.y, c.y], height) {
        for x in columns.clone() {
            let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
            let shares = [edge(&b, &c, px, py), edge(&c, &a, px, py), edge(&a, &b, px, py)];
            // All three are compared: that has fewer branches to be wrong about.
            let inside =
                (shares[0] > limits[0]) & (shares[1] > limits[1]) & (shares[2] > limits[2]);
            if inside {
                let depth = (shares[0] * a.z + shares[1] * b.z + shares[2] * c.z) / doubled;
                paint(x, y, depth);
            }
        }
    }
}

/// Twice the signed area of the triangle of an edge and a point; positive on the inner side.
fn edge(from: &Vector3<f64>, to: &Vector3<f64>, x: f64, y: f64) -> f64 {
    (to.x - from.x) * (y - from.y) - (to.y - from.y) * (x - from.x)
}

/// Of two triangles that share an edge they walk it in opposite directions, so exactly one owns it.
fn owns_edge(from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
    to.y < from.y || (to.y == from.y && to.x > from.x)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn two_triangles_of_a_quad_share_no_pixel_and_leave_no_gap(
            left in 1_i32..20, top in 1_i32..20, w in 1_i32..30, h in 1_i32..30, halves in any::<bool>()
        ) {
            let shift = if halves { 0.5 } else { 0.0 };
            let corner = |x: i32, y: i32| Vector3::new(f64::from(x) + shift, f64::from(y) + shift, 0.0);
            let (a, b) = (corner(left, top), corner(left + w, top));
            let (c, d) = (corner(left + w, top + h), corner(left, top + h));
            let mut count = vec![0; 64 * 64];
            cover(&[a, b, c], 64, 64, |x, y, _| count[64 * y + x] += 1);
            cover(&[a, c, d], 64, 64, |x, y, _| count[64 * y + x] += 1);
            prop_assert!(count.iter().all(|&n| n <= 1));
            prop_assert_eq!(count.iter().sum::<i32>(), w * h);
        }
    }

    #[test]
    fn depth_is_interpolated_and_nothing_is_drawn_outside() {
        let corners = [
            Vector3::new(-10.0, -10.0, 0.0),
            Vector3::new(50.0, -10.0, 6.0),
            Vector3::new(-10.0, 50.0, 0.0),
        ];
        let mut seen = 0;
        cover(&corners, 8, 8, |x, y, depth| {
            assert!(x < 8 && y < 8);
            assert!((depth - 0.1 * (x as f64 + 10.5)).abs() < 1e-12);
            seen += 1;
        });
        assert_eq!(seen, 64);
        let flat = [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0), Vector3::new(8.0, 0.0, 0.0)];
        cover(&flat, 8, 8, |_, _, _| panic!("a line covers nothing"));
    }
}
