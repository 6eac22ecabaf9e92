//! The actuators of a stage's robots: their PD laws, strength and play, and the torques that they add to these.

use crate::control::{AxisGains, ControllerConfig};
use crate::math::Real;
use crate::robot::{Breakage, LOCK_STIFFNESS, Robot};
use crate::rows::DriveRow;

use super::{Backlash, Driven, Members, Model};

/// The actuators of all axes: of each joint, and in 3D yaw before pitch.
pub struct Drives<T: Real> {
    pub gains: Vec<AxisGains<T>>,
    /// Of the largest torques, 0 where actuators are off.
    pub strength: T,
    /// Axes that joints do not have.
    absent: Vec<usize>,
    /// Axes of joints that are locked or limp.
    broken: Vec<(usize, Breakage)>,
    pub backlash: Backlash<T>,
    /// Torques beside the controller's, and those of one robot.
    has_own_torques: bool,
    own_torque: Vec<T>,
    torques: Vec<f64>,
}

impl<T: Real> Drives<T> {
    /// Of joints with `axes` axes each, and these gains of yaw and pitch.
    pub fn new(robot: &Robot, gains: &[[AxisGains; 2]], axes: usize) -> Self {
        let all = axes * gains.len();
        let is_absent = |axis: &usize| axes > 1 && !robot.axes[axis / axes].has(axis % axes);
        let broken = robot.broken.iter().flat_map(|(joint, breakage)| {
            let first = joint * axes;
            (first..first + axes).map(|axis| (axis, *breakage))
        });
        Self {
            gains: gains.iter().flat_map(|joint| &joint[..axes]).map(|gains| gains.splat()).collect(),
            strength: T::splat(1.0),
            absent: (0..all).filter(is_absent).collect(),
            broken: broken.collect(),
            backlash: Backlash::new(robot.backlash.iter().flat_map(|joint| &joint[..axes]).copied()),
            has_own_torques: false,
            own_torque: vec![T::zero(); all],
            torques: vec![0.0; all],
        }
    }

    /// Takes what the actuators of the members do at `end` after the start of the step: within which share of their torque
    /// limits they follow their references, zero where they are off, and their torques beside.
    pub fn read<M: Model>(&mut self, members: &Members<M>, controller: &ControllerConfig, end: T) {
        self.has_own_torques = false;
        for lane in 0..T::LANES {
            let Driven { body, reference } = members.robot(lane);
            let time = body.state.time + end.lane(lane);
            let share = body.parameters.torque_limit;
            self.strength.set_lane(lane, if controller.acts_until(time) { share } else { 0.0 });
            if !reference.torques(time, &mut self.torques) {
                continue;
            }
            // Zero for the robots of the register that have none.
            if !std::mem::replace(&mut self.has_own_torques, true) {
                self.own_torque.fill(T::zero());
            }
            for (lanes, torque) in self.own_torque.iter_mut().zip(&self.torques) {
                lanes.set_lane(lane, *torque);
            }
        }
    }

    /// The PD torque (T 3.51 != D3), (T 4.101)-(T 4.102) of each axis at the end of a stage of coefficient `c`, where phi =
    /// phi_base + c phi', is linear in phi'. `deviation` is by how much the reference of an axis exceeds phi_base, and the
    /// rate of the reference.
    #[inline(always)]
    pub fn fill(&self, c: T, deviation: impl Fn(usize) -> [T; 2], rows: &mut [DriveRow<T>]) {
        let (zero, unlimited) = (T::zero(), T::splat(f64::INFINITY));
        for (axis, (row, gains)) in rows.iter_mut().zip(&self.gains).enumerate() {
            let [error, rate] = deviation(axis);
            let [drive, stiffness, limit] = gains.stage(c, self.strength, error, rate);
            *row = DriveRow { drive, stiffness, limit, slack: zero };
        }
        if self.has_own_torques {
            for (row, torque) in rows.iter_mut().zip(&self.own_torque) {
                row.drive += c * *torque;
            }
        }
        if self.backlash.is_any {
            for (axis, (row, gains)) in rows.iter_mut().zip(&self.gains).enumerate() {
                let (loss, slack) = self.backlash.dead_zone(axis, c, gains.kd, row.stiffness);
                row.drive -= loss;
                row.slack = slack;
            }
        }
        // A locked joint is held at its reference, the angle at which it broke, by a stiff spring without play or limit; a
        // limp one has no torque.
        for (axis, breakage) in &self.broken {
            let stiffness = match breakage {
                Breakage::Locked => T::splat(LOCK_STIFFNESS) * c,
                Breakage::Limp => zero,
            };
            let drive = stiffness * deviation(*axis)[0];
            rows[*axis] = DriveRow { drive, stiffness: stiffness * c, limit: unlimited, slack: zero };
        }
        for axis in &self.absent {
            rows[*axis] = DriveRow::none();
        }
    }
}
