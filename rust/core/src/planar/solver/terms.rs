//! Contacts and stops of a stage in proximal form, in the link's frame.

use nalgebra::Vector3;

use crate::math::{Real, dot};
use crate::planar::{Stage, StageContact};
use crate::solver::LawForm;
use crate::stepping::StageStop;

use super::link_term::in_frame;
use super::unilateral::{RowLaw, UnilateralTerm};

/// A row in the solver: where it acts, and the law of its impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowTerm<P, L> {
    pub row: P,
    pub law: L,
}

/// A row on one link: the link and the direction in its frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct OnLink<T> {
    pub link: usize,
    pub direction: Vector3<T>,
}

/// One contact between a link and an obstacle.
pub(super) type ContactTerm<T> = RowTerm<OnLink<T>, UnilateralTerm<T>>;

/// Both stops of one joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct StopTerm<T> {
    stop: StageStop<T>,
    laws: [UnilateralTerm<T>; 2],
}

impl<T: Real> StopTerm<T> {
    /// `penalty` is the stiffness of a closed stop \[kg\].
    #[inline(always)]
    pub fn new(stop: &StageStop<T>, impulse: [T; 2], penalty: T) -> Self {
        let law = |side: usize| UnilateralTerm::new(stop.offset[side], impulse[side], penalty);
        Self { stop: *stop, laws: [law(0), law(1)] }
    }

    /// Moves to the joint rate omega_J; returns the stiffness there.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, rate: T) -> T {
        let StageStop { lever, .. } = self.stop;
        let velocity = lever * rate;
        let [upper, lower] = &mut self.laws;
        lever * lever * (upper.evaluate(form, -velocity) + lower.evaluate(form, velocity))
    }

    /// First and second derivative of the laws' function at omega_J + alpha change by alpha.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        let (velocity, change) = (self.stop.lever * rate, self.stop.lever * change);
        let (upper, lower) =
            (self.laws[0].along(-velocity, -change, alpha), self.laws[1].along(velocity, change, alpha));
        (upper.0 + lower.0, upper.1 + lower.1)
    }

    #[inline(always)]
    pub fn impulse(&self) -> [T; 2] {
        [self.laws[0].impulse, self.laws[1].impulse]
    }

    /// \[N m s\]
    #[inline(always)]
    pub fn moment(&self) -> T {
        self.stop.moment(&self.impulse())
    }

    #[inline(always)]
    pub fn squared_error(&self) -> T {
        self.laws[0].squared_error().max(self.laws[1].squared_error())
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.laws.iter_mut().for_each(|law| law.stiffen(factor));
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.laws.iter_mut().for_each(|law| law.recentre(lanes));
    }
}

impl<T: Real> OnLink<T> {
    #[inline(always)]
    pub fn new(row: &StageContact<T>, stage: &Stage<T>) -> Self {
        Self { link: row.link, direction: in_frame(&stage.links[row.link].heading, &row.direction) }
    }
}

impl<T: Real, L: RowLaw<T>> RowTerm<OnLink<T>, L> {
    #[inline(always)]
    pub fn velocity(&self, u: &Vector3<T>) -> T {
        dot(&self.row.direction, u)
    }

    /// First and second derivative of the law's function at u + alpha du by alpha.
    #[inline(always)]
    pub fn along(&self, u: &Vector3<T>, du: &Vector3<T>, alpha: T) -> (T, T) {
        self.law.along(dot(&self.row.direction, u), dot(&self.row.direction, du), alpha)
    }

    /// The alpha at which the law's function bends, as [`RowLaw::kink`].
    #[inline(always)]
    pub fn kink(&self, u: &Vector3<T>, du: &Vector3<T>) -> T {
        self.law.kink(dot(&self.row.direction, u), dot(&self.row.direction, du))
    }
}
