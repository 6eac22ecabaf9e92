//! The minimal model, the "robot model" of (T ch. 6): n - 2 links in the plane, minimal coordinates, two contact points
//! per link.
//!
//! | symbol | name here | meaning | unit |
//! | --- | --- | --- | --- |
//! | q, q' | `MinimalState` | (x_O2, y_O2, theta, phi), frame I | m, rad |
//! | w | `passive_velocity` | (v_O2 in frame B_3, theta') | m/s, rad/s |
//! | phi, tau | joint angles and torques; positive tau_j drives phi_j up | | rad, N m |
//! | G_i, F_i, R_i | centre of a link, contact points L_GS before and behind it | | |
//! | M_P, C_P, J | `ProcessPlant` | matrices of (T 6.14) | |
//! | M, C, h, g | `ControlPlant` | matrices of (T 6.37) | |
//!
//! Links count from 0 here, from 3 in the thesis, whose links 1 and 2 are virtual.

mod certificate;
mod control_plant;
mod controller;
mod feedback;
mod forward_dynamics;
mod friction;
mod implicit;
mod inverse_dynamics;
mod model;
mod motion;
mod noise;
mod printed;
mod process_plant;
mod simulation;
mod smooth;
mod smooth_law;
mod smooth_plant;
mod solver;
mod stage;
mod state;

pub use certificate::{Certificate, certify};
pub use control_plant::{ControlPlant, JointDynamics, velocity_transform};
pub use feedback::{Feedback, Measurement};
pub use forward_dynamics::ForwardDynamics;
pub use friction::Friction;
pub use inverse_dynamics::InverseDynamics;
pub use model::{Ground, Model, ModelLink};
pub use motion::{Base, LinkMotion, Motion, Twist};
pub use noise::Noise;
pub use process_plant::{ProcessPlant, actuation};
pub use simulation::{MinimalConfig, MinimalSimulation};
pub use smooth_law::{FrictionLaw, SmoothLaw};
pub use solver::Newton;
pub use stage::{Stage, StageJoint, StageLink, StageSolution};
pub use state::MinimalState;

use snake_core::control::ControllerConfig;

/// PD with the gains of (T Table 7.2), "robot model".
pub fn pd() -> ControllerConfig {
    ControllerConfig { kp: 200.0, kd: 1.2, ..ControllerConfig::default() }
}
