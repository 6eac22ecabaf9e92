//! The laws of [`Newton`] from a stage and a warm start, and its velocities and impulses as a solution.

use nalgebra::Vector2;

use crate::math::Real;
use crate::solver::{ActuatorTerm, MotorTerm, SurfaceTerm};
use crate::spatial::spatial_vector::{difference, inner, sum};
use crate::spatial::{Stage, StageSolution, hinge_directions};

use super::link_term::{GroundLaws, LinkTerm};
use super::newton::Newton;
use super::sweep::Affine;
use super::terms::{ObstacleTerm, StopTerm};

impl<T: Real> Newton<T> {
    /// Laws with the friction radii of the warm start, and twists that satisfy the joints.
    #[inline(always)]
    pub(super) fn warm_up(&mut self, stage: &Stage<T>, solution: &StageSolution<T>) {
        self.lightest = stage.links[0].mass;
        self.is_holding = true;
        let (mut total, chain) = (T::zero(), stage.chain());
        for (i, link) in stage.links.iter().enumerate() {
            self.lightest = self.lightest.min(link.mass);
            // Lanes may have neighbours among more obstacles that can be pushed.
            if i < chain {
                total += link.mass;
            }
        }
        let penalty = T::splat(PENALTY / chain as f64) * total;
        self.laws = GroundLaws::new(&stage.friction, penalty);
        self.links.resize_with(stage.links.len(), LinkTerm::vacant);
        for i in 0..chain {
            self.begin_link(stage, solution, i);
        }
        self.surfaces.clear();
        self.movables.resize(stage.surfaces.len(), Affine::zero());
        for (k, (axes, impulse)) in stage.surfaces.iter().zip(&solution.surface).enumerate() {
            self.surfaces.push(SurfaceTerm::new(*axes, impulse, penalty));
            let motion = (solution.twist[chain + k], [T::zero(); 2], [ActuatorTerm::none(); 2]);
            self.links[chain + k].begin(stage, solution, chain + k, &self.laws, motion);
        }
        if let Some(skin) = self.laws.skin {
            for (link, impulses) in self.links.iter_mut().zip(&solution.friction) {
                for (end, impulse) in link.ends.iter_mut().zip(impulses) {
                    end.friction.hold(skin, &self.laws.sliding, impulse);
                }
            }
        }
        self.stops.clear();
        for (axis, (stop, impulse)) in stage.stops.iter().zip(&solution.stop).enumerate() {
            let actuator = &self.links[axis / 2 + 1].actuators[axis % 2];
            self.stops.push(StopTerm::new(stop, penalty, impulse, actuator));
        }
        self.motors.clear();
        for (axis, (motor, impulse)) in stage.motors.iter().zip(&solution.gear).enumerate() {
            self.motors.push(MotorTerm::new(motor, *impulse, stage.links[axis / 2].half_length, penalty).held());
        }
        self.contacts.clear();
        for (contact, impulse) in stage.contacts.iter().zip(&solution.contact) {
            self.contacts.push(ObstacleTerm::new(contact, penalty, *impulse));
        }
        self.obstacle_friction.warm_up(stage, solution, penalty);
        self.self_contacts.warm_up(stage, &solution.pair, penalty);
    }

    #[inline(always)]
    fn begin_link(&mut self, stage: &Stage<T>, solution: &StageSolution<T>, i: usize) {
        let Self { links, laws, .. } = self;
        let (placed, rest) = links.split_at_mut(i);
        let own = &mut rest[0];
        let (zero, link) = (T::zero(), &stage.links[i]);
        let before = if i > 0 { &stage.links[i - 1] } else { link };
        let axes = stage.axes_of(i.saturating_sub(1));
        let directions = hinge_directions(axes, &before.axes, &link.axes);
        let hinge = [link.hinge(&directions[0]), link.hinge(&directions[1])];
        own.segment.place(axes, sum(&before.joint_arms()[1], &link.joint_arms()[0]), hinge);
        let motion = match placed.last() {
            Some(previous) => {
                let relative = difference(&solution.twist[i].angular, &solution.twist[i - 1].angular);
                let mut rates = [zero; 2];
                for axis in 0..2 {
                    if axes.has(axis) {
                        rates[axis] = inner(&directions[axis], &relative);
                    }
                }
                (
                    own.segment.follow(&previous.twist, &rates),
                    rates,
                    [
                        ActuatorTerm::new(&stage.joints[i - 1][0], zero),
                        ActuatorTerm::new(&stage.joints[i - 1][1], zero),
                    ],
                )
            }
            None => (solution.twist[0], [zero; 2], [ActuatorTerm::none(); 2]),
        };
        own.begin(stage, solution, i, laws, motion);
    }

    /// Velocities and impulses of all lanes.
    #[inline(always)]
    pub(super) fn write(&self, solution: &mut StageSolution<T>) {
        for (twist, link) in solution.twist.iter_mut().zip(&self.links) {
            *twist = link.twist;
        }
        for (impulse, surface) in solution.surface.iter_mut().zip(&self.surfaces) {
            *impulse = surface.impulse();
        }
        for (i, link) in self.chain().iter().enumerate() {
            solution.normal[i] = [link.ends[0].normal.value, link.ends[1].normal.value];
            let [front, rear] = &link.ends;
            let law = &self.laws.sliding;
            solution.friction[i] = [law.scaled(&front.friction.value), law.scaled(&rear.friction.value)];
            // The law was evaluated at (omega_x, omega_y), the rolling velocity is (-omega_y, omega_x).
            let rolling = link.rolling.value;
            solution.rolling[i] = Vector2::new(-rolling.y, rolling.x);
            if i > 0 {
                solution.rate[i - 1] = link.rates;
                solution.actuator[i - 1] = [link.actuators[0].impulse, link.actuators[1].impulse];
            }
        }
        for (impulse, stop) in solution.stop.iter_mut().zip(&self.stops) {
            *impulse = stop.impulse();
        }
        for (impulse, motor) in solution.gear.iter_mut().zip(&self.motors) {
            *impulse = motor.friction;
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contacts) {
            *impulse = contact.normal.value;
        }
        self.obstacle_friction.write(&mut solution.obstacle_friction);
        self.self_contacts.write(&mut solution.pair);
    }
}

/// Stiffness r of a contact over the mean mass of a link. The compliance lets a contact that bears a link's weight
/// yield by g c / r, less than 1e-6 m/s, which moving the multipliers removes. A stiffer one takes more steps: where it
/// sticks or slips is decided within a narrower range of velocities.
const PENALTY: f64 = 3e5;
