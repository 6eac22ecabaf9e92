//! Cardan joints of the spatial model: gaps, angles and rates against the print and differences.

use std::f64::consts::PI;

use nalgebra::Vector2;
use snake_core::robot::Robot;
use snake_core::spatial::{
    Pose, StackedTwist, assemble_chain, joint_angle, joint_axes, joint_gap, joint_rate, largest_joint_gap,
};
use snake_test_support::planar::{Random, links};
use snake_test_support::spatial_random::{
    D, nudged, random_angle, random_joint, random_link, random_pose, random_twist,
};

#[test]
fn joint_rates_are_the_derivatives_of_the_joint_angles() {
    let mut random = Random::new(48);
    for _ in 0..1000 {
        let [(near, q), (far, p)] = random_joint(&mut random, random_link);
        // A twist of the far link that keeps the joint closed: rates about the joint's axes on top of the near link's.
        let rates = random_angle(&mut random, 1.0);
        let u = random_twist(&mut random);
        let omega = q.orientation * u.fixed_rows::<3>(3).into_owned();
        let axes = joint_axes(&q, &p);
        let omega_far = omega + axes.yaw * rates.x + axes.pitch * rates.y;
        let at_joint = u.fixed_rows::<3>(0).into_owned() + omega.cross(&(q.axis() * (0.5 * near.length)));
        let v = at_joint + omega_far.cross(&(p.axis() * (0.5 * far.length)));
        let far_body = p.orientation.inverse_transform_vector(&omega_far);
        let w = StackedTwist::new(v.x, v.y, v.z, far_body.x, far_body.y, far_body.z);
        let angle = |d: f64| joint_angle(&nudged(&q, &(u * d)), &nudged(&p, &(w * d)));
        let differences = (angle(D) - angle(-D)) / (2.0 * D);
        assert!((joint_rate(&q, &u, &p, &w) - rates).norm() < 1e-13);
        assert!((differences - rates).norm() < 1e-7, "angles up to 1.4 rad: derivatives grow as 1 / cos^3");
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
