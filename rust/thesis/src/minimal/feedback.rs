//! The joint controllers of chapter 6: PD (T 7.8) and input-output linearising (T 6.58), (T 6.60).

use nalgebra::Vector2;
use snake_core::control::{ControlLaw, ControllerConfig};
use snake_core::gait::JointTarget;

use super::motion::{Base, Motion};
use super::{InverseDynamics, MinimalState, Model};

/// The state as measured; the position is measured too, but no controller uses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    pub theta: f64,
    pub phi: Vec<f64>,
    /// v_O2 in frame I.
    pub velocity: Vector2<f64>,
    pub theta_rate: f64,
    pub phi_rate: Vec<f64>,
}

impl Measurement {
    pub fn new(joints: usize) -> Self {
        let zero = vec![0.0; joints];
        Self { theta: 0.0, phi: zero.clone(), velocity: Vector2::zeros(), theta_rate: 0.0, phi_rate: zero }
    }

    /// Without noise.
    pub fn take(&mut self, state: &MinimalState) {
        self.theta = state.q[2];
        self.phi.copy_from_slice(state.phi());
        self.velocity = Vector2::new(state.rate[0], state.rate[1]);
        self.theta_rate = state.rate[2];
        self.phi_rate.copy_from_slice(state.phi_rate());
    }

    fn base(&self) -> Base {
        Base { theta: self.theta, rate: self.velocity.push(self.theta_rate) }
    }
}

/// Torques from measurements, with workspace.
#[derive(Debug, Clone)]
pub struct Feedback {
    pub config: ControllerConfig,
    motion: Motion,
    dynamics: InverseDynamics,
    u: Vec<f64>,
}

impl Feedback {
    pub fn new(config: ControllerConfig, model: &Model) -> Self {
        let links = model.link_count();
        Self { config, motion: Motion::new(links), dynamics: InverseDynamics::new(model), u: vec![0.0; links - 1] }
    }

    /// tau from what is measured at `time`, within the limit.
    pub fn torque(
        &mut self,
        model: &Model,
        measured: &Measurement,
        targets: &[JointTarget],
        time: f64,
        tau: &mut [f64],
    ) {
        let config = self.config;
        let limit = config.limit_at(time);
        for (j, (output, target)) in self.u.iter_mut().zip(targets).enumerate() {
            *output = self::output(&config, target, measured.phi[j], measured.phi_rate[j]);
        }
        match config.law {
            ControlLaw::Pd => tau.copy_from_slice(&self.u),
            ControlLaw::Io => {
                self.motion.set(model, measured.base(), &measured.phi, &measured.phi_rate);
                self.dynamics.torques(model, &self.motion, &self.u, tau);
            }
        }
        tau.iter_mut().for_each(|tau| *tau = tau.clamp(-limit, limit));
    }
}

/// The law's own output for a joint at `angle` and `rate`: a torque (T 7.8), or u (T 6.60).
pub fn output(config: &ControllerConfig, target: &JointTarget, angle: f64, rate: f64) -> f64 {
    let feedback = config.kp * (target.angle - angle) + config.kd * (target.rate - rate);
    match config.law {
        ControlLaw::Pd => feedback,
        ControlLaw::Io => feedback + target.acceleration,
    }
}
