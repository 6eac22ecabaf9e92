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
    /// d / 2 \[rad\].
    half: T,
    /// e of each joint, axis by axis, at the start of the step, at the base of the stage and at its end \[rad\].
    start: Vec<T>,
    base: Vec<T>,
    end: Vec<T>,
}

/// The law of one axis of a joint in a stage, to which the play adds a dead zone.
pub struct PlayedAxis<'a, T> {
    pub drive: &'a mut T,
    pub stiffness: T,
    pub slack: &'a mut T,
}

/// The same law with the rate of the axis in the solution.
pub struct MovedAxis<T> {
    pub drive: T,
    pub stiffness: T,
    pub slack: T,
    pub rate: T,
}

impl<T: Real> Backlash<T> {
    pub fn new(axes: usize) -> Self {
        let tight = vec![T::zero(); axes];
        Self { is_any: false, half: T::zero(), start: tight.clone(), base: tight.clone(), end: tight }
    }

    /// Gathers the play of the lanes' robots \[rad\] and the positions of their joints in it.
    pub fn load<'a>(&mut self, robot: impl Fn(usize) -> (f64, &'a [f64])) {
        self.is_any = (0..T::LANES).any(|lane| robot(lane).0 > 0.0);
        if !self.is_any {
            return;
        }
        for lane in 0..T::LANES {
            let (play, positions) = robot(lane);
            self.half.set_lane(lane, 0.5 * play);
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

    /// Adds the dead zones to the actuator laws of a stage of coefficient `c`; k_D is `kd`.
    #[inline(always)]
    pub fn apply<'a>(&self, c: T, kd: T, axes: impl Iterator<Item = PlayedAxis<'a, T>>) {
        let rate = self.half / c;
        for (axis, e) in axes.zip(&self.base) {
            *axis.drive -= kd * *e;
            *axis.slack = axis.stiffness * rate;
        }
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
