//! The Stribeck effect in a stage's friction bounds (T 7.5.4).
//!
//! A bound that falls with the slip it bounds makes a stage non-convex, and its solution not unique once the falling
//! slope exceeds m / c. So the bounds of a stage follow from slips that are known before it, and the stage stays
//! convex. Implicit Euler takes the slip u_A at the start of the step, to first order. The two-stage scheme takes u_A
//! in its first stage and, in its second, the slip extrapolated to `u_A + (u_1 - u_A) / (2 gamma^2)`: with weights (1 -
//! gamma, gamma) of the stages the bounds then are those of the middle of the step, and order two is kept where links
//! slide on (a semi-implicit Runge-Kutta scheme in the sense of Boscarino, Filbet and Russo, 2016).

use nalgebra::Vector3;

use crate::laws::remaining;
use crate::math::{Real, add_scaled};
use crate::planar::StageLink;

use crate::stepping::{Driven, Members};

use super::{Body, Planar};

/// What slip leaves of the friction of the links in the lanes of a register.
#[derive(Debug, Clone)]
pub struct StribeckBounds<T> {
    /// Whether any lane's ground has the effect.
    pub is_any: bool,
    drop: T,
    /// Square of the speed at which half of the drop is reached \[m^2/s^2\].
    squared_scale: T,
    /// Velocity of each link from which its bound follows.
    slip: Vec<Vector3<T>>,
}

impl<T: Real> StribeckBounds<T> {
    pub fn new(links: usize, speed: f64) -> Self {
        let zero = T::zero();
        let slip = vec![Vector3::new(zero, zero, zero); links];
        Self { is_any: false, drop: zero, squared_scale: T::splat(speed * speed), slip }
    }

    pub fn load<D: Driven<Model = Planar>>(&mut self, members: &Members<D>) {
        let drop = |body: &Body| members.system.stribeck().drop + body.parameters.stribeck;
        self.is_any = members.any(|body| drop(body) > 0.0);
        for lane in 0..T::LANES {
            self.drop.set_lane(lane, drop(members.body(lane)));
        }
    }

    /// Takes the slip of a stage that starts with the step.
    pub fn begin_step(&mut self, start: &[Vector3<T>]) {
        if self.is_any {
            self.slip.copy_from_slice(start);
        }
    }

    /// Takes the slip of the second stage, `weight` times as far from the start as the end of the first.
    #[inline(always)]
    pub fn extrapolate(&mut self, start: &[Vector3<T>], end: &[Vector3<T>], weight: T) {
        for ((slip, start), end) in self.slip.iter_mut().zip(start).zip(end) {
            let change = Vector3::new(end.x - start.x, end.y - start.y, end.z - start.z);
            *slip = add_scaled(start, &change, weight);
        }
    }

    /// Lowers the friction bounds of the links.
    #[inline(always)]
    pub fn lower(&self, links: &mut [StageLink<T>]) {
        for (link, u) in links.iter_mut().zip(&self.slip) {
            let share = remaining(self.drop, self.squared_scale, u.x * u.x + u.y * u.y);
            link.friction.x = link.friction.x * share;
            link.friction.y = link.friction.y * share;
        }
    }
}
