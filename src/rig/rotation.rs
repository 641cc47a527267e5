//! Rotation vectors, their exponential and logarithm, and the mean of rotations.
//!
//! A rotation vector is the axis of a rotation times its angle in radians, right-handed. Unit
//! quaternions `q` and `−q` are the same rotation; everything here gives the same answer for both.

use nalgebra::{Matrix4, Quaternion, SymmetricEigen, UnitQuaternion, Vector3, Vector4};

/// Below this length of the vector part its square loses digits to underflow; the first term of
/// the series is then exact to f64 by a margin of a hundred orders of magnitude.
const TINY: f64 = 1e-100;

/// Below this angle in radians the series of `sin(x/2)/x` to the second order is exact to f64:
/// the next term is x⁴/3840 < 1e-19.
const SMALL_ANGLE_RAD: f64 = 1e-4;

/// Longest shift of the mean, in radians, that still counts as movement; a few hundred units in
/// the last place.
const MEAN_TOLERANCE_RAD: f64 = 1e-13;

/// Rotations within 90° of their mean converge in about five steps; the rest is for safety.
const MEAN_STEPS: usize = 100;

/// The rotation vector of a rotation, radians, length 0 to π: log(q) of the rotation group.
///
/// Accurate to a few units in the last place over the whole range, near 0 and near π as well,
/// since the angle is 2·atan2(|v|, w) of the quaternion (w, v). Singularity: at exactly π the
/// axis has two valid signs. The sign of the quaternion's vector part then decides, so that two
/// rotations on either side of π give nearly opposite vectors.
#[must_use]
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let w = rotation.w * sign;
    let v = rotation.imag() * sign;
    let length = v.norm();
    if length < TINY { v * (2.0 / w) } else { v * (2.0 * length.atan2(w) / length) }
}

/// The rotation with a given rotation vector in radians: the inverse of [`rotation_vector`].
/// Vectors longer than π wrap round.
#[must_use]
pub fn rotation_from_vector(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = vector.norm();
    let factor = if angle < SMALL_ANGLE_RAD {
        0.5 - angle * angle / 48.0
    } else {
        (angle / 2.0).sin() / angle
    };
    UnitQuaternion::new_normalize(Quaternion::from_parts((angle / 2.0).cos(), vector * factor))
}

/// The geodesic angle between two rotations, radians, 0 to π; accurate for small angles too.
#[must_use]
pub fn angle_between_rad(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    rotation_vector(&(a.inverse() * b)).norm()
}

/// The mean of rotations on the sphere of unit quaternions: the rotation about which their
/// rotation vectors sum to zero (Karcher mean), so the one with the least sum of squared geodesic
/// angles when all lie within 90° of it. The identity for an empty list.
///
/// Started from the eigenvector of Σ q qᵀ with the largest eigenvalue (Markley, Cheng, Crassidis
/// and Oshman, *Averaging Quaternions*, 2007), which needs no alignment of signs. Where the mean
/// is not unique (two rotations exactly 180° apart), one of the valid means is returned, always
/// the same one for the same list.
#[must_use]
pub fn mean_rotation(rotations: &[UnitQuaternion<f64>]) -> UnitQuaternion<f64> {
    if rotations.is_empty() {
        return UnitQuaternion::identity();
    }
    let mut mean = eigenvector_mean(rotations);
    for _ in 0..MEAN_STEPS {
        let sum: Vector3<f64> =
            rotations.iter().map(|q| rotation_vector(&(mean.inverse() * q))).sum();
        let shift = sum / rotations.len() as f64;
        mean = UnitQuaternion::new_normalize(*(mean * rotation_from_vector(&shift)));
        if shift.norm() < MEAN_TOLERANCE_RAD {
            break;
        }
    }
    mean
}

fn eigenvector_mean(rotations: &[UnitQuaternion<f64>]) -> UnitQuaternion<f64> {
    let scatter: Matrix4<f64> = rotations.iter().map(|q| q.coords * q.coords.transpose()).sum();
    let eigen = SymmetricEigen::new(scatter);
    let coords: Vector4<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let mean = UnitQuaternion::new_normalize(Quaternion::from_vector(coords));
    // An eigenvector's sign is arbitrary: take the one nearer to the first rotation.
    if mean.coords.dot(&rotations[0].coords) < 0.0 {
        UnitQuaternion::new_unchecked(-mean.into_inner())
    } else {
        mean
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    fn about(axis: [f64; 3], angle: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis.into()), angle)
    }

    fn any_vector(longest: f64) -> impl Strategy<Value = Vector3<f64>> {
        (prop::array::uniform3(-1.0..1.0_f64), 0.0..longest)
            .prop_filter("an axis", |(a, _)| Vector3::from(*a).norm() > 0.1)
            .prop_map(|(a, length)| Vector3::from(a).normalize() * length)
    }

    proptest! {
        #[test]
        fn logarithm_undoes_exponential(v in any_vector(PI - 1e-9)) {
            prop_assert!((rotation_vector(&rotation_from_vector(&v)) - v).norm() < 1e-12);
        }

        #[test]
        fn exponential_is_rodrigues_formula(v in any_vector(10.0), p in any_vector(1.0)) {
            let angle = v.norm();
            prop_assume!(angle > 1e-3);
            let k = v / angle;
            let turned = p * angle.cos()
                + k.cross(&p) * angle.sin()
                + k * (k.dot(&p) * (1.0 - angle.cos()));
            prop_assert!((rotation_from_vector(&v) * p - turned).norm() < 1e-13);
        }

        #[test]
        fn both_signs_of_a_quaternion_have_one_vector(v in any_vector(3.0)) {
            let q = rotation_from_vector(&v);
            let negative = UnitQuaternion::new_unchecked(-q.into_inner());
            prop_assert_eq!(rotation_vector(&q), rotation_vector(&negative));
        }

        #[test]
        fn vectors_about_the_mean_sum_to_zero(vs in prop::collection::vec(any_vector(1.4), 1..9)) {
            let qs: Vec<_> = vs.iter().map(rotation_from_vector).collect();
            let mean = mean_rotation(&qs);
            let sum: Vector3<f64> = qs.iter().map(|q| rotation_vector(&(mean.inverse() * q))).sum();
            prop_assert!(sum.norm() < 1e-10, "{}", sum);
        }

        #[test]
        fn the_mean_moves_with_the_frame(
            vs in prop::collection::vec(any_vector(1.0), 1..6), turn in any_vector(3.0),
        ) {
            let turn = rotation_from_vector(&turn);
            let qs: Vec<_> = vs.iter().map(rotation_from_vector).collect();
            let turned: Vec<_> = qs.iter().map(|q| turn * q).collect();
            let angle = angle_between_rad(&(turn * mean_rotation(&qs)), &mean_rotation(&turned));
            prop_assert!(angle < 1e-10, "{}", angle);
        }
    }

    #[test]
    fn tiny_rotations_keep_all_their_digits() {
        for length in [1e-3, 1e-5, 1e-8, 1e-15, 1e-120, 1e-200, 1e-300] {
            let v = Vector3::new(length, -2.0 * length, 0.5 * length);
            let back = rotation_vector(&rotation_from_vector(&v));
            assert!((back - v).amax() <= 1e-15 * length, "{length}: {back}");
        }
        assert_eq!(rotation_vector(&UnitQuaternion::identity()), Vector3::zeros());
    }

    #[test]
    fn half_a_turn_has_length_pi_and_either_sign() {
        let v =
            rotation_vector(&UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 1.0, 0.0)));
        assert!((v - Vector3::new(0.0, PI, 0.0)).norm() < 1e-15);
        let below = rotation_vector(&about([0.0, 0.0, 1.0], PI - 1e-9));
        let above = rotation_vector(&about([0.0, 0.0, 1.0], PI + 1e-9));
        assert!((below.z - (PI - 1e-9)).abs() < 1e-14, "{below}");
        assert!((above.z + (PI - 1e-9)).abs() < 1e-14, "{above}");
    }

    #[test]
    fn angles_of_a_millionth_of_a_degree_are_seen() {
        let small = 1e-6_f64.to_radians();
        let a = about([1.0, 2.0, 3.0], 1.0);
        let angle = angle_between_rad(&a, &(a * about([0.0, 1.0, 0.0], small)));
        assert!((angle / small - 1.0).abs() < 1e-6, "{angle}");
    }

    #[test]
    fn the_mean_ignores_signs_and_is_the_middle_about_one_axis() {
        let qs = [10.0_f64, 20.0, 60.0].map(|d| about([0.0, 1.0, 0.0], d.to_radians()));
        let flipped = [qs[0], UnitQuaternion::new_unchecked(-qs[1].into_inner()), qs[2]];
        let middle = about([0.0, 1.0, 0.0], 30.0_f64.to_radians());
        assert!(angle_between_rad(&mean_rotation(&qs), &middle) < 1e-12);
        assert!(angle_between_rad(&mean_rotation(&flipped), &middle) < 1e-12);
    }

    #[test]
    fn opposite_rotations_have_a_mean_half_way() {
        let qs = [UnitQuaternion::identity(), about([1.0, 0.0, 0.0], PI)];
        let mean = mean_rotation(&qs);
        for q in &qs {
            assert!((angle_between_rad(&mean, q) - PI / 2.0).abs() < 1e-9);
        }
        assert_eq!(mean_rotation(&[]), UnitQuaternion::identity());
    }
}
