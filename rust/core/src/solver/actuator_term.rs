use crate::laws::{Backlash, LimitedActuator};
use crate::math::Real;
use crate::rows::DriveRow;

use super::{LawForm, MotorTerm};

/// The actuator of one joint axis, a single-valued law that needs no multiplier.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ActuatorTerm<T> {
    law: Backlash<T>,
    /// D \[N m s\].
    pub impulse: T,
}

impl<T: Real> ActuatorTerm<T> {
    #[inline(always)]
    pub fn new(drive: &DriveRow<T>, impulse: T) -> Self {
        let actuator = LimitedActuator { offset: drive.drive, stiffness: drive.stiffness, limit: drive.limit };
        Self { law: Backlash { actuator, slack: drive.slack }, impulse }
    }

    /// No actuator at all.
    #[inline(always)]
    pub fn none() -> Self {
        Self { law: Backlash::none(), impulse: T::zero() }
    }

    /// Moves to a rate of the axis; returns the stiffness there.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, rate: T) -> T {
        let (impulse, stiffness) = match form {
            LawForm::LastBranch => self.law.evaluate_last_branch(rate, self.impulse),
            LawForm::Present => self.law.evaluate(rate),
        };
        self.impulse = impulse;
        stiffness
    }

    /// Impulse and stiffness at another rate.
    #[inline(always)]
    pub fn at(&self, rate: T) -> (T, T) {
        self.law.evaluate(rate)
    }

    /// Moves to a rate of the axis, as does the motor if there is one; returns impulse and stiffness of the whole axis.
    #[inline(always)]
    pub fn evaluate_with(&mut self, motor: Option<&mut MotorTerm<T>>, form: LawForm, rate: T) -> (T, T) {
        let stiffness = self.evaluate(form, rate);
        let Some(motor) = motor else { return (self.impulse, stiffness) };
        let (drive, impulse, stiffness) = motor.drive(form, rate, (self.impulse, stiffness));
        self.impulse = drive;
        (impulse, stiffness)
    }

    /// First and second derivative by alpha of the function of the laws of the axis, the motor's among them if there is one,
    /// at rate + alpha change.
    #[inline(always)]
    pub fn along_with(&self, motor: Option<&MotorTerm<T>>, rate: T, change: T, alpha: T) -> (T, T) {
        let Some(motor) = motor else { return self.law.along(rate, change, alpha) };
        motor.along(
            #[inline(always)]
            |rate| self.at(rate),
            rate,
            change,
            alpha,
        )
    }
}
