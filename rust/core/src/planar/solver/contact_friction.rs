//! Friction of contacts, with obstacles or between links, in [`Newton`](super::Newton). A chain among smooth obstacles pays
//! for none.

use crate::laws::{Interval, LimitedActuator};
use crate::math::Real;
use crate::rows::FrictionRow;
use crate::solver::LawForm;

use super::terms::RowTerm;
use super::unilateral::{RowLaw, UnilateralTerm};

/// Friction at the contacts of one kind of the stage at hand; `P` is where a row acts.
pub(super) struct ContactFriction<P, T> {
    pub terms: Vec<RowTerm<P, BoundedTerm<T>>>,
}

/// Friction of a contact in proximal form: P = clamp(centre - r gamma, +-b). The bound b is mu P_N, or is held while the inner
/// problem is minimised and moves there with the multipliers.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoundedTerm<T> {
    /// Index of the row whose impulse presses.
    pub normal: usize,
    /// mu, and the mass of the first link \[kg\].
    coefficient: T,
    mass: T,
    law: LimitedActuator<T>,
    /// The bound before the present step \[N s\].
    start: T,
    /// P over P_N of friction that slips and whose bound follows, otherwise 0 \[-\].
    pub ratio: T,
    /// P \[N s\].
    impulse: T,
}

impl<P, T: Real> ContactFriction<P, T> {
    pub fn new(capacity: usize) -> Self {
        Self { terms: Vec::with_capacity(capacity) }
    }

    /// Begins a stage.
    #[inline(always)]
    pub fn clear(&mut self) {
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

    /// Square of the largest distance of a bound from that of its normal impulse, as a velocity \[m/s\]. Where links are wedged, a
    /// violation within the tolerance may belong to impulses that grow with every move of the multipliers. So the distance from
    /// the bound of the multiplier counts too, if less.
    #[inline(always)]
    pub fn squared_bound_error(&self, normal: &[RowTerm<P, UnilateralTerm<T>>]) -> T {
        let mut largest = T::zero();
        for RowTerm { law, .. } in &self.terms {
            let wanted = law.wanted(normal);
            let growth = T::splat(GROWTH) * (wanted - law.coefficient * normal[law.normal].law.centre);
            let change = (wanted - law.law.limit).abs().max(growth.abs()) / law.mass;
            largest = largest.max(change * change);
        }
        largest
    }

    /// The impulses become the centres of the laws.
    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.terms.iter_mut().for_each(|term| term.law.recentre(lanes));
    }

    /// Bounds become those of the normal impulses.
    #[inline(always)]
    pub fn move_bounds(&mut self, normal: &[RowTerm<P, UnilateralTerm<T>>], lanes: T::Mask) {
        for RowTerm { law, .. } in &mut self.terms {
            law.law.limit = T::select(lanes, law.wanted(normal), law.law.limit);
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
        Self { normal, coefficient, mass, law, start: bound, ratio: T::zero(), impulse }
    }

    /// Moves to a velocity; returns the stiffness along the row. In the lanes `follows` the bound becomes that of the impulse of
    /// the normal row there, and an impulse that has reached it varies with that.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, velocity: T, normal: T, follows: T::Mask) -> T {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let load = self.coefficient * normal;
        let wanted = self.law.unlimited(velocity);
        let (sticks, side) = match form {
            LawForm::Present => {
                self.start = self.law.limit;
                self.law.limit = T::select(follows, load.max(zero), self.law.limit);
                (Interval { limit: self.law.limit }.contains(wanted), wanted)
            }
            LawForm::LastBranch => (Interval { limit: self.law.limit }.stuck(self.law.offset), self.law.offset),
        };
        let side = T::select(side.lt(zero), -one, one);
        // On its last branch a contact that is held closed may pull.
        let slides = side * T::select(follows, load, self.law.limit);
        self.impulse = T::select(sticks, wanted, slides);
        self.ratio = T::select(follows & !sticks, side * self.coefficient, zero);
        T::select(sticks, self.law.stiffness, zero)
    }

    /// Square of the violation |P - P_centre| / r.
    #[inline(always)]
    fn squared_error(&self) -> T {
        let violation = (self.impulse - self.law.offset) / self.law.stiffness;
        violation * violation
    }

    /// Bound of the normal impulse \[N s\].
    #[inline(always)]
    fn wanted<P>(&self, normal: &[RowTerm<P, UnilateralTerm<T>>]) -> T {
        self.coefficient * normal[self.normal].law.impulse.max(T::zero())
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

    /// With the bound at the start of the step.
    #[inline(always)]
    fn along(&self, velocity: T, rate: T, alpha: T) -> (T, T) {
        LimitedActuator { limit: self.start, ..self.law }.along(velocity, rate, alpha)
    }

    #[inline(always)]
    fn kink(&self, velocity: T, rate: T) -> T {
        self.law.kink(velocity, rate)
    }
}

/// Share of the growth of a bound by a move of the multipliers that counts as its error: impulses need not be as accurate as
/// velocities.
const GROWTH: f64 = 1e-3;
