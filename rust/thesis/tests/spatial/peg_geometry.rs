//! Pegs and links: gaps and directions against closed forms, the print, and differences.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3, Vector6};
use snake_core::robot::{Link, Robot, RobotConfig};
use snake_core::scene::Peg;
use snake_core::spatial::{End, Pose, StackedTwist, orientation_of, peg_gap};
use snake_test_support::planar::Random;
use snake_test_support::spatial_random::{gradient, random_even_link, random_peg, random_pose, random_twist, tilde};
use snake_thesis::spatial::{ground_contact, peg_contact};

/// (gap, w_H) from the printed cases: cylinder (T 4.10)-(T 4.12), (T 4.53)-(T 4.54), sphere (T 4.13)-(T 4.15),
/// (T 4.57).
fn printed_peg(link: &Link, pose: &Pose, peg: &Peg) -> (f64, Vector6<f64>) {
    let r = pose.rotation();
    let e_z: Vector3<f64> = r.column(2).into();
    let up = Vector3::z();
    let flat = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
    let from_peg = pose.position - Vector3::new(peg.x, peg.y, 0.0);
    let reach = peg.radius + link.radius;
    let shadow = flat * e_z;
    let along = -from_peg.dot(&shadow) / shadow.norm_squared();
    let joined = |linear: Vector3<f64>, angular: Vector3<f64>| {
        Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    };
    if along.abs() <= link.contact_half_length {
        let width = up.cross(&e_z).norm();
        let n = up.cross(&e_z) / width;
        let d = from_peg.dot(&n);
        let c = (from_peg.transpose() / width) * (n * e_z.transpose() * flat / width - tilde(&up));
        let angular = (c * r * tilde(&Vector3::z())).transpose();
        return (d.abs() - reach, joined(n, angular) * d.signum());
    }
    let body_fixed = Vector3::z() * link.contact_half_length * along.signum();
    let to_sphere = flat * (pose.position + r * body_fixed) - Vector3::new(peg.x, peg.y, 0.0);
    let unit = to_sphere / to_sphere.norm();
    let angular = -(unit.transpose() * flat * r * tilde(&body_fixed)).transpose();
    (to_sphere.norm() - reach, joined(flat * unit, angular))
}

#[test]
fn peg_gap_and_direction_are_the_printed_cases() {
    let mut random = Random::new(44);
    for _ in 0..50_000 {
        let (link, pose) = (random_even_link(&mut random), random_pose(&mut random));
        if pose.axis().xy().norm() < 1e-2 {
            continue; // the print divides by this length
        }
        let peg = random_peg(&mut random, &link, &pose);
        let contact = peg_contact(&link, &pose, &peg);
        let (gap, direction) = printed_peg(&link, &pose, &peg);
        assert!((contact.gap - gap).abs() < 1e-13, "ulps of 1 over the shadow's length");
        assert!((contact.direction - direction).norm() < 1e-9, "ulps of 1 over its square and the distance");
    }
}

#[test]
fn peg_direction_is_the_gradient_of_the_gap_on_cylinder_and_spheres() {
    let mut random = Random::new(45);
    let (mut sides, mut caps) = (0, 0);
    for _ in 0..20_000 {
        let (link, pose) = (random_even_link(&mut random), random_pose(&mut random));
        let peg = random_peg(&mut random, &link, &pose);
        let contact = peg_contact(&link, &pose, &peg);
        let on_cap = contact.along.abs() == link.contact_half_length;
        // The second derivative grows as 1 / shadow^2, and it jumps where side and cap meet.
        let clear = pose.axis().xy().norm() > 0.1 && (contact.along.abs() < link.contact_half_length - 1e-3 || on_cap);
        if clear {
            let error = (contact.direction - gradient(&pose, |pose| peg_gap(&link, pose, &peg))).norm();
            assert!(error < 2e-5, "{error:.1e}: first-order at the seam, d^2 / distance^2 elsewhere");
            *(if on_cap { &mut caps } else { &mut sides }) += 1;
        }
    }
    assert!(sides > 1000 && caps > 1000, "{sides} {caps}");
}

#[test]
fn an_upright_link_touches_a_peg_with_its_circular_outline() {
    let link = Robot::new(&RobotConfig::default()).unwrap().links[0];
    for tilt in [0.0, 1e-17, 1e-10, 1e-8, 1e-6] {
        for yaw in [0.0, 1.0, 4.0] {
            let pose =
                Pose { position: Vector3::new(0.1, 0.2, 0.5), orientation: orientation_of(yaw, 0.5 * PI - tilt, 0.3) };
            let peg = Peg { radius: 0.1, x: 0.4, y: 0.6 };
            let contact = peg_contact(&link, &pose, &peg);
            assert!((contact.gap - (0.5 - 0.1 - link.radius)).abs() < 1e-7, "a tilt of 1e-6 moves it by 4e-8 m");
            assert!((contact.normal - Vector3::new(-0.6, -0.8, 0.0)).norm() < 1e-6);
            assert!(contact.direction.iter().all(|x| x.is_finite()));
            assert!(contact.along.abs() <= link.contact_half_length);
        }
    }
    let inside = Pose { position: Vector3::new(0.4, 0.6, 0.5), orientation: orientation_of(0.0, 0.5 * PI, 0.0) };
    let contact = peg_contact(&link, &inside, &Peg { radius: 0.1, x: 0.4, y: 0.6 });
    assert!((contact.normal.norm() - 1.0).abs() < 1e-15, "a peg on the centre line still has a unit normal");
}

#[test]
fn gaps_and_velocities_do_not_change_when_the_scene_is_moved_in_the_plane() {
    let mut random = Random::new(51);
    for _ in 0..1000 {
        let (link, pose, u) = (random_even_link(&mut random), random_pose(&mut random), random_twist(&mut random));
        let peg = random_peg(&mut random, &link, &pose);
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.angle());
        let shift = Vector3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
        let moved = Pose { position: turn * pose.position + shift, orientation: turn * pose.orientation };
        let hub = turn * Vector3::new(peg.x, peg.y, 0.0) + shift;
        let moved_peg = Peg { x: hub.x, y: hub.y, ..peg };
        let v = turn * u.fixed_rows::<3>(0).into_owned();
        let moved_u = StackedTwist::new(v.x, v.y, v.z, u[3], u[4], u[5]);
        let (before, after) = (peg_contact(&link, &pose, &peg), peg_contact(&link, &moved, &moved_peg));
        assert!((before.gap - after.gap).abs() < 1e-14);
        assert!((before.direction.dot(&u) - after.direction.dot(&moved_u)).abs() < 1e-11);
        for end in End::BOTH {
            let (before, after) = (ground_contact(&link, &pose, end), ground_contact(&link, &moved, end));
            assert!((before.gap - after.gap).abs() < 1e-15);
            assert!((before.normal.dot(&u) - after.normal.dot(&moved_u)).abs() < 1e-14);
            assert!((before.tangent.tr_mul(&u) - after.tangent.tr_mul(&moved_u)).norm() < 1e-13);
        }
    }
}
