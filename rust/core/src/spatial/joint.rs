//! Cardan joints: two free rotations, four constraints (T 4.2.4), (T 4.5); and hinges, one free rotation.

use std::f64::consts::PI;

use nalgebra::{Unit, UnitQuaternion, Vector2, Vector3, Vector4};

use crate::math::Real;
use crate::robot::{Axes, Link};

use super::spatial_vector::combined;
use super::{Pose, StackedTwist, turning};

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
    let front = near_pose.position + near_pose.axis() * near.arms()[1];
    let rear = far_pose.position - far_pose.axis() * far.arms()[0];
    let JointAxes { yaw, pitch } = joint_axes(near_pose, far_pose);
    (front - rear).push(yaw.dot(&pitch))
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

/// Directions of both axes of a joint, given e_x^B, e_y^B and e_z^B of the links before and behind it; an axis that it does
/// not have has some direction.
#[inline(always)]
pub fn hinge_directions<T: Real>(axes: Axes, near: &[Vector3<T>; 3], far: &[Vector3<T>; 3]) -> [Vector3<T>; 2] {
    match axes {
        Axes::About(axis) => [combined(far, &axis.map(T::splat)); 2],
        _ => [near[1], far[0]],
    }
}

/// Orientation of the link behind a joint with the given angles.
pub fn turned_by(axes: Axes, near: &UnitQuaternion<f64>, [first, second]: [f64; 2]) -> UnitQuaternion<f64> {
    let about = UnitQuaternion::from_axis_angle;
    match axes {
        Axes::Both => near * about(&Vector3::y_axis(), first) * about(&Vector3::x_axis(), second),
        Axes::Yaw => near * about(&Vector3::y_axis(), first),
        Axes::Pitch => near * about(&Vector3::x_axis(), second),
        Axes::About(axis) => near * about(&Unit::new_unchecked(axis.into()), if axes.has(0) { first } else { second }),
    }
}

/// [`joint_angle`] of a joint with any axes; zero about an axis that it does not have.
pub fn axis_angles(axes: Axes, near: &Pose, far: &Pose) -> [f64; 2] {
    match axes {
        Axes::About(axis) => {
            let turn = near.orientation.inverse() * far.orientation;
            let half = turn.imag().dot(&Vector3::from(axis)).atan2(turn.w);
            // A rotation has two quaternions, whose angles are a full turn apart.
            axes.at_own_place(2.0 * (half - PI * (half / PI).round()))
        }
        _ => of_axes(axes, joint_angle(near, far)),
    }
}

/// [`joint_rate`] of a joint with any axes; zero about an axis that it does not have.
pub fn axis_rates(axes: Axes, near: (&Pose, &StackedTwist), far: (&Pose, &StackedTwist)) -> [f64; 2] {
    match axes {
        Axes::About(axis) => {
            let of_link = |(pose, twist): (&Pose, &StackedTwist)| pose.orientation * turning(twist);
            let relative = far.0.orientation.inverse_transform_vector(&(of_link(far) - of_link(near)));
            axes.at_own_place(relative.dot(&Vector3::from(axis)))
        }
        _ => of_axes(axes, joint_rate(near.0, near.1, far.0, far.1)),
    }
}

fn of_axes(axes: Axes, both: Vector2<f64>) -> [f64; 2] {
    [0, 1].map(|axis| if axes.has(axis) { both[axis] } else { 0.0 })
}
