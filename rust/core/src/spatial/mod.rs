//! The spatial model (T ch. 4): n links in 3D, joined by cardan joints, 6 n velocities.
//!
//! | symbol | name here | meaning | frame, unit |
//! | --- | --- | --- | --- |
//! | q_i | `Pose` | position of the CG of link i and unit quaternion | I; m |
//! | u_i | `StackedTwist` | velocity of the CG and angular velocity | v in I, omega in B_i; m/s, rad/s |
//! | x_i | `Twist` | velocity of the CG and angular velocity, the unknown of a stage | I; m/s, rad/s |
//! | M | `mass_diagonal` | diag(m, m, m, Theta_psi, Theta_psi, Theta_rho) | kg, kg m^2 |
//! | phi_h, phi_v | `joint_angle` | yaw and pitch of a joint | rad |
//!
//! Frame I has its z axis up. Of frame B_i, e_z points along the link to the next one; e_y points up while the link
//! lies flat and unrolled. A positive yaw turns the next link anticlockwise seen from above, a positive pitch lowers
//! it.

mod balls;
mod certificate;
mod chain_state;
mod configuration;
mod dynamics;
mod energy;
mod gap;
mod ground;
mod joint;
mod kinematics;
mod lane_fallback;
mod lanes;
mod model;
mod movables;
mod near_pairs;
mod nodes;
mod obstacle_contacts;
mod penetration;
mod self_contact;
mod solver;
mod sources;
mod spatial_vector;
mod stage;
mod support;

mod rest;
mod state;
mod system;
mod workspace;

pub(crate) use balls::ball_gap;
pub use certificate::{Certificate, certify};
pub use chain_state::ChainState;
pub use configuration::{ChainShape, ChainVelocity, Configuration, Frame, LinkAxis};
pub use dynamics::{inertia, mass_diagonal, potential_energy};
pub use gap::{centre_line, nearest_point, obstacle_gap, peg_gap, solid_line, wall_gap};
pub use ground::{End, ground_gap};
pub use joint::{
    JointAxes, axis_angles, axis_rates, hinge_directions, joint_angle, joint_axes, joint_gap, joint_rate, turned_by,
};
pub use kinematics::{assemble_chain, close_positions, largest_joint_gap, orientation_of, rest_on_ground};
pub use lane_fallback::observe_hard_stages;
use model::stopping;
pub use model::{Spatial, SpatialBody, SpatialFleet, SpatialScripted};
pub(crate) use movables::{movable_gap, pair_gap};
pub use self_contact::self_gap;
pub use solver::{CoulombNewton, Fallback, Newton};
pub use spatial_vector::{Momentum, SpatialVector, Twist, Wrench};
pub use stage::{
    Stage, StageContact, StageDrive, StageFriction, StageLink, StageObstacleFriction, StagePair, StageSolution,
};
pub use state::{Pose, SpatialState, StackedTwist, turning, twist_of};
use state::{moved_of, place_and_twist};
pub use support::rest_on;
pub use system::SpatialSystem;
