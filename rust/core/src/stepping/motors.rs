//! The motors of a stage's robots: rows of the axes, see [`MotorRow`], and what they carry from step to step.

use crate::math::Real;
use crate::robot::{Motor, Robot};
use crate::rows::MotorRow;

use super::sdirk::EXTRAPOLATION;

/// The motors of a register's robots: the same in all lanes but for the share of their torque.
pub struct Motors<T> {
    /// Of the axes, `None` where a joint is broken or has no such axis; empty where robots have none.
    of_axes: Vec<Option<Motor>>,
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
        let motors = robot.motors.iter().flatten().zip(&robot.axes).enumerate();
        let of_axes: Vec<_> = motors
            .flat_map(|(joint, (motors, of_joint))| {
                let has = |axis: usize| !robot.is_broken(joint) && (axes == 1 || of_joint.has(axis));
                (0..axes).map(|axis| has(axis).then_some(motors[axis])).collect::<Vec<_>>()
            })
            .collect();
        let none = vec![T::zero(); of_axes.len()];
        Self { of_axes, share: T::splat(1.0), start: none.clone(), reference: none.clone(), friction: none }
    }

    /// Whether the robots have any.
    pub fn is_any(&self) -> bool {
        !self.of_axes.is_empty()
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
    pub fn fill(&self, c: T, motors: &mut Vec<MotorRow<T>>, gear: &mut Vec<T>) {
        motors.clear();
        gear.clear();
        for ((motor, reference), torque) in self.of_axes.iter().zip(&self.reference).zip(&self.friction) {
            motors.push(motor.as_ref().map_or_else(MotorRow::none, |motor| row(motor, c, self.share, *reference)));
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

/// A motor in a stage of coefficient `c`, with a share of its torque and the rate of its axis without any torque.
#[inline(always)]
fn row<T: Real>(motor: &Motor, c: T, share: T, reference: T) -> MotorRow<T> {
    let stall = c * share * T::splat(motor.stall_torque);
    let has_line = motor.no_load_speed.is_finite();
    MotorRow {
        stall,
        fall: if has_line { stall * T::splat(1.0 / motor.no_load_speed) } else { T::zero() },
        friction: c * T::splat(motor.gear_friction),
        inertia: T::splat(motor.reflected_inertia()),
        reference,
        damping: c * T::splat(motor.gear_damping),
    }
}
