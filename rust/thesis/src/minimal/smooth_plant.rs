//! The smooth plant as an ordinary differential equation y' = f(t, y), y = (q, q') (T 6.14).

use snake_core::control::{ControlLaw, ControllerConfig, Treatment};
use snake_core::gait::{JointTarget, Reference};

use crate::minimal::{Base, ForwardDynamics, InverseDynamics, Model, Motion, SmoothLaw};

use super::feedback::output;

/// Right-hand side with its workspace.
#[derive(Debug, Clone)]
pub struct SmoothPlant {
    model: Model,
    law: SmoothLaw,
    config: ControllerConfig,
    motion: Motion,
    forward: ForwardDynamics,
    inverse: InverseDynamics,
    targets: Vec<JointTarget>,
    u: Vec<f64>,
    /// tau \[N m\].
    pub torque: Vec<f64>,
}

impl SmoothPlant {
    pub fn new(model: &Model, law: SmoothLaw, config: ControllerConfig) -> Self {
        let (links, joints) = (model.link_count(), model.joint_count());
        Self {
            model: model.clone(),
            law,
            config,
            motion: Motion::new(links),
            forward: ForwardDynamics::new(links),
            inverse: InverseDynamics::new(model),
            targets: vec![JointTarget::default(); joints],
            u: vec![0.0; joints],
            torque: vec![0.0; joints],
        }
    }

    /// f(t, y); a held torque is taken from `held`.
    pub fn derivative(
        &mut self,
        t: f64,
        y: &[f64],
        reference: &impl Reference<JointTarget>,
        held: &[f64],
        dy: &mut [f64],
    ) {
        let n = self.model.degrees();
        let (q, rate) = y.split_at(n);
        let (dq, acceleration) = dy.split_at_mut(n);
        dq.copy_from_slice(rate);
        let base = Base { theta: q[2], rate: nalgebra::Vector3::new(rate[0], rate[1], rate[2]) };
        self.motion.set(&self.model, base, &q[3..], &rate[3..]);
        if self.config.treatment == Treatment::Implicit {
            self.continuous_torque(t, q, rate, reference, acceleration);
        } else {
            self.torque.copy_from_slice(held);
            self.forward.accelerations(&self.model, &self.motion, self.law, &self.torque, acceleration);
        }
    }

    /// The torque at this instant, and the accelerations it causes.
    fn continuous_torque(
        &mut self,
        t: f64,
        q: &[f64],
        rate: &[f64],
        reference: &impl Reference<JointTarget>,
        acceleration: &mut [f64],
    ) {
        let Self { model, law, config, motion, forward, inverse, targets, u, torque } = self;
        reference.targets(t, targets);
        for (j, (u, target)) in u.iter_mut().zip(targets.iter()).enumerate() {
            *u = output(config, target, q[3 + j], rate[3 + j]);
        }
        let limit = config.limit_at(t);
        if config.law == ControlLaw::Pd {
            torque.copy_from_slice(u);
        } else {
            let base = inverse.torques(model, motion, u, torque);
            if *law == SmoothLaw::PRINTED && torque.iter().all(|tau| tau.abs() <= limit) {
                // The plant is the model: phi'' = u (T 6.59).
                acceleration[..3].copy_from_slice((base + model.pull.push(0.0)).as_slice());
                acceleration[3..].copy_from_slice(u);
                return;
            }
        }
        torque.iter_mut().for_each(|tau| *tau = tau.clamp(-limit, limit));
        forward.accelerations(model, motion, *law, torque, acceleration);
    }
}
