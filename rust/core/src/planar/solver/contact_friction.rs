use nalgebra::Vector3;

use crate::laws::LimitedActuator;
use crate::math::{Real, dot};
use crate::planar::{StageContactFriction, StageLink};
use crate::solver::LawForm;

use super::link_term::in_frame;

/// Friction of a contact with an obstacle under a held bound, in proximal form: P = clamp(centre - r gamma, +-b).
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactFrictionTerm<T> {
    pub link: usize,
    pub direction: Vector3<T>,
    law: LimitedActuator<T>,
    /// P \[N s\].
    pub impulse: T,
}

impl<T: Real> ContactFrictionTerm<T> {
    /// `penalty` is the stiffness of sticking \[kg\].
    #[inline(always)]
    pub fn new(friction: &StageContactFriction<T>, link: &StageLink<T>, impulse: T, penalty: T) -> Self {
        let impulse = impulse.min(friction.bound).max(-friction.bound);
        Self {
            link: friction.link,
            direction: in_frame(&link.heading, &friction.direction),
            law: LimitedActuator { offset: impulse, stiffness: penalty, limit: friction.bound },
            impulse,
        }
    }

    /// Moves to the twist u; returns the stiffness along the direction.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, u: &Vector3<T>) -> T {
        let slip = dot(&self.direction, u);
        let (impulse, stiffness) = match form {
            LawForm::Present => self.law.evaluate(slip),
            LawForm::LastBranch => {
                let sticks = self.law.offset.abs().lt(self.law.limit);
                let stiffness = T::select(sticks, self.law.stiffness, T::zero());
                (self.law.offset - stiffness * slip, stiffness)
            }
        };
        self.impulse = impulse;
        stiffness
    }

    /// First and second derivative of the law's function at u + alpha du by alpha.
    #[inline(always)]
    pub fn along(&self, u: &Vector3<T>, du: &Vector3<T>, alpha: T) -> (T, T) {
        self.law.along(dot(&self.direction, u), dot(&self.direction, du), alpha)
    }

    /// Square of the violation |P - P_centre| / r.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let violation = (self.impulse - self.law.offset) / self.law.stiffness;
        violation * violation
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.law.stiffness = self.law.stiffness * factor;
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.law.offset = T::select(lanes, self.impulse, self.law.offset);
    }
}
