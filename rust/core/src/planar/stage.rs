//! The problem of one stage: data, without any algorithm.
//!
//! A stage looks for the end velocity u of the inclusion
//!
//! `M (u - u_ref) = W_T P_T + W_H P_H + W_J P_J + W_tau D`, `W_J^T u = 0`,
//! `-W_T^T u in N_{C_T}(P_T)`, `0 <= P_H  _|_  W_H^T u + offset >= 0`, `D = clamp(b - k W_tau^T u)`
//!
//! with directions W fixed at the predicted end configuration. It is (T 3.66)-(T 3.72) with the PD
//! torque taken at the end of the stage, and the optimality condition of a strongly convex problem:
//! u minimises `|u - u_ref|_M^2 / 2 + sum support_{C_T}(-gamma_T) + sum psi(gamma_tau)` subject to the
//! joints and to `W_H^T u + offset >= 0`. So u exists and is unique; the impulses need not be.
//! Implicit Euler is one stage with coefficient h; higher order composes several.

use nalgebra::{Vector2, Vector3};

use super::{Heading, Twist};

/// One link in a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageLink {
    /// R_B^I at the predicted end configuration.
    pub heading: Heading,
    /// u_ref: the velocity the link would have without any force in this stage.
    pub reference: Twist,
    pub mass: f64,
    pub inertia: f64,
    /// L_i / 2 \[m\].
    pub half_length: f64,
    /// Semi-axes of C_T as impulses, mu m g c, in the link's frame \[N s\].
    pub friction: Vector2<f64>,
}

/// One joint in a stage: the impulse that drives phi upwards is `clamp(drive - stiffness omega_J)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageJoint {
    /// b = c (k_P (phi_d - phi_base) + k_D phi_d') \[N m s\].
    pub drive: f64,
    /// k = c (c k_P + k_D) \[N m s^2\].
    pub stiffness: f64,
    /// c times the torque limit \[N m s\].
    pub limit: f64,
}

/// One link-peg contact in a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageContact {
    pub link: usize,
    /// Index of the pair in [`crate::contact::NearPegs`].
    pub pair: usize,
    /// w_H.
    pub direction: Vector3<f64>,
    /// Gap over coefficient: the contact closes when `w_H . u + offset` reaches zero \[m/s\].
    pub offset: f64,
}

/// Data of one stage.
#[derive(Debug, Clone, Default)]
pub struct Stage {
    /// c: the part of the step this stage covers \[s\].
    pub coefficient: f64,
    pub links: Vec<StageLink>,
    pub joints: Vec<StageJoint>,
    pub contacts: Vec<StageContact>,
}

impl Stage {
    pub fn with_capacity(links: usize) -> Self {
        Self {
            coefficient: 0.0,
            links: Vec::with_capacity(links),
            joints: Vec::with_capacity(links - 1),
            contacts: Vec::with_capacity(CONTACTS_PER_LINK * links),
        }
    }
}

/// What a solver returns, and what the certificate judges.
#[derive(Debug, Clone, PartialEq)]
pub struct StageSolution {
    /// u of each link.
    pub twist: Vec<Twist>,
    /// P_T of each link in its own frame \[N s\].
    pub friction: Vec<Vector2<f64>>,
    /// D of each joint, positive driving phi upwards: -c tau_C of (T 3.51) \[N m s\].
    pub drive: Vec<f64>,
    /// P_H of each entry of [`Stage::contacts`] \[N s\].
    pub contact: Vec<f64>,
}

impl StageSolution {
    pub fn new(links: usize) -> Self {
        Self {
            twist: vec![Twist::zeros(); links],
            friction: vec![Vector2::zeros(); links],
            drive: vec![0.0; links - 1],
            contact: Vec::with_capacity(CONTACTS_PER_LINK * links),
        }
    }
}

/// Contacts reserved for each link; a denser field grows the list once.
const CONTACTS_PER_LINK: usize = 8;
