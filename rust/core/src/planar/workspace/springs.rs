//! Springs and dampers that hold discs where they start.

use nalgebra::Vector2;

use crate::math::{Real, laned};
use crate::obstacles::{Movable, Spring};

use super::Workspace;

/// What holds a disc; without stiffness and damping nothing does.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageSpring<T> {
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
}

impl StageSpring<f64> {
    pub const NONE: Self = Self { stiffness: 0.0, damping: 0.0, home: Vector2::new(0.0, 0.0) };

    pub fn of(movable: &Movable) -> Self {
        let of_spring = |spring: Spring| (spring.stiffness, spring.damping);
        let (stiffness, damping) = movable.spring.map_or((0.0, 0.0), of_spring);
        Self { stiffness, damping, home: movable.start.into() }
    }
}

impl<T: Real> Workspace<T> {
    /// Adds springs to the discs of the stage.
    ///
    /// At the end of a stage, where a disc is at q_B + c u, spring and damper give it the impulse -c (k (q_B + c u - q_0) +
    /// d u). What is linear in u acts like c (c k + d) of mass, and the rest is part of the reference: the disc stays a
    /// body with one mass for the solver, the fallback and the certificate.
    #[inline(always)]
    pub(super) fn add_springs(&mut self) {
        let c = self.stage.coefficient;
        let first = self.stage.links.len() - self.springs.len();
        let bases = &self.motion.base[first..];
        for ((link, spring), base) in self.stage.links[first..].iter_mut().zip(&self.springs).zip(bases) {
            let (pull, drag) = (c * spring.stiffness, c * (c * spring.stiffness + spring.damping));
            let mass = link.mass + drag;
            // In this form a disc without a spring keeps its reference bit by bit.
            let change = |u: T, from: T, home: T| (pull * (from - home) + drag * u) / mass;
            let u = link.reference;
            link.reference.x = u.x - change(u.x, base.x, spring.home.x);
            link.reference.y = u.y - change(u.y, base.y, spring.home.y);
            link.mass = mass;
        }
    }

    /// Work of the dampers over the stage \[J\].
    #[inline(always)]
    pub(super) fn work_of_dampers(&self) -> T {
        let first = self.stage.links.len() - self.springs.len();
        let mut work = T::zero();
        for (spring, u) in self.springs.iter().zip(&self.solution.twist[first..]) {
            work -= self.stage.coefficient * spring.damping * (u.x * u.x + u.y * u.y);
        }
        work
    }
}
