//! Kinematics of the chain: orientations, and joints that close (T 4.2).

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use crate::robot::Robot;

use super::{End, Pose, ground_gap, joint_gap, turned_by};

/// Orientation of a link whose centre line points along (cos yaw cos pitch, sin yaw cos pitch, sin pitch), turned by
/// `roll` about it; with roll 0 its e_x^B is horizontal and e_y^B points up \[rad\].
pub fn orientation_of(yaw: f64, pitch: f64, roll: f64) -> UnitQuaternion<f64> {
    let flat = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[
        Vector3::y(),
        Vector3::z(),
        Vector3::x(),
    ])));
    let about = UnitQuaternion::from_axis_angle;
    about(&Vector3::z_axis(), yaw) * flat * about(&Vector3::x_axis(), -pitch) * about(&Vector3::z_axis(), roll)
}

/// Poses of a chain from the pose of link 1 and the joint angles (yaw, pitch) (T 4.92); those about axes that joints do
/// not have are left out.
pub fn assemble_chain(robot: &Robot, head: Pose, joint_angle: &[Vector2<f64>], pose: &mut [Pose]) {
    pose[0] = head;
    for (i, angle) in joint_angle.iter().enumerate() {
        pose[i + 1].orientation = turned_by(robot.axes[i], &pose[i].orientation, (*angle).into());
    }
    close_positions(robot, pose);
}

/// Shifts links 2..n so that the ends meet in every joint (T 4.18).
pub fn close_positions(robot: &Robot, pose: &mut [Pose]) {
    let mut joint: Option<Vector3<f64>> = None;
    for (link, pose) in robot.links.iter().zip(pose) {
        let (axis, [front, rear]) = (pose.axis(), link.arms());
        if let Some(joint) = joint {
            pose.position = joint + axis * front;
        }
        joint = Some(pose.position + axis * rear);
    }
}

/// Largest distance between the two ends that meet in a joint \[m\].
pub fn largest_joint_gap(robot: &Robot, pose: &[Pose]) -> f64 {
    let pairs = robot.links.windows(2).zip(pose.windows(2));
    let width = |(link, q): (&[_], &[Pose])| joint_gap(&link[0], &q[0], &link[1], &q[1]).fixed_rows::<3>(0).norm();
    pairs.map(width).fold(0.0, f64::max)
}

/// Lifts or lowers the whole chain until its lowest end sphere touches the ground.
pub fn rest_on_ground(robot: &Robot, pose: &mut [Pose]) {
    let gaps = robot.links.iter().zip(&*pose).flat_map(|(link, pose)| End::BOTH.map(|end| ground_gap(link, pose, end)));
    let lowest = gaps.fold(f64::INFINITY, f64::min);
    pose.iter_mut().for_each(|pose| pose.position.z -= lowest);
}
