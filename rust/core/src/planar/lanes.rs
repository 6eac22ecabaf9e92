//! Copies of one robot's stage from the lanes of many, and of its solution back to them.
//!
//! In the copy the stops of joints are contacts between neighbouring links: the fallback needs one kind of row less.

use nalgebra::Vector3;

use crate::math::{Real, laned, replace_by_lane, write_lane};
use crate::rows::{read_friction, read_rows, write_rows};
use crate::stepping::StageStop;

use super::{Heading, Stage, StageLink, StagePair, StageSolution};

laned! {
    Heading { cos, sin };
    StageLink { heading, reference, mass, inertia, half_length, cg_offset, friction };
}

impl<T: Real> Stage<T> {
    /// The stop of a lane's joint as a contact between the links.
    fn stop_as_pair(&self, lane: usize, joint: usize, side: usize) -> StagePair {
        let stop = &self.stops[joint];
        let turn = StageStop::<T>::SIDES[side] * Real::lane(&stop.lever, lane);
        let direction = [Vector3::new(0.0, 0.0, turn), Vector3::new(0.0, 0.0, -turn)];
        StagePair { links: [joint, joint + 1], direction, offset: Real::lane(&stop.offset[side], lane) }
    }

    /// Copies the stage of `lane` into `one`, with the contacts that the lane has.
    pub fn copy_lane(&self, lane: usize, one: &mut Stage) {
        one.coefficient = Real::lane(&self.coefficient, lane);
        one.skin = self.skin;
        replace_by_lane::<T, _>(&mut one.links, &self.links, lane);
        replace_by_lane::<T, _>(&mut one.joints, &self.joints, lane);
        replace_by_lane::<T, _>(&mut one.spins, &self.spins, lane);
        read_rows(&self.contacts, &self.contacts, lane, &mut one.contacts);
        read_friction(&self.obstacle_friction, &self.contacts, lane, &mut one.obstacle_friction);
        read_friction(&self.pair_friction, &self.pairs, lane, &mut one.pair_friction);
        replace_by_lane::<T, _>(&mut one.motors, &self.motors, lane);
        read_rows(&self.pairs, &self.pairs, lane, &mut one.pairs);
        one.stops.clear();
        one.pairs
            .extend(StageStop::in_lane(&self.stops, lane).map(|(joint, side)| self.stop_as_pair(lane, joint, side)));
    }
}

impl<T: Real> StageSolution<T> {
    /// Copies the solution of `lane` into `one`, with the impulses of those contacts of `stage` that the lane has.
    pub fn copy_lane(&self, stage: &Stage<T>, lane: usize, one: &mut StageSolution) {
        replace_by_lane::<T, _>(&mut one.twist, &self.twist, lane);
        replace_by_lane::<T, _>(&mut one.friction, &self.friction, lane);
        replace_by_lane::<T, _>(&mut one.spin, &self.spin, lane);
        replace_by_lane::<T, _>(&mut one.actuator, &self.actuator, lane);
        replace_by_lane::<T, _>(&mut one.gear, &self.gear, lane);
        read_rows(&self.contact, &stage.contacts, lane, &mut one.contact);
        read_rows(&self.obstacle_friction, &stage.obstacle_friction, lane, &mut one.obstacle_friction);
        read_rows(&self.pair, &stage.pairs, lane, &mut one.pair);
        read_rows(&self.pair_friction, &stage.pair_friction, lane, &mut one.pair_friction);
        one.stop.clear();
        let stops = StageStop::in_lane(&stage.stops, lane);
        one.pair.extend(stops.map(|(joint, side)| Real::lane(&self.stop[joint][side], lane)));
    }

    /// Copies `one` to the solution of `lane`; both are of the same `stage`.
    pub fn set_lane(&mut self, stage: &Stage<T>, lane: usize, one: &StageSolution) {
        write_lane::<T, _>(&mut self.twist, lane, &one.twist);
        write_lane::<T, _>(&mut self.friction, lane, &one.friction);
        write_lane::<T, _>(&mut self.spin, lane, &one.spin);
        write_lane::<T, _>(&mut self.actuator, lane, &one.actuator);
        write_lane::<T, _>(&mut self.gear, lane, &one.gear);
        write_rows(&mut self.contact, &stage.contacts, lane, &one.contact);
        write_rows(&mut self.obstacle_friction, &stage.obstacle_friction, lane, &one.obstacle_friction);
        let written = write_rows(&mut self.pair, &stage.pairs, lane, &one.pair);
        write_rows(&mut self.pair_friction, &stage.pair_friction, lane, &one.pair_friction);
        for ((joint, side), one) in StageStop::in_lane(&stage.stops, lane).zip(&one.pair[written..]) {
            Real::set_lane(&mut self.stop[joint][side], lane, *one);
        }
    }
}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::*;
    #[cfg(target_arch = "x86_64")]
    use crate::math::Wide8;
    use crate::math::{Kernel, Mask, Wide4};
    use crate::planar::{Newton, StageContact, StageJoint};
    use crate::rows::SavedStage;

    struct Solve<'a, T: Real>(&'a Stage<T>, &'a mut StageSolution<T>);

    impl<T: Real> Kernel for Solve<'_, T> {
        type Output = T;

        #[inline(always)]
        fn run(self) -> T {
            Newton::new(self.0.links.len()).solve(self.0, self.1, 1e-8, 200, T::Mask::of(|_| true)).iterations
        }
    }

    /// The same stage, faster in every lane; the solution at rest without impulses.
    fn fanned<T: Real>(one: &Stage) -> (Stage<T>, StageSolution<T>) {
        let many = |x: f64| T::splat(x);
        let faster = |x: f64| {
            let mut lanes = T::splat(x);
            (0..T::LANES).for_each(|lane| lanes.set_lane(lane, x * speed(lane)));
            lanes
        };
        let mut stage = Stage::with_capacity(one.links.len());
        stage.coefficient = many(one.coefficient);
        stage.links.extend(one.links.iter().map(|link| StageLink {
            heading: Heading { cos: many(link.heading.cos), sin: many(link.heading.sin) },
            reference: link.reference.map(faster),
            mass: many(link.mass),
            inertia: many(link.inertia),
            half_length: many(link.half_length),
            cg_offset: many(link.cg_offset),
            friction: link.friction.map(many),
        }));
        stage.joints.extend(one.joints.iter().map(|joint| StageJoint {
            drive: many(joint.drive),
            stiffness: many(joint.stiffness),
            limit: many(joint.limit),
            slack: many(joint.slack),
        }));
        stage.contacts.extend(one.contacts.iter().map(|contact| StageContact {
            link: contact.link,
            direction: contact.direction.map(many),
            offset: many(contact.offset),
        }));
        let mut solution = StageSolution::new(one.links.len());
        solution.contact.resize(one.contacts.len(), T::zero());
        (stage, solution)
    }

    fn speed(lane: usize) -> f64 {
        1.0 + 0.3 * lane as f64
    }

    /// Every golden stage in all lanes, and each lane separately: the same bits, whether Newton's method converges or
    /// not.
    fn lanes_agree<T: Real>() {
        for file in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden")).unwrap() {
            let path = file.unwrap().path();
            let saved: SavedStage<Stage> = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
            let (stage, mut solution) = fanned::<T>(&saved.stage);
            let iterations = T::run(Solve(&stage, &mut solution));
            for lane in 0..T::LANES {
                let (mut one, mut lonely) = (Stage::with_capacity(2), StageSolution::new(stage.links.len()));
                stage.copy_lane(lane, &mut one);
                lonely.contact.resize(one.contacts.len(), 0.0);
                let alone = f64::run(Solve(&one, &mut lonely));
                let mut copy = StageSolution::new(2);
                solution.copy_lane(&stage, lane, &mut copy);
                assert_eq!(copy, lonely, "{} lane {lane}", path.display());
                assert_eq!(iterations.lane(lane), alone);
                solution.set_lane(&stage, lane, &lonely);
            }
        }
    }

    #[test]
    fn golden_stages_are_solved_alike_in_every_width() {
        if Wide4::is_available() {
            lanes_agree::<Wide4>();
        }
        #[cfg(target_arch = "x86_64")]
        if Wide8::is_available() {
            lanes_agree::<Wide8>();
        }
    }
}
