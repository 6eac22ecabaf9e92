//! Torques that give the joints wanted accelerations, the virtual joints being free: (T 6.58) in O(n).
//!
//! (T 6.58) takes M_22 - M_21 M_11^-1 M_12 apart into two steps that need no matrix: the base balance
//! (T 6.53), three equations for the acceleration of the virtual joints, and the moments about each
//! joint of all that lies behind it.

use nalgebra::{Vector2, Vector3};

use super::Model;
use super::friction::SmoothLaw;
use super::motion::{Composite, Motion, cross, quarter_turn};

/// Workspace: inertia minus applied forces on each link, as force and moment about G_i.
#[derive(Debug, Clone)]
pub struct InverseDynamics {
    force: Vec<Vector3<f64>>,
}

impl InverseDynamics {
    pub fn new(links: usize) -> Self {
        Self { force: vec![Vector3::zeros(); links] }
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
        let total = self.with_base_at_rest(model, motion, law, u);
        let composite = composite(model, motion);
        let base = composite.rate_of(-total);
        self.add_base(model, motion, base);
        self.moments(model, motion, tau);
        base
    }

    /// Forces with the acceleration of the virtual joints left out; returns their sum and moment about O_2.
    fn with_base_at_rest(&mut self, model: &Model, motion: &Motion, law: Option<SmoothLaw>, u: &[f64]) -> Vector3<f64> {
        let (mut alpha, mut joint, mut total) = (0.0, Vector2::zeros(), Vector3::zeros());
        for (i, (link, at)) in model.links.iter().zip(&motion.links).enumerate() {
            if i > 0 {
                alpha += u[i - 1];
            }
            let half = at.axial * link.half_length;
            // Tangential and centripetal acceleration over half the link.
            let along = quarter_turn(half) * alpha - half * (at.twist.z * at.twist.z);
            let inertia = ((joint + along) * link.mass).push(link.inertia * alpha);
            let applied = law.map_or_else(Vector3::zeros, |law| at.friction(link, law));
            let force = inertia - applied;
            self.force[i] = force;
            total += force.xy().push(force.z + cross(at.arm, force.xy()));
            joint += along * 2.0;
        }
        total
    }

    fn add_base(&mut self, model: &Model, motion: &Motion, base: Vector3<f64>) {
        for ((force, link), at) in self.force.iter_mut().zip(&model.links).zip(&motion.links) {
            let acceleration = base.xy() + quarter_turn(at.arm) * base.z;
            *force += (acceleration * link.mass).push(link.inertia * base.z);
        }
    }

    /// From tail to head: the moment about each joint of the forces behind it.
    fn moments(&self, model: &Model, motion: &Motion, tau: &mut [f64]) {
        let (mut behind, mut moment) = (Vector2::zeros(), 0.0);
        for i in (1..self.force.len()).rev() {
            let half = motion.links[i].axial * model.links[i].half_length;
            let force = self.force[i];
            moment += force.z + cross(half, force.xy()) + 2.0 * cross(half, behind);
            behind += force.xy();
            tau[i - 1] = moment;
        }
    }
}

/// The chain frozen in its posture.
pub fn composite(model: &Model, motion: &Motion) -> Composite {
    let links = model.links.iter().zip(&motion.links);
    Composite::of(links.map(|(link, at)| (link.mass, link.inertia, at.arm)))
}
