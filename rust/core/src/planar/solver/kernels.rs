//! Parts of [`Newton`] that are functions of their own, since they are needed in several places or by few stages: the code
//! of the iteration stays small. The law of a skin is chosen here.

use crate::laws::{Skin, Whole};
use crate::math::{Kernel, Real};
use crate::solver::{LawForm, NewtonStep};

use super::newton::{Newton, StepEnd};

/// [`Newton::evaluate_laws`] at the present twists.
pub(super) struct EvaluateLaws<'a, T: Real> {
    pub newton: &'a mut Newton<T>,
    pub form: LawForm,
}

impl<T: Real> Kernel for EvaluateLaws<'_, T> {
    type Output = StepEnd<T>;

    #[inline(always)]
    fn run(self) -> StepEnd<T> {
        let Self { newton, form } = self;
        if let Some(skin) = newton.skin {
            T::run(EvaluateSkin { newton, form, skin })
        } else if !newton.is_coupled() {
            newton.evaluate_laws::<false>(Whole, form, |_| ())
        } else {
            newton.evaluate_laws::<true>(Whole, form, |_| ())
        }
    }
}

/// The same with a skin.
struct EvaluateSkin<'a, T: Real> {
    newton: &'a mut Newton<T>,
    form: LawForm,
    skin: Skin,
}

impl<T: Real> Kernel for EvaluateSkin<'_, T> {
    type Output = StepEnd<T>;

    #[inline(always)]
    fn run(self) -> StepEnd<T> {
        self.newton.evaluate_laws::<true>(self.skin, self.form, |_| ())
    }
}

/// [`Newton::squared_friction_error`] with a skin.
pub(super) struct FrictionError<'a, T: Real> {
    pub newton: &'a Newton<T>,
    pub skin: Skin,
}

impl<T: Real> Kernel for FrictionError<'_, T> {
    type Output = T;

    #[inline(always)]
    fn run(self) -> T {
        self.newton.squared_friction_error(self.skin)
    }
}

/// [`Newton::step`] with contacts between links, obstacles that can be pushed or a skin, apart from the code of all other
/// stages.
pub(super) struct CoupledStep<'a, T: Real> {
    pub newton: &'a mut Newton<T>,
    pub active: T::Mask,
    pub damped: bool,
}

impl<T: Real> Kernel for CoupledStep<'_, T> {
    type Output = NewtonStep<T>;

    #[inline(always)]
    fn run(self) -> NewtonStep<T> {
        match self.newton.skin {
            None => self.newton.step::<true>(Whole, self.active, self.damped),
            Some(skin) => T::run(SkinStep { newton: self.newton, active: self.active, damped: self.damped, skin }),
        }
    }
}

/// The same with a skin.
struct SkinStep<'a, T: Real> {
    newton: &'a mut Newton<T>,
    active: T::Mask,
    damped: bool,
    skin: Skin,
}

impl<T: Real> Kernel for SkinStep<'_, T> {
    type Output = NewtonStep<T>;

    #[inline(always)]
    fn run(self) -> NewtonStep<T> {
        self.newton.step::<true>(self.skin, self.active, self.damped)
    }
}
