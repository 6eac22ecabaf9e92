//! Motors of the joint axes in a stage: a torque-speed line, an inertia and a friction.
//!
//! A motor that turns with the joint gives up to `min(limit, stall - fall phi')` upwards and `min(limit, stall + fall
//! phi')` downwards, not below zero: less and less the faster it drives, up to its limit where it brakes. Within these
//! bounds it gives what its PD law asks for. All of that falls with the rate, so the torque is minus the gradient of a
//! convex function. The rotor's inertia J adds `J (phi'_A - phi')` over a stage, with the rate phi'_A that it would keep
//! without any torque, and the friction of the gear `-phi' in N_[-b, b](P)`: both are convex too. A stage keeps its one
//! solution.

use serde::{Deserialize, Serialize};

use crate::math::{Real, laned};
use crate::robot::{Axes, Motor, Robot};
use crate::rows::Saved;

use super::sdirk::EXTRAPOLATION;

/// The motor of one axis in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct StageMotor<T = f64> {
    /// c times the stall torque \[N m s\].
    #[serde(with = "crate::rows::limit")]
    pub stall: T,
    /// Decrease of the largest impulse per rate, [`Self::stall`] over the no-load speed \[N m s^2\].
    pub fall: T,
    /// Largest impulse of the gear's friction \[N m s\].
    pub friction: T,
    /// J \[kg m^2\].
    pub inertia: T,
    /// phi'_A \[rad/s\].
    pub reference: T,
}

laned! {
    StageMotor { stall, fall, friction, inertia, reference };
}

impl<T: Real> StageMotor<T> {
    /// Of an axis without motor, or whose joint is broken.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        Self { stall: T::splat(f64::INFINITY), fall: zero, friction: zero, inertia: zero, reference: zero }
    }

    /// Heat of an ideal DC motor that gives an impulse, `c torque^2 omega_0 / stall torque`, over the stage \[J\].
    #[inline(always)]
    pub fn heat(&self, impulse: T) -> T {
        let zero = T::zero();
        T::select(zero.lt(self.fall), impulse * impulse / self.fall, zero)
    }

    /// Impulse of the inertia at a rate.
    #[inline(always)]
    pub fn rotor_impulse(&self, rate: T) -> T {
        self.inertia * (self.reference - rate)
    }
}

/// The motors of a register's robots: the same in all lanes but for the share of their torque.
#[derive(Debug, Clone)]
pub struct Motors<T> {
    motor: Option<Motor>,
    /// Which axes have one; empty where none has.
    driven: Vec<bool>,
    share: T,
    /// Rate of each axis at the start of the step, and that without any torque at the end of the stage \[rad/s\].
    start: Vec<T>,
    reference: Vec<T>,
    /// Torque of the gears' friction in the last stage \[N m\].
    friction: Vec<T>,
}

impl<T: Real> Motors<T> {
    /// Of joints with `axes` axes each.
    pub fn new(robot: &Robot, axes: usize) -> Self {
        let of_joint = |(joint, of_joint): (usize, &Axes)| {
            let has = |axis: usize| !robot.is_broken(joint) && (axes == 1 || of_joint.has(axis));
            (0..axes).map(has).collect::<Vec<_>>()
        };
        let driven: Vec<_> = match robot.motor {
            Some(_) => robot.axes.iter().enumerate().flat_map(of_joint).collect(),
            None => Vec::new(),
        };
        let none = vec![T::zero(); driven.len()];
        let (start, reference) = (none.clone(), none.clone());
        Self { motor: robot.motor, driven, share: T::splat(1.0), start, reference, friction: none }
    }

    /// Whether the robots have any.
    pub fn is_any(&self) -> bool {
        self.motor.is_some()
    }

    /// Gathers the shares of the lanes' robots and the friction of their gears in their last stages, empty where there was
    /// none.
    pub fn load<'a>(&mut self, robot: impl Fn(usize) -> (f64, &'a [f64])) {
        if !self.is_any() {
            return;
        }
        for lane in 0..T::LANES {
            let (share, friction) = robot(lane);
            self.share.set_lane(lane, share);
            for (axis, lanes) in self.friction.iter_mut().enumerate() {
                lanes.set_lane(lane, friction.get(axis).copied().unwrap_or(0.0));
            }
        }
    }

    /// Takes the rates of a stage that starts with the step.
    #[inline(always)]
    pub fn begin_step(&mut self, rates: impl Iterator<Item = T>) {
        for ((start, reference), rate) in self.start.iter_mut().zip(&mut self.reference).zip(rates) {
            (*start, *reference) = (rate, rate);
        }
    }

    /// Takes the rates at the end of the first stage, whose changes the second one extrapolates.
    #[inline(always)]
    pub fn extrapolate(&mut self, rates: impl Iterator<Item = T>) {
        for ((start, reference), rate) in self.start.iter().zip(&mut self.reference).zip(rates) {
            *reference = *start + T::splat(EXTRAPOLATION) * (rate - *start);
        }
    }

    /// Lists the motors of a stage of coefficient `c`, and what their gears' friction is expected to give.
    #[inline(always)]
    pub fn fill(&self, c: T, motors: &mut Vec<StageMotor<T>>, gear: &mut Vec<T>) {
        motors.clear();
        gear.clear();
        let Some(motor) = self.motor else { return };
        let stall = c * self.share * T::splat(motor.stall_torque);
        let fall = stall * T::splat(1.0 / motor.no_load_speed);
        let (friction, inertia) = (c * T::splat(motor.gear_friction), T::splat(motor.reflected_inertia()));
        for ((is_driven, reference), torque) in self.driven.iter().zip(&self.reference).zip(&self.friction) {
            let driven = StageMotor { stall, fall, friction, inertia, reference: *reference };
            motors.push(if *is_driven { driven } else { StageMotor::none() });
            gear.push(*torque * c);
        }
    }

    /// Keeps the friction of the gears in a solved stage in the given lanes.
    #[inline(always)]
    pub fn store(&mut self, c: T, gear: &[T], lanes: T::Mask) {
        let per_second = T::splat(1.0) / c;
        for (torque, impulse) in self.friction.iter_mut().zip(gear) {
            *torque = T::select(lanes, *impulse * per_second, *torque);
        }
    }

    /// Passes on the friction of the gears of a lane's robot.
    pub fn save(&self, lane: usize, friction: &mut Vec<f64>) {
        friction.clear();
        friction.extend(self.friction.iter().map(|torque| torque.lane(lane)));
    }
}
