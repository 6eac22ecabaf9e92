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
mod fallback;
mod heading;
mod interior_point;
mod kinematics;
mod lanes;
mod link_term;
mod modified_newton;
mod newton;
mod problem;
mod proximal;
mod ray;
mod stage;
mod state;
mod sweep;

pub use certificate::{Certificate, certify};
pub use fallback::{Closing, Fallback, SLACK};
pub use heading::Heading;
pub use interior_point::{Descent, InteriorPoint};
pub use kinematics::{assemble_chain, close_joints, joint_gap, largest_joint_gap, travel};
pub use modified_newton::{ModifiedNewton, Penalties};
pub use newton::Newton;
pub use problem::{Answer, ContactRow, JointRow, LinkRow, Problem};
pub use stage::{Stage, StageContact, StageJoint, StageLink, StageSolution};
pub use state::{PlanarState, Pose, Twist, is_sane};
