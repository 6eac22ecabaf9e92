//! Cardan joints: directions and rates against the print and differences, and Algorithm 4.3.

use std::f64::consts::PI;

use nalgebra::Vector2;
use snake_core::robot::Robot;
use snake_core::spatial::{Pose, StackedTwist, assemble_chain, joint_angle, joint_axes, joint_gap};
use snake_test_support::planar::{Random, links};
use snake_test_support::spatial_random::{
    gradient, random_angle, random_even_link, random_joint, random_pose, random_twist, random_vector, turned,
};
use snake_thesis::spatial::{close_joints, joint_rows, printed_joint_rate};

#[test]
fn joint_directions_are_the_gradients_of_the_joint_gaps() {
    let mut random = Random::new(47);
    for _ in 0..1000 {
        let [(near, q), (far, p)] = random_joint(&mut random, random_even_link);
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

/// The twist of the far link keeps the joint closed: rates about the joint's axes on top of the near link's.
#[test]
fn closed_joints_have_the_printed_rates() {
    let mut random = Random::new(48);
    for _ in 0..1000 {
        let [(near, q), (far, p)] = random_joint(&mut random, random_even_link);
        let rates = random_angle(&mut random, 1.0);
        let u = random_twist(&mut random);
        let omega = q.orientation * u.fixed_rows::<3>(3).into_owned();
        let axes = joint_axes(&q, &p);
        let omega_far = omega + axes.yaw * rates.x + axes.pitch * rates.y;
        let at_joint = u.fixed_rows::<3>(0).into_owned() + omega.cross(&(q.axis() * (0.5 * near.length)));
        let v = at_joint + omega_far.cross(&(p.axis() * (0.5 * far.length)));
        let far_body = p.orientation.inverse_transform_vector(&omega_far);
        let w = StackedTwist::new(v.x, v.y, v.z, far_body.x, far_body.y, far_body.z);
        let gap_rate = joint_rows(&near, &q, &far, &p);
        assert!((gap_rate.near.tr_mul(&u) + gap_rate.far.tr_mul(&w)).norm() < 1e-14, "W_J^T u = 0");
        let printed = printed_joint_rate(&q, &u, &p, &w);
        let pitch = joint_angle(&q, &p).y;
        assert!((printed - Vector2::new(pitch.cos() * rates.x, rates.y)).norm() < 1e-13, "(T 4.98) has the cosine");
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
