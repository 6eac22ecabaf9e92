use nalgebra::Vector3;

use crate::math::Real;

use super::proximal::{DriveTerm, FrictionTerm};
use super::sweep::{Quadratic, Segment};
use super::{Heading, StageLink};

/// One link as [`super::Newton`] sees it: constants, laws and velocities in its own frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkTerm<T> {
    pub segment: Segment<T>,
    pub mass: T,
    pub inertia: T,
    pub reference: Vector3<T>,
    pub friction: FrictionTerm<T>,
    /// The joint to the link before; none for the first.
    pub drive: DriveTerm<T>,
    /// Inertia and laws but for drives, seen from the present twist, and the drive's stiffness.
    pub model: Quadratic<T>,
    pub drive_stiffness: T,
    /// Velocities before the present Newton step, the step, and where it leads.
    pub start: Vector3<T>,
    pub step: Vector3<T>,
    pub twist: Vector3<T>,
}

impl<T: Real> LinkTerm<T> {
    /// A link that moves with `twist`; its laws begin around their last impulses.
    #[inline(always)]
    pub fn new(
        link: &StageLink<T>,
        segment: Segment<T>,
        friction: FrictionTerm<T>,
        drive: DriveTerm<T>,
        twist: Vector3<T>,
    ) -> Self {
        Self {
            segment,
            mass: link.mass,
            inertia: link.inertia,
            reference: in_frame(&link.heading, &link.reference),
            friction,
            drive,
            model: Quadratic::zero(),
            drive_stiffness: T::zero(),
            start: twist,
            step: Vector3::new(T::zero(), T::zero(), T::zero()),
            twist,
        }
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
