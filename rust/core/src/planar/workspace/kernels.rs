//! The arithmetic of a stage over lanes: all but the solver.

use nalgebra::{Vector2, Vector3};

use crate::contact::Folding;
use crate::gait::turned;
use crate::math::{Real, add_scaled, select_into};
use crate::planar::energy::work_of;
use crate::planar::io_drive::IoInput;
use crate::planar::{StageJoint, StageLink, certify, is_plausible, mean_twist, travel};
use crate::robot::{Breakage, LOCK_STIFFNESS};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};
use crate::stepping::{MovedAxis, PlayedAxis, SolvedStage, StageKernels};

use super::Workspace;
use super::motion_bound::MotionBound;
use crate::planar::contact_friction::solve_with_contact_friction;

impl<T: Real> StageKernels<T> for Workspace<T> {
    #[inline(always)]
    fn begin(&mut self) {
        self.base.copy_from_slice(&self.start_pose);
        self.reference.copy_from_slice(&self.start_twist);
        self.guess.copy_from_slice(&self.start_twist);
        self.backlash.begin_step();
        self.stribeck.begin_step(self.start_twist.iter().map(in_plane));
        self.closings.begin_part();
        self.self_contacts.begin_step();
    }

    /// Joint references along the wave, whose phase is turned from joint to joint.
    #[inline(always)]
    fn follow_waves(&mut self) {
        let Self { wave, target, .. } = self;
        let (mut phase, phase_shift) = (wave.phase.sin_cos(), wave.phase_shift.value.sin_cos());
        for (joint, target) in target.iter_mut().enumerate() {
            *target = wave.joint(joint, phase);
            phase = turned(phase, phase_shift);
        }
    }

    #[inline(always)]
    fn extrapolate(&mut self, h: T) {
        let (to_reference, to_guess) = (T::splat(EXTRAPOLATION), T::splat(1.0 / GAMMA));
        for (i, u) in self.start_twist.iter().enumerate() {
            let end = &self.kept_twist[i];
            let change = Vector3::new(end.x - u.x, end.y - u.y, end.z - u.z);
            self.reference[i] = add_scaled(u, &change, to_reference);
            self.guess[i] = add_scaled(u, &change, to_guess);
        }
        if self.backlash.is_any {
            self.backlash.extrapolate(to_reference);
        }
        if self.stribeck.is_any {
            self.stribeck.extrapolate(self.kept_twist.iter().map(in_plane));
        }
        let per_second = T::splat(1.0) / self.stage.coefficient;
        for (torque, impulse) in self.actuator_torque.iter_mut().zip(&self.kept_actuator) {
            *torque = *impulse * per_second;
        }
        let elapsed = h - T::splat(GAMMA) * h;
        let Self { half_length, kept_twist, base, heading, start_pose, .. } = self;
        travel(half_length, start_pose, kept_twist, elapsed, base, heading);
    }

    #[inline(always)]
    fn predict(&mut self, c: T, elapsed: T, pending: T::Mask) {
        self.stage.coefficient = c;
        self.elapsed = elapsed;
        travel(&self.half_length, &self.base, &self.guess, c, &mut self.predicted, &mut self.heading);
        let folding = Folding::of(self.predicted.iter().map(|pose| pose.z));
        self.self_contacts.predict(&folding);
        self.joint_stops.predict(folding.bend);
        if self.has_pegs || self.self_contacts.is_any_possible() {
            mean_twist(&self.half_length, &self.heading, &self.guess, &mut self.travel);
            let gain = (self.pull.x * self.pull.x + self.pull.y * self.pull.y).sqrt() * c;
            let fastest = self.fastest(&self.guess).max(self.fastest(&self.reference) + gain);
            let displacement = self.bound(&self.predicted, &self.start_pose);
            let MotionBound { fastest: last_fastest, displacement: last_displacement } = self.motion_bound;
            self.motion_bound = MotionBound {
                fastest: T::select(pending, fastest, last_fastest),
                displacement: T::select(pending, displacement, last_displacement),
            };
            let margin = self.motion_bound.contact_margin(c, 2.0, self.smallest_radius);
            self.self_contacts.list_close_pairs(&self.predicted, margin, pending);
        }
    }

    #[inline(always)]
    fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> SolvedStage<T> {
        self.fill_links();
        self.fill_joints();
        self.load_forces();
        let Self { stage, solution, newton, .. } = self;
        let outcome = if stage.contact_friction.is_empty() {
            newton.solve(stage, solution, tolerance, max_iterations, lanes)
        } else {
            solve_with_contact_friction(newton, stage, solution, tolerance, max_iterations, lanes)
        };
        let certificate = certify(stage, solution);
        SolvedStage { outcome, residual: certificate.residual(), gap: certificate.gap }
    }

    #[inline(always)]
    fn evaluate(&mut self, lanes: T::Mask) {
        self.energy = work_of(&self.stage, &self.solution);
        self.store_forces(lanes);
        self.measure_deviation();
    }

    #[inline(always)]
    fn keep(&mut self, solved: T::Mask, again: T::Mask) {
        for (i, u) in self.solution.twist.iter().enumerate() {
            select_into(&mut self.kept_twist[i], solved, u);
            select_into(&mut self.guess[i], again, u);
        }
        for (kept, drive) in self.kept_actuator.iter_mut().zip(&self.solution.actuator) {
            *kept = T::select(solved, *drive, *kept);
        }
        self.kept_energy.select_into(solved, &self.energy);
        if self.backlash.is_any {
            let rates = self.kept_twist.windows(2).map(|u| u[1].z - u[0].z);
            let axes = self.stage.joints.iter().zip(rates).map(|(joint, rate)| {
                let StageJoint { drive, stiffness, slack, .. } = *joint;
                MovedAxis { drive, stiffness, slack, rate }
            });
            self.backlash.end_stage(self.stage.coefficient, axes);
        }
    }

    /// End configuration q_B + c u of the solved stage.
    #[inline(always)]
    fn arrive(&mut self) {
        let c = self.stage.coefficient;
        travel(&self.half_length, &self.base, &self.kept_twist, c, &mut self.end, &mut self.heading);
        self.misprediction = if self.has_pegs { self.bound(&self.end, &self.predicted) } else { T::zero() };
        self.plausible = is_plausible(&self.end, &self.kept_twist);
    }
}

/// Velocity of a link's CG.
#[inline(always)]
fn in_plane<T: Real>(u: &Vector3<T>) -> Vector2<T> {
    Vector2::new(u.x, u.y)
}

impl<T: Real> Workspace<T> {
    /// Largest angle of a joint at the end of the solved stage.
    #[inline(always)]
    fn largest_bend(&self) -> T {
        let c = self.stage.coefficient;
        let ends = self.base.iter().zip(&self.solution.twist).map(|(q, u)| c.mul_add(u.z, q.z));
        Folding::of(ends).bend
    }

    #[inline(always)]
    fn fill_links(&mut self) {
        let c = self.stage.coefficient;
        let (gain_x, gain_y) = (self.pull.x * c, self.pull.y * c);
        self.stage.links.clear();
        for (i, link) in self.constants.iter().enumerate() {
            let u = &self.reference[i];
            self.stage.links.push(StageLink {
                heading: self.heading[i],
                reference: Vector3::new(u.x + gain_x, u.y + gain_y, u.z),
                mass: link.mass,
                inertia: link.inertia,
                half_length: self.half_length[i],
                friction: Vector2::new(link.friction.x * c, link.friction.y * c),
            });
        }
        if self.stribeck.is_any {
            for (link, share) in self.stage.links.iter_mut().zip(self.stribeck.shares()) {
                link.friction.x = link.friction.x * share;
                link.friction.y = link.friction.y * share;
            }
        }
    }

    #[inline(always)]
    fn fill_joints(&mut self) {
        let Some(io) = &mut self.io else { return self.fill_pd() };
        let input = IoInput {
            heading: &self.heading,
            base: &self.base,
            reference: &self.reference,
            guess: &self.guess,
            target: &self.target,
            gains: self.gains,
            torque_limit: self.torque_limit,
            coefficient: self.stage.coefficient,
        };
        io.fill(&input, &mut self.stage.joints);
    }

    /// The PD torque (T 3.51 != D3) at the end of the stage, where phi = phi_base + c omega_J, is linear in
    /// omega_J.
    #[inline(always)]
    fn fill_pd(&mut self) {
        let c = self.stage.coefficient;
        let [kp, kd] = self.gains;
        self.stage.joints.clear();
        for (j, target) in self.target.iter().enumerate() {
            let error = target.value - (self.base[j + 1].z - self.base[j].z);
            self.stage.joints.push(StageJoint {
                drive: c * (kp * error + kd * target.rate),
                stiffness: c * (c * kp + kd),
                limit: c * self.torque_limit,
                slack: T::zero(),
            });
        }
        if self.has_own_torques {
            for (joint, torque) in self.stage.joints.iter_mut().zip(&self.own_torque) {
                joint.drive += c * *torque;
            }
        }
        if self.backlash.is_any {
            let axes = self.stage.joints.iter_mut().map(|joint| PlayedAxis {
                drive: &mut joint.drive,
                stiffness: joint.stiffness,
                slack: &mut joint.slack,
            });
            self.backlash.apply(c, kd, axes);
        }
        self.replace_broken_joints();
    }

    /// A locked joint is held at its reference, the angle at which it broke, by a stiff spring without play or limit; a
    /// limp one has no torque.
    #[inline(always)]
    fn replace_broken_joints(&mut self) {
        let (c, zero) = (self.stage.coefficient, T::zero());
        for (j, breakage) in &self.broken {
            let error = self.target[*j].value - (self.base[j + 1].z - self.base[*j].z);
            let stiffness = match breakage {
                Breakage::Locked => T::splat(LOCK_STIFFNESS) * c,
                Breakage::Limp => zero,
            };
            let limit = T::splat(f64::INFINITY);
            self.stage.joints[*j] =
                StageJoint { drive: stiffness * error, stiffness: stiffness * c, limit, slack: zero };
        }
    }

    #[inline(always)]
    fn load_forces(&mut self) {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.guess);
        for (impulse, force) in self.solution.friction.iter_mut().zip(&self.friction_force) {
            *impulse = Vector2::new(force.x * c, force.y * c);
        }
        for (impulse, torque) in self.solution.actuator.iter_mut().zip(&self.actuator_torque) {
            *impulse = *torque * c;
        }
        let bends = self.start_pose.windows(2).zip(self.base.windows(2));
        let angles = bends.map(|(start, base)| (start[1].z - start[0].z, base[1].z - base[0].z));
        self.joint_stops.fill(angles, c, self.elapsed, &mut self.stage.stops, &mut self.solution.stop);
    }

    #[inline(always)]
    fn store_forces(&mut self, lanes: T::Mask) {
        let per_second = T::splat(1.0) / self.stage.coefficient;
        for (force, impulse) in self.friction_force.iter_mut().zip(&self.solution.friction) {
            force.x = T::select(lanes, impulse.x * per_second, force.x);
            force.y = T::select(lanes, impulse.y * per_second, force.y);
        }
        let rates = self.guess.windows(2).zip(self.solution.twist.windows(2));
        let rates = rates.map(|(expected, u)| (expected[1].z - expected[0].z, u[1].z - u[0].z));
        self.joint_stops.arrive(self.largest_bend());
        self.joint_stops.store(&self.solution.stop, rates, [self.stage.coefficient, self.elapsed], lanes);
    }
}
