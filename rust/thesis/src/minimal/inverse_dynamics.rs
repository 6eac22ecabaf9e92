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

    /// tau for joint accelerations `u` under the smooth friction `law`; returns the acceleration of the
    /// virtual joints, of O_2 and of theta, in the frame of `motion`.
    ///
    /// With `law` none there is no friction, and with a motion at rest tau is `M_22_bar u`.
    pub fn torques(
        &mut self,
        model: &Model,
        motion: &Motion,
        law: Option<SmoothLaw>,
        u: &[f64],
        tau: &mut [f64],
    ) -> Vector3<f64> {
        for ((applied, link), at) in self.chain.applied.iter_mut().zip(&model.links).zip(&motion.links) {
            *applied = law.map_or_else(Vector3::zeros, |law| link.friction_force(at, law));
        }
        self.chain.solve(&motion.links, u, tau)
    }
}
