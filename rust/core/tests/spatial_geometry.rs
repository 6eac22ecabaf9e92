//! Geometry of the spatial model: gaps, force directions and joints against closed forms, the print, and differences.

mod common;

#[path = "common/spatial.rs"]
mod spatial;

use std::f64::consts::PI;

use common::{Random, links};
use nalgebra::{DMatrix, Matrix3, Matrix6x2, Quaternion, Vector2, Vector3, Vector6};
use snake_core::robot::{Link, Robot, RobotConfig};
use snake_core::scene::Peg;
use snake_core::spatial::{
    End, Pose, Twist, assemble_chain, close_joints, ground_contact, ground_frame, ground_gap, joint_angle, joint_gap,
    joint_rate, joint_rows, largest_joint_gap, orientation_of, peg_contact, peg_gap, printed_joint_rate,
    rest_on_ground, travel,
};
use spatial::{nudged, random_angle, random_link, random_peg, random_pose, random_twist, random_vector, tilde, turned};

/// Step of central differences: they err by its square times a third derivative, and by round-off over the step.
const D: f64 = 1e-6;

/// Derivative of `f` along each of the six directions of a twist.
fn gradient(pose: &Pose, f: impl Fn(&Pose) -> f64) -> Vector6<f64> {
    Vector6::from_fn(|k, _| {
        let mut step = Twist::zeros();
        step[k] = D;
        (f(&nudged(pose, &step)) - f(&nudged(pose, &-step))) / (2.0 * D)
    })
}

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
fn ground_gap_is_the_height_of_the_sphere_above_the_ground() {
    let link = Robot::new(&RobotConfig::default()).unwrap().links[0];
    let at = |pitch: f64, roll: f64| Pose {
        position: Vector3::new(0.3, -0.2, 0.2),
        orientation: orientation_of(0.7, pitch, roll),
    };
    for (pitch, roll) in [(0.0, 0.0), (0.4, 0.0), (-1.2, 2.0), (0.5 * PI, 0.3)] {
        let lift = 0.0393 * pitch.sin();
        assert!((ground_gap(&link, &at(pitch, roll), End::Front) - (0.2 + lift - 0.0525)).abs() < 1e-15);
        assert!((ground_gap(&link, &at(pitch, roll), End::Rear) - (0.2 - lift - 0.0525)).abs() < 1e-15);
    }
}

#[test]
fn normal_direction_is_the_gradient_of_the_ground_gap() {
    let mut random = Random::new(41);
    for _ in 0..2000 {
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
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
        let (link, pose, u) = (random_link(&mut random), random_pose(&mut random), random_twist(&mut random));
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
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
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

/// (gap, w_H) from the printed cases: cylinder (T 4.10)-(T 4.12), (T 4.53)-(T 4.54), sphere (T 4.13)-(T 4.15), (T 4.57).
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
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
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
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
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
fn peg_gap_is_the_distance_between_the_surfaces() {
    let mut random = Random::new(46);
    for _ in 0..300 {
        let (link, pose) = (random_link(&mut random), random_pose(&mut random));
        let peg = random_peg(&mut random, &link, &pose);
        let places = 20_000;
        let nearest = (0..=places)
            .map(|k| {
                let s = link.contact_half_length * (2.0 * f64::from(k) / f64::from(places) - 1.0);
                (pose.position + pose.axis() * s).xy().metric_distance(&Vector2::new(peg.x, peg.y))
            })
            .fold(f64::INFINITY, f64::min);
        let gap = peg_gap(&link, &pose, &peg);
        let sampled = nearest - link.radius - peg.radius;
        assert!(gap <= sampled + 1e-15 && sampled - gap < 2e-5, "samples lie at most 1.5e-5 m apart");
    }
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

/// Two links whose joint is closed up to a small random error.
fn random_joint(random: &mut Random) -> [(Link, Pose); 2] {
    let (near, far) = (random_link(random), random_link(random));
    let robot = Robot { links: vec![near, far], gravity: 9.81 };
    let mut pose = [random_pose(random), Pose::identity()];
    assemble_chain(&robot, pose[0], &[random_angle(random, 1.4)], &mut pose);
    [(near, pose[0]), (far, pose[1])]
}

#[test]
fn joint_directions_are_the_gradients_of_the_joint_gaps() {
    let mut random = Random::new(47);
    for _ in 0..1000 {
        let [(near, q), (far, p)] = random_joint(&mut random);
        let p = turned(&p, random_vector(&mut random, 0.1));
        let rows = joint_rows(&near, &q, &far, &p);
        for row in 0..4 {
            let by_near = gradient(&q, |q| joint_gap(&near, q, &far, &p)[row]);
            let by_far = gradient(&p, |p| joint_gap(&near, &q, &far, p)[row]);
            assert!((rows.near.column(row) - by_near).norm() < 1e-9);
            assert!((rows.far.column(row) - by_far).norm() < 1e-9);
        }
    }
}

#[test]
fn joint_rates_are_the_derivatives_of_the_joint_angles() {
    let mut random = Random::new(48);
    for _ in 0..1000 {
        let [(near, q), (far, p)] = random_joint(&mut random);
        // A twist of the far link that keeps the joint closed: rates about the joint's axes on top of the near link's.
        let rates = random_angle(&mut random, 1.0);
        let u = random_twist(&mut random);
        let omega = q.orientation * u.fixed_rows::<3>(3).into_owned();
        let axes = snake_core::spatial::joint_axes(&q, &p);
        let omega_far = omega + axes.yaw * rates.x + axes.pitch * rates.y;
        let at_joint = u.fixed_rows::<3>(0).into_owned() + omega.cross(&(q.axis() * (0.5 * near.length)));
        let v = at_joint + omega_far.cross(&(p.axis() * (0.5 * far.length)));
        let far_body = p.orientation.inverse_transform_vector(&omega_far);
        let w = Twist::new(v.x, v.y, v.z, far_body.x, far_body.y, far_body.z);
        let gap_rate = joint_rows(&near, &q, &far, &p);
        assert!((gap_rate.near.tr_mul(&u) + gap_rate.far.tr_mul(&w)).norm() < 1e-14, "W_J^T u = 0");
        let angle = |d: f64| joint_angle(&nudged(&q, &(u * d)), &nudged(&p, &(w * d)));
        let differences = (angle(D) - angle(-D)) / (2.0 * D);
        assert!((joint_rate(&q, &u, &p, &w) - rates).norm() < 1e-13);
        assert!((differences - rates).norm() < 1e-7, "angles up to 1.4 rad: derivatives grow as 1 / cos^3");
        let printed = printed_joint_rate(&q, &u, &p, &w);
        let pitch = joint_angle(&q, &p).y;
        assert!((printed - Vector2::new(pitch.cos() * rates.x, rates.y)).norm() < 1e-13, "(T 4.98) has the cosine");
    }
}

/// (phi_h, phi_v) of (T 4.96), (T 4.97) from the last row of the relative rotation (T 4.95).
fn printed_joint_angle(near: &Pose, far: &Pose) -> Vector2<f64> {
    let relative = near.rotation().transpose() * far.rotation();
    Vector2::new(-relative[(2, 0)].asin(), (relative[(2, 1)] / relative[(2, 2)]).atan())
}

#[test]
fn an_assembled_chain_is_closed_and_has_its_joint_angles_beyond_right_angles_too() {
    let mut random = Random::new(49);
    for _ in 0..200 {
        let robot = Robot::new(&links(12)).unwrap();
        let mut pose = vec![Pose::identity(); 12];
        let angles: Vec<_> = (0..11).map(|_| random_angle(&mut random, 3.1)).collect();
        assemble_chain(&robot, random_pose(&mut random), &angles, &mut pose);
        assert!(largest_joint_gap(&robot, &pose) < 1e-15);
        for (j, angle) in angles.iter().enumerate() {
            let found = joint_angle(&pose[j], &pose[j + 1]);
            assert!((found - angle).norm() < 1e-13);
            if angle.amax() < 0.5 * PI {
                let printed = printed_joint_angle(&pose[j], &pose[j + 1]);
                assert!((found - printed).norm() < 1e-6, "asin loses half of the digits at a right angle");
            }
            let gap = joint_gap(&robot.links[j], &pose[j], &robot.links[j + 1], &pose[j + 1]);
            assert!(gap.norm() < 1e-14, "{gap}");
        }
    }
}

/// Algorithm 4.3 keeps link 1 and all centre lines' directions.
#[test]
fn closing_the_joints_keeps_the_first_link_and_all_centre_lines() {
    let mut random = Random::new(50);
    for _ in 0..200 {
        let robot = Robot::new(&links(8)).unwrap();
        let mut pose = vec![Pose::identity(); 8];
        // Every other joint is folded back by half a turn: the projection must not unfold it.
        let folded = |j: usize| Vector2::new(0.0, if j.is_multiple_of(2) { 0.0 } else { PI });
        let angles: Vec<_> = (0..7).map(|j| random_angle(&mut random, 1.2) + folded(j)).collect();
        assemble_chain(&robot, random_pose(&mut random), &angles, &mut pose);
        for pose in &mut pose {
            *pose = turned(pose, random_vector(&mut random, 1e-3));
            pose.position += random_vector(&mut random, 1e-3);
        }
        let before = pose.clone();
        close_joints(&robot, &mut pose);
        assert_eq!(pose[0], before[0]);
        for j in 0..7 {
            let gap = joint_gap(&robot.links[j], &pose[j], &robot.links[j + 1], &pose[j + 1]);
            assert!(gap.norm() < 1e-14);
            assert!((pose[j + 1].axis() - before[j + 1].axis()).norm() < 1e-14);
            let turn = pose[j + 1].orientation.angle_to(&before[j + 1].orientation);
            assert!(turn < 0.05, "errors of 1e-3 rad add up along the chain, more where links stand askew: {turn}");
        }
    }
}

#[test]
fn gaps_and_velocities_do_not_change_when_the_scene_is_moved_in_the_plane() {
    let mut random = Random::new(51);
    for _ in 0..1000 {
        let (link, pose, u) = (random_link(&mut random), random_pose(&mut random), random_twist(&mut random));
        let peg = random_peg(&mut random, &link, &pose);
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.angle());
        let shift = Vector3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
        let moved = Pose { position: turn * pose.position + shift, orientation: turn * pose.orientation };
        let hub = turn * Vector3::new(peg.x, peg.y, 0.0) + shift;
        let moved_peg = Peg { x: hub.x, y: hub.y, ..peg };
        let v = turn * u.fixed_rows::<3>(0).into_owned();
        let moved_u = Twist::new(v.x, v.y, v.z, u[3], u[4], u[5]);
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
        let u = Twist::new(v.x, v.y, v.z, 0.0, 0.0, omega);
        for end in End::BOTH {
            let contact = ground_contact(&link, &pose, end);
            assert!(contact.gap.abs() < 1e-16);
            assert!(contact.tangent.tr_mul(&u).norm() < 1e-15 && contact.normal.dot(&u).abs() < 1e-16);
            assert!((contact.rolling.tr_mul(&u).norm() - omega * link.radius).abs() < 1e-15);
        }
    }
}

#[test]
fn a_chain_put_on_the_ground_touches_it_and_nowhere_enters_it() {
    let mut random = Random::new(52);
    for _ in 0..200 {
        let robot = Robot::new(&links(6)).unwrap();
        let mut pose = vec![Pose::identity(); 6];
        let angles: Vec<_> = (0..5).map(|_| random_angle(&mut random, 1.0)).collect();
        assemble_chain(&robot, random_pose(&mut random), &angles, &mut pose);
        rest_on_ground(&robot, &mut pose);
        let gaps = robot.links.iter().zip(&pose).flat_map(|(link, q)| End::BOTH.map(|end| ground_gap(link, q, end)));
        let lowest = gaps.fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 1e-15);
    }
}
