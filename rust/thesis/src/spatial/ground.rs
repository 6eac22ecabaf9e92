//! Contact of a link's two end spheres with the ground (T 4.3.1).

use nalgebra::{Matrix3, Matrix6x2, Vector3, Vector6};
use snake_core::robot::Link;
use snake_core::spatial::{End, Pose, ground_gap, twist_of};

use super::force_direction;

/// Gap and directions of one end sphere against the ground; relative velocities are W^T u_i.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundContact {
    /// g_N, negative when penetrating \[m\] (T 4.8).
    pub gap: f64,
    /// w_N: the velocity along e_z^I of the body-fixed point at the contact (T 4.25).
    pub normal: Vector6<f64>,
    /// W_T: its velocity along e_x^Pi and e_y^Pi (T 4.39).
    pub tangent: Matrix6x2<f64>,
    /// W_V: the rolling velocity along e_x^I and e_y^I \[m/s\] (T 4.45).
    pub rolling: Matrix6x2<f64>,
}

/// Gap and directions of one end sphere (T 4.21)-(T 4.45).
pub fn ground_contact(link: &Link, pose: &Pose, end: End) -> GroundContact {
    let rotation = pose.rotation();
    let up = Vector3::z();
    let arm = rotation.column(2) * end.along(link) - up * link.radius;
    let direction = |axis: &Vector3<f64>| force_direction(&rotation, axis, &arm);
    let [x, y] = ground_frame(&rotation);
    GroundContact {
        gap: ground_gap(link, pose, end),
        normal: direction(&up),
        tangent: Matrix6x2::from_columns(&[direction(&x), direction(&y)]),
        rolling: Matrix6x2::from_columns(&[
            rolling_direction(link, &rotation, &Vector3::x()),
            rolling_direction(link, &rotation, &Vector3::y()),
        ]),
    }
}

/// e_x^Pi and e_y^Pi in frame I: along the link's shadow on the ground and across it (T 4.36).
///
/// The shadow of a link that stands upright has no direction; e_y^Pi is then the shadow of e_x^B, which it equals for
/// every link that is unrolled.
pub fn ground_frame(rotation: &Matrix3<f64>) -> [Vector3<f64>; 2] {
    let shadow = |column: usize| Vector3::new(rotation[(0, column)], rotation[(1, column)], 0.0);
    if let Some(x) = shadow(2).try_normalize(SHORTEST_SHADOW) {
        return [x, Vector3::new(-x.y, x.x, 0.0)];
    }
    let y = shadow(0).normalize();
    [Vector3::new(y.y, -y.x, 0.0), y]
}

/// One column of W_V: the component along `axis` of (radius e_z^I) x omega (T 4.43).
fn rolling_direction(link: &Link, rotation: &Matrix3<f64>, axis: &Vector3<f64>) -> Vector6<f64> {
    // axis . (c x omega) = omega . (axis x c)
    let moment = axis.cross(&(Vector3::z() * link.radius));
    twist_of(Vector3::zeros(), rotation.tr_mul(&moment))
}

/// Length of e_z^B's shadow below which a link counts as upright: round-off would turn the frame.
const SHORTEST_SHADOW: f64 = 1e-9;
