//! Robots and their references into lanes.

use crate::math::{Laned, Real, write_lane};
use crate::planar::{Body, Planar, PlanarSystem, Pose, Twist};
use crate::stepping::lanes::{Lanes, NO_LANES, active, mask};
use crate::stepping::{ContactPoint, Members, PlantParameters, StageInput};

use super::Workspace;

impl<T: Real> StageInput<T> for Workspace<T> {
    type Model = Planar;

    fn new(system: &PlanarSystem) -> Self {
        Self::new(system, 0)
    }

    fn load(&mut self, members: &Members<Planar>) {
        self.load_movables(members);
        self.load_variations(members);
        let (system, parameters) = (members.system, |lane| &members.body(lane).parameters);
        self.drives.backlash.load(|lane| (parameters(lane).backlash, &members.body(lane).warm_start.backlash));
        self.shares.load(|lane| system.stribeck.drop + parameters(lane).stribeck);
        self.joint_stops.load(|lane| &members.body(lane).warm_start.joint_stops);
        self.motors.load(|lane| (parameters(lane).torque_limit, &members.body(lane).warm_start.gear_friction));
        self.has_obstacles = members.any(|body| !body.obstacles.is_unbounded());
        self.near_obstacles =
            std::array::from_fn(|lane| lane < T::LANES && !members.body(lane).warm_start.near.pairs().is_empty());
        let is_among =
            |lane: usize| self.near_obstacles[lane] || lane < T::LANES && !members.body(lane).state.movables.is_empty();
        self.among_obstacles = mask::<T>(std::array::from_fn(is_among));
        for lane in 0..T::LANES {
            let Body { state, warm_start, .. } = members.body(lane);
            self.clear_way.set_lane(lane, warm_start.near.clear_way());
            for (lanes, torque) in self.actuator_torque.iter_mut().zip(&warm_start.joint_torque) {
                lanes.set_lane(lane, -torque);
            }
            if self.shares.has_patches() {
                let contacts = state.pose.iter().zip(&state.twist);
                let point = |(pose, twist): (&Pose, &Twist)| ContactPoint { position: pose.xy(), velocity: twist.xy() };
                self.shares.find_patches(lane, contacts.map(point));
            }
            for (i, (q, u)) in state.pose.iter().zip(&state.twist).enumerate() {
                self.motion.start_pose[i].set_lane(lane, q);
                self.motion.start_twist[i].set_lane(lane, u);
            }
            let chain = state.pose.len();
            for (link, lanes) in self.spin_torque.iter_mut().enumerate().take(chain) {
                lanes.set_lane(lane, warm_start.spin.get(link).copied().unwrap_or(0.0));
            }
            for (lanes, force) in self.friction_force.iter_mut().zip(&warm_start.friction[..chain]) {
                lanes.set_lane(lane, force);
            }
        }
    }

    fn take_guesses(&mut self, members: &mut Members<Planar>) {
        let chain = self.motion.arms.len();
        for lane in active(members.lanes()) {
            let guesses = &mut members.body_mut(lane).warm_start.guess;
            if !guesses.is_empty() {
                write_lane::<T, _>(&mut self.motion.guess[..chain], lane, guesses);
                self.awake.write(lane, &mut self.motion.guess[chain..], &guesses[chain..]);
                guesses.clear();
            }
        }
    }

    fn read_waves(&mut self, members: &Members<Planar>, end: T) -> Lanes {
        let mut waving = NO_LANES;
        for (lane, waving) in waving.iter_mut().enumerate().take(T::LANES) {
            let robot = members.robot(lane);
            if let Some(wave) = robot.reference.travelling_wave(robot.body.state.time + end.lane(lane)) {
                self.references.wave.set_lane(lane, &wave);
                *waving = true;
            }
        }
        waving
    }

    fn read_references(&mut self, members: &Members<Planar>, end: T, waving: Lanes) {
        self.drives.read(members, &members.system.controller, end);
        for lane in (0..T::LANES).filter(|lane| !waving[*lane]) {
            let robot = members.robot(lane);
            robot.reference.targets(robot.body.state.time + end.lane(lane), &mut self.references.targets);
            for (lanes, target) in self.references.target.iter_mut().zip(&self.references.targets) {
                lanes.value.set_lane(lane, target.angle);
                lanes.rate.set_lane(lane, target.rate);
                lanes.acceleration.set_lane(lane, target.acceleration);
            }
        }
    }

    fn find_contacts(&mut self, members: &mut Members<Planar>, pending: Lanes) {
        self.detect_contacts(members, pending);
    }
}

impl<T: Real> Workspace<T> {
    /// Constants of the lanes' own robots; nothing to do where all are as the system's.
    fn load_variations(&mut self, members: &Members<Planar>) {
        let was_varied = self.is_varied;
        self.is_varied = members.any(|body| body.parameters != PlantParameters::default());
        if !self.is_varied && !was_varied {
            return;
        }
        for lane in 0..T::LANES {
            let PlantParameters { mass, friction, .. } = members.body(lane).parameters;
            for (constants, link) in self.constants.iter_mut().zip(&members.system.robot.links) {
                let bound = members.system.friction_force(link).component_mul(&friction) * mass;
                constants.mass.set_lane(lane, link.mass * mass);
                constants.inertia.set_lane(lane, link.inertia * mass);
                constants.friction.x.set_lane(lane, bound.x);
                constants.friction.y.set_lane(lane, bound.y);
                if members.system.resists_spin() {
                    constants.spin.set_lane(lane, members.system.spin_torque(link, &friction) * mass);
                }
            }
        }
    }
}
