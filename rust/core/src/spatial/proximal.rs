//! The set-valued laws of a stage in proximal form, around given multipliers.
//!
//! P = prox_C(P_centre - r gamma) is the gradient of a smooth convex function of the velocity gamma; its derivative is
//! a generalised Hessian of rank one or two. Around the multiplier zero it is the law with a compliance 1/r; the same r
//! for all contacts selects (T 4.78 != D43) the shortest of all impulses that move the robot alike.

use nalgebra::{Vector2, Vector3};

use crate::math::{Mask, Real};

use super::screw::Screw;
use super::sweep::DriveModel;
use super::{StageDrive, StagePeg};

/// Unilateral contact: P = max(centre - r (gamma + offset), 0).
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactTerm<T: Real> {
    offset: T,
    penalty: T,
    centre: T,
    /// Whether the contact counts as closed whatever its velocity: one for yes, zero for no.
    held: T::Mask,
    pub value: T,
}

/// The actuator of one joint axis, D = clamp(drive - stiffness phi').
#[derive(Debug, Clone, Copy)]
pub(super) struct DriveTerm<T> {
    data: StageDrive<T>,
    pub value: T,
}

impl<T: Real> ContactTerm<T> {
    #[inline(always)]
    pub fn new(offset: T, penalty: T, impulse: T) -> Self {
        Self { offset, penalty, centre: T::zero(), held: T::zero().lt(impulse), value: T::zero() }
    }

    /// Moves to the velocity gamma; returns the present stiffness.
    #[inline(always)]
    pub fn respond(&mut self, gamma: T) -> T {
        let wanted = self.centre - self.penalty * (gamma + self.offset);
        self.value = T::select(self.held, wanted, wanted.max(T::zero()));
        T::select(T::zero().lt(wanted) | self.held, self.penalty, T::zero())
    }

    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// First and second derivative of the law's function at gamma + alpha rate by alpha.
    #[inline(always)]
    pub fn along(&self, gamma: T, rate: T, alpha: T) -> (T, T) {
        let wanted = self.centre - self.penalty * (gamma + self.offset + alpha * rate);
        let penalty = T::select(T::zero().lt(wanted), self.penalty, T::zero());
        (-wanted.max(T::zero()) * rate, penalty * rate * rate)
    }

    /// How far the centre is from the impulse, squared: over the squared penalty it is the velocity by which the law is
    /// violated.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let x = self.value - self.centre;
        x * x
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = T::select(lanes, self.value, self.centre);
    }
}

impl<T: Real> DriveTerm<T> {
    #[inline(always)]
    pub fn new(data: &StageDrive<T>) -> Self {
        Self { data: *data, value: T::zero() }
    }

    /// No actuator at all.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        Self::new(&StageDrive { drive: zero, stiffness: zero, limit: zero })
    }

    /// Moves to the joint rate.
    #[inline(always)]
    pub fn respond(&mut self, rate: T) -> DriveModel<T> {
        let (wanted, free) = self.wanted(rate);
        self.value = clamp(wanted, self.data.limit);
        DriveModel { stiffness: T::select(free, self.data.stiffness, T::zero()), value: self.value }
    }

    /// First and second derivative of the law's function at rate + alpha change by alpha.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        let (wanted, free) = self.wanted(rate + alpha * change);
        let stiffness = T::select(free, self.data.stiffness, T::zero());
        (-clamp(wanted, self.data.limit) * change, stiffness * change * change)
    }

    /// The drive without limit, and whether the limit allows it.
    #[inline(always)]
    fn wanted(&self, rate: T) -> (T, T::Mask) {
        let wanted = self.data.drive - self.data.stiffness * rate;
        (wanted, wanted.abs().le(self.data.limit))
    }
}

/// A peg's contact together with its direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct PegTerm<T: Real> {
    pub link: usize,
    pub direction: Screw<T>,
    pub contact: ContactTerm<T>,
}

impl<T: Real> PegTerm<T> {
    #[inline(always)]
    pub fn new(peg: &StagePeg<T>, penalty: T, impulse: T) -> Self {
        Self { link: peg.link, direction: peg.direction, contact: ContactTerm::new(peg.offset, penalty, impulse) }
    }
}

#[inline(always)]
fn clamp<T: Real>(x: T, limit: T) -> T {
    x.min(limit).max(-limit)
}

/// `yes` in the given lanes, elsewhere `no`.
#[inline(always)]
pub(super) fn select<T: Real>(lanes: T::Mask, yes: &Vector2<T>, no: &Vector2<T>) -> Vector2<T> {
    Vector2::new(T::select(lanes, yes.x, no.x), T::select(lanes, yes.y, no.y))
}

/// (x, y) of a vector.
#[inline(always)]
pub(super) fn horizontal<T: Real>(v: &Vector3<T>) -> Vector2<T> {
    Vector2::new(v.x, v.y)
}
