use crate::laws::Interval;
use crate::math::{Mask, Real};
use crate::rows::MotorRow;

use super::LawForm;

/// The motor of one joint axis: the drive within its torque-speed line, the inertia of its rotor and the damping of its
/// gear, all single-valued; and the friction of its gear in proximal form, P = clamp(centre - r phi', +-b). The friction of
/// the ground against the spin of a link is a motor that has nothing else.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotorTerm<T: Real> {
    motor: MotorRow<T>,
    /// From rates to velocities \[m\].
    lever: T,
    /// r \[N m s^2\], and the present slope of the friction.
    penalty: T,
    slope: T,
    centre: T,
    /// Whether the gear counts as sticking whatever its rate.
    held: T::Mask,
    /// P \[N m s\].
    pub friction: T,
}

impl<T: Real> MotorTerm<T> {
    /// `penalty` is the stiffness of sticking at the lever \[kg\], `impulse` the friction that is expected.
    #[inline(always)]
    pub fn new(motor: &MotorRow<T>, impulse: T, lever: T, penalty: T) -> Self {
        let centre = impulse.min(motor.friction).max(-motor.friction);
        Self {
            motor: *motor,
            lever,
            penalty: penalty * lever * lever,
            slope: T::zero(),
            centre,
            held: T::Mask::of(|_| false),
            friction: centre,
        }
    }

    /// Friction of at most `bound` alone.
    #[inline(always)]
    pub fn friction(bound: T, impulse: T, lever: T, penalty: T) -> Self {
        Self::new(&MotorRow { friction: bound, ..MotorRow::none() }, impulse, lever, penalty)
    }

    /// The same, sticking where it is expected to until [`Self::release`].
    #[inline(always)]
    pub fn held(self) -> Self {
        Self { held: Interval { limit: self.motor.friction }.stuck(self.centre), ..self }
    }

    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// Keeps a drive within the line and moves to a rate: impulse of the drive, impulse and stiffness of the whole axis.
    #[inline(always)]
    pub fn drive(&mut self, form: LawForm, rate: T, drive: (T, T)) -> (T, T, T) {
        let (impulse, stiffness) = self.motor.limit(rate, drive);
        let (own, own_stiffness) = self.evaluate(form, rate);
        (impulse, impulse + own, stiffness + own_stiffness)
    }

    /// Moves to a rate. Returns the impulse of inertia, damping and friction, and their stiffness.
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, rate: T) -> (T, T) {
        let (bound, wanted) = (self.motor.friction, self.centre - self.penalty * rate);
        let (sticks, slides) = match form {
            LawForm::Present => (self.held | wanted.abs().lt(bound), wanted.min(bound).max(-bound)),
            LawForm::LastBranch => (Interval { limit: bound }.stuck(self.centre), self.centre),
        };
        self.slope = T::select(sticks, self.penalty, T::zero());
        self.friction = T::select(sticks, wanted, slides);
        let (impulse, stiffness) = self.motor.passive(rate);
        (self.friction + impulse, self.slope + stiffness)
    }

    /// First and second derivative by alpha of the laws' function at rate + alpha change, `drive` without the line among
    /// them.
    #[inline(always)]
    pub fn along(&self, drive: impl FnOnce(T) -> (T, T), rate: T, change: T, alpha: T) -> (T, T) {
        let there = rate + alpha * change;
        let (_, impulse, stiffness) = { *self }.drive(LawForm::Present, there, drive(there));
        (-impulse * change, stiffness * change * change)
    }

    /// Part of the change at which the gear sticks; not a number where it has no friction.
    #[inline(always)]
    pub fn kink(&self, rate: T, change: T) -> T {
        let kink = (self.centre / self.penalty - rate) / change;
        T::select(T::zero().lt(self.motor.friction), kink, T::splat(f64::NAN))
    }

    /// Square of the velocity by which the friction's law is violated.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let violation = (self.friction - self.centre) * self.lever / self.penalty;
        violation * violation
    }

    /// How far the friction is from its centre, as an impulse at the lever \[N s\].
    #[inline(always)]
    pub fn centre_error(&self) -> T {
        (self.friction - self.centre).abs() / self.lever
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = T::select(lanes, self.friction, self.centre);
    }

    /// The same, and the friction becomes what it will then be at the rate of the last evaluation, on the same branch.
    /// Returns its change.
    #[inline(always)]
    pub fn recentre_here(&mut self, rate: T, lanes: T::Mask) -> T {
        self.recentre(lanes);
        let change = T::select(lanes, -(self.slope * rate), T::zero());
        self.friction += change;
        change
    }
}
