//! Robots and their references into lanes.

use crate::gait::CardanTarget;
use crate::math::{Laned, Mask, Real, write_lane};
use crate::spatial::{Spatial, SpatialSystem};
use crate::stepping::lanes::{Lanes, active};
use crate::stepping::{ContactPoint, Members, PlantParameters, StageInput};

use super::Workspace;

impl<T: Real> StageInput<T> for Workspace<T> {
    type Model = Spatial;

    fn new(system: &SpatialSystem) -> Self {
        Self::new(system, 0)
    }

    fn load(&mut self, members: &Members<Spatial>) {
        self.load_movables(members);
        self.load_variations(members);
        let (system, parameters) = (members.system, |lane| &members.body(lane).parameters);
        self.drives.backlash.load(|lane| (parameters(lane).backlash, &members.body(lane).warm_start.last.backlash));
        self.shares.load(|lane| system.stribeck.drop + parameters(lane).stribeck);
        self.joint_stops.load(|lane| &members.body(lane).warm_start.last.joint_stops);
        self.motors.load(|lane| (parameters(lane).torque_limit, &members.body(lane).warm_start.last.gear_friction));
        for lane in 0..T::LANES {
            let state = &members.body(lane).warm_start;
            self.motion.start.set_lane(lane, &state.configuration);
            self.motion.start_velocity.set_lane(lane, &state.velocity);
            write_lane::<T, _>(&mut self.motion.start_momentum, lane, &state.momentum);
            self.forces.set_lane(lane, &state.last.forces);
            self.known[lane].copy_from(&state.last.contacts);
        }
        for (i, ends) in self.stood.iter_mut().enumerate() {
            *ends = [0, 1].map(|end| T::Mask::of(|lane| members.body(lane).warm_start.last.stands[i][end]));
        }
        self.began_at_rest = T::Mask::of(|lane| members.body(lane).warm_start.last.began_at_rest);
    }

    fn take_guesses(&mut self, members: &mut Members<Spatial>) {
        for lane in active(members.lanes()) {
            let state = &mut members.body_mut(lane).warm_start;
            if std::mem::take(&mut state.is_postponed) {
                self.motion.guess.set_lane(lane, &state.guess);
                self.awake.write(lane, &mut self.motion.guess.moved, &state.guess.moved);
            }
            // The links have been placed only now.
            if self.shares.has_patches() {
                self.find_patches(lane);
            }
        }
    }

    fn read_references(&mut self, members: &Members<Spatial>, end: T, _: Lanes) {
        self.drives.read(members, &members.system.controller, end);
        for lane in 0..T::LANES {
            let robot = members.robot(lane);
            robot.reference.targets(robot.body.state.time + end.lane(lane), &mut self.targets);
            for (lanes, CardanTarget { yaw, pitch }) in self.target.iter_mut().zip(&self.targets) {
                for (lanes, target) in lanes.iter_mut().zip([yaw, pitch]) {
                    lanes[0].set_lane(lane, target.angle);
                    lanes[1].set_lane(lane, target.rate);
                }
            }
        }
    }

    fn find_contacts(&mut self, members: &mut Members<Spatial>, pending: Lanes) {
        self.find_rows(members, pending);
    }
}

impl<T: Real> Workspace<T> {
    /// Finds the patches below a lane's end spheres.
    fn find_patches(&mut self, lane: usize) {
        let Self { motion, stage, shares, .. } = self;
        let links = stage.links.iter().zip(motion.start_frames.iter().zip(&motion.expected));
        let contacts = links.flat_map(|(link, (frame, twist))| {
            let (at, twist) = (frame.axis_of(lane), twist.lane(lane));
            link.spheres().map(|along| {
                let arm = at.axis * along.lane(lane);
                let (position, velocity) = ((at.position + arm).xy(), twist.velocity_at(&arm).xy());
                ContactPoint { position, velocity }
            })
        });
        shares.find_patches(lane, contacts);
    }

    /// Constants of the lanes' own robots; nothing to do where all are as the system's.
    fn load_variations(&mut self, members: &Members<Spatial>) {
        let was_varied = self.is_varied;
        self.is_varied = members.any(|body| body.parameters != PlantParameters::default());
        if !self.is_varied && !was_varied {
            return;
        }
        for lane in 0..T::LANES {
            let PlantParameters { mass, friction, .. } = members.body(lane).parameters;
            let sliding = members.system.friction.component_mul(&friction);
            self.stage.friction.sliding.set_lane(lane, &sliding);
            for (of_stage, link) in self.stage.links.iter_mut().zip(&members.system.robot.links) {
                of_stage.mass.set_lane(lane, link.mass * mass);
                of_stage.inertia.set_lane(lane, link.inertia * mass);
                of_stage.roll_inertia.set_lane(lane, link.roll_inertia * mass);
            }
        }
    }
}
