//! Contacts and actuators of a stage in proximal form, in the link's frame.

use nalgebra::Vector3;

use crate::laws::{Backlash, HalfLine, LimitedActuator};
use crate::math::{Real, dot};
use crate::planar::{StageContact, StageJoint, StageLink};
use crate::solver::LawForm;

/// One link-peg contact: P = max(centre - r gamma, 0).
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactTerm<T> {
    pub link: usize,
    pub direction: Vector3<T>,
    offset: T,
    penalty: T,
    centre: T,
    /// P_H \[N s\].
    pub impulse: T,
}

/// The actuator of one joint, a single-valued law that needs no multiplier.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActuatorTerm<T> {
    law: Backlash<T>,
    /// D \[N m s\].
    pub impulse: T,
}

impl<T: Real> ContactTerm<T> {
    /// `penalty` is the stiffness of the closed contact \[kg\].
    #[inline(always)]
    pub fn new(contact: &StageContact<T>, link: &StageLink<T>, impulse: T, penalty: T) -> Self {
        let in_plane = link.heading.to_link(contact.direction.xy());
        Self {
            link: contact.link,
            direction: Vector3::new(in_plane.x, in_plane.y, contact.direction.z),
            offset: contact.offset,
            penalty,
            centre: impulse,
            impulse,
        }
    }

    /// Moves to the twist u; returns the stiffness along the contact's direction.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, u: &Vector3<T>) -> T {
        let wanted = self.centre - self.penalty * (dot(&self.direction, u) + self.offset);
        let closed = HalfLine.is_closed(if form == LawForm::LastBranch { self.centre } else { wanted });
        let (impulse, stiffness) = HalfLine.evaluate(wanted, self.penalty, closed);
        self.impulse = impulse;
        stiffness
    }

    /// First and second derivative of the law's function at u + alpha du by alpha.
    #[inline(always)]
    pub fn along(&self, u: &Vector3<T>, du: &Vector3<T>, alpha: T) -> (T, T) {
        let rate = dot(&self.direction, du);
        let wanted = self.centre - self.penalty * (dot(&self.direction, u) + self.offset + alpha * rate);
        HalfLine.along(wanted, self.penalty, rate)
    }

    /// Square of the violation |P - P_centre| / r.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let violation = (self.impulse - self.centre) / self.penalty;
        violation * violation
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = T::select(lanes, self.impulse, self.centre);
    }
}

impl<T: Real> ActuatorTerm<T> {
    #[inline(always)]
    pub fn new(joint: &StageJoint<T>, impulse: T) -> Self {
        let actuator = LimitedActuator { offset: joint.drive, stiffness: joint.stiffness, limit: joint.limit };
        Self { law: Backlash { actuator, slack: joint.slack }, impulse }
    }

    /// No actuator at all.
    #[inline(always)]
    pub fn none() -> Self {
        Self { law: Backlash::none(), impulse: T::zero() }
    }

    /// Moves to the joint rate omega_J; returns the stiffness there.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, rate: T) -> T {
        let (impulse, stiffness) = match form {
            LawForm::LastBranch => self.law.evaluate_last_branch(rate, self.impulse),
            LawForm::Present => self.law.evaluate(rate),
        };
        self.impulse = impulse;
        stiffness
    }

    /// First and second derivative of the law's function at omega_J + alpha change by alpha.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        self.law.along(rate, change, alpha)
    }
}
