//! One linear solve of the chain in O(n) for tangents without symmetry.
//!
//! The elimination from tail to head is that of [`sweep`](super::sweep), but friction that follows the normal impulse
//! makes a link's tangent an unsymmetric 6 x 6 matrix, and there is no function to minimise: what is eliminated are
//! rows and columns.

use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::robot::Axes;
use crate::spatial::{SpatialVector, StageLink, hinge_directions};

/// Linearised balance of a link and of the chain behind it, for a change x of its twist: `matrix x = load`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Balance {
    pub matrix: Matrix6<f64>,
    pub load: Vector6<f64>,
}

/// Place of a link in the chain, and what the elimination of the joint before it left: `rate = row . x + constant`.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainLink {
    /// Of the joint.
    axes: Axes,
    /// Twist of this link's CG for a twist of the link before with the joint locked.
    carry: Matrix6<f64>,
    /// Twists for the two rates of the joint.
    hinge: [Vector6<f64>; 2],
    row: [Vector6<f64>; 2],
    constant: [f64; 2],
    /// For another load: column of a rate in the balance, and 1 / pivot.
    column: [Vector6<f64>; 2],
    inverse: [f64; 2],
}

impl ChainLink {
    /// `link` behind `before`; for link 1 pass it twice.
    pub fn new(axes: Axes, before: &StageLink, link: &StageLink) -> Self {
        let arm = before.joint_arms()[1] + link.joint_arms()[0];
        let mut carry = Matrix6::identity();
        carry.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
        let hinge = hinge_directions(axes, &before.axes, &link.axes).map(|axis| stacked(&link.hinge(&axis)));
        let none = [Vector6::zeros(); 2];
        Self { axes, carry, hinge, row: none, constant: [0.0; 2], column: none, inverse: [0.0; 2] }
    }

    /// The link's twist, given the twist of the link before and the rates.
    pub fn follow(&self, before: &Vector6<f64>, rates: &[f64; 2]) -> Vector6<f64> {
        self.carry * before + self.hinge[0] * rates[0] + self.hinge[1] * rates[1]
    }

    /// The axes of the joint, and the power of a force on this link for a unit rate about each.
    pub fn hinge_moments(&self, force: &Vector6<f64>) -> impl Iterator<Item = (usize, f64)> {
        self.own_axes().map(|axis| (axis, self.hinge[axis].dot(force)))
    }

    fn own_axes(&self) -> impl DoubleEndedIterator<Item = usize> + use<> {
        let axes = self.axes;
        (0..2).filter(move |axis| axes.has(*axis))
    }

    /// A force on this link as one on the link before.
    pub fn carry_force(&self, force: &Vector6<f64>) -> Vector6<f64> {
        self.carry.tr_mul(force)
    }

    /// Eliminates both rates; `stiffness` and `moment` are those of the drives at the present rates. Returns what
    /// remains for the link before.
    pub fn eliminate(&mut self, mut balance: Balance, stiffness: [f64; 2], moment: [f64; 2]) -> Balance {
        for axis in self.own_axes().rev() {
            let hinge = &self.hinge[axis];
            let column = balance.matrix * hinge;
            let row = balance.matrix.tr_mul(hinge);
            let inverse = 1.0 / (hinge.dot(&column) + stiffness[axis]);
            let constant = (hinge.dot(&balance.load) + moment[axis]) * inverse;
            balance.matrix -= column * (row * inverse).transpose();
            balance.load -= column * constant;
            (self.row[axis], self.constant[axis]) = (row * -inverse, constant);
            (self.column[axis], self.inverse[axis]) = (column, inverse);
        }
        let matrix = self.carry.tr_mul(&(balance.matrix * self.carry));
        Balance { matrix, load: self.carry_force(&balance.load) }
    }

    /// Repeats the last elimination for another load, without drives. Returns what remains for the link before, and the
    /// constants for [`Self::substitute_with`].
    pub fn eliminate_load(&self, mut load: Vector6<f64>) -> (Vector6<f64>, [f64; 2]) {
        let mut constant = [0.0; 2];
        for axis in self.own_axes().rev() {
            constant[axis] = self.hinge[axis].dot(&load) * self.inverse[axis];
            load -= self.column[axis] * constant[axis];
        }
        (self.carry_force(&load), constant)
    }

    /// Changes of the rates and of the link's twist, given that of the link before.
    pub fn substitute(&self, before: &Vector6<f64>) -> ([f64; 2], Vector6<f64>) {
        self.substitute_with(&self.constant, before)
    }

    /// [`Self::substitute`] with the constants of another load.
    pub fn substitute_with(&self, constant: &[f64; 2], before: &Vector6<f64>) -> ([f64; 2], Vector6<f64>) {
        let mut x = self.carry * before;
        let mut rates = [0.0; 2];
        for axis in self.own_axes() {
            rates[axis] = self.row[axis].dot(&x) + constant[axis];
            x += self.hinge[axis] * rates[axis];
        }
        (rates, x)
    }
}

/// M of a link, frame I.
pub(super) fn mass_matrix(link: &StageLink) -> Matrix6<f64> {
    let axis = &link.axes[2];
    let mut matrix = Matrix6::identity() * link.mass;
    let turning = Matrix3::identity() * link.inertia + axis * axis.transpose() * (link.roll_inertia - link.inertia);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&turning);
    matrix
}

/// (v, omega) or (force, moment).
pub(super) fn stacked(vector: &SpatialVector) -> Vector6<f64> {
    let (v, w) = (&vector.linear, &vector.angular);
    Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

pub(super) fn spatial_vector(stacked: &Vector6<f64>) -> SpatialVector {
    SpatialVector { linear: stacked.fixed_rows::<3>(0).into(), angular: stacked.fixed_rows::<3>(3).into() }
}
