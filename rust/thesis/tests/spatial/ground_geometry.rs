//! Ground contact: directions against closed forms, the print, and differences.

use std::f64::consts::PI;

use nalgebra::{DMatrix, Matrix3, Matrix6x2, Quaternion, Vector2, Vector3, Vector6};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::spatial::{End, Pose, StackedTwist, ground_gap, orientation_of};
use snake_test_support::planar::Random;
use snake_test_support::spatial_random::{D, gradient, nudged, random_even_link, random_pose, random_twist, tilde};
use snake_thesis::spatial::{ground_contact, ground_frame, travel};

fn end_of(end: End) -> f64 {
    if end == End::Front { 1.0 } else { -1.0 }
}

#[test]
fn rotation_matrix_and_quaternion_rate_are_the_printed_ones() {
    let mut random = Random::new(40);
    for _ in 0..1000 {
        let pose = random_pose(&mut random);
        let p = pose.orientation.into_inner();
        let (e0, e) = (p.scalar(), p.vector().into_owned());
        // H and H-bar of (T 4.4), 3 x 4.
        let mut h = DMatrix::zeros(3, 4);
        let mut h_bar = DMatrix::zeros(3, 4);
        for (matrix, sign) in [(&mut h, 1.0), (&mut h_bar, -1.0)] {
            matrix.column_mut(0).copy_from(&-e);
            matrix.columns_mut(1, 3).copy_from(&(tilde(&e) * sign + Matrix3::identity() * e0));
        }
        let rotation = &h * h_bar.transpose();
        assert!((rotation - pose.rotation()).norm() < 1e-14, "a few ulps");
        let u = random_twist(&mut random);
        let rate = h_bar.transpose() * u.fixed_rows::<3>(3) * 0.5;
        let dt = 1e-3;
        let printed = Quaternion::new(e0, e.x, e.y, e.z) + Quaternion::new(rate[0], rate[1], rate[2], rate[3]) * dt;
        let moved = travel(&pose, &u, dt);
        assert!((moved.orientation.into_inner() - printed / printed.norm()).norm() < 1e-15);
        assert!((moved.position - pose.position - u.fixed_rows::<3>(0) * dt).norm() < 1e-15);
    }
}

#[test]
fn normal_direction_is_the_gradient_of_the_ground_gap() {
    let mut random = Random::new(41);
    for _ in 0..2000 {
        let (link, pose) = (random_even_link(&mut random), random_pose(&mut random));
        for end in End::BOTH {
            let contact = ground_contact(&link, &pose, end);
            let differences = gradient(&pose, |pose| ground_gap(&link, pose, end));
            assert!((contact.normal - differences).norm() < 1e-9, "d^2 L / 6 and 1e-16 / d are below 1e-9");
            assert_eq!(contact.gap, ground_gap(&link, &pose, end));
        }
    }
}

/// The contact slides over the sphere as the link turns; friction sees the velocity of the material point there.
#[test]
fn friction_directions_give_the_velocity_of_the_body_fixed_contact_point() {
    let mut random = Random::new(42);
    for _ in 0..2000 {
        let (link, pose, u) = (random_even_link(&mut random), random_pose(&mut random), random_twist(&mut random));
        for end in End::BOTH {
            let centre = Vector3::z() * end_of(end) * link.contact_half_length;
            let body_fixed = centre + pose.orientation.inverse_transform_vector(&(-Vector3::z() * link.radius));
            let place = |pose: &Pose| pose.position + pose.orientation * body_fixed;
            let velocity = (place(&nudged(&pose, &(u * D))) - place(&nudged(&pose, &(u * -D)))) / (2.0 * D);
            let contact = ground_contact(&link, &pose, end);
            let [x, y] = ground_frame(&pose.rotation());
            assert!((contact.tangent.tr_mul(&u) - Vector2::new(x.dot(&velocity), y.dot(&velocity))).norm() < 1e-9);
            assert!((contact.normal.dot(&u) - velocity.z).abs() < 1e-9);
        }
    }
}

/// W'_T R-bar (T 4.31), (T 4.37)-(T 4.39), and W_V (T 4.45), written out from the print.
#[test]
fn friction_and_rolling_directions_are_the_printed_ones() {
    let mut random = Random::new(43);
    for _ in 0..2000 {
        let (link, pose) = (random_even_link(&mut random), random_pose(&mut random));
        let r = pose.rotation();
        let e_z: Vector3<f64> = r.column(2).into();
        let shadow = Vector2::new(e_z.x, e_z.y).normalize();
        let frame = nalgebra::Matrix2::new(shadow.x, -shadow.y, shadow.y, shadow.x);
        for end in End::BOTH {
            let to_contact =
                tilde(&(e_z * end_of(end) * link.contact_half_length)) + tilde(&(-Vector3::z() * link.radius));
            let row = |axis: Vector3<f64>| {
                let angular = -(axis.transpose() * to_contact * r).transpose();
                Vector6::new(axis.x, axis.y, axis.z, angular.x, angular.y, angular.z)
            };
            let inertial = Matrix6x2::from_columns(&[row(Vector3::x()), row(Vector3::y())]);
            let contact = ground_contact(&link, &pose, end);
            assert!((contact.tangent - inertial * frame).norm() < 1e-14);
            let rolling = (tilde(&(Vector3::z() * link.radius)) * r).transpose();
            assert!((contact.rolling.fixed_view::<3, 2>(3, 0) - rolling.fixed_columns::<2>(0)).norm() < 1e-14);
            assert_eq!(contact.rolling.fixed_view::<3, 2>(0, 0).norm(), 0.0);
        }
    }
}

#[test]
fn a_flat_link_has_its_friction_frame_along_its_own_axes_and_an_upright_one_keeps_an_orthonormal_frame() {
    let flat = orientation_of(0.8, 0.0, 0.0).to_rotation_matrix().into_inner();
    let [x, y] = ground_frame(&flat);
    assert!((x - flat.column(2)).norm() < 1e-15 && (y - flat.column(0)).norm() < 1e-15);
    for tilt in [0.0, 1e-17, 1e-12, 1e-10, 1e-8, 1e-3] {
        for roll in [0.0, 1.0, 2.5, -3.0] {
            let upright = orientation_of(0.8, 0.5 * PI - tilt, roll).to_rotation_matrix().into_inner();
            let [x, y] = ground_frame(&upright);
            assert!((x.norm() - 1.0).abs() < 1e-15 && x.z == 0.0 && y.z == 0.0);
            assert!((x.cross(&y) - Vector3::z()).norm() < 1e-15);
            if roll == 0.0 {
                assert!((y - flat.column(0)).norm() < 1e-6, "pitching an unrolled link up does not turn its frame");
            }
        }
    }
}

#[test]
fn rolling_through_360_degrees_changes_neither_gaps_nor_slip() {
    let link = Robot::new(&RobotConfig::default()).unwrap().links[0];
    let lying =
        |roll: f64| Pose { position: Vector3::new(0.0, 0.0, link.radius), orientation: orientation_of(0.4, 0.0, roll) };
    for k in 0..=360 {
        let pose = lying(f64::from(k) * PI / 180.0);
        // Rolling without slipping about e_z^B = (cos 0.4, sin 0.4, 0): v = omega x (radius e_z^I).
        let omega = 2.0;
        let v = (pose.axis() * omega).cross(&(Vector3::z() * link.radius));
        let u = StackedTwist::new(v.x, v.y, v.z, 0.0, 0.0, omega);
        for end in End::BOTH {
            let contact = ground_contact(&link, &pose, end);
            assert!(contact.gap.abs() < 1e-16);
            assert!(contact.tangent.tr_mul(&u).norm() < 1e-15 && contact.normal.dot(&u).abs() < 1e-16);
            assert!((contact.rolling.tr_mul(&u).norm() - omega * link.radius).abs() < 1e-15);
        }
    }
}
