use crate::math::Real;

/// What turns the violations of a link into velocities.
#[derive(Debug, Clone, Copy)]
pub struct Mobility<T> {
    /// 1 / m, for a force \[1/kg\].
    pub force: T,
    /// 1 / Theta, for a moment \[1/(kg m^2)\].
    pub moment: T,
    /// L / (2 Theta), for a moment that moves the ends \[1/(kg m)\].
    pub end: T,
    /// 2 / (m L), for a torque that is held by a force at an end \[1/(kg m)\].
    pub torque: T,
}

impl<T: Real> Mobility<T> {
    /// Of a link of given mass, moment of inertia and half length, by one division.
    #[inline(always)]
    pub fn of(mass: T, inertia: T, half_length: T) -> Self {
        let inverse = T::splat(1.0) / (mass * inertia * half_length);
        let moment = mass * half_length * inverse;
        Self { force: inertia * half_length * inverse, moment, end: half_length * moment, torque: inertia * inverse }
    }
}
