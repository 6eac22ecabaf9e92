//! The joint controllers of chapter 6: PD (T 7.8) and input-output linearising (T 6.58), (T 6.60).

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::control::{ControlLaw, ControllerConfig};
use crate::error::{ConfigError, positive};
use crate::gait::JointTarget;

use super::motion::{Base, Motion};
use super::{InverseDynamics, MinimalState, Model};
use crate::laws::SmoothLaw;

/// When the torque is computed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", expecting = "\"implicit\", \"step\" or a period in seconds")]
pub enum Treatment {
    /// Continuously; in a time step linearly implicit, from the state at its end.
    #[default]
    Implicit,
    /// At the start of a step, held over it.
    Step,
    /// At the start of each control period of this length \[s\], held over it.
    #[serde(untagged)]
    Period(f64),
}

/// What a user may choose about the controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedbackConfig {
    pub law: ControlLaw,
    /// k_P \[N m/rad\], or K_P \[1/s^2\] for `Io`.
    pub kp: f64,
    /// k_D \[N m s/rad\], or K_D \[1/s\] for `Io`.
    pub kd: f64,
    /// Largest torque of a joint \[N m\]; `None` for none.
    pub torque_limit: Option<f64>,
    /// The actuators are off before this time \[s\].
    pub active_from: f64,
    pub treatment: Treatment,
}

impl FeedbackConfig {
    /// PD with the gains of (T Table 7.2), "robot model".
    pub fn pd() -> Self {
        let treatment = Treatment::Implicit;
        Self { law: ControlLaw::Pd, kp: 200.0, kd: 1.2, torque_limit: None, active_from: 0.0, treatment }
    }

    /// Torques of `controller`, held over a step.
    pub fn of(controller: ControllerConfig) -> Self {
        let ControllerConfig { law, kp, kd, torque_limit, active_from } = controller;
        Self { law, kp, kd, torque_limit, active_from, treatment: Treatment::Step }
    }

    /// Input-output linearisation with the gains of (T Table 7.2).
    pub fn io() -> Self {
        Self { law: ControlLaw::Io, kp: 4e5, kd: 2.4e3, ..Self::pd() }
    }

    /// # Errors
    /// Names the gain, limit or period that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.controller().validate()?;
        if let Treatment::Period(period) = self.treatment {
            positive("treatment", period)?;
        }
        Ok(())
    }

    /// Without the treatment.
    pub fn controller(&self) -> ControllerConfig {
        let Self { law, kp, kd, torque_limit, active_from, .. } = *self;
        ControllerConfig { law, kp, kd, torque_limit, active_from }
    }

    /// The largest torque at a time: infinite when there is no limit, 0 before `active_from` \[N m\].
    pub fn limit_at(&self, time: f64) -> f64 {
        self.controller().limit_at(time)
    }

    /// The law's own output for a joint at `angle` and `rate`: a torque (T 7.8), or u (T 6.60).
    pub fn output(&self, target: &JointTarget, angle: f64, rate: f64) -> f64 {
        let feedback = self.kp * (target.angle - angle) + self.kd * (target.rate - rate);
        match self.law {
            ControlLaw::Pd => feedback,
            ControlLaw::Io => feedback + target.acceleration,
        }
    }
}

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
    pub config: FeedbackConfig,
    motion: Motion,
    dynamics: InverseDynamics,
    u: Vec<f64>,
}

impl Feedback {
    pub fn new(config: FeedbackConfig, model: &Model) -> Self {
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
            *output = config.output(target, measured.phi[j], measured.phi_rate[j]);
        }
        match config.law {
            ControlLaw::Pd => tau.copy_from_slice(&self.u),
            ControlLaw::Io => {
                self.motion.set(model, measured.base(), &measured.phi, &measured.phi_rate);
                self.dynamics.torques(model, &self.motion, Some(SmoothLaw::PRINTED), &self.u, tau);
            }
        }
        tau.iter_mut().for_each(|tau| *tau = tau.clamp(-limit, limit));
    }
}
