//! Cardan joints: two free rotations, four constraints (T 4.2.4), (T 4.3.3), (T 4.5).

use nalgebra::{Matrix6x4, Vector2, Vector3, Vector4};

use crate::robot::Link;

use super::{Pose, StackedTwist, force_direction, turning, twist_of};

/// W_J of one joint: gamma_J = near^T u_i + far^T u_{i+1}, columns x, y, z and rotation (T 4.63), (T 4.65).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRows {
    pub near: Matrix6x4<f64>,
    pub far: Matrix6x4<f64>,
}

/// The axes of a joint's two free rotations, in frame I.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointAxes {
    /// e_y^{B_i}: a rate phi_h' turns the next link about it.
    pub yaw: Vector3<f64>,
    /// e_x^{B_{i+1}}: the same for phi_v'.
    pub pitch: Vector3<f64>,
}

/// g_J = (x, y, z, rotation): the vector from the joint on the next link to the joint on this one \[m\], and
/// e_y^{B_i} . e_x^{B_{i+1}} (T 4.18), (T 4.20).
pub fn joint_gap(near: &Link, near_pose: &Pose, far: &Link, far_pose: &Pose) -> Vector4<f64> {
    let front = near_pose.position + near_pose.axis() * (0.5 * near.length);
    let rear = far_pose.position - far_pose.axis() * (0.5 * far.length);
    let JointAxes { yaw, pitch } = joint_axes(near_pose, far_pose);
    (front - rear).push(yaw.dot(&pitch))
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

/// e_y^{B_i} and e_x^{B_{i+1}} (T 4.19).
pub fn joint_axes(near: &Pose, far: &Pose) -> JointAxes {
    JointAxes { yaw: near.orientation * Vector3::y(), pitch: far.orientation * Vector3::x() }
}

/// (phi_h, phi_v) of a joint, each in (-pi, pi] (T 4.96 != D33), (T 4.97 != D33) \[rad\].
///
/// In a closed joint the relative rotation (T 4.92) has the first column (cos phi_h, 0, -sin phi_h) and the second row
/// (0, cos phi_v, -sin phi_v).
pub fn joint_angle(near: &Pose, far: &Pose) -> Vector2<f64> {
    let turn = (near.orientation.inverse() * far.orientation).to_rotation_matrix();
    Vector2::new((-turn[(2, 0)]).atan2(turn[(0, 0)]), (-turn[(1, 2)]).atan2(turn[(1, 1)]))
}

/// (phi_h', phi_v') of a closed joint: the relative angular velocity along its axes \[rad/s\] (T 4.98 != D30).
pub fn joint_rate(near: &Pose, near_twist: &StackedTwist, far: &Pose, far_twist: &StackedTwist) -> Vector2<f64> {
    let relative = far.orientation * turning(far_twist) - near.orientation * turning(near_twist);
    let JointAxes { yaw, pitch } = joint_axes(near, far);
    Vector2::new(yaw.dot(&relative), pitch.dot(&relative))
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
