//! One linear solve of a chain in O(n) for tangents without symmetry, of twists of `N` numbers and joints of `A` axes.
//!
//! The elimination from tail to head is that of the spatial solver of the lanes, but friction that follows the normal impulse makes
//! a link's tangent an unsymmetric matrix, and there is no function to minimise: what is eliminated are rows and columns.
//! Twists are those of the CGs in the inertial frame.

use nalgebra::{SMatrix, SVector};

/// Linearised balance of a link and of the chain behind it, for a change x of its twist: `matrix x = load`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Balance<const N: usize> {
    pub matrix: SMatrix<f64, N, N>,
    pub load: SVector<f64, N>,
}

/// Place of a link in the chain, and what the elimination of the joint before it left: `rate = row . x + constant`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChainLink<const N: usize, const A: usize> {
    /// Which axes the joint has.
    has: [bool; A],
    /// Twist of this link's CG for a twist of the link before with the joint locked.
    carry: SMatrix<f64, N, N>,
    /// Twists for the rates of the joint.
    hinge: [SVector<f64, N>; A],
    row: [SVector<f64, N>; A],
    pub constant: [f64; A],
    /// For another load: column of a rate in the balance, and 1 / pivot.
    column: [SVector<f64, N>; A],
    inverse: [f64; A],
}

impl<const N: usize> Balance<N> {
    pub fn zero() -> Self {
        Self { matrix: SMatrix::zeros(), load: SVector::zeros() }
    }
}

impl<const N: usize, const A: usize> ChainLink<N, A> {
    pub fn new(has: [bool; A], carry: SMatrix<f64, N, N>, hinge: [SVector<f64, N>; A]) -> Self {
        let none = [SVector::zeros(); A];
        Self { has, carry, hinge, row: none, constant: [0.0; A], column: none, inverse: [0.0; A] }
    }

    /// The link's twist, given the twist of the link before and the rates.
    pub fn follow(&self, before: &SVector<f64, N>, rates: &[f64; A]) -> SVector<f64, N> {
        self.hinge.iter().zip(rates).fold(self.carry * before, |twist, (hinge, rate)| twist + hinge * *rate)
    }

    /// The axes of the joint, and the power of a force on this link for a unit rate about each.
    pub fn hinge_moments(&self, force: &SVector<f64, N>) -> impl Iterator<Item = (usize, f64)> {
        self.axes().map(|axis| (axis, self.hinge[axis].dot(force)))
    }

    fn axes(&self) -> impl DoubleEndedIterator<Item = usize> + use<N, A> {
        let has = self.has;
        (0..A).filter(move |axis| has[*axis])
    }

    /// A force on this link as one on the link before.
    pub fn carry_force(&self, force: &SVector<f64, N>) -> SVector<f64, N> {
        self.carry.tr_mul(force)
    }

    /// Eliminates the rates; `stiffness` and `moment` are those of the drives at the present rates. Returns what remains
    /// for the link before.
    pub fn eliminate(&mut self, mut balance: Balance<N>, stiffness: [f64; A], moment: [f64; A]) -> Balance<N> {
        for axis in self.axes().rev() {
            let hinge = &self.hinge[axis];
            let column = balance.matrix * hinge;
            let inverse = 1.0 / (hinge.dot(&column) + stiffness[axis]);
            let row = balance.matrix.tr_mul(hinge) * -inverse;
            let constant = (hinge.dot(&balance.load) + moment[axis]) * inverse;
            balance.matrix += column * row.transpose();
            balance.load -= column * constant;
            (self.row[axis], self.constant[axis]) = (row, constant);
            (self.column[axis], self.inverse[axis]) = (column, inverse);
        }
        let matrix = self.carry.tr_mul(&(balance.matrix * self.carry));
        Balance { matrix, load: self.carry_force(&balance.load) }
    }

    /// Sign of the pivots.
    pub fn orientation(&self) -> f64 {
        self.axes().map(|axis| self.inverse[axis].signum()).product()
    }

    /// Repeats the last elimination for another load, without drives. Returns what remains for the link before, and the
    /// constants for [`Self::substitute`].
    pub fn eliminate_load(&self, mut load: SVector<f64, N>) -> (SVector<f64, N>, [f64; A]) {
        let mut constant = [0.0; A];
        for axis in self.axes().rev() {
            constant[axis] = self.hinge[axis].dot(&load) * self.inverse[axis];
            load -= self.column[axis] * constant[axis];
        }
        (self.carry_force(&load), constant)
    }

    /// Changes of the rates and of the link's twist with the constants of an elimination, given that of the link before.
    pub fn substitute(&self, constant: &[f64; A], before: &SVector<f64, N>) -> ([f64; A], SVector<f64, N>) {
        let mut x = self.carry * before;
        let mut rates = [0.0; A];
        for axis in self.axes() {
            rates[axis] = self.row[axis].dot(&x) + constant[axis];
            x += self.hinge[axis] * rates[axis];
        }
        (rates, x)
    }
}
