//! Friction at obstacles in [`Newton`](super::Newton). A stage without it pays for none.

use nalgebra::Vector3;

use crate::laws::LimitedActuator;
use crate::math::{Real, dot};
use crate::planar::{Stage, StageLink, StageObstacleFriction};
use crate::solver::LawForm;

use super::link_term::in_frame;
use super::terms::ContactTerm;

/// Friction at all contacts of the stage at hand.
#[derive(Debug, Clone)]
pub(super) struct ObstacleFriction<T> {
    pub terms: Vec<ObstacleFrictionTerm<T>>,
    /// Whether the bounds stay as they are instead of following the normal impulses.
    pub are_bounds_held: bool,
    /// How often the bounds have moved.
    moves: T,
}

/// Friction of a contact with an obstacle, in proximal form: P = clamp(centre - r gamma, +-b). The bound b is held while
/// the inner problem is minimised, and moves to mu P_N with the multipliers.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleFrictionTerm<T> {
    pub link: usize,
    /// Index of the contact.
    pub contact: usize,
    pub direction: Vector3<T>,
    /// mu, and the mass of the link \[kg\].
    coefficient: T,
    mass: T,
    law: LimitedActuator<T>,
    /// P \[N s\].
    pub impulse: T,
}

impl<T: Real> ObstacleFriction<T> {
    pub fn new(capacity: usize) -> Self {
        Self { terms: Vec::with_capacity(capacity), are_bounds_held: false, moves: T::zero() }
    }

    /// Laws around a warm start; `penalty` over the mass of the link.
    #[inline(always)]
    pub fn warm_up(&mut self, stage: &Stage<T>, impulses: &[T], penalty: f64) {
        self.moves = T::zero();
        self.terms.clear();
        for (friction, &impulse) in stage.obstacle_friction.iter().zip(impulses) {
            let link = &stage.links[friction.link];
            self.terms.push(ObstacleFrictionTerm::new(friction, link, impulse, T::splat(penalty) * link.mass));
        }
    }

    /// Square of the largest violation.
    #[inline(always)]
    pub fn squared_error(&self, contacts: &[ContactTerm<T>]) -> T {
        let mut of_laws = T::zero();
        for term in &self.terms {
            of_laws = of_laws.max(term.squared_error());
        }
        if self.are_bounds_held { of_laws } else { of_laws.max(self.squared_bound_error(contacts)) }
    }

    /// Square of the largest way of a bound to that of its normal impulse, as a velocity \[m/s\].
    #[inline(always)]
    pub fn squared_bound_error(&self, contacts: &[ContactTerm<T>]) -> T {
        let mut largest = T::zero();
        for term in &self.terms {
            let change = term.bound_change(contacts) / term.mass;
            largest = largest.max(change * change);
        }
        largest
    }

    /// The impulses become the centres of the laws, and bounds move to those of the normal impulses.
    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask, contacts: &[ContactTerm<T>]) {
        if self.terms.is_empty() {
            return;
        }
        let is_undamped = self.moves.lt(T::splat(UNDAMPED_MOVES));
        let share = T::select(is_undamped, T::splat(1.0), T::splat(DAMPED_SHARE));
        self.moves += T::select(lanes, T::splat(1.0), T::zero());
        for term in &mut self.terms {
            term.recentre(lanes);
            if !self.are_bounds_held {
                let bound = term.law.limit + share * term.bound_change(contacts);
                term.law.limit = T::select(lanes, bound, term.law.limit);
            }
        }
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.terms.iter_mut().for_each(|term| term.law.stiffness = term.law.stiffness * factor);
    }
}

impl<T: Real> ObstacleFrictionTerm<T> {
    /// `penalty` is the stiffness of sticking \[kg\].
    #[inline(always)]
    fn new(friction: &StageObstacleFriction<T>, link: &StageLink<T>, impulse: T, penalty: T) -> Self {
        let impulse = impulse.min(friction.bound).max(-friction.bound);
        Self {
            link: friction.link,
            contact: friction.contact,
            coefficient: friction.coefficient,
            mass: link.mass,
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
    fn squared_error(&self) -> T {
        let violation = (self.impulse - self.law.offset) / self.law.stiffness;
        violation * violation
    }

    /// Way of the bound to that of the normal impulse \[N s\].
    #[inline(always)]
    fn bound_change(&self, contacts: &[ContactTerm<T>]) -> T {
        self.coefficient * contacts[self.contact].law.impulse.max(T::zero()) - self.law.limit
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        self.law.offset = T::select(lanes, self.impulse, self.law.offset);
    }
}

/// Moves after which the bounds move by a part of the way only, and that part.
const UNDAMPED_MOVES: f64 = 12.0;
const DAMPED_SHARE: f64 = 0.5;
