use crate::laws::HalfLine;
use crate::math::Real;
use crate::solver::LawForm;

/// The law of a row's impulse P in proximal form, a function of the velocity `w . u`.
pub(super) trait RowLaw<T: Real> {
    /// P \[N s\].
    fn impulse(&self) -> T;

    /// First and second derivative of the law's function at velocity + alpha rate by alpha.
    fn along(&self, velocity: T, rate: T, alpha: T) -> (T, T);

    /// The alpha at which the slope of that function bends or nearly jumps; may be not a number.
    fn kink(&self, velocity: T, rate: T) -> T;
}

/// A unilateral contact in proximal form, P = max(centre - r gamma, 0) with gamma the velocity at which it opens.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnilateralTerm<T> {
    offset: T,
    penalty: T,
    pub centre: T,
    /// P_H \[N s\].
    pub impulse: T,
}

impl<T: Real> UnilateralTerm<T> {
    /// `penalty` is the stiffness of the closed contact \[kg\].
    #[inline(always)]
    pub fn new(offset: T, impulse: T, penalty: T) -> Self {
        Self { offset, penalty, centre: impulse, impulse }
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

    /// Moves to a velocity; returns the stiffness along the row.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, velocity: T) -> T {
        let wanted = self.penalty.subtract_from(velocity + self.offset, self.centre);
        let closed = HalfLine.is_closed(if form == LawForm::LastBranch { self.centre } else { wanted });
        let (impulse, stiffness) = HalfLine.evaluate(wanted, self.penalty, closed);
        self.impulse = impulse;
        stiffness
    }
}

impl<T: Real> RowLaw<T> for UnilateralTerm<T> {
    #[inline(always)]
    fn impulse(&self) -> T {
        self.impulse
    }

    #[inline(always)]
    fn along(&self, velocity: T, rate: T, alpha: T) -> (T, T) {
        let wanted = self.centre - self.penalty * (velocity + self.offset + alpha * rate);
        HalfLine.along(wanted, self.penalty, rate)
    }

    #[inline(always)]
    fn kink(&self, velocity: T, rate: T) -> T {
        HalfLine.kink(self.centre - self.penalty * (velocity + self.offset), self.penalty, rate)
    }
}
