//! Accelerations from torques on the smooth plant, O(n): (T 6.14) solved without its matrices.
//!
//! Gauss's principle: the accelerations minimise sum |a_i + bias_i - F_i / m_i|^2 over the motions that
//! the joints allow, where the bias is the centripetal acceleration.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::Model;
use super::SmoothLaw;
use super::motion::{Motion, Twist, quarter_turn};
use super::solver::{ChainFactor, Curvature};

/// Workspace of the computation.
#[derive(Debug, Clone)]
pub struct ForwardDynamics {
    curvature: Vec<Curvature>,
    gradient: Vec<Vector3<f64>>,
    factor: ChainFactor,
    scratch: Vec<f64>,
    twist: Vec<Twist>,
}

impl ForwardDynamics {
    pub fn new(links: usize) -> Self {
        let curvature = Curvature { swing: Vector2::zeros(), link: Matrix3::zeros(), joint: 0.0 };
        Self {
            curvature: vec![curvature; links],
            gradient: vec![Vector3::zeros(); links],
            factor: ChainFactor::new(links),
            scratch: vec![0.0; links],
            twist: vec![Twist::zeros(); links],
        }
    }

    /// q'' under the torques `tau` and the smooth friction `law`: of O_2 and theta in the frame of
    /// `motion`, which is frame I, then of the joints.
    pub fn accelerations(&mut self, model: &Model, motion: &Motion, law: SmoothLaw, tau: &[f64], q: &mut [f64]) {
        let mut joint_bias = Vector2::zeros();
        for (i, (link, at)) in model.links.iter().zip(&motion.links).enumerate() {
            let half = at.axial * link.half_length;
            let centripetal = -half * (at.twist.z * at.twist.z);
            let bias = joint_bias + centripetal;
            joint_bias = bias + centripetal;
            let before = if i > 0 { tau[i - 1] } else { 0.0 };
            let after = tau.get(i).copied().unwrap_or(0.0);
            let pull = model.pull * link.mass;
            let applied = link.friction_force(at, law) + pull.push(before - after);
            self.gradient[i] = (bias * link.mass).push(0.0) - applied;
            self.curvature[i] = Curvature {
                swing: quarter_turn(half),
                link: Matrix3::from_diagonal(&Vector3::new(link.mass, link.mass, link.inertia)),
                joint: 0.0,
            };
        }
        self.factor.factorise(&self.curvature);
        self.factor.solve(&self.gradient, &mut self.scratch, &mut self.twist);
        let first = &self.twist[0];
        let base = first.xy() - self.curvature[0].swing * first.z;
        (q[0], q[1], q[2]) = (base.x, base.y, first.z);
        for (joint, pair) in self.twist.windows(2).enumerate() {
            q[3 + joint] = pair[1].z - pair[0].z;
        }
    }
}
