//! Derivatives of the convex function along start + alpha step, for the line search.

use crate::laws::{Halves, Whole};
use crate::math::Real;
use crate::solver::{NearestKink, Ray, Search, add, step_length};

use super::newton::Newton;

/// The convex function along the present step.
struct Step<'a, T: Real, H> {
    newton: &'a Newton<T>,
    halves: H,
    /// The quadratic part: [`Newton::inertia_along`].
    inertia: [T; 2],
}

impl<T: Real> Newton<T> {
    /// How much of the step to take in the given lanes, and in which of them less than all of it, as [`step_length`].
    #[inline(always)]
    pub(super) fn step_length(&self, accuracy: T, lanes: T::Mask) -> (T, T::Mask) {
        match self.laws.skin {
            None => step_length(&self.along_step(Whole)(), accuracy, lanes),
            Some(skin) => T::run(Search { function: self.along_step(skin), accuracy, lanes }),
        }
    }

    #[inline(always)]
    fn along_step<'a, H: Halves + 'a>(&'a self, halves: H) -> impl FnOnce() -> Step<'a, T, H> {
        #[inline(always)]
        move || Step { newton: self, halves, inertia: self.inertia_along() }
    }

    /// Slope of |x - M^-1 p|_M^2 / 2 at alpha = 0, and its constant rise.
    #[inline(always)]
    fn inertia_along(&self) -> [T; 2] {
        let (mut slope, mut rise) = (T::zero(), T::zero());
        for link in &self.links {
            let change = link.momentum_of(&link.step);
            slope += change.dot(&link.twist) - link.momentum.dot(&link.step);
            rise += change.dot(&link.step);
        }
        [slope, rise]
    }
}

impl<T: Real, H: Halves> Ray<T> for Step<'_, T, H> {
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let Self { newton, halves, inertia } = self;
        let laws = &newton.laws;
        let mut sum = (inertia[0] + alpha * inertia[1], inertia[1]);
        for (i, link) in newton.chain().iter().enumerate() {
            add(&mut sum, link.ground_along(*halves, laws, alpha));
            for axis in 0..2 {
                let (actuator, rate, change) = (&link.actuators[axis], link.rates[axis], link.step_rates[axis]);
                let motor = (2 * i + axis).checked_sub(2).and_then(|axis| newton.motors.get(axis));
                add(&mut sum, actuator.along_with(motor, rate, change, alpha));
                if i > 0
                    && let Some(stop) = newton.stops.get(2 * (i - 1) + axis)
                {
                    add(&mut sum, stop.along(link.rates[axis], link.step_rates[axis], alpha));
                }
            }
        }
        for contact in &newton.contacts {
            let link = &newton.links[contact.link];
            let contact =
                contact.normal.along(contact.direction.dot(&link.twist), contact.direction.dot(&link.step), alpha);
            add(&mut sum, contact);
        }
        add(&mut sum, newton.obstacle_friction.along(&newton.contacts, &newton.links, alpha));
        add(&mut sum, newton.self_contacts.along(&newton.links, alpha));
        for (link, surface) in newton.pushed() {
            add(&mut sum, surface.along([&link.twist.in_plane(), &link.step.in_plane()], alpha));
        }
        sum
    }

    #[inline(always)]
    fn visit_kinks(&self, nearest: &mut NearestKink<T>) {
        for link in self.newton.chain() {
            for kink in link.kinks(self.halves) {
                nearest.consider(kink);
            }
        }
        for (axis, motor) in self.newton.motors.iter().enumerate() {
            let link = &self.newton.links[axis / 2 + 1];
            nearest.consider(motor.kink(link.rates[axis % 2], link.step_rates[axis % 2]));
        }
        for (link, surface) in self.newton.pushed() {
            nearest.consider(surface.kink([&link.twist.in_plane(), &link.step.in_plane()]));
        }
        self.newton
            .obstacle_friction
            .visit_kinks(&self.newton.contacts, &self.newton.links, |kink| nearest.consider(kink));
    }
}
