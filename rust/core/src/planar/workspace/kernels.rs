//! The arithmetic of a stage over lanes: all but the solver.

use nalgebra::{Vector2, Vector3};

use crate::contact::Folding;
use crate::gait::turned;
use crate::math::{Mask, Real, add_scaled, select_into};
use crate::planar::energy::work_of;
use crate::planar::io_drive::IoInput;
use crate::planar::{StageJoint, StageLink, certify, is_plausible, mean_twist, travel};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};
use crate::stepping::{MovedAxis, SolvedMotion, SolvedStage, StageKernels};

use super::motion_bound::MotionBound;
use super::references::References;
use super::{Motion, StageResult, Workspace};
use crate::planar::contact_friction::solve_with_contact_friction;

impl<T: Real> StageKernels<T> for Workspace<T> {
    #[inline(always)]
    fn begin(&mut self) {
        self.motion.base.copy_from_slice(&self.motion.start_pose);
        self.motion.reference.copy_from_slice(&self.motion.start_twist);
        self.motion.guess.copy_from_slice(&self.motion.start_twist);
        self.drives.backlash.begin_step();
        self.shares.begin_step(
            #[inline(always)]
            |link| in_plane(&self.motion.start_twist[link]),
        );
        self.motors.begin_step(joint_rates(&self.motion.start_twist));
        self.closings.begin_part();
        self.self_contacts.begin_step();
    }

    /// Joint references along the wave, whose phase is turned from joint to joint.
    #[inline(always)]
    fn follow_waves(&mut self) {
        let References { wave, target, .. } = &mut self.references;
        let (mut phase, phase_shift) = (wave.phase.sin_cos(), wave.phase_shift.value.sin_cos());
        for (joint, target) in target.iter_mut().enumerate() {
            *target = wave.joint(joint, phase);
            phase = turned(phase, phase_shift);
        }
    }

    #[inline(always)]
    fn extrapolate(&mut self, h: T) {
        let (to_reference, to_guess) = (T::splat(EXTRAPOLATION), T::splat(1.0 / GAMMA));
        for (i, u) in self.motion.start_twist.iter().enumerate() {
            let end = &self.result.twist[i];
            let change = Vector3::new(end.x - u.x, end.y - u.y, end.z - u.z);
            self.motion.reference[i] = add_scaled(u, &change, to_reference);
            self.motion.guess[i] = add_scaled(u, &change, to_guess);
        }
        if self.drives.backlash.is_any {
            self.drives.backlash.extrapolate(to_reference);
        }
        self.motors.extrapolate(joint_rates(&self.result.twist));
        if self.shares.is_any {
            self.shares.extrapolate(
                #[inline(always)]
                |link| in_plane(&self.result.twist[link]),
            );
        }
        let per_second = T::splat(1.0) / self.stage.coefficient;
        for (torque, impulse) in self.actuator_torque.iter_mut().zip(&self.result.actuator) {
            *torque = *impulse * per_second;
        }
        let elapsed = h - T::splat(GAMMA) * h;
        let Motion { arms, base, heading, start_pose, .. } = &mut self.motion;
        travel(arms, start_pose, &self.result.twist, elapsed, base, heading);
    }

    #[inline(always)]
    fn predict(&mut self, c: T, elapsed: T, pending: T::Mask) {
        self.stage.coefficient = c;
        self.motion.elapsed = elapsed;
        let Motion { arms, base, guess, predicted, heading, .. } = &mut self.motion;
        travel(arms, base, guess, c, predicted, heading);
        let folding = Folding::of(self.motion.predicted[..self.motion.arms.len()].iter().map(|pose| pose.z));
        self.self_contacts.predict(&folding);
        let bend = if self.joint_stops.has_own_bounds() {
            self.joint_stops.excess(self.motion.predicted.windows(2).map(|pose| pose[1].z - pose[0].z))
        } else {
            folding.bend
        };
        self.joint_stops.predict(bend);
        if self.has_obstacles || self.room > 0 || self.self_contacts.is_any_possible() {
            let gain = (self.pull.x * self.pull.x + self.pull.y * self.pull.y).sqrt() * c;
            let fastest = self.fastest(&self.motion.guess).max(self.fastest(&self.motion.reference) + gain);
            let displacement = self.bound(&self.motion.predicted, &self.motion.start_pose);
            let MotionBound { fastest: last_fastest, displacement: last_displacement } = self.motion.bound;
            self.motion.bound = MotionBound {
                fastest: T::select(pending, fastest, last_fastest),
                displacement: T::select(pending, displacement, last_displacement),
            };
            let (bound, radius) = (self.motion.bound, self.motion.smallest_radius);
            self.is_clear = (bound.displacement + bound.contact_margin(c, 1.0, radius)).le(self.clear_way);
            let Motion { arms, heading, guess, travel, predicted, .. } = &mut self.motion;
            if self.room > 0 || self.self_contacts.is_any_possible() || (pending & !self.is_clear).any() {
                mean_twist(arms, heading, guess, travel);
            }
            let chain = &predicted[..arms.len()];
            self.self_contacts.list_close_pairs(chain, bound.contact_margin(c, 2.0, radius), pending);
        }
    }

    #[inline(always)]
    fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> SolvedStage<T> {
        self.fill_links();
        self.fill_joints();
        self.load_forces();
        let Self { stage, solution, newton, .. } = self;
        let outcome = if stage.is_convex() {
            newton.solve(stage, solution, tolerance, max_iterations, lanes)
        } else {
            solve_with_contact_friction(newton, stage, solution, tolerance, max_iterations, lanes)
        };
        let certificate = certify(stage, solution);
        SolvedStage { outcome, residual: certificate.residual(), gap: certificate.gap }
    }

    #[inline(always)]
    fn evaluate(&mut self, lanes: T::Mask) {
        self.result.stage_energy = work_of(&self.stage, &self.solution);
        if self.has_springs {
            let first = self.stage.links.len() - self.springs.len();
            for (spring, u) in self.springs.iter().zip(&self.solution.twist[first..]) {
                self.result.stage_energy.friction += spring.work_of_damper(self.stage.coefficient, u);
            }
        }
        self.closings.begin_stage();
        self.find_closings();
        self.store_forces(lanes);
        self.measure_deviation();
    }

    #[inline(always)]
    fn keep(&mut self, solved: T::Mask, again: T::Mask) {
        for (i, u) in self.solution.twist.iter().enumerate() {
            select_into(&mut self.result.twist[i], solved, u);
            select_into(&mut self.motion.guess[i], again, u);
        }
        for (kept, drive) in self.result.actuator.iter_mut().zip(&self.solution.actuator) {
            *kept = T::select(solved, *drive, *kept);
        }
        let StageResult { energy, stage_energy, .. } = &mut self.result;
        energy.select_into(solved, stage_energy);
        self.closings.keep_stage(solved);
        if self.drives.backlash.is_any {
            let axes = self.stage.joints.iter().zip(joint_rates(&self.result.twist)).map(|(joint, rate)| {
                let StageJoint { drive, stiffness, slack, .. } = *joint;
                MovedAxis { drive, stiffness, slack, rate }
            });
            self.drives.backlash.end_stage(self.stage.coefficient, axes);
        }
    }

    /// End configuration q_B + c u of the solved stage.
    #[inline(always)]
    fn arrive(&mut self) {
        let c = self.stage.coefficient;
        travel(
            &self.motion.arms,
            &self.motion.base,
            &self.result.twist,
            c,
            &mut self.result.end,
            &mut self.motion.heading,
        );
        self.result.misprediction =
            if self.has_obstacles { self.bound(&self.result.end, &self.motion.predicted) } else { T::zero() };
        self.result.plausible = is_plausible(&self.result.end, &self.result.twist);
    }
}

/// Rates of all joints of links with these twists.
#[inline(always)]
fn joint_rates<T: Real>(twist: &[Vector3<T>]) -> impl Iterator<Item = T> + '_ {
    twist.windows(2).map(|u| u[1].z - u[0].z)
}

/// Velocity of a link's CG.
#[inline(always)]
fn in_plane<T: Real>(u: &Vector3<T>) -> Vector2<T> {
    Vector2::new(u.x, u.y)
}

impl<T: Real> Workspace<T> {
    /// How far joints are bent at the end of the solved stage, as [`crate::stepping::JointStops`] counts it.
    #[inline(always)]
    fn bend(&self) -> T {
        let c = self.stage.coefficient;
        if self.joint_stops.has_own_bounds() {
            let joints = self.motion.base.windows(2).zip(self.solution.twist.windows(2));
            let angles = joints.map(|(q, u)| c.mul_add(u[1].z - u[0].z, q[1].z - q[0].z));
            return self.joint_stops.excess(angles);
        }
        let chain = &self.motion.base[..self.motion.arms.len()];
        let ends = chain.iter().zip(&self.solution.twist).map(|(q, u)| c.mul_add(u.z, q.z));
        Folding::of(ends).bend
    }

    #[inline(always)]
    fn fill_links(&mut self) {
        let c = self.stage.coefficient;
        self.stage.links.clear();
        for (i, link) in self.constants.iter().enumerate() {
            let u = &self.motion.reference[i];
            self.stage.links.push(StageLink {
                heading: self.motion.heading[i],
                reference: Vector3::new(u.x + link.pull.x * c, u.y + link.pull.y * c, u.z),
                mass: link.mass,
                inertia: link.inertia,
                half_length: link.half_length,
                cg_offset: link.cg_offset,
                friction: Vector2::new(link.friction.x * c, link.friction.y * c),
            });
        }
        if self.shares.is_any {
            for (i, link) in self.stage.links.iter_mut().enumerate().take(self.shares.count()) {
                let share = self.shares.share(i);
                link.friction.x = link.friction.x * share;
                link.friction.y = link.friction.y * share;
            }
        }
        if self.has_springs {
            let first = self.stage.links.len() - self.springs.len();
            let bases = &self.motion.base[first..];
            for ((link, spring), base) in self.stage.links[first..].iter_mut().zip(&self.springs).zip(bases) {
                (link.mass, link.reference) = spring.hold(c, base, link.mass, &link.reference);
            }
        }
        self.stage.spins.clear();
        for link in self.constants.iter().take(self.spin_torque.len()) {
            self.stage.spins.push(link.spin * c);
        }
        if self.shares.is_any {
            for (i, spin) in self.stage.spins.iter_mut().enumerate().take(self.shares.count()) {
                *spin = *spin * self.shares.share(i);
            }
        }
    }

    #[inline(always)]
    fn fill_joints(&mut self) {
        let Self { motion: Motion { heading, base, reference, guess, .. }, references, drives, io, stage, .. } = self;
        let (c, target) = (stage.coefficient, &references.target);
        let Some(io) = io else {
            stage.joints.resize(target.len(), StageJoint::none());
            return drives.fill(
                c,
                #[inline(always)]
                |joint| [target[joint].value - (base[joint + 1].z - base[joint].z), target[joint].rate],
                &mut stage.joints,
            );
        };
        let (gains, strength) = (&drives.gains[0], drives.strength);
        let input = IoInput { heading, base, reference, guess, target, gains, strength, coefficient: c };
        io.fill(&input, &mut stage.joints);
    }

    #[inline(always)]
    fn load_forces(&mut self) {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.motion.guess);
        for (impulse, force) in self.solution.friction.iter_mut().zip(&self.friction_force) {
            *impulse = Vector2::new(force.x * c, force.y * c);
        }
        self.solution.spin.clear();
        for torque in &self.spin_torque {
            self.solution.spin.push(*torque * c);
        }
        for (impulse, torque) in self.solution.actuator.iter_mut().zip(&self.actuator_torque) {
            *impulse = *torque * c;
        }
        self.motors.fill(c, &mut self.stage.motors, &mut self.solution.gear);
        let bends = self.motion.start_pose.windows(2).zip(self.motion.base.windows(2));
        let angles = bends.map(|(start, base)| (start[1].z - start[0].z, base[1].z - base[0].z));
        self.joint_stops.fill(angles, c, self.motion.elapsed, &mut self.stage.stops, &mut self.solution.stop);
    }

    #[inline(always)]
    fn store_forces(&mut self, lanes: T::Mask) {
        let per_second = T::splat(1.0) / self.stage.coefficient;
        for (force, impulse) in self.friction_force.iter_mut().zip(&self.solution.friction) {
            force.x = T::select(lanes, impulse.x * per_second, force.x);
            force.y = T::select(lanes, impulse.y * per_second, force.y);
        }
        for (torque, impulse) in self.spin_torque.iter_mut().zip(&self.solution.spin) {
            *torque = T::select(lanes, *impulse * per_second, *torque);
        }
        self.motors.store(self.stage.coefficient, &self.solution.gear, lanes);
        let rates = joint_rates(&self.motion.guess).zip(joint_rates(&self.solution.twist));
        self.joint_stops.arrive(self.bend());
        let times = [self.stage.coefficient, self.motion.elapsed];
        self.joint_stops.store(&self.solution.stop, rates, times, lanes, &mut self.closings);
    }

    /// When contacts close.
    #[inline(always)]
    fn find_closings(&mut self) {
        let Self { contacts, self_contacts, closings, stage, solution, motion, .. } = self;
        let (coefficient, elapsed) = (stage.coefficient, motion.elapsed);
        let motion = SolvedMotion { coefficient, elapsed, expected: &motion.guess, twist: &solution.twist };
        contacts.rows.add_closings((&stage.contacts, &solution.contact), &motion, closings);
        self_contacts.rows.add_closings((&stage.pairs, &solution.pair), &motion, closings);
    }
}
