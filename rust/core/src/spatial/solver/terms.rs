//! The set-valued laws of a stage in proximal form, around given multipliers.
//!
//! P = prox_C(P_centre - r gamma) is the gradient of a smooth convex function of the velocity gamma; its derivative is
//! a generalised Hessian of rank one or two. Around the multiplier zero it is the law with a compliance 1/r; the same r
//! for all contacts selects (T 4.78 != D43) the shortest of all impulses that move the robot alike; for stops of joints
//! those that are closest to what their actuators give.

use crate::laws::HalfLine;
use crate::math::{Mask, Real};
use crate::solver::ActuatorTerm;
use crate::stepping::StageStop;

use super::ray_laws::RayLaws;
use super::sweep::ActuatorModel;
use crate::spatial::StageContact;
use crate::spatial::spatial_vector::Wrench;

/// Unilateral contact: P = max(centre - r (gamma + offset), 0).
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactTerm<T: Real> {
    offset: T,
    penalty: T,
    centre: T,
    /// Whether the contact counts as closed whatever its velocity.
    held: T::Mask,
    pub value: T,
}

/// Both stops of one joint axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct StopTerm<T: Real> {
    stop: StageStop<T>,
    contacts: [ContactTerm<T>; 2],
}

impl<T: Real> StopTerm<T> {
    /// The multiplier of a stop that pressed is what the actuator of its axis gives where the stop is just met: from zero it
    /// would move by much at the end, and friction radii would have to settle again.
    #[inline(always)]
    pub fn new(stop: &StageStop<T>, penalty: T, impulse: &[T; 2], actuator: &ActuatorTerm<T>) -> Self {
        let contact = |side: usize| ContactTerm::new(stop.offset[side], penalty, impulse[side]);
        let mut contacts = [contact(0), contact(1)];
        for (side, contact) in contacts.iter_mut().enumerate() {
            let sign = T::splat(StageStop::<T>::SIDES[side]);
            let (moment, _) = actuator.at(sign * contact.offset / stop.lever);
            let pressing = (sign * moment / stop.lever).max(T::zero());
            contact.centre = T::select(contact.held, pressing, T::zero());
        }
        Self { stop: *stop, contacts }
    }

    /// Moves to the rate of the axis, and multipliers to the impulses in the lanes `recentred`; adds moment and stiffness
    /// to those of the drive.
    #[inline(always)]
    pub fn add_to(&mut self, axis: &mut ActuatorModel<T>, rate: T, recentred: T::Mask) {
        let velocity = self.stop.lever * rate;
        for (contact, gamma) in self.contacts.iter_mut().zip([-velocity, velocity]) {
            let stiffness = contact.evaluate(gamma);
            contact.recentre_here(gamma, stiffness, recentred);
            axis.stiffness += self.stop.lever * self.stop.lever * stiffness;
        }
        axis.impulse += self.stop.moment(&self.impulse());
    }

    /// Adds both laws at rate + alpha change.
    #[inline(always)]
    pub fn add_along(&self, rate: T, change: T, ray: &mut RayLaws<T>) {
        let (velocity, change) = (self.stop.lever * rate, self.stop.lever * change);
        let [upper, lower] = &self.contacts;
        upper.add_along(-velocity, -change, ray);
        lower.add_along(velocity, change, ray);
    }

    /// Impulses of both \[N s\].
    #[inline(always)]
    pub fn impulse(&self) -> [T; 2] {
        [self.contacts[0].value, self.contacts[1].value]
    }

    #[inline(always)]
    pub fn squared_error(&self) -> T {
        self.contacts[0].squared_error().max(self.contacts[1].squared_error())
    }

    #[inline(always)]
    pub fn release(&mut self) {
        self.contacts.iter_mut().for_each(ContactTerm::release);
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        for contact in &mut self.contacts {
            contact.recentre(lanes);
        }
    }
}

impl<T: Real> ContactTerm<T> {
    #[inline(always)]
    pub fn new(offset: T, penalty: T, impulse: T) -> Self {
        Self { offset, penalty, centre: T::zero(), held: T::zero().lt(impulse), value: T::zero() }
    }

    /// Moves to the velocity gamma; returns the present stiffness.
    #[inline(always)]
    pub fn evaluate(&mut self, gamma: T) -> T {
        let wanted = self.centre - self.penalty * (gamma + self.offset);
        let (value, stiffness) = HalfLine.evaluate(wanted, self.penalty, HalfLine.is_closed(wanted) | self.held);
        self.value = value;
        stiffness
    }

    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// Adds the law at gamma + alpha rate.
    #[inline(always)]
    pub fn add_along(&self, gamma: T, rate: T, ray: &mut RayLaws<T>) {
        ray.add_contact(self.centre - self.penalty * (gamma + self.offset), rate, self.penalty);
    }

    /// How far the centre is from the impulse, squared: over the squared penalty it is the velocity by which the law is
    /// violated.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let x = self.value - self.centre;
        x * x
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = T::select(lanes, self.value, self.centre);
    }

    /// The impulse becomes the multiplier in the given lanes, and the impulse what it will then be at the velocity gamma
    /// of the last evaluation, on the branch of `stiffness`.
    #[inline(always)]
    pub fn recentre_here(&mut self, gamma: T, stiffness: T, lanes: T::Mask) {
        self.recentre(lanes);
        let value = (self.value - stiffness * (gamma + self.offset)).max(T::zero());
        self.value = T::select(lanes, value, self.value);
    }
}

/// Contact with an obstacle together with its direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleTerm<T: Real> {
    pub link: usize,
    pub direction: Wrench<T>,
    pub normal: ContactTerm<T>,
}

impl<T: Real> ObstacleTerm<T> {
    #[inline(always)]
    pub fn new(contact: &StageContact<T>, penalty: T, impulse: T) -> Self {
        Self {
            link: contact.link,
            direction: contact.direction,
            normal: ContactTerm::new(contact.offset, penalty, impulse),
        }
    }
}
