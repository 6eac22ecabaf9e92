//! One linear solve of the chain in O(n) for tangents without symmetry.
//!
//! The elimination from tail to head is that of [`sweep`](super::sweep), but friction that follows the normal impulse makes
//! a link's tangent an unsymmetric matrix, and there is no function to minimise: what is eliminated are rows and columns.
//! Twists are those of the CGs in the inertial frame.

use nalgebra::{Matrix3, Vector3};

use crate::planar::StageLink;

/// Linearised balance of a link and of the chain behind it, for a change x of its twist: `matrix x = load`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Balance {
    pub matrix: Matrix3<f64>,
    pub load: Vector3<f64>,
}

/// Place of a link in the chain, and what the elimination of the joint before it left: `rate = row . x + constant`.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainLink {
    /// Twist of this link's CG for a twist of the link before with the joint locked.
    carry: Matrix3<f64>,
    /// Twist for the rate of the joint.
    hinge: Vector3<f64>,
    row: Vector3<f64>,
    constant: f64,
    /// For another load: column of the rate in the balance, and 1 / pivot.
    column: Vector3<f64>,
    inverse: f64,
}

impl ChainLink {
    /// `link` behind `before`; for link 1 pass it twice.
    pub fn new(before: &StageLink, link: &StageLink) -> Self {
        let swing = link.heading.lateral() * link.arms()[0];
        let arm = before.heading.lateral() * before.arms()[1] + swing;
        let carry = Matrix3::new(1.0, 0.0, arm.x, 0.0, 1.0, arm.y, 0.0, 0.0, 1.0);
        let none = Vector3::zeros();
        Self { carry, hinge: swing.push(1.0), row: none, constant: 0.0, column: none, inverse: 0.0 }
    }

    /// The link's twist, given the twist of the link before and the rate.
    pub fn follow(&self, before: &Vector3<f64>, rate: f64) -> Vector3<f64> {
        self.carry * before + self.hinge * rate
    }

    /// Power of a force on this link for the unit rate.
    pub fn hinge_moment(&self, force: &Vector3<f64>) -> f64 {
        self.hinge.dot(force)
    }

    /// A force on this link as one on the link before.
    pub fn carry_force(&self, force: &Vector3<f64>) -> Vector3<f64> {
        self.carry.tr_mul(force)
    }

    /// Eliminates the rate; `stiffness` and `moment` are those of the drive at the present rate. Returns what remains
    /// for the link before.
    pub fn eliminate(&mut self, balance: Balance, stiffness: f64, moment: f64) -> Balance {
        let (hinge, Balance { matrix, load }) = (&self.hinge, balance);
        self.column = matrix * hinge;
        self.inverse = 1.0 / (hinge.dot(&self.column) + stiffness);
        self.row = matrix.tr_mul(hinge) * -self.inverse;
        self.constant = (hinge.dot(&load) + moment) * self.inverse;
        let matrix = matrix + self.column * self.row.transpose();
        let load = load - self.column * self.constant;
        Balance { matrix: self.carry.tr_mul(&(matrix * self.carry)), load: self.carry_force(&load) }
    }

    /// Sign of the pivot.
    pub fn orientation(&self) -> f64 {
        self.inverse.signum()
    }

    /// Repeats the last elimination for another load, without a drive. Returns what remains for the link before, and the
    /// constant for [`Self::substitute_with`].
    pub fn eliminate_load(&self, load: Vector3<f64>) -> (Vector3<f64>, f64) {
        let constant = self.hinge.dot(&load) * self.inverse;
        (self.carry_force(&(load - self.column * constant)), constant)
    }

    /// Change of the link's twist, given that of the link before.
    pub fn substitute(&self, before: &Vector3<f64>) -> Vector3<f64> {
        self.substitute_with(self.constant, before)
    }

    /// [`Self::substitute`] with the constant of another load.
    pub fn substitute_with(&self, constant: f64, before: &Vector3<f64>) -> Vector3<f64> {
        let x = self.carry * before;
        x + self.hinge * (self.row.dot(&x) + constant)
    }
}
