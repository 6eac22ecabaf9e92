//! Copies of one robot's stage from the lanes of many, and of its solution back to them.
//!
//! In the copy the stops of joints are contacts between neighbouring links: the fallback needs one kind of row less.

use nalgebra::{Vector2, Vector3};

use crate::math::Real;
use crate::stepping::StageStop;

use super::{Heading, Stage, StageContact, StageContactFriction, StageJoint, StageLink, StagePair, StageSolution};

impl<T: Real> Stage<T> {
    /// The stop of a lane's joint as a contact between the links.
    fn stop_as_pair(&self, lane: usize, joint: usize, side: usize) -> StagePair {
        let stop = &self.stops[joint];
        let turn = StageStop::<T>::SIDES[side] * stop.lever.lane(lane);
        let direction = [Vector3::new(0.0, 0.0, turn), Vector3::new(0.0, 0.0, -turn)];
        StagePair { links: [joint, joint + 1], direction, offset: stop.offset[side].lane(lane) }
    }

    /// Copies the stage of `lane` into `one`, with the contacts that the lane has.
    pub fn copy_lane(&self, lane: usize, one: &mut Stage) {
        let vector = |v: &Vector3<T>| Vector3::new(v.x.lane(lane), v.y.lane(lane), v.z.lane(lane));
        one.coefficient = self.coefficient.lane(lane);
        one.links.clear();
        one.links.extend(self.links.iter().map(|link| StageLink {
            heading: Heading { cos: link.heading.cos.lane(lane), sin: link.heading.sin.lane(lane) },
            reference: vector(&link.reference),
            mass: link.mass.lane(lane),
            inertia: link.inertia.lane(lane),
            half_length: link.half_length.lane(lane),
            friction: Vector2::new(link.friction.x.lane(lane), link.friction.y.lane(lane)),
        }));
        one.joints.clear();
        one.joints.extend(self.joints.iter().map(|joint| StageJoint {
            drive: joint.drive.lane(lane),
            stiffness: joint.stiffness.lane(lane),
            limit: joint.limit.lane(lane),
            slack: joint.slack.lane(lane),
        }));
        one.contacts.clear();
        one.contacts.extend(self.contacts.iter().filter(|contact| contact.is_in(lane)).map(|contact| StageContact {
            link: contact.link,
            direction: vector(&contact.direction),
            offset: contact.offset.lane(lane),
        }));
        one.contact_friction.clear();
        let rows = self.contact_friction.iter().filter(|row| row.is_in(lane));
        one.contact_friction.extend(rows.map(|row| StageContactFriction {
            contact: self.contacts[..row.contact].iter().filter(|contact| contact.is_in(lane)).count(),
            link: row.link,
            direction: vector(&row.direction),
            coefficient: row.coefficient.lane(lane),
            bound: row.bound.lane(lane),
        }));
        one.pairs.clear();
        one.pairs.extend(self.pairs.iter().filter(|pair| pair.is_in(lane)).map(|pair| StagePair {
            links: pair.links,
            direction: pair.direction.each_ref().map(vector),
            offset: pair.offset.lane(lane),
        }));
        one.stops.clear();
        one.pairs
            .extend(StageStop::in_lane(&self.stops, lane).map(|(joint, side)| self.stop_as_pair(lane, joint, side)));
    }
}

impl<T: Real> StageContact<T> {
    /// Whether the lane has this contact: a force has a direction.
    pub fn is_in(&self, lane: usize) -> bool {
        has_direction(&self.direction, lane)
    }
}

impl<T: Real> StageContactFriction<T> {
    /// Whether the lane has this friction.
    pub fn is_in(&self, lane: usize) -> bool {
        has_direction(&self.direction, lane)
    }
}

impl<T: Real> StagePair<T> {
    /// Whether the lane has this contact.
    pub fn is_in(&self, lane: usize) -> bool {
        has_direction(&self.direction[0], lane)
    }
}

fn has_direction<T: Real>(w: &Vector3<T>, lane: usize) -> bool {
    w.x.lane(lane) != 0.0 || w.y.lane(lane) != 0.0 || w.z.lane(lane) != 0.0
}

impl<T: Real> StageSolution<T> {
    /// Copies the solution of `lane` into `one`, with the impulses of those contacts of `stage` that the lane has.
    pub fn copy_lane(&self, stage: &Stage<T>, lane: usize, one: &mut StageSolution) {
        let vector = |v: &Vector3<T>| Vector3::new(v.x.lane(lane), v.y.lane(lane), v.z.lane(lane));
        one.twist.clear();
        one.twist.extend(self.twist.iter().map(vector));
        one.friction.clear();
        one.friction.extend(self.friction.iter().map(|p| Vector2::new(p.x.lane(lane), p.y.lane(lane))));
        one.actuator.clear();
        one.actuator.extend(self.actuator.iter().map(|impulse| impulse.lane(lane)));
        one.contact.clear();
        let impulses = self.contact.iter().zip(&stage.contacts).filter(|(_, contact)| contact.is_in(lane));
        one.contact.extend(impulses.map(|(impulse, _)| impulse.lane(lane)));
        one.contact_friction.clear();
        let impulses = self.contact_friction.iter().zip(&stage.contact_friction).filter(|(_, row)| row.is_in(lane));
        one.contact_friction.extend(impulses.map(|(impulse, _)| impulse.lane(lane)));
        one.pair.clear();
        let impulses = self.pair.iter().zip(&stage.pairs).filter(|(_, pair)| pair.is_in(lane));
        one.pair.extend(impulses.map(|(impulse, _)| impulse.lane(lane)));
        one.stop.clear();
        one.pair.extend(StageStop::in_lane(&stage.stops, lane).map(|(joint, side)| self.stop[joint][side].lane(lane)));
    }

    /// Copies `one` to the solution of `lane`; both are of the same `stage`.
    pub fn set_lane(&mut self, stage: &Stage<T>, lane: usize, one: &StageSolution) {
        for (many, one) in self.twist.iter_mut().zip(&one.twist) {
            many.x.set_lane(lane, one.x);
            many.y.set_lane(lane, one.y);
            many.z.set_lane(lane, one.z);
        }
        for (many, one) in self.friction.iter_mut().zip(&one.friction) {
            many.x.set_lane(lane, one.x);
            many.y.set_lane(lane, one.y);
        }
        for (many, one) in self.actuator.iter_mut().zip(&one.actuator) {
            many.set_lane(lane, *one);
        }
        let impulses = self.contact.iter_mut().zip(&stage.contacts).filter(|(_, contact)| contact.is_in(lane));
        for ((many, _), one) in impulses.zip(&one.contact) {
            many.set_lane(lane, *one);
        }
        let rows = stage.contact_friction.iter();
        let impulses = self.contact_friction.iter_mut().zip(rows).filter(|(_, row)| row.is_in(lane));
        for ((many, _), one) in impulses.zip(&one.contact_friction) {
            many.set_lane(lane, *one);
        }
        let mut impulses = one.pair.iter();
        for (many, _) in self.pair.iter_mut().zip(&stage.pairs).filter(|(_, pair)| pair.is_in(lane)) {
            impulses.next().into_iter().for_each(|one| many.set_lane(lane, *one));
        }
        for ((joint, side), one) in StageStop::in_lane(&stage.stops, lane).zip(impulses) {
            self.stop[joint][side].set_lane(lane, *one);
        }
    }
}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::*;
    #[cfg(target_arch = "x86_64")]
    use crate::math::Wide8;
    use crate::math::{Kernel, Mask, Wide4};
    use crate::planar::{Newton, Problem};

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
            let problem: Problem = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
            let (stage, mut solution) = fanned::<T>(&problem.stage().unwrap());
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
