//! Smooth forces on a link, its motion over half a step, and the projection on closed joints (T 4.4.1), (T 4.6).

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector6};
use snake_core::robot::{Link, Robot};
use snake_core::spatial::{Pose, StackedTwist, close_positions, inertia, turning, twist_of};

/// h_i = (m g; -omega x Theta omega) under the acceleration of gravity g, (0, 0, -g) on level ground (T 4.72)
/// \[N, N m\].
pub fn smooth_force(link: &Link, gravity: &Vector3<f64>, u: &StackedTwist) -> Vector6<f64> {
    let omega = turning(u);
    let momentum = inertia(link).component_mul(&omega);
    twist_of(gravity * link.mass, -omega.cross(&momentum))
}

/// The pose after moving with `u` for `duration`: q + duration F(q) u, with the quaternion back on the unit sphere
/// (T 4.103 != D44), (T 4.104), (T 4.105), (T 4.123).
///
/// F(q) turns the angular velocity into p' = 1/2 p (0, omega). Scaling p scales p' alike, so it does not matter whether
/// the quaternion is normalised after each half step or once at the end.
pub fn travel(pose: &Pose, u: &StackedTwist, duration: f64) -> Pose {
    let p = pose.orientation.into_inner();
    let rate = p * Quaternion::from_imag(turning(u) * 0.5);
    Pose {
        position: pose.position + u.fixed_rows::<3>(0) * duration,
        orientation: UnitQuaternion::new_normalize(p + rate * duration),
    }
}

/// Turns links 2..n about their centre lines and shifts them so that every joint closes; link 1 and all centre lines'
/// directions are kept (Algorithm 4.3, steps 2 and 3) (T 4.6.3).
pub fn close_joints(robot: &Robot, pose: &mut [Pose]) {
    for i in 1..pose.len() {
        let previous_y = pose[i - 1].orientation * Vector3::y();
        pose[i].orientation = unrolled(&pose[i], &previous_y);
    }
    close_positions(robot, pose);
}

/// The orientation with the centre line of `pose` and e_x^B perpendicular to the previous link's e_y^B
/// (T 4.124)-(T 4.127).
///
/// Of the two such orientations it is the one nearer to that of `pose`; in a joint pitched beyond a right angle it is
/// not the printed one (T 4.125 != D33).
fn unrolled(pose: &Pose, previous_y: &Vector3<f64>) -> UnitQuaternion<f64> {
    let z = pose.axis();
    let Some(x) = previous_y.cross(&z).try_normalize(0.0) else { return pose.orientation };
    let x = x * x.dot(&(pose.orientation * Vector3::x())).signum();
    let y = z.cross(&x).normalize();
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z])))
}
