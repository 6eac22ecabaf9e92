//! Forces in and rates of cardan joints, in stacked coordinates (T 4.3.3), (T 4.5).

use nalgebra::{Matrix6x4, Vector2, Vector3};
use snake_core::robot::Link;
use snake_core::spatial::{JointAxes, Pose, StackedTwist, joint_axes, turning, twist_of};

use super::force_direction;

/// W_J of one joint: gamma_J = near^T u_i + far^T u_{i+1}, columns x, y, z and rotation (T 4.63), (T 4.65).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRows {
    pub near: Matrix6x4<f64>,
    pub far: Matrix6x4<f64>,
}

/// Directions of the four constraint forces of a joint.
pub fn joint_rows(near: &Link, near_pose: &Pose, far: &Link, far_pose: &Pose) -> JointRows {
    let (near_rotation, far_rotation) = (near_pose.rotation(), far_pose.rotation());
    let near_arm = near_rotation.column(2) * (0.5 * near.length);
    let far_arm = far_rotation.column(2) * (-0.5 * far.length);
    let JointAxes { yaw, pitch } = joint_axes(near_pose, far_pose);
    // The gap e_y . e_x opens as fast as link i turns about e_y x e_x relative to link i+1.
    let twist_axis = yaw.cross(&pitch);
    let mut rows = JointRows { near: Matrix6x4::zeros(), far: Matrix6x4::zeros() };
    for (column, axis) in [Vector3::x(), Vector3::y(), Vector3::z()].iter().enumerate() {
        rows.near.set_column(column, &force_direction(&near_rotation, axis, &near_arm));
        rows.far.set_column(column, &-force_direction(&far_rotation, axis, &far_arm));
    }
    rows.near.set_column(3, &twist_of(Vector3::zeros(), near_rotation.tr_mul(&twist_axis)));
    rows.far.set_column(3, &-twist_of(Vector3::zeros(), far_rotation.tr_mul(&twist_axis)));
    rows
}

/// (omega_h, omega_v) as printed: the first is cos(phi_v) phi_h' (T 4.98)-(T 4.100) \[rad/s\].
pub fn printed_joint_rate(
    near: &Pose,
    near_twist: &StackedTwist,
    far: &Pose,
    far_twist: &StackedTwist,
) -> Vector2<f64> {
    let seen_from_far = far.orientation.inverse_transform_vector(&(near.orientation * turning(near_twist)));
    let relative = turning(far_twist) - seen_from_far;
    Vector2::new(relative.y, relative.x)
}

/// Moments in the frames of the two links of a joint's torques tau_C = (yaw, pitch) (T 4.89) \[N m\].
pub fn actuator_torque(near: &Pose, far: &Pose, torque: Vector2<f64>) -> [Vector3<f64>; 2] {
    let JointAxes { yaw, pitch } = joint_axes(near, far);
    let moment = yaw * torque.x + pitch * torque.y;
    [near.orientation.inverse_transform_vector(&moment), -far.orientation.inverse_transform_vector(&moment)]
}
