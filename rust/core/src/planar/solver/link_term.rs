use nalgebra::{Vector2, Vector3};

use crate::math::{Real, add_scaled, select_into};
use crate::planar::{Heading, StageLink};
use crate::solver::{ActuatorTerm, FrictionTerm};

use super::sweep::{Quadratic, Segment};

/// One link in the solver: constants, laws and velocities in its own frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkTerm<T> {
    pub segment: Segment<T>,
    pub mass: T,
    pub inertia: T,
    pub reference: Vector3<T>,
    pub friction: FrictionTerm<T>,
    /// Actuator of the joint to the link before; none for the first.
    pub actuator: ActuatorTerm<T>,
    /// Inertia and laws of the link at the present twist; moment of that joint, with its stops, and its stiffness.
    pub model: Quadratic<T>,
    pub joint_moment: T,
    pub joint_stiffness: T,
    /// Velocities before the present Newton step, the step, and where it leads.
    pub start: Vector3<T>,
    pub step: Vector3<T>,
    pub twist: Vector3<T>,
}

impl<T: Real> LinkTerm<T> {
    /// Room for a link.
    pub fn vacant() -> Self {
        let zero = T::zero();
        let rest = Vector3::new(zero, zero, zero);
        let ahead = Heading { cos: T::splat(1.0), sin: zero };
        Self {
            segment: Segment::new(&ahead, &ahead, [zero; 2]),
            mass: zero,
            inertia: zero,
            reference: rest,
            friction: FrictionTerm::new(rest.xy(), &rest.xy(), zero),
            actuator: ActuatorTerm::none(),
            model: Quadratic::zero(),
            joint_moment: zero,
            joint_stiffness: zero,
            start: rest,
            step: rest,
            twist: rest,
        }
    }

    /// Takes in a link with its laws, whose multipliers are the last impulses, and the joint to the link before, which
    /// has the heading `before`. Step, model and stiffness of the last stage stay: only the first evaluation reads them,
    /// for a `StepEnd` that nobody uses.
    #[inline(always)]
    pub fn begin(
        &mut self,
        link: &StageLink<T>,
        before: &Heading<T>,
        friction: FrictionTerm<T>,
        actuator: ActuatorTerm<T>,
    ) {
        self.segment.place(&link.heading, before, link.arms());
        (self.mass, self.inertia) = (link.mass, link.inertia);
        self.reference = in_frame(&link.heading, &link.reference);
        (self.friction, self.actuator) = (friction, actuator);
    }

    /// The same of an obstacle that can be pushed, which has no joint and another law of friction.
    #[inline(always)]
    pub fn begin_free(&mut self, link: &StageLink<T>) {
        let zero = Vector2::new(T::zero(), T::zero());
        let friction = FrictionTerm::new(zero, &zero, T::zero());
        self.begin(link, &link.heading, friction, ActuatorTerm::none());
        self.segment.place(&link.heading, &link.heading, [T::zero(); 2]);
        (self.joint_moment, self.joint_stiffness) = (T::zero(), T::zero());
    }

    /// Takes the Newton step in full in the given lanes.
    #[inline(always)]
    pub fn advance(&mut self, lanes: T::Mask) {
        self.start = self.twist;
        let full = add_scaled(&self.start, &self.step, T::splat(1.0));
        select_into(&mut self.twist, lanes, &full);
    }

    /// |u - u_ref|_M^2 / 2 at the present twist.
    #[inline(always)]
    pub fn inertia_model(&self) -> Quadratic<T> {
        let (u, reference) = (&self.twist, &self.reference);
        Quadratic {
            xx: self.mass,
            yy: self.mass,
            ww: self.inertia,
            gx: self.mass * (u.x - reference.x),
            gy: self.mass * (u.y - reference.y),
            gw: self.inertia * (u.z - reference.z),
            ..Quadratic::zero()
        }
    }
}

/// A twist in the frame of a link.
#[inline(always)]
pub(super) fn in_frame<T: Real>(heading: &Heading<T>, twist: &Vector3<T>) -> Vector3<T> {
    let velocity = heading.to_link(twist.xy());
    Vector3::new(velocity.x, velocity.y, twist.z)
}

/// The linear part of a twist.
#[inline(always)]
pub(super) fn linear<T: Real>(twist: &Vector3<T>) -> Vector2<T> {
    Vector2::new(twist.x, twist.y)
}
