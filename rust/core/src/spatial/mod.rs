//! The spatial model (T ch. 4): n links in 3D, joined by cardan joints, 6 n velocities.
//!
//! | symbol | name here | meaning | frame, unit |
//! | --- | --- | --- | --- |
//! | q_i | `Pose` | position of the CG of link i and unit quaternion | I; m |
//! | u_i | `StackedTwist` | velocity of the CG and angular velocity | v in I, omega in B_i; m/s, rad/s |
//! | x_i | `Twist` | velocity of the CG and angular velocity, the unknown of a stage | I; m/s, rad/s |
//! | M | `mass_diagonal` | diag(m, m, m, Theta_psi, Theta_psi, Theta_rho) | kg, kg m^2 |
//! | h | `smooth_force` | gravity and gyroscopic moment | N, N m |
//! | W_N, W_T, W_V | `GroundContact` | directions of normal, friction and rolling friction | m/s per twist |
//! | W_H | `PegContact` | direction of a peg's force | m/s per twist |
//! | W_J | `JointRows` | directions of a joint's constraint forces | m/s, 1/s per twist |
//! | phi_h, phi_v | `joint_angle` | yaw and pitch of a joint | rad |
//!
//! Frame I has its z axis up. Of frame B_i, e_z points along the link to the next one; e_y points up while the link
//! lies flat and unrolled. A positive yaw turns the next link anticlockwise seen from above, a positive pitch lowers
//! it.

mod certificate;
mod chain_state;
mod configuration;
mod dynamics;
mod energy;
mod ground;
mod joint;
mod kinematics;
mod lane_fallback;
mod lanes;
mod model;
mod obstacle_contacts;
mod peg;
mod penetration;
mod self_contact;
mod solver;
mod spatial_vector;
mod stage;
mod support;

mod rest;
mod state;
mod system;
mod thesis;
mod workspace;

pub use certificate::{Certificate, certify};
pub use chain_state::ChainState;
pub use configuration::{ChainVelocity, Configuration, Frame};
pub use dynamics::{inertia, mass_diagonal, potential_energy, smooth_force};
pub use ground::{End, GroundContact, ground_contact, ground_frame, ground_gap};
pub use joint::{
    JointAxes, JointRows, actuator_torque, joint_angle, joint_axes, joint_gap, joint_rate, joint_rows,
    printed_joint_rate,
};
pub use kinematics::{assemble_chain, close_joints, largest_joint_gap, orientation_of, rest_on_ground, travel};
pub use model::{Spatial, SpatialBody, SpatialFleet, SpatialScripted};
pub use peg::{PegContact, centre_line, nearest_point, obstacle_gap, peg_contact, peg_gap, solid_line, wall_gap};
pub use self_contact::self_gap;
pub use solver::{CoulombNewton, Fallback, Newton};
pub use spatial_vector::{Momentum, SpatialVector, Twist, Wrench};
pub use stage::{Stage, StageDrive, StageFriction, StageLink, StagePair, StagePeg, StagePegFriction, StageSolution};
pub use state::{Pose, SpatialState, StackedTwist, turning, twist_of};
pub use support::rest_on;
pub use system::SpatialSystem;
pub use thesis::{
    ContactPenalties, GroundImpulse, ModifiedNewton, SpatialThesis, Step, StepGround, StepLink, StepPeg, StepSolution,
    step_residual,
};

use nalgebra::{Matrix3, Vector3, Vector6};

/// Direction of a force along `axis` (frame I) at `arm` from the CG (frame I): its power is this times the twist
/// (T 4.25).
pub(crate) fn force_direction(rotation: &Matrix3<f64>, axis: &Vector3<f64>, arm: &Vector3<f64>) -> Vector6<f64> {
    twist_of(*axis, rotation.tr_mul(&arm.cross(axis)))
}
