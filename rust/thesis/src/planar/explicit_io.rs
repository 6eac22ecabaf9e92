//! Input-output linearisation (T 6.58) with the smooth two-point model of chapter 6, for the plant of chapter 3.

use snake_core::control::{ControllerConfig, Treatment};
use snake_core::gait::JointTarget;
use snake_core::planar::{Heading, PlanarState, PlanarSystem};
use snake_core::slope::Slope;

use crate::minimal::{Feedback, Ground, Measurement, Model};

/// Input-output linearisation: torques from the state at the start of a step (T 3.51 != D8).
#[derive(Debug, Clone)]
pub struct ExplicitIo {
    model: Model,
    feedback: Feedback,
    measured: Measurement,
    /// tau \[N m\].
    pub tau: Vec<f64>,
}

impl ExplicitIo {
    pub fn new(system: &PlanarSystem) -> Self {
        let model = model_of(system);
        let feedback = Feedback::new(ControllerConfig { treatment: Treatment::Step, ..system.controller }, &model);
        let joints = model.joint_count();
        Self { feedback, measured: Measurement::new(joints), tau: vec![0.0; joints], model }
    }

    /// Computes tau.
    pub fn update(&mut self, state: &PlanarState, targets: &[JointTarget]) {
        let Self { model, feedback, measured, tau } = self;
        let (first, twist) = (&state.pose[0], &state.twist[0]);
        measured.theta = first.z;
        // O_2 lies half a link behind G.
        let half = model.links[0].half_length * twist.z;
        measured.velocity = twist.xy() - Heading::of(first.z).lateral() * half;
        measured.theta_rate = twist.z;
        for j in 0..tau.len() {
            (measured.phi[j], measured.phi_rate[j]) = (state.joint_angle(j), state.joint_rate(j));
        }
        feedback.torque(model, measured, targets, state.time, tau);
    }
}

/// The robot on two contact points per link; the planar model has no viscous friction.
///
/// The pull of inclined ground is left out: it accelerates all links alike and takes no torques.
fn model_of(system: &PlanarSystem) -> Model {
    let coulomb = system.model_friction().into();
    Model::new(&system.robot, &Ground { coulomb, viscous: [0.0; 2], slope: Slope::default() })
}
