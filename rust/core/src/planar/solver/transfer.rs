//! The laws of [`Newton`] from a stage and a warm start, and its velocities and impulses as a solution.

use nalgebra::{Vector2, Vector3};

use crate::math::{Mask, Real, keep, select_into};
use crate::planar::{Stage, StageLink, StageSolution};
use crate::solver::{ActuatorTerm, FrictionTerm, MotorTerm, SurfaceTerm};

use super::link_term::{LinkTerm, in_frame};
use super::newton::{Newton, TUNING};
use super::sweep::Quadratic;
use super::terms::{ContactTerm, OnLink, StopTerm};
use super::unilateral::{RowLaw, UnilateralTerm};

impl<T: Real> Newton<T> {
    /// Laws around the warm start, and twists that satisfy the joints.
    #[inline(always)]
    pub(super) fn warm_up(&mut self, stage: &Stage<T>, solution: &StageSolution<T>) {
        let chain = stage.chain();
        self.links.resize_with(stage.links.len(), LinkTerm::vacant);
        self.movables.resize(stage.links.len() - chain, Quadratic::zero());
        self.surfaces.clear();
        let (mut mass, mut inertia) = (stage.links[0].mass, stage.links[0].inertia);
        let mut before = stage.links[0].heading;
        let mut end = free_end(&stage.links[0], &solution.twist[0]);
        for (i, (term, link)) in self.links.iter_mut().zip(&stage.links).enumerate() {
            (mass, inertia) = (mass.min(link.mass), inertia.min(link.inertia));
            let penalty = T::splat(TUNING.penalty) * link.mass;
            if i >= chain {
                term.begin_free(link);
                self.surfaces.push(SurfaceTerm::new(stage.limit_surface(i), &solution.surface_impulse(i), penalty));
                term.twist = in_frame(&link.heading, &solution.twist[i]);
                continue;
            }
            let friction = FrictionTerm::new(link.friction, &solution.friction[i], penalty);
            let actuator = if i > 0 {
                ActuatorTerm::new(&stage.joints[i - 1], solution.actuator[i - 1])
            } else {
                ActuatorTerm::none()
            };
            term.begin(link, &before, friction, actuator);
            term.twist = term.segment.follow(solution.twist[i].z, &mut end);
            before = link.heading;
        }
        self.skin = stage.skin;
        self.raise(T::Mask::of(|_| true));
        self.mobility = [mass, inertia].map(|least| T::splat(1.0) / least);
        self.stops.clear();
        for ((stop, link), impulse) in stage.stops.iter().zip(&stage.links).zip(&solution.stop) {
            self.stops.push(StopTerm::new(stop, *impulse, T::splat(TUNING.penalty) * link.mass));
        }
        self.motors.clear();
        for ((motor, link), impulse) in stage.motors.iter().zip(&stage.links).zip(&solution.gear) {
            let penalty = T::splat(TUNING.penalty) * link.mass;
            self.motors.push(MotorTerm::new(motor, *impulse, link.half_length, penalty));
        }
        self.spins.clear();
        for ((&bound, link), &impulse) in stage.link_spins().iter().zip(&stage.links).zip(&solution.spin) {
            let penalty = T::splat(TUNING.penalty) * link.mass;
            self.spins.push(MotorTerm::friction(bound, impulse, link.half_length, penalty));
        }
        self.contacts.clear();
        for (contact, &impulse) in stage.contacts.iter().zip(&solution.contact) {
            let penalty = T::splat(TUNING.penalty) * stage.links[contact.link].mass;
            let law = UnilateralTerm::new(contact.offset, impulse, penalty);
            self.contacts.push(ContactTerm { row: OnLink::new(contact, stage), law });
        }
        self.obstacle_friction.clear();
        for (friction, &impulse) in stage.obstacle_friction.iter().zip(&solution.obstacle_friction) {
            let (row, mass) = (OnLink::new(&friction.along, stage), stage.links[friction.along.link].mass);
            self.obstacle_friction.add(friction, row, mass, impulse, TUNING.penalty);
        }
        self.self_contacts.warm_up(stage, solution, TUNING.penalty);
    }

    /// Velocities in the world frame, and impulses, in the given lanes.
    #[inline(always)]
    pub(super) fn write(&self, stage: &Stage<T>, solution: &mut StageSolution<T>, lanes: T::Mask) {
        for (i, link) in self.links.iter().enumerate() {
            let velocity = stage.links[i].heading.to_world(link.twist.xy());
            select_into(&mut solution.twist[i], lanes, &Vector3::new(velocity.x, velocity.y, link.twist.z));
            select_into(&mut solution.friction[i], lanes, &link.friction.impulse());
            if (1..stage.chain()).contains(&i) {
                keep(&mut solution.actuator[i - 1], lanes, link.actuator.impulse);
            }
        }
        for (impulse, stop) in solution.stop.iter_mut().zip(&self.stops) {
            let [upper, lower] = stop.impulse();
            keep(&mut impulse[0], lanes, upper);
            keep(&mut impulse[1], lanes, lower);
        }
        for (impulse, motor) in solution.gear.iter_mut().zip(&self.motors) {
            keep(impulse, lanes, motor.friction);
        }
        for (impulse, spin) in solution.spin.iter_mut().zip(&self.spins) {
            keep(impulse, lanes, spin.friction);
        }
        for (node, surface) in (stage.chain()..).zip(&self.surfaces) {
            let impulse = surface.impulse();
            select_into(&mut solution.friction[node], lanes, &impulse.xy());
            keep(&mut solution.spin[node], lanes, impulse.z);
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contacts) {
            keep(impulse, lanes, contact.law.impulse);
        }
        for (impulse, term) in solution.obstacle_friction.iter_mut().zip(&self.obstacle_friction.terms) {
            keep(impulse, lanes, term.law.impulse());
        }
        self.self_contacts.write(solution, lanes);
    }
}

/// Velocity of the end without a joint of the first link, in its frame.
#[inline(always)]
fn free_end<T: Real>(link: &StageLink<T>, twist: &Vector3<T>) -> Vector2<T> {
    let u = in_frame(&link.heading, twist);
    Vector2::new(u.x, u.y - link.arms()[0] * u.z)
}
