//! Minimisation of a quadratic over the motions of the chain, O(n), and again for more gradients.
//!
//! Unknowns are the velocity p of O_2 and the angular velocities. Each link contributes
//! `g . x + x^T H x / 2` in its twist x, each joint `k (omega_i - omega_{i-1})^2 / 2`. What lies behind a
//! joint is, minimised, a quadratic of the joint's velocity and the angular velocity before it; from
//! tail to head each link adds itself and one scalar pivot removes its angular velocity.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::minimal::motion::Twist;

/// Curvature that one link and the joint before it contribute.
#[derive(Debug, Clone, Copy)]
pub struct Curvature {
    /// (L/2) e_y: velocity of the far end relative to the CG at omega = 1.
    pub swing: Vector2<f64>,
    /// H, symmetric.
    pub link: Matrix3<f64>,
    /// k of the joint before; 0 for the first link.
    pub joint: f64,
}

/// omega_i = -(px p_x + py p_y + ...): what eliminating omega_i leaves for gradients and substitution.
#[derive(Debug, Clone, Copy)]
struct Pivot {
    swing: Vector2<f64>,
    /// Coupling of omega_i with p.
    cross: Vector2<f64>,
    inverse: f64,
    joint: f64,
}

/// A factorised chain.
#[derive(Debug, Clone)]
pub struct ChainFactor {
    pivots: Vec<Pivot>,
    /// Inverse of the curvature left for p.
    head: [f64; 3],
}

impl ChainFactor {
    pub fn new(links: usize) -> Self {
        let nothing = Vector2::zeros();
        Self { pivots: vec![Pivot { swing: nothing, cross: nothing, inverse: 0.0, joint: 0.0 }; links], head: [0.0; 3] }
    }

    /// Eliminates from tail to head.
    pub fn factorise(&mut self, links: &[Curvature]) {
        let (mut xx, mut xy, mut yy, mut xw, mut yw, mut ww) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (pivot, link) in self.pivots.iter_mut().zip(links).rev() {
            let (ax, ay) = (link.swing.x, link.swing.y);
            let h = &link.link;
            for side in 0..2 {
                // Seen from the CG, then from the near end: p = p_new + omega (ax, ay).
                let (px, py) = (xx * ax + xy * ay, xy * ax + yy * ay);
                ww += ax * (xw + xw + px) + ay * (yw + yw + py);
                xw += px;
                yw += py;
                if side == 0 {
                    (xx, xy, yy) = (xx + h[(0, 0)], xy + h[(0, 1)], yy + h[(1, 1)]);
                    (xw, yw, ww) = (xw + h[(0, 2)], yw + h[(1, 2)], ww + h[(2, 2)]);
                }
            }
            let k = link.joint;
            let inverse = 1.0 / (ww + k);
            *pivot = Pivot { swing: link.swing, cross: Vector2::new(xw, yw), inverse, joint: k };
            (xx, xy, yy) = (xx - xw * xw * inverse, xy - xw * yw * inverse, yy - yw * yw * inverse);
            (xw, yw, ww) = (xw * k * inverse, yw * k * inverse, ww * k * inverse);
        }
        let determinant = xx * yy - xy * xy;
        self.head = [yy / determinant, -xy / determinant, xx / determinant];
    }

    /// The twists that minimise for the gradients `g`; `scratch` is as long as the chain.
    pub fn solve(&self, g: &[Vector3<f64>], scratch: &mut [f64], twist: &mut [Twist]) {
        let (mut gx, mut gy, mut gw) = (0.0, 0.0, 0.0);
        for ((pivot, g), constant) in self.pivots.iter().zip(g).zip(scratch.iter_mut()).rev() {
            let (ax, ay) = (pivot.swing.x, pivot.swing.y);
            gw += ax * gx + ay * gy + g.z;
            (gx, gy) = (gx + g.x, gy + g.y);
            gw += ax * gx + ay * gy;
            *constant = gw * pivot.inverse;
            (gx, gy) = (gx - pivot.cross.x * *constant, gy - pivot.cross.y * *constant);
            gw = pivot.joint * *constant;
        }
        let [a, b, c] = self.head;
        let (mut px, mut py, mut omega) = (-(a * gx + b * gy), -(b * gx + c * gy), 0.0);
        for ((pivot, constant), twist) in self.pivots.iter().zip(scratch.iter()).zip(twist) {
            let pull = pivot.cross.x * px + pivot.cross.y * py - pivot.joint * omega;
            omega = -pull * pivot.inverse - constant;
            *twist = Twist::new(px + pivot.swing.x * omega, py + pivot.swing.y * omega, omega);
            (px, py) = (twist.x + pivot.swing.x * omega, twist.y + pivot.swing.y * omega);
        }
    }
}
