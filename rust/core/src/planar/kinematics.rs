//! Kinematics of the chain: joints as position constraints (T 3.3.3) and as kinematic recursion.

use nalgebra::{Vector2, Vector3};

use crate::math::{Real, add_scaled};
use crate::robot::{Link, Robot};

use super::{Heading, Pose};

/// g_J of one joint: the vector from the joint on the next link to the joint on this one (T 3.14).
pub fn joint_gap(link: &Link, pose: &Pose, next_link: &Link, next_pose: &Pose) -> Vector2<f64> {
    let front = pose.xy() + Heading::of(pose.z).axial() * link.arms()[1];
    let rear = next_pose.xy() - Heading::of(next_pose.z).axial() * next_link.arms()[0];
    front - rear
}

/// Length of the widest joint gap of a chain \[m\].
pub fn largest_joint_gap(robot: &Robot, pose: &[Pose]) -> f64 {
    let pairs = robot.links.windows(2).zip(pose.windows(2));
    pairs.map(|(link, q)| joint_gap(&link[0], &q[0], &link[1], &q[1]).norm()).fold(0.0, f64::max)
}

/// Moves links 2..n so that every joint closes, link 1 and all angles kept (T 3.6.3).
pub fn close_joints(robot: &Robot, pose: &mut [Pose]) {
    let mut joint: Option<Vector2<f64>> = None;
    for (link, pose) in robot.links.iter().zip(pose) {
        let (axial, [front, rear]) = (Heading::of(pose.z).axial(), link.arms());
        if let Some(joint) = joint {
            let cg = joint + axial * front;
            (pose.x, pose.y) = (cg.x, cg.y);
        }
        joint = Some(pose.xy() + axial * rear);
    }
}

/// Poses of a chain from the CG and absolute angle of link 1 and the joint angles.
pub fn assemble_chain(robot: &Robot, first: Pose, joint_angle: &[f64], pose: &mut [Pose]) {
    pose[0] = first;
    for (i, angle) in joint_angle.iter().enumerate() {
        pose[i + 1] = Pose::new(0.0, 0.0, pose[i].z + angle);
    }
    close_joints(robot, pose);
}

/// Poses after moving from `from` with `twist` for `duration`, joints closed: link 1 and all angles
/// travel along their velocities, the rest of the chain follows from the joints, whose distances from the CGs are `arms`.
/// Writes the headings too. What follows the chain, which has as many links as `arms`, moves freely and keeps its heading.
#[inline(always)]
pub fn travel<T: Real>(
    arms: &[[T; 2]],
    from: &[Vector3<T>],
    twist: &[Vector3<T>],
    duration: T,
    to: &mut [Vector3<T>],
    heading: &mut [Heading<T>],
) {
    let (mut x, mut y) = (T::zero(), T::zero());
    for i in 0..arms.len() {
        let theta = from[i].z + twist[i].z * duration;
        heading[i] = Heading::of(theta);
        let (Heading { cos, sin }, [front, rear]) = (heading[i], arms[i]);
        if i == 0 {
            (x, y) = (from[0].x + twist[0].x * duration, from[0].y + twist[0].y * duration);
        } else {
            (x, y) = (x + cos * front, y + sin * front);
        }
        to[i] = Vector3::new(x, y, theta);
        (x, y) = (x + cos * rear, y + sin * rear);
    }
    for i in arms.len()..from.len() {
        to[i] = add_scaled(&from[i], &twist[i], duration);
        heading[i] = Heading::of(to[i].z);
    }
}

/// Mean twists between `twist` and those that keep the joints closed at `heading`, where `twist` keeps link 1 and turns all
/// angles. If it keeps the joints closed at the headings from which [`travel`] moves a chain to these, the links travel as
/// fast as this, to second order in the duration.
#[inline(always)]
pub fn mean_twist<T: Real>(arms: &[[T; 2]], heading: &[Heading<T>], twist: &[Vector3<T>], mean: &mut [Vector3<T>]) {
    let (mut x, mut y) = (T::zero(), T::zero());
    let half = T::splat(0.5);
    for (i, u) in twist.iter().enumerate() {
        let Some(arms) = arms.get(i) else {
            mean[i] = *u;
            continue;
        };
        let (Heading { cos, sin }, [front, rear]) = (heading[i], [u.z * arms[0], u.z * arms[1]]);
        (x, y) = if i == 0 { (u.x, u.y) } else { (x - sin * front, y + cos * front) };
        mean[i] = Vector3::new(half * (u.x + x), half * (u.y + y), u.z);
        (x, y) = (x - sin * rear, y + cos * rear);
    }
}
