//! Friction of contacts, with obstacles or between links, in [`Newton`](super::Newton). A stage without it pays for none.

use crate::laws::LimitedActuator;
use crate::math::Real;
use crate::rows::FrictionRow;
use crate::solver::LawForm;

use super::terms::RowTerm;
use super::unilateral::{RowLaw, UnilateralTerm};

/// Friction at the contacts of one kind of the stage at hand; `P` is where a row acts.
pub(super) struct ContactFriction<P, T> {
    pub terms: Vec<RowTerm<P, BoundedTerm<T>>>,
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

    /// Square of the largest way of a bound to that of its normal impulse, as a velocity \[m/s\].
    #[inline(always)]
    pub fn squared_bound_error(&self, normal: &[RowTerm<P, UnilateralTerm<T>>]) -> T {
        let mut largest = T::zero();
        for RowTerm { law, .. } in &self.terms {
            let change = (law.wanted(normal) - law.law.limit) / law.mass;
            largest = largest.max(change * change);
        }
        largest
    }

    /// The impulses become the centres of the laws.
    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.terms.iter_mut().for_each(|term| term.law.recentre(lanes));
    }

    /// Bounds, and those of the normal impulses \[N s\].
    #[inline(always)]
    pub fn bounds<'a>(
        &'a mut self,
        normal: &'a [RowTerm<P, UnilateralTerm<T>>],
    ) -> impl Iterator<Item = (&'a mut T, T)> {
        self.terms.iter_mut().map(|RowTerm { law, .. }| {
            let wanted = law.wanted(normal);
            (&mut law.law.limit, wanted)
        })
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

    #[inline(always)]
    fn kink(&self, velocity: T, rate: T) -> T {
        self.law.kink(velocity, rate)
    }
}
