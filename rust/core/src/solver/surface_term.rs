use nalgebra::Vector3;

use crate::laws::{LimitSurface, SurfaceEvaluation};
use crate::math::{Real, dot, select_into};

/// Friction of the ground on what can be pushed, in proximal form around a multiplier, in coordinates in which its limit
/// surface is the unit ball: what [`FrictionTerm`](super::FrictionTerm) is for links.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceTerm<T> {
    law: LimitSurface<T>,
    /// r \[1/(kg m^2/s^2)\]: the stiffness of sticking over the square of the largest force.
    penalty: T,
    centre: Vector3<T>,
    value: Vector3<T>,
}

impl<T: Real> SurfaceTerm<T> {
    /// Within the semi-axes \[N s\], \[N m s\] around the impulse of the last stage; `penalty` is the stiffness of sticking
    /// \[kg\].
    #[inline(always)]
    pub fn new(axes: Vector3<T>, impulse: &Vector3<T>, penalty: T) -> Self {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let has = zero.lt(axes.x) & zero.lt(axes.z);
        // Both inverses by one division, zero without friction.
        let [force, moment] = [T::select(has, axes.x, one), T::select(has, axes.z, one)];
        let inverse = T::select(has, one / (force * moment), zero);
        let [force, moment] = [moment * inverse, force * inverse];
        let centre = Vector3::new(impulse.x * force, impulse.y * force, impulse.z * moment);
        Self { law: LimitSurface { axes }, penalty: penalty * (force * force), centre, value: centre }
    }

    /// Force and moment, in the frame of the body \[N s\], \[N m s\].
    #[inline(always)]
    pub fn impulse(&self) -> Vector3<T> {
        self.law.scaled(&self.value)
    }

    /// Moves to a twist; returns impulse and stiffness there.
    #[inline(always)]
    pub fn evaluate(&mut self, twist: &Vector3<T>) -> SurfaceEvaluation<T> {
        let evaluation = self.law.evaluate(&self.centre, self.penalty, twist);
        self.value = evaluation.value;
        evaluation
    }

    /// First and second derivative of the law's function by alpha along the step of a body from a twist.
    #[inline(always)]
    pub fn along(&self, [start, step]: [&Vector3<T>; 2], alpha: T) -> (T, T) {
        self.law.along(&self.centre, self.penalty, start, step, alpha)
    }

    /// The alpha at which its slope nearly jumps; NaN where the step is zero.
    #[inline(always)]
    pub fn kink(&self, [start, step]: [&Vector3<T>; 2]) -> T {
        self.law.kink(&self.centre, self.penalty, start, step)
    }

    /// Square of how far the velocity is from obeying the law because the multiplier is not yet the impulse, as of
    /// [`FrictionTerm`](super::FrictionTerm), of a body of this mass; a rate counts at the lever of the ground's friction
    /// \[m^2/s^2\].
    #[inline(always)]
    pub fn squared_error(&self, twist: &Vector3<T>, mass: T) -> T {
        let (zero, force) = (T::zero(), self.law.axes.x);
        let change =
            Vector3::new(self.value.x - self.centre.x, self.value.y - self.centre.y, self.value.z - self.centre.z);
        let change = dot(&change, &change);
        let slip = self.law.scaled(twist);
        let squared_speed = dot(&slip, &slip) / (force * force);
        let slides = T::splat(SLIDING).lt(dot(&self.value, &self.value));
        let (sticking, sliding) = (self.penalty * force, self.penalty * mass);
        let (sticking, sliding) = (sticking * sticking, sliding * sliding * squared_speed);
        let stiffness = T::select(slides, sticking.min(sliding), sticking);
        let violation = (change / stiffness).min(T::select(slides, squared_speed, T::splat(f64::INFINITY)));
        T::select(zero.lt(change) & zero.lt(sticking), violation, zero)
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        select_into(&mut self.centre, lanes, &self.value);
    }
}

/// Squared impulse, over that of sliding, from which on a body counts as sliding.
const SLIDING: f64 = 1.0 - 1e-9;
