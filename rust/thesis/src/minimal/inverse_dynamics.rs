//! Torques that give the joints of the model desired accelerations, the virtual joints being free (T 6.58).

use nalgebra::Vector3;
use snake_core::planar;

use super::motion::Motion;
use super::{Model, ModelLink, SmoothLaw};

/// Workspace.
#[derive(Debug, Clone)]
pub struct InverseDynamics {
    chain: planar::InverseDynamics,
}

impl InverseDynamics {
    pub fn new(model: &Model) -> Self {
        Self { chain: planar::InverseDynamics::new(model.links.iter().map(ModelLink::inertia).collect()) }
    }

    /// tau for joint accelerations `u` under the printed friction law; returns the acceleration of the virtual joints, of
    /// O_2 and of theta, in the frame of `motion`.
    pub fn torques(&mut self, model: &Model, motion: &Motion, u: &[f64], tau: &mut [f64]) -> Vector3<f64> {
        for ((applied, link), at) in self.chain.applied.iter_mut().zip(&model.links).zip(&motion.links) {
            *applied = link.friction_force(at, SmoothLaw::PRINTED);
        }
        self.chain.solve(&motion.links, u, tau)
    }
}
