//! The planar model (T ch. 3): n links in the plane, 3 n absolute coordinates.
//!
//! | symbol | name here | meaning | unit |
//! | --- | --- | --- | --- |
//! | q_i | `Pose` | (x, y, theta) of the CG of link i, theta absolute | m, m, rad |
//! | u_i | `Twist` | (v_x, v_y, omega) of link i, world frame | m/s, rad/s |
//! | M | `Robot::links` | diag(m_i, m_i, Theta_i) | kg, kg m^2 |
//! | W_H, W_T, W_J | `direction`, `Heading`, `joint` | force directions | |
//! | P_H, P_T, P_J | impulses of contact, friction, joints | N s |
//! | c | `Stage::coefficient` | the part of a step that one stage covers | s |

mod certificate;
mod contact_detection;
mod contact_friction;
mod contacts;
mod energy;
mod heading;
mod inverse_dynamics;
mod io_drive;
mod kinematics;
mod lane_fallback;
mod lanes;
mod link_pairs;
mod model;
mod penetration;
mod self_contact;
mod solver;
mod stage;

mod state;
mod system;
mod warm_start;
mod workspace;

pub use certificate::{Certificate, certify};
pub use energy::work_of;
pub use heading::Heading;
pub use inverse_dynamics::{Composite, InverseDynamics, LinkInertia, LinkMotion, own_inertia};
pub use kinematics::{assemble_chain, close_joints, joint_gap, largest_joint_gap, mean_twist, travel};
pub use lane_fallback::observe_hard_stages;
pub use model::{Body, Fleet, Planar, Scripted};
pub use solver::{Descent, Fallback, InteriorPoint, Newton};
pub use stage::{
    Stage, StageContact, StageJoint, StageLink, StageObstacleFriction, StagePair, StagePairFriction, StageSolution,
};
pub use state::{PlanarState, Pose, Twist, is_plausible};
pub use system::PlanarSystem;
pub use warm_start::WarmStart;
