//! One robot's stage taken out of the lanes of many, and its solution put back.

use nalgebra::{Vector2, Vector3};

use crate::math::Real;

use super::{Heading, Stage, StageContact, StageJoint, StageLink, StageSolution};

impl<T: Real> Stage<T> {
    /// Copies the stage of `lane` into `one`; contacts that the lane does not have stay in, open.
    pub fn copy_lane(&self, lane: usize, one: &mut Stage) {
        let vector = |v: &Vector3<T>| Vector3::new(v.x.lane(lane), v.y.lane(lane), v.z.lane(lane));
        one.coefficient = self.coefficient;
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
        }));
        one.contacts.clear();
        one.contacts.extend(self.contacts.iter().map(|contact| StageContact {
            link: contact.link,
            direction: vector(&contact.direction),
            offset: contact.offset.lane(lane),
        }));
    }
}

impl<T: Real> StageSolution<T> {
    /// Copies the solution of `lane` into `one`.
    pub fn copy_lane(&self, lane: usize, one: &mut StageSolution) {
        let vector = |v: &Vector3<T>| Vector3::new(v.x.lane(lane), v.y.lane(lane), v.z.lane(lane));
        one.twist.clear();
        one.twist.extend(self.twist.iter().map(vector));
        one.friction.clear();
        one.friction.extend(self.friction.iter().map(|p| Vector2::new(p.x.lane(lane), p.y.lane(lane))));
        one.drive.clear();
        one.drive.extend(self.drive.iter().map(|drive| drive.lane(lane)));
        one.contact.clear();
        one.contact.extend(self.contact.iter().map(|impulse| impulse.lane(lane)));
    }

    /// Takes the solution of `lane` over from `one`; both are of the same stage.
    pub fn set_lane(&mut self, lane: usize, one: &StageSolution) {
        for (many, one) in self.twist.iter_mut().zip(&one.twist) {
            many.x.set_lane(lane, one.x);
            many.y.set_lane(lane, one.y);
            many.z.set_lane(lane, one.z);
        }
        for (many, one) in self.friction.iter_mut().zip(&one.friction) {
            many.x.set_lane(lane, one.x);
            many.y.set_lane(lane, one.y);
        }
        for (many, one) in self.drive.iter_mut().zip(&one.drive) {
            many.set_lane(lane, *one);
        }
        for (many, one) in self.contact.iter_mut().zip(&one.contact) {
            many.set_lane(lane, *one);
        }
    }
}
