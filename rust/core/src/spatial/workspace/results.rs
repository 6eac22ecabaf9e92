//! What follows from a solved stage, lane by lane: the next prediction, the verdict on the step and its end state.

use nalgebra::{Vector2, Vector3};

use super::kernels::SUNK;
use crate::contact::{KnownContact, Source};
use crate::math::{Mask, Real, read_lane};
use crate::obstacles::Movable;
use crate::spatial::obstacle_contacts::friction_of;
use crate::spatial::rest::is_at_rest;
use crate::spatial::support::Support;
use crate::spatial::{ChainState, Spatial, SpatialBody, SpatialSystem, StageSolution, Twist};
use crate::stepping::lanes::{Lanes, active};
use crate::stepping::penetration::Sinking;
use crate::stepping::{
    Closing, ContactImpulse, Effort, EnergyLedger, FallbackResult, Members, StageOutput, StageRecord, holding,
};

use super::Workspace;

impl<T: Real> StageOutput<T> for Workspace<T> {
    type Model = Spatial;

    fn fall_back(&mut self, lane: usize, tolerance: f64, effort: Effort) -> Option<FallbackResult> {
        let nodes = self.motion.frames.len() + self.awake.of(lane).len();
        self.fallback.solve_lane(&self.stage, &mut self.solution, (lane, nodes), tolerance, effort)
    }

    fn deviation(&self) -> T {
        self.result.deviation
    }

    fn is_mispredicted(&self, lane: usize) -> bool {
        // Also where the deviation is not a number.
        self.joint_stops.has_missed(lane)
            || !matches!(self.result.deviation.lane(lane), deviation if deviation < MISPREDICTED)
    }

    /// Its forces serve as the next warm start, too.
    fn postpone(&mut self, lane: usize, body: &mut SpatialBody) {
        let state = &mut body.warm_start;
        self.motion.guess.read_lane(lane, &mut state.guess);
        state.guess.moved.fill(Twist::zero());
        self.awake.read(lane, &self.motion.guess.moved, &mut state.guess.moved);
        state.is_postponed = true;
        self.keep_forces(lane, state);
    }

    fn collect_contact_impulses(
        &mut self,
        _: &mut Members<Spatial>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        for lane in active(solved) {
            contact_impulses.extend(self.top_impulses(lane));
        }
        let Self { contacts, self_contacts, known, stage, solution, .. } = self;
        let c = stage.coefficient;
        contacts.rows.read(c, (&solution.contact, solved), contact_impulses, |found, force| {
            let friction = friction_of(stage, solution, found.slot, found.lane) / c.lane(found.lane);
            known[found.lane].add(found.id, KnownContact { force, friction, ..found.known });
        });
        contact_impulses.extend(contacts.friction_impulses(stage, solution, solved));
        self_contacts.rows.read(c, (&solution.pair, solved), contact_impulses, |found, force| {
            known[found.lane].add(found.id, KnownContact { force, ..found.known });
        });
    }

    fn record(&self, lane: usize, record: &mut StageRecord) {
        let StageSolution { rate, actuator, .. } = &self.solution;
        for (link, to) in record.ground.iter_mut().enumerate() {
            *to = [0, 1].map(|side| match self.is_on_top(lane, link, side) {
                true => Vector3::zeros(),
                false => self.impulse_from_below(lane, link, side),
            });
        }
        for (work, (impulse, rate)) in record.actuator_work.iter_mut().zip(actuator.iter().zip(rate)) {
            *work = [0, 1].map(|axis| impulse[axis].lane(lane) * rate[axis].lane(lane));
        }
        let axes = actuator.iter().flatten().zip(rate.iter().flatten());
        for (drawn, (motor, (impulse, rate))) in
            record.drawn.iter_mut().flatten().zip(self.stage.motors.iter().zip(axes))
        {
            *drawn = motor.drawn(*impulse, *rate).lane(lane);
        }
    }

    fn kept_energy(&self) -> &EnergyLedger<T> {
        &self.result.kept.energy
    }

    fn closing(&self, lane: usize) -> Closing {
        self.closings.of(lane)
    }

    fn end_step(&mut self, members: &mut Members<Spatial>, lanes: Lanes) {
        if self.shares.has_patches() {
            active(lanes).for_each(|lane| self.find_crossing(lane));
        }
        self.measure_sinking(members, lanes);
    }

    fn sinks(&self, lane: usize) -> bool {
        self.result.sinking_into_ground.lane(lane) > SINKING || self.result.sinking[lane] >= Sinking::TooDeep
    }

    fn sinks_beyond_recovery(&self, lane: usize) -> bool {
        self.result.sinking[lane] == Sinking::BeyondRecovery
    }

    fn keep_first_stage(&mut self) {
        let c = self.stage.coefficient;
        for (sum, ends) in self.first_ground.iter_mut().zip(&self.forces.normal) {
            *sum = ends[0] * c + ends[1] * c;
        }
        for lane in 0..T::LANES {
            for &Support { link, .. } in &self.supports[lane] {
                let of_ground = self.ground_impulse(lane, link);
                self.first_ground[link].set_lane(lane, of_ground);
            }
        }
    }

    fn add_first_stage(&self, lane: usize, weight: f64, body: &mut SpatialBody) {
        for (sum, impulse) in body.impulses.ground.iter_mut().zip(&self.first_ground) {
            *sum += impulse.lane(lane) * weight;
        }
    }

    fn accept(&mut self, system: &SpatialSystem, lane: usize, body: &mut SpatialBody) {
        let c = self.stage.coefficient.lane(lane);
        let SpatialBody { warm_start: state, impulses, obstacles, .. } = body;
        state.last.began_at_rest = is_at_rest(&state.velocity);
        self.result.arrival.read_lane(lane, &mut state.configuration);
        state.near.advance(self.motion.way.lane(lane));
        self.result.kept.end.read_lane(lane, &mut state.velocity);
        self.drives.backlash.save(lane, &mut state.last.backlash);
        self.joint_stops.save(lane, &mut state.last.joint_stops);
        self.motors.save(lane, &mut state.last.gear_friction);
        read_lane::<T, _>(&self.result.kept.momentum, lane, &mut state.momentum);
        self.keep_forces(lane, state);
        self.keep_bodies(system, lane, obstacles.movables(), state);
        state.end_step();
        for (link, sum) in impulses.ground.iter_mut().enumerate() {
            *sum += self.ground_impulse(lane, link);
        }
        for (torque, drive) in state.last.joint_torque.iter_mut().zip(&self.result.kept.actuator) {
            *torque = -Vector2::new(drive[0].lane(lane), drive[1].lane(lane)) / c;
        }
        body.is_plausible &= state.velocity.is_plausible();
    }
}

impl<T: Real> Workspace<T> {
    /// Where what can be pushed is, and how it moves; what sleeps lies still.
    fn keep_bodies(&self, system: &SpatialSystem, lane: usize, movables: &[Movable], state: &mut ChainState) {
        self.awake.read(lane, &self.result.arrival.moved, &mut state.configuration.moved);
        self.awake.read(lane, &self.result.kept.end.moved, &mut state.velocity.moved);
        for &number in self.awake.asleep(lane) {
            state.velocity.moved[number] = Twist::zero();
            let held = holding(&movables[number], &state.moved(number), &system.gravity);
            state.last.surface[number] = held.unwrap_or_default();
        }
    }

    /// Impulses of top faces in a lane's solved stage.
    fn top_impulses(&self, lane: usize) -> impl Iterator<Item = ContactImpulse> + '_ {
        self.supports[lane].iter().map(move |&Support { link, side, obstacle, .. }| ContactImpulse {
            lane,
            link,
            impulse: self.impulse_from_below(lane, link, side),
            source: Source::Top(obstacle),
        })
    }

    /// Impulse of the ground or a top face on an end sphere in a lane's solved stage, frame I \[N s\].
    fn impulse_from_below(&self, lane: usize, link: usize, side: usize) -> Vector3<f64> {
        let tangent = self.stage.links[link].tangent.map(|t| t.lane(lane));
        let across = Vector2::new(-tangent.y, tangent.x);
        let friction = self.solution.friction[link][side].map(|p| p.lane(lane));
        (tangent * friction.x + across * friction.y).push(self.solution.normal[link][side].lane(lane))
    }

    /// When the first sphere of a lane that the ground carries leaves its patch.
    fn find_crossing(&mut self, lane: usize) {
        let ends = self.motion.frames.iter().enumerate().flat_map(|(i, frame)| {
            let at = frame.axis_of(lane);
            let spheres = self.stage.links[i].spheres();
            [0, 1].map(|end| {
                let carries = self.stood[i][end].lane(lane) || self.forces.normal[i][end].lane(lane) > 0.0;
                carries.then(|| (at.position + at.axis * spheres[end].lane(lane)).xy())
            })
        });
        let at = self.shares.first_crossing(lane, self.motion.elapsed.lane(lane), ends);
        self.closings.add_crossing(lane, at);
    }

    /// Normal impulse of the ground on a lane's link in the last stage, without those of top faces \[N s\].
    fn ground_impulse(&self, lane: usize, link: usize) -> f64 {
        let c = self.stage.coefficient.lane(lane);
        let [front, rear] = [0, 1].map(|side| match self.is_on_top(lane, link, side) {
            true => 0.0,
            false => self.forces.normal[link][side].lane(lane) * c,
        });
        front + rear
    }

    /// Measures again how a lane's spheres sink into what carries them, where that is not the plane of the ground alone.
    pub(in crate::spatial) fn measure_sinking_into_supports(&mut self, lane: usize) {
        let mut sinking = 0.0_f64;
        for (i, (frame, link)) in self.motion.frames.iter().zip(&self.stage.links).enumerate() {
            let at = frame.axis_of(lane);
            let [offset, sphere, radius] =
                [&link.cg_offset, &link.sphere, &link.radius].map(|length| length.lane(lane));
            for (side, along) in [offset + sphere, offset - sphere].into_iter().enumerate() {
                let height = self.support_of(lane, i, side).map_or(0.0, |support| support.height);
                let gap = at.position.z + along * at.axis.z - radius;
                if gap - height < -SUNK {
                    sinking = sinking.max(self.motion.start_gap[i][side].lane(lane) - gap);
                }
            }
        }
        self.result.sinking_into_ground.set_lane(lane, sinking);
    }

    fn is_on_top(&self, lane: usize, link: usize, side: usize) -> bool {
        self.support_of(lane, link, side).is_some()
    }

    fn support_of(&self, lane: usize, link: usize, side: usize) -> Option<&Support> {
        self.supports[lane].iter().find(|support| (support.link, support.side) == (link, side))
    }

    /// Keeps the forces of a lane's last stage as the next warm start.
    fn keep_forces(&self, lane: usize, state: &mut ChainState) {
        self.forces.read_lane(lane, &mut state.last.forces);
        self.awake.read(lane, &self.surface_force, &mut state.last.surface);
        state.last.contacts.copy_from(&self.known[lane]);
    }
}

/// A step that takes a sunk sphere deeper by more is divided \[m\].
const SINKING: f64 = 2e-5;

/// Distance between prediction and end of a stage from which on it is predicted again \[m\].
const MISPREDICTED: f64 = 2.5e-3;
