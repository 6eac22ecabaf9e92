//! Friction of contacts, with obstacles or between links, in [`Newton`](super::Newton). A stage without it pays for none.

use crate::laws::LimitedActuator;
use crate::math::Real;
use crate::rows::FrictionRow;
use crate::solver::LawForm;

use super::terms::RowTerm;
use super::unilateral::{RowLaw, UnilateralTerm};

/// Friction at the contacts of one kind of the stage at hand; `P` is where a row acts.
#[derive(Debug, Clone)]
pub(super) struct ContactFriction<P, T> {
    pub terms: Vec<RowTerm<P, BoundedTerm<T>>>,
    /// How often the bounds have moved.
    moves: T,
}

/// Friction of a contact in proximal form: P = clamp(centre - r gamma, +-b). The bound b is held while the inner problem is
/// minimised, and moves to mu P_N with the multipliers.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoundedTerm<T> {
    /// Index of the row whose impulse presses.
    normal: usize,
    /// mu, and the mass of the first link \[kg\].
    coefficient: T,
    mass: T,
    law: LimitedActuator<T>,
    /// P \[N s\].
    impulse: T,
}

impl<P, T: Real> ContactFriction<P, T> {
    pub fn new(capacity: usize) -> Self {
        Self { terms: Vec::with_capacity(capacity), moves: T::zero() }
    }

    /// Begins a stage.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.moves = T::zero();
        self.terms.clear();
    }

    /// Adds a law around a warm start; `penalty` is the stiffness of sticking over the mass of the first link.
    #[inline(always)]
    pub fn add<R>(&mut self, friction: &FrictionRow<R, T>, row: P, mass: T, impulse: T, penalty: f64) {
        let law = BoundedTerm::new(friction, mass, impulse, T::splat(penalty) * mass);
        self.terms.push(RowTerm { row, law });
    }

    /// Square of the largest violation, with that of the bounds where these are not `held`.
    #[inline(always)]
    pub fn squared_error(&self, normal: &[RowTerm<P, UnilateralTerm<T>>], held: bool) -> T {
        let mut of_laws = T::zero();
        for term in &self.terms {
            of_laws = of_laws.max(term.law.squared_error());
        }
        if held { of_laws } else { of_laws.max(self.squared_bound_error(normal)) }
    }

    /// Square of the largest way of a bound to that of its normal impulse, as a velocity \[m/s\].
    #[inline(always)]
    pub fn squared_bound_error(&self, normal: &[RowTerm<P, UnilateralTerm<T>>]) -> T {
        let mut largest = T::zero();
        for RowTerm { law, .. } in &self.terms {
            let change = law.bound_change(normal) / law.mass;
            largest = largest.max(change * change);
        }
        largest
    }

    /// The impulses become the centres of the laws, and bounds that are not `held` move to those of the normal impulses.
    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask, normal: &[RowTerm<P, UnilateralTerm<T>>], held: bool) {
        if self.terms.is_empty() {
            return;
        }
        let is_undamped = self.moves.lt(T::splat(UNDAMPED_MOVES));
        let share = T::select(is_undamped, T::splat(1.0), T::splat(DAMPED_SHARE));
        self.moves += T::select(lanes, T::splat(1.0), T::zero());
        for RowTerm { law: term, .. } in &mut self.terms {
            term.recentre(lanes);
            if !held {
                let bound = term.law.limit + share * term.bound_change(normal);
                term.law.limit = T::select(lanes, bound, term.law.limit);
            }
        }
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.terms.iter_mut().for_each(|term| term.law.law.stiffness = term.law.law.stiffness * factor);
    }
}

impl<T: Real> BoundedTerm<T> {
    /// `penalty` is the stiffness of sticking \[kg\].
    #[inline(always)]
    fn new<R>(row: &FrictionRow<R, T>, mass: T, impulse: T, penalty: T) -> Self {
        let FrictionRow { normal, coefficient, bound, .. } = *row;
        let impulse = impulse.min(bound).max(-bound);
        let law = LimitedActuator { offset: impulse, stiffness: penalty, limit: bound };
        Self { normal, coefficient, mass, law, impulse }
    }

    /// Square of the violation |P - P_centre| / r.
    #[inline(always)]
    fn squared_error(&self) -> T {
        let violation = (self.impulse - self.law.offset) / self.law.stiffness;
        violation * violation
    }

    /// Way of the bound to that of the normal impulse \[N s\].
    #[inline(always)]
    fn bound_change<P>(&self, normal: &[RowTerm<P, UnilateralTerm<T>>]) -> T {
        self.coefficient * normal[self.normal].law.impulse.max(T::zero()) - self.law.limit
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        self.law.offset = T::select(lanes, self.impulse, self.law.offset);
    }
}

impl<T: Real> RowLaw<T> for BoundedTerm<T> {
    #[inline(always)]
    fn impulse(&self) -> T {
        self.impulse
    }

    #[inline(always)]
    fn evaluate(&mut self, form: LawForm, velocity: T) -> T {
        let (impulse, stiffness) = match form {
            LawForm::Present => self.law.evaluate(velocity),
            LawForm::LastBranch => {
                let sticks = self.law.offset.abs().lt(self.law.limit);
                let stiffness = T::select(sticks, self.law.stiffness, T::zero());
                (self.law.offset - stiffness * velocity, stiffness)
            }
        };
        self.impulse = impulse;
        stiffness
    }

    #[inline(always)]
    fn along(&self, velocity: T, rate: T, alpha: T) -> (T, T) {
        self.law.along(velocity, rate, alpha)
    }
}

/// Moves after which the bounds move by a part of the way only, and that part.
const UNDAMPED_MOVES: f64 = 12.0;
const DAMPED_SHARE: f64 = 0.5;
