//! The Stribeck effect in a stage's friction bounds, or in its coefficients of friction (T 7.5.4).
//!
//! A bound that falls with the slip it bounds makes a stage non-convex, and its solution not unique once the falling
//! slope exceeds m / c. So the bounds of a stage follow from slips that are known before it, and the stage stays
//! convex. Implicit Euler takes the slip u_A at the start of the step, to first order. The two-stage scheme takes u_A
//! in its first stage and, in its second, the slip extrapolated to `u_A + (u_1 - u_A) / (2 gamma^2)`: with weights (1 -
//! gamma, gamma) of the stages the bounds then are those of the middle of the step, and order two is kept where links
//! slide on (a semi-implicit Runge-Kutta scheme in the sense of Boscarino, Filbet and Russo, 2016).

use nalgebra::Vector2;

use crate::laws::remaining;
use crate::math::Real;

use super::sdirk::GAMMA;

/// What slip leaves of the friction at the contacts with the ground of robots in the lanes of a register.
#[derive(Debug, Clone)]
pub struct StribeckBounds<T> {
    /// Whether any lane's ground has the effect.
    pub is_any: bool,
    drop: T,
    /// Square of the speed at which half of the drop is reached \[m^2/s^2\].
    squared_scale: T,
    /// Slip of each contact from which its bound follows.
    slip: Vec<Vector2<T>>,
}

impl<T: Real> StribeckBounds<T> {
    pub fn new(contacts: usize, speed: f64) -> Self {
        let zero = T::zero();
        let slip = vec![Vector2::new(zero, zero); contacts];
        Self { is_any: false, drop: zero, squared_scale: T::splat(speed * speed), slip }
    }

    /// Takes the drop of friction of the lanes' robots.
    pub fn load(&mut self, drop: impl Fn(usize) -> f64) {
        self.is_any = (0..T::LANES).any(|lane| drop(lane) > 0.0);
        for lane in 0..T::LANES {
            self.drop.set_lane(lane, drop(lane));
        }
    }

    /// Takes the slip of a stage that starts with the step.
    #[inline(always)]
    pub fn begin_step(&mut self, start: impl Iterator<Item = Vector2<T>>) {
        if self.is_any {
            self.slip.iter_mut().zip(start).for_each(|(slip, start)| *slip = start);
        }
    }

    /// Takes the slip of the second stage, as far from the start of the step as the end of the first.
    #[inline(always)]
    pub fn extrapolate(&mut self, end: impl Iterator<Item = Vector2<T>>) {
        let weight = T::splat(0.5 / (GAMMA * GAMMA));
        for (slip, end) in self.slip.iter_mut().zip(end) {
            *slip = Vector2::new(slip.x + (end.x - slip.x) * weight, slip.y + (end.y - slip.y) * weight);
        }
    }

    /// What is left of the friction at each contact.
    #[inline(always)]
    pub fn shares(&self) -> impl Iterator<Item = T> + '_ {
        self.slip.iter().map(|u| remaining(self.drop, self.squared_scale, u.x * u.x + u.y * u.y))
    }
}
