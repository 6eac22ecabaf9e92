//! Free play between the motors and the joints of a stage's robots (T 7.5.4).
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

use nalgebra::Vector3;

use crate::math::Real;
use crate::planar::StageJoint;

use crate::stepping::{Driven, Members};

use super::Planar;

/// The play of the joints in the lanes of a register.
#[derive(Debug, Clone)]
pub struct Backlash<T> {
    /// Whether any lane's robot has play.
    pub is_any: bool,
    /// d / 2 \[rad\].
    half: T,
    /// e of each joint at the start of the step, at the base of the stage and at its end \[rad\].
    start: Vec<T>,
    base: Vec<T>,
    end: Vec<T>,
}

impl<T: Real> Backlash<T> {
    pub fn new(joints: usize) -> Self {
        let tight = vec![T::zero(); joints];
        Self { is_any: false, half: T::zero(), start: tight.clone(), base: tight.clone(), end: tight }
    }

    /// Gathers the robots' backlash and the positions of their joints in it.
    pub fn load<D: Driven<Model = Planar>>(&mut self, members: &Members<D>) {
        let system = members.system;
        self.is_any = members.any(|body| system.backlash(&body.parameters) > 0.0);
        if !self.is_any {
            return;
        }
        for lane in 0..T::LANES {
            let body = members.body(lane);
            self.half.set_lane(lane, 0.5 * system.backlash(&body.parameters));
            for (lanes, &e) in self.start.iter_mut().zip(&body.warm_start.backlash) {
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
    pub fn apply(&self, c: T, kd: T, joints: &mut [StageJoint<T>]) {
        let rate = self.half / c;
        for (joint, e) in joints.iter_mut().zip(&self.base) {
            joint.drive -= kd * *e;
            joint.slack = joint.stiffness * rate;
        }
    }

    /// Positions of the joints in their play at the end of the solved stage.
    #[inline(always)]
    pub fn end_stage(&mut self, c: T, joints: &[StageJoint<T>], twist: &[Vector3<T>]) {
        for (j, (end, joint)) in self.end.iter_mut().zip(joints).enumerate() {
            let tight = joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z);
            let absorbed = tight.min(joint.slack).max(-joint.slack);
            // A motor without gains gives no torque at any angle.
            let compliance = T::select(T::zero().lt(joint.stiffness), c / joint.stiffness, T::zero());
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
