//! What follows from a solved stage, lane by lane: the next prediction, the verdict on the step and its end state.

use nalgebra::{Vector2, Vector3};

use crate::math::{Laned, Mask, Real, read_lane};
use crate::obstacles::Moved;
use crate::planar::contact_detection::MARGIN;
use crate::planar::{Body, Heading, Planar, PlanarSystem, StageSolution, Twist, WarmStart};
use crate::stepping::lanes::{Lanes, active};
use crate::stepping::penetration::Sinking;
use crate::stepping::{
    Closing, ContactImpulse, Effort, EnergyLedger, FallbackResult, Members, StageOutput, StageRecord, holding,
};

use super::Workspace;

impl<T: Real> StageOutput<T> for Workspace<T> {
    type Model = Planar;

    fn fall_back(&mut self, lane: usize, tolerance: f64, effort: Effort) -> Option<FallbackResult> {
        let nodes = self.motion.arms.len() + self.awake.of(lane).len();
        self.fallback.solve_lane(&self.stage, &mut self.solution, (lane, nodes), tolerance, effort)
    }

    fn deviation(&self) -> T {
        self.result.deviation
    }

    /// Gaps linearised at the prediction may then be wrong, or contacts missing.
    fn is_mispredicted(&self, lane: usize) -> bool {
        self.joint_stops.has_missed(lane) || (self.is_near_contact(lane) && self.result.deviation.lane(lane) > MARGIN)
    }

    fn postpone(&mut self, lane: usize, body: &mut Body) {
        let (chain, guess) = (self.motion.arms.len(), &mut body.warm_start.guess);
        guess.clear();
        guess.resize(chain + body.state.movables.len(), Vector3::zeros());
        read_lane::<T, _>(&self.solution.twist[..chain], lane, guess);
        self.awake.read(lane, &self.solution.twist[chain..], &mut guess[chain..]);
        self.keep_friction(lane, body);
    }

    fn collect_contact_impulses(
        &mut self,
        members: &mut Members<Planar>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        self.keep_forces(members, solved, contact_impulses);
        self.keep_self_contacts(members, solved, contact_impulses);
    }

    fn record(&self, lane: usize, record: &mut StageRecord) {
        let StageSolution { twist, friction, actuator, .. } = &self.solution;
        for ((to, link), impulse) in record.ground.iter_mut().zip(&self.stage.links).zip(friction) {
            to[0] = link.heading.to_world(*impulse).map(|p| p.lane(lane)).push(0.0);
        }
        for (j, (work, impulse)) in record.actuator_work.iter_mut().zip(actuator).enumerate() {
            work[0] = impulse.lane(lane) * (twist[j + 1].z.lane(lane) - twist[j].z.lane(lane));
        }
        for (j, (drawn, motor)) in record.drawn.iter_mut().zip(&self.stage.motors).enumerate() {
            drawn[0] = motor.drawn(actuator[j], twist[j + 1].z - twist[j].z).lane(lane);
        }
    }

    fn kept_energy(&self) -> &EnergyLedger<T> {
        &self.result.energy
    }

    fn closing(&self, lane: usize) -> Closing {
        self.closings.of(lane)
    }

    fn end_step(&mut self, members: &mut Members<Planar>, lanes: Lanes) {
        for lane in active(lanes) {
            self.keep_friction(lane, members.body_mut(lane));
            if self.shares.has_patches() {
                let ends = self.result.end.iter().map(|pose| Some(pose.lane(lane).xy()));
                let at = self.shares.first_crossing(lane, self.motion.elapsed.lane(lane), ends);
                self.closings.add_crossing(lane, at);
            }
        }
        self.measure_sinking(members, lanes);
    }

    fn sinks(&self, lane: usize) -> bool {
        self.result.sinking[lane] >= Sinking::TooDeep
    }

    fn sinks_beyond_recovery(&self, lane: usize) -> bool {
        self.result.sinking[lane] == Sinking::BeyondRecovery
    }

    fn accept(&mut self, system: &PlanarSystem, lane: usize, body: &mut Body) {
        read_lane::<T, _>(&self.result.end, lane, &mut body.state.pose);
        read_lane::<T, _>(&self.result.twist, lane, &mut body.state.twist);
        self.keep_bodies(system, lane, body);
        self.drives.backlash.save(lane, &mut body.warm_start.backlash);
        self.joint_stops.save(lane, &mut body.warm_start.joint_stops);
        self.motors.save(lane, &mut body.warm_start.gear_friction);
        body.is_plausible &= self.result.plausible.lane(lane);
        // Without obstacles in the register the motion is not bounded.
        if !body.obstacles.is_unbounded() {
            let [displacement, error] =
                [self.motion.bound.displacement, self.result.misprediction].map(|b| b.lane(lane));
            body.warm_start.near.arrive(displacement, error);
            body.warm_start.near.end_step();
        }
        let nodes = self.nodes(system, lane, &body.obstacles);
        let gap = |id| self.end_gap_of_pair(nodes, lane, &body.state.movables, id);
        body.warm_start.self_contacts.end_step(gap);
        let per_second = 1.0 / self.stage.coefficient.lane(lane);
        for (torque, drive) in body.warm_start.joint_torque.iter_mut().zip(&self.result.actuator) {
            *torque = -drive.lane(lane) * per_second;
        }
    }
}

impl<T: Real> Workspace<T> {
    /// Where what can be pushed is, and how it moves; what sleeps lies still.
    fn keep_bodies(&self, system: &PlanarSystem, lane: usize, body: &mut Body) {
        let (chain, gravity) = (system.robot.link_count(), system.gravity);
        let Body { state, warm_start, obstacles, .. } = body;
        for (node, &number) in (chain..).zip(self.awake.of(lane)) {
            let [pose, twist] = [&self.result.end, &self.result.twist].map(|of_all| of_all[node].lane(lane));
            state.movables[number] = Moved::flat(pose, twist);
        }
        for &number in self.awake.asleep(lane) {
            let moved = &mut state.movables[number];
            moved.twist = Twist::zeros();
            let force = holding(&obstacles.movables()[number], moved, &gravity).unwrap_or_default();
            warm_start.friction[chain + number] = Heading::of(moved.pose.z).to_link(force.xy());
            warm_start.spin[chain + number] = 0.0;
        }
    }

    /// Keeps the friction of the last stage as the next initial guess.
    fn keep_friction(&self, lane: usize, body: &mut Body) {
        let (own, chain) = (body.state.movables.len(), self.motion.arms.len());
        let WarmStart { friction, spin, .. } = &mut body.warm_start;
        friction.resize(chain + own, Vector2::zeros());
        read_lane::<T, _>(&self.friction_force[..chain], lane, friction);
        self.awake.read(lane, &self.friction_force[chain..], &mut friction[chain..]);
        // Other lanes may have discs that turn.
        spin.resize(if own > 0 || self.resists_spin { chain + own } else { 0 }, 0.0);
        if !(spin.is_empty() || self.spin_torque.is_empty()) {
            read_lane::<T, _>(&self.spin_torque[..chain], lane, spin);
            self.awake.read(lane, &self.spin_torque[chain..], &mut spin[chain..]);
        }
    }
}
