//! The convex function along start + alpha step, for the line search.

use crate::laws::{Halves, Whole};
use crate::math::Real;
use crate::solver::{NearestKink, Ray, add, step_length};

use super::newton::Newton;

/// The convex function along the present step; its ground laws and contacts are [`Newton::ray`].
struct Step<'a, T: Real> {
    newton: &'a Newton<T>,
    /// The quadratic part: [`Newton::inertia_along`].
    inertia: [T; 2],
}

impl<T: Real> Newton<T> {
    /// How much of the step to take in the given lanes, and in which of them less than all of it, as [`step_length`].
    #[inline(always)]
    pub(super) fn step_length(&mut self, accuracy: T, lanes: T::Mask) -> (T, T::Mask) {
        match self.laws.skin {
            None => self.search(Whole, accuracy, lanes),
            // Apart from the code of other stages.
            Some(skin) => T::call(
                #[inline(always)]
                || self.search(skin, accuracy, lanes),
            ),
        }
    }

    #[inline(always)]
    fn search(&mut self, halves: impl Halves, accuracy: T, lanes: T::Mask) -> (T, T::Mask) {
        self.collect(halves);
        let step = Step { newton: self, inertia: self.inertia_along() };
        step_length(&step, accuracy, lanes)
    }

    /// Collects the laws along the present step.
    #[inline(always)]
    fn collect(&mut self, halves: impl Halves) {
        let Self { ray, links, stops, contacts, .. } = self;
        ray.clear();
        let chain = links.len() - self.surfaces.len();
        for link in &links[..chain] {
            link.add_ground_along(halves, &self.laws, ray);
        }
        for (axis, stop) in stops.iter().enumerate() {
            let link = &links[axis / 2 + 1];
            stop.add_along(link.rates[axis % 2], link.step_rates[axis % 2], ray);
        }
        for contact in contacts.iter() {
            let link = &links[contact.link];
            contact.normal.add_along(contact.direction.dot(&link.twist), contact.direction.dot(&link.step), ray);
        }
        self.obstacle_friction.add_along(contacts, links, ray);
        self.self_contacts.add_along(links, ray);
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

impl<T: Real> Ray<T> for Step<'_, T> {
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let Self { newton, inertia } = self;
        let mut sum = newton.ray.derivatives(alpha);
        add(&mut sum, (inertia[0] + alpha * inertia[1], inertia[1]));
        for (i, link) in newton.chain().iter().enumerate().skip(1) {
            for axis in 0..2 {
                let (actuator, motor) = (&link.actuators[axis], newton.motors.get(2 * (i - 1) + axis));
                add(&mut sum, actuator.along_with(motor, link.rates[axis], link.step_rates[axis], alpha));
            }
        }
        for (link, surface) in newton.pushed() {
            add(&mut sum, surface.along([&link.twist.in_plane(), &link.step.in_plane()], alpha));
        }
        sum
    }

    #[inline(always)]
    fn visit_kinks(&self, nearest: &mut NearestKink<T>) {
        self.newton.ray.visit_kinks(nearest);
        for (axis, motor) in self.newton.motors.iter().enumerate() {
            let link = &self.newton.links[axis / 2 + 1];
            nearest.consider(motor.kink(link.rates[axis % 2], link.step_rates[axis % 2]));
        }
        for (link, surface) in self.newton.pushed() {
            nearest.consider(surface.kink([&link.twist.in_plane(), &link.step.in_plane()]));
        }
    }
}
