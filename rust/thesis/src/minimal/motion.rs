//! Kinematics of the chain link by link, O(n), in any frame that turns with or stands in the plane.

use nalgebra::{Vector2, Vector3};

pub use snake_core::planar::{Composite, LinkMotion};

use super::Model;

/// A link's velocity: (v_x, v_y) of its CG and omega.
pub type Twist = Vector3<f64>;

/// All links of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    pub links: Vec<LinkMotion>,
}

/// Virtual joints: orientation of the first link, and velocity of O_2 with the first link's rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base {
    pub theta: f64,
    pub rate: Vector3<f64>,
}

/// e_y from e_x: a quarter turn.
pub fn quarter_turn(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

/// The third component of a x b.
pub fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

impl Motion {
    pub fn new(links: usize) -> Self {
        let link = LinkMotion { axial: Vector2::x(), arm: Vector2::zeros(), twist: Twist::zeros() };
        Self { links: vec![link; links] }
    }

    /// Positions and velocities from virtual and real joints (T 6.2), (T 6.4), (T 6.7).
    pub fn set(&mut self, model: &Model, base: Base, phi: &[f64], phi_rate: &[f64]) {
        let (mut theta, mut omega) = (base.theta, base.rate.z);
        let (mut joint, mut velocity) = (Vector2::zeros(), base.rate.xy());
        for (i, (motion, link)) in self.links.iter_mut().zip(&model.links).enumerate() {
            if i > 0 {
                theta += phi[i - 1];
                omega += phi_rate[i - 1];
            }
            let (sin, cos) = theta.sin_cos();
            motion.axial = Vector2::new(cos, sin);
            let half = motion.axial * link.half_length;
            let swing = quarter_turn(half) * omega;
            motion.arm = joint + half;
            motion.twist = (velocity + swing).push(omega);
            joint = motion.arm + half;
            velocity += swing * 2.0;
        }
    }
}
