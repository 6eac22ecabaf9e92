//! Parts of [`Newton`] that are functions of their own, since they are needed in several places or by few stages: the code
//! of the iteration stays small. The law of a skin is chosen here.

use crate::laws::Whole;
use crate::math::Real;
use crate::solver::{LawForm, NewtonStep};

use super::newton::{Newton, StepEnd};

impl<T: Real> Newton<T> {
    /// [`Self::evaluate_laws`] at the present twists.
    #[inline(always)]
    pub(super) fn evaluate_here(&mut self, form: LawForm) -> StepEnd<T> {
        T::call(
            #[inline(always)]
            move || match self.skin {
                Some(skin) => T::call(
                    #[inline(always)]
                    move || self.evaluate_laws::<true, true>(skin, form, |_| ()),
                ),
                None if self.is_coupled() => self.evaluate_laws::<true, true>(Whole, form, |_| ()),
                None if self.is_rough() => self.evaluate_laws::<false, true>(Whole, form, |_| ()),
                None => self.evaluate_laws::<false, false>(Whole, form, |_| ()),
            },
        )
    }

    /// [`Self::step`] with friction at obstacles, apart from the code of all other stages.
    #[inline(always)]
    pub(super) fn rough_step(&mut self, active: T::Mask, damped: bool) -> NewtonStep<T> {
        T::call(
            #[inline(always)]
            move || self.step::<false, true>(Whole, active, damped),
        )
    }

    /// [`Self::step`] with contacts between links, obstacles that can be pushed or a skin, apart from the code of all other
    /// stages.
    #[inline(always)]
    pub(super) fn coupled_step(&mut self, active: T::Mask, damped: bool) -> NewtonStep<T> {
        T::call(
            #[inline(always)]
            move || match self.skin {
                None => self.step::<true, true>(Whole, active, damped),
                Some(skin) => T::call(
                    #[inline(always)]
                    move || self.step::<true, true>(skin, active, damped),
                ),
            },
        )
    }
}
