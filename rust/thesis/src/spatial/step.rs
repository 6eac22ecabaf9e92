//! The contact problem of one time step of Algorithm 4.2: data and unknowns.
//!
//! Find the end velocity u_E and impulses with
//!
//! ```text
//! M (u_E - u_R) = W_N P_N + W_T P_T + W_V P_V + W_H P_H + W_J P_J       (T 4.112), u_R = u_A + M^-1 (h + tau) dt
//! W_J^T u_E = 0                                                        (T 4.66)
//! -gamma_N in N_CN(P_N), -gamma_H in N_CH(P_H)                         (T 4.78), (T 4.79)
//! -gamma_T in N_CT(P_T), -gamma_V in N_CV(P_V), bounds from P_N        (T 4.82), (T 4.86)
//! ```

use nalgebra::{Vector2, Vector4, Vector6};
use snake_core::laws::{Disc, Ellipse};
use snake_core::spatial::StackedTwist;

use super::{GroundContact, JointRows};

/// One link: its velocity without contacts and joints, and the inverse of its mass matrix's diagonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLink {
    pub reference: StackedTwist,
    pub inverse_mass: Vector6<f64>,
}

/// A closed contact with the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepGround {
    pub link: usize,
    pub rows: GroundContact,
}

/// A closed contact with a peg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepPeg {
    pub link: usize,
    /// w_H.
    pub direction: Vector6<f64>,
}

/// Data of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub links: Vec<StepLink>,
    pub joints: Vec<JointRows>,
    pub ground: Vec<StepGround>,
    pub pegs: Vec<StepPeg>,
    /// mu_Tx, mu_Ty.
    pub friction: Vector2<f64>,
    /// mu_V.
    pub rolling_friction: f64,
}

impl Step {
    /// An empty step with memory for `links` links.
    pub fn with_capacity(links: usize, friction: Vector2<f64>, rolling_friction: f64) -> Self {
        Self {
            links: Vec::with_capacity(links),
            joints: Vec::with_capacity(links - 1),
            ground: Vec::with_capacity(2 * links),
            pegs: Vec::with_capacity(2 * links),
            friction,
            rolling_friction,
        }
    }

    /// C_T of a contact that carries the normal impulse `normal` (T 4.84 != D45).
    pub fn friction_set(&self, normal: f64) -> Ellipse {
        Ellipse { axes: self.friction * normal }
    }

    /// C_V of such a contact (T 4.87).
    pub fn rolling_set(&self, normal: f64) -> Disc {
        Disc { radius: self.rolling_friction * normal }
    }
}

/// Impulses of one ground contact \[N s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroundImpulse {
    /// P_N.
    pub normal: f64,
    /// P_T along and across the link's shadow.
    pub tangent: Vector2<f64>,
    /// P_V along e_x^I and e_y^I.
    pub rolling: Vector2<f64>,
}

impl GroundImpulse {
    /// W_N P_N + W_T P_T + W_V P_V.
    pub fn on_link(&self, rows: &GroundContact) -> Vector6<f64> {
        rows.normal * self.normal + rows.tangent * self.tangent + rows.rolling * self.rolling
    }
}

/// The unknowns of a step; contacts in the order of the [`Step`].
#[derive(Debug, Clone, PartialEq)]
pub struct StepSolution {
    /// u_E.
    pub twist: Vec<StackedTwist>,
    /// P_J.
    pub joint: Vec<Vector4<f64>>,
    pub ground: Vec<GroundImpulse>,
    /// P_H.
    pub peg: Vec<f64>,
}

impl StepSolution {
    pub fn new(links: usize) -> Self {
        Self {
            twist: vec![StackedTwist::zeros(); links],
            joint: vec![Vector4::zeros(); links - 1],
            ground: Vec::with_capacity(2 * links),
            peg: Vec::with_capacity(2 * links),
        }
    }
}
