//! Springs and dampers that hold discs where they start.

use nalgebra::{Vector2, Vector3};

use crate::math::{Real, laned};
use crate::obstacles::{Movable, Spring};

/// What holds a disc; without stiffness and damping nothing does.
#[derive(Debug, Clone, Copy)]
pub struct StageSpring<T> {
    stiffness: T,
    damping: T,
    /// Where the spring is slack \[m\].
    home: Vector2<T>,
}

laned! {
    StageSpring { stiffness, damping, home };
}

impl<T: Real> StageSpring<T> {
    pub fn none() -> Self {
        let zero = T::zero();
        Self { stiffness: zero, damping: zero, home: Vector2::new(zero, zero) }
    }

    /// Mass and reference velocity in a stage of coefficient `c` of a disc that is at `base` before it.
    ///
    /// At the end of a stage, where a disc is at q_B + c u, spring and damper give it the impulse -c (k (q_B + c u - q_0) +
    /// d u). What is linear in u acts like c (c k + d) of mass, and the rest is part of the reference: the disc stays a
    /// body with one mass for the solver, the fallback and the certificate.
    #[inline(always)]
    pub fn hold(&self, c: T, base: &Vector3<T>, mass: T, reference: &Vector3<T>) -> (T, Vector3<T>) {
        let (pull, drag) = (c * self.stiffness, c * (c * self.stiffness + self.damping));
        let mass = mass + drag;
        // In this form a disc without a spring keeps its reference bit by bit.
        let change = |u: T, from: T, home: T| (pull * (from - home) + drag * u) / mass;
        let (u, home) = (reference, &self.home);
        (mass, Vector3::new(u.x - change(u.x, base.x, home.x), u.y - change(u.y, base.y, home.y), u.z))
    }

    /// Work of the damper over a stage of coefficient `c` with this end velocity \[J\].
    #[inline(always)]
    pub fn work_of_damper(&self, c: T, u: &Vector3<T>) -> T {
        -(c * self.damping * (u.x * u.x + u.y * u.y))
    }
}

impl StageSpring<f64> {
    pub fn of(movable: &Movable) -> Self {
        let of_spring = |spring: Spring| (spring.stiffness, spring.damping);
        let (stiffness, damping) = movable.spring.map_or((0.0, 0.0), of_spring);
        Self { stiffness, damping, home: movable.start.into() }
    }
}
