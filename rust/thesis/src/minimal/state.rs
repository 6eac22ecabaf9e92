use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use snake_core::stepping::MAX_RATE;

use super::motion::{Base, Motion};
use super::{Model, ModelLink};

/// State of one robot in minimal coordinates: plain data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MinimalState {
    /// \[s\]
    pub time: f64,
    /// q = (x_O2, y_O2, theta, phi_1 ...) (T 6.3) \[m, rad\].
    pub q: Vec<f64>,
    /// q' \[m/s, rad/s\].
    pub rate: Vec<f64>,
}

impl MinimalState {
    /// The straight robot at rest, O_2 at the origin, along +x.
    pub fn zero(degrees: usize) -> Self {
        Self { time: 0.0, q: vec![0.0; degrees], rate: vec![0.0; degrees] }
    }

    /// Copies without allocating; both states have the same length.
    pub fn copy_from(&mut self, other: &Self) {
        self.time = other.time;
        self.q.copy_from_slice(&other.q);
        self.rate.copy_from_slice(&other.rate);
    }

    pub fn phi(&self) -> &[f64] {
        &self.q[3..]
    }

    pub fn phi_rate(&self) -> &[f64] {
        &self.rate[3..]
    }

    /// The virtual joints in frame I.
    pub fn base(&self) -> Base {
        Base { theta: self.q[2], rate: Vector3::new(self.rate[0], self.rate[1], self.rate[2]) }
    }

    /// w = (v_O2 in frame B_3, theta') (T 6.41).
    pub fn passive_velocity(&self) -> Vector3<f64> {
        let (sin, cos) = self.q[2].sin_cos();
        let (x, y) = (self.rate[0], self.rate[1]);
        Vector3::new(cos * x + sin * y, cos * y - sin * x, self.rate[2])
    }

    /// Kinetic energy q'^T M_P q' / 2 \[J\].
    pub fn kinetic_energy(&self, model: &Model, motion: &mut Motion) -> f64 {
        motion.set(model, self.base(), self.phi(), self.phi_rate());
        let energy = |(link, at): (&ModelLink, &super::motion::LinkMotion)| {
            0.5 * (link.mass * at.twist.xy().norm_squared() + link.inertia * at.twist.z * at.twist.z)
        };
        model.links.iter().zip(&motion.links).map(energy).sum()
    }

    /// Finite, and slow enough to be a robot rather than a diverged computation.
    pub fn is_plausible(&self) -> bool {
        self.q.iter().all(|x| x.is_finite()) && self.rate.iter().all(|v| v.abs() < MAX_RATE)
    }
}
