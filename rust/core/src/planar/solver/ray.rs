//! The inner function along start + alpha step, for the line search.

use crate::laws::{Halves, Whole};
use crate::math::Real;
use crate::solver::{NearestKink, Ray, Search, add};

use super::link_term::linear;
use super::newton::Newton;

/// The inner function along the present step.
struct Step<'a, T: Real, H> {
    newton: &'a Newton<T>,
    halves: H,
    /// The quadratic part: [`Newton::inertia_along`].
    inertia: [T; 2],
}

impl<T: Real> Newton<T> {
    /// How much of the step to take in the given lanes, as [`step_length`](crate::solver::step_length).
    #[inline(always)]
    pub(super) fn step_length(&self, accuracy: T, lanes: T::Mask) -> (T, T::Mask) {
        match self.skin {
            None => T::run(Search { function: self.along_step(Whole), accuracy, lanes }),
            Some(skin) => T::run(Search { function: self.along_step(skin), accuracy, lanes }),
        }
    }

    /// Slope of the inner function at the start of the step \[J\].
    #[inline(always)]
    pub(super) fn slope_at_start(&self) -> T {
        T::call(
            #[inline(always)]
            move || match self.skin {
                None => self.along_step(Whole)().derivatives(T::zero()).0,
                Some(skin) => self.along_step(skin)().derivatives(T::zero()).0,
            },
        )
    }

    #[inline(always)]
    fn along_step<'a, H: Halves + 'a>(&'a self, halves: H) -> impl FnOnce() -> Step<'a, T, H> {
        #[inline(always)]
        move || Step { newton: self, halves, inertia: self.inertia_along() }
    }

    /// Slope of |u - u_ref|_M^2 / 2 at alpha = 0, and its constant rise.
    #[inline(always)]
    fn inertia_along(&self) -> [T; 2] {
        let (mut slope, mut rise) = (T::zero(), T::zero());
        for link in &self.links {
            let (u, du, reference) = (&link.start, &link.step, &link.reference);
            let (px, py, pz) = (link.mass * du.x, link.mass * du.y, link.inertia * du.z);
            slope += px * (u.x - reference.x) + py * (u.y - reference.y) + pz * (u.z - reference.z);
            rise += px * du.x + py * du.y + pz * du.z;
        }
        [slope, rise]
    }
}

impl<T: Real, H: Halves> Ray<T> for Step<'_, T, H> {
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let Self { newton, halves, inertia } = self;
        let mut sum = (inertia[0] + alpha * inertia[1], inertia[1]);
        let (mut omega, mut change) = (T::zero(), T::zero());
        for (i, link) in newton.links.iter().enumerate() {
            add(&mut sum, link.friction.along(*halves, &linear(&link.start), &linear(&link.step), alpha));
            if let Some(spin) = newton.spins.get(i) {
                add(
                    &mut sum,
                    spin.along(
                        #[inline(always)]
                        |_| (T::zero(), T::zero()),
                        link.start.z,
                        link.step.z,
                        alpha,
                    ),
                );
            }
            let (rate, turn) = (link.start.z - omega, link.step.z - change);
            let motor = i.checked_sub(1).and_then(|joint| newton.motors.get(joint));
            add(&mut sum, link.actuator.along_with(motor, rate, turn, alpha));
            if i > 0
                && let Some(stop) = newton.stops.get(i - 1)
            {
                add(&mut sum, stop.along(rate, turn, alpha));
            }
            (omega, change) = (link.start.z, link.step.z);
        }
        for (surface, link) in newton.surfaces.iter().zip(newton.pushed()) {
            add(&mut sum, surface.along([&link.start, &link.step], alpha));
        }
        for contact in &newton.contacts {
            let link = &newton.links[contact.row.link];
            add(&mut sum, contact.along(&link.start, &link.step, alpha));
        }
        for term in &newton.obstacle_friction.terms {
            let link = &newton.links[term.row.link];
            add(&mut sum, term.along(&link.start, &link.step, alpha));
        }
        add(&mut sum, newton.self_contacts.along(&newton.links, alpha));
        sum
    }

    #[inline(always)]
    fn visit_kinks(&self, nearest: &mut NearestKink<T>) {
        for link in &self.newton.links {
            nearest.consider(link.friction.kink(self.halves, &linear(&link.start), &linear(&link.step)));
        }
        for contact in &self.newton.contacts {
            let link = &self.newton.links[contact.row.link];
            nearest.consider(contact.kink(&link.start, &link.step));
        }
        for term in &self.newton.obstacle_friction.terms {
            let link = &self.newton.links[term.row.link];
            nearest.consider(term.kink(&link.start, &link.step));
        }
        for (motor, links) in self.newton.motors.iter().zip(self.newton.links.windows(2)) {
            let [start, step] = [links[1].start.z - links[0].start.z, links[1].step.z - links[0].step.z];
            nearest.consider(motor.kink(start, step));
        }
        for (surface, link) in self.newton.surfaces.iter().zip(self.newton.pushed()) {
            nearest.consider(surface.kink([&link.start, &link.step]));
        }
        for (spin, link) in self.newton.spins.iter().zip(&self.newton.links) {
            nearest.consider(spin.kink(link.start.z, link.step.z));
        }
    }
}
