//! Backlash between the motors and the joints of a stage's robots (T 7.5.4).
//!
//! A motor is at phi_m behind its gear, a joint at phi; e = phi - phi_m lies within half the play, `|e| <= d / 2`.
//! Inside the play no torque passes, at its ends a unilateral one: the torque D on the joint obeys `-D in N_C(e)`, C =
//! \[-d/2, d/2\]. The motor has no inertia, so D is also what its PD law (T 3.51), at phi_m and within its limit,
//! gives. Over a stage with e = e_B + c (omega_J - omega_m) both together are one monotone, single-valued law of the
//! joint's rate,
//!
//! `D = clamp(y - prox_S(y))`, `y = b - k_D e_B - k omega_J`, `S = [-s, s]`, `s = k d / (2 c)`,
//!
//! with b, k and the limit of the tight joint: the play takes up prox_S(y), and at the end `e = -(c / k) prox_S(y)`.
//! Where D = 0 the motor only follows its reference. e is the only state carried from step to step.

use crate::math::Real;

/// The play of the joints in the lanes of a register.
#[derive(Debug, Clone)]
pub struct Backlash<T> {
    /// Whether any lane's robot has play.
    pub is_any: bool,
    /// d / 2 of each axis without what robots have beyond it, and with it \[rad\].
    shared: Vec<f64>,
    half: Vec<T>,
    /// e of each joint, axis by axis, at the start of the step, at the base of the stage and at its end \[rad\].
    start: Vec<T>,
    base: Vec<T>,
    end: Vec<T>,
}

/// The law of one axis of a joint in a stage with its rate in the solution.
pub struct MovedAxis<T> {
    pub drive: T,
    pub stiffness: T,
    pub slack: T,
    pub rate: T,
}

impl<T: Real> Backlash<T> {
    /// Of the play of each axis \[rad\].
    pub fn new(plays: impl Iterator<Item = f64>) -> Self {
        let shared: Vec<_> = plays.map(|play| 0.5 * play).collect();
        let tight = vec![T::zero(); shared.len()];
        Self { is_any: false, shared, half: tight.clone(), start: tight.clone(), base: tight.clone(), end: tight }
    }

    /// Gathers the play that the lanes' robots have beyond the shared one \[rad\] and the positions of their joints in it.
    pub fn load<'a>(&mut self, robot: impl Fn(usize) -> (f64, &'a [f64])) {
        let is_shared = self.shared.iter().any(|half| *half > 0.0);
        self.is_any = is_shared || (0..T::LANES).any(|lane| robot(lane).0 > 0.0);
        if !self.is_any {
            return;
        }
        for lane in 0..T::LANES {
            let (more, positions) = robot(lane);
            for (lanes, shared) in self.half.iter_mut().zip(&self.shared) {
                lanes.set_lane(lane, shared + 0.5 * more);
            }
            for (lanes, &e) in self.start.iter_mut().zip(positions) {
                lanes.set_lane(lane, e);
            }
        }
    }

    /// Base of a stage that starts with the step.
    pub fn begin_step(&mut self) {
        if self.is_any {
            self.base.copy_from_slice(&self.start);
        }
    }

    /// Base of the second stage: e moves on as positions do, `weight` times as far as in the first stage.
    #[inline(always)]
    pub fn extrapolate(&mut self, weight: T) {
        for ((base, start), end) in self.base.iter_mut().zip(&self.start).zip(&self.end) {
            *base = *start + weight * (*end - *start);
        }
    }

    /// What a drive of this k_D and stiffness loses in a stage of coefficient `c`, and its dead zone.
    #[inline(always)]
    pub fn dead_zone(&self, axis: usize, c: T, kd: T, stiffness: T) -> (T, T) {
        (kd * self.base[axis], stiffness * (self.half[axis] / c))
    }

    /// Positions of the joints in their play at the end of the solved stage.
    #[inline(always)]
    pub fn end_stage(&mut self, c: T, axes: impl Iterator<Item = MovedAxis<T>>) {
        for (end, MovedAxis { drive, stiffness, slack, rate }) in self.end.iter_mut().zip(axes) {
            let tight = drive - stiffness * rate;
            let absorbed = tight.min(slack).max(-slack);
            // A motor without gains gives no torque at any angle.
            let compliance = T::select(T::zero().lt(stiffness), c / stiffness, T::zero());
            *end = -(compliance * absorbed);
        }
    }

    /// Writes the end of a lane's step.
    pub fn save(&self, lane: usize, play: &mut [f64]) {
        if self.is_any {
            play.iter_mut().zip(&self.end).for_each(|(play, end)| *play = end.lane(lane));
        }
    }
}
