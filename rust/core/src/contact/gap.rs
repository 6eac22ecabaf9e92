//! Distance between a stadium-shaped link and a circular peg, with a moving contact point.

use nalgebra::{Vector2, Vector3};

use crate::robot::Link;
use crate::scene::Peg;

/// Gap and force direction of one link-peg pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPegContact {
    /// g_H, negative when penetrating \[m\] (T 3.9), (T 3.10).
    pub gap: f64,
    /// w_H with g_H' = w_H^T u_i for the link's twist u_i (T 3.16), (T 3.18).
    pub direction: Vector3<f64>,
}

/// Gap g_H between `link` at `pose` = (x, y, theta) and `peg` \[m\].
pub fn gap(pose: &Vector3<f64>, link: &Link, peg: &Peg) -> f64 {
    let (sin, cos) = pose.z.sin_cos();
    separation(pose, cos, sin, link, peg).0.norm() - (peg.radius + link.radius)
}

/// Gap and force direction; `cos` and `sin` are those of the link's angle.
///
/// The nearest point of the link's centre line to the peg's centre lies at
/// `s = clamp((r_H - r_G) . e_x^B, -L_GS, L_GS)`. Inside the clamp this is the rectangle case
/// (T 3.8)-(T 3.9), (T 3.16 != D1); on it one of the end caps (T 3.10)-(T 3.12), (T 3.18 != D1). In both, the
/// normal `n` points from the peg to the link, and since moving `s` along the link changes the
/// distance only to second order, g' = n . (v_G + omega s e_y^B).
pub fn link_peg_contact(pose: &Vector3<f64>, cos: f64, sin: f64, link: &Link, peg: &Peg) -> LinkPegContact {
    let (offset, s) = separation(pose, cos, sin, link, peg);
    let distance = offset.norm();
    let lateral = Vector2::new(-sin, cos);
    // A peg centred exactly on the link's centre line leaves the side open: take e_y^B.
    let normal = if distance > 0.0 { offset / distance } else { lateral };
    LinkPegContact {
        gap: distance - (peg.radius + link.radius),
        direction: Vector3::new(normal.x, normal.y, s * normal.dot(&lateral)),
    }
}

/// Vector from the peg's centre to the nearest point of the link's centre line, and that point's
/// coordinate `s` along the link.
fn separation(pose: &Vector3<f64>, cos: f64, sin: f64, link: &Link, peg: &Peg) -> (Vector2<f64>, f64) {
    let from_peg = Vector2::new(pose.x - peg.x, pose.y - peg.y);
    let axis = Vector2::new(cos, sin);
    let s = (-from_peg.dot(&axis)).clamp(-link.contact_half_length, link.contact_half_length);
    (from_peg + axis * s, s)
}
