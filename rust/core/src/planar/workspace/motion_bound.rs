//! Bounds on how far any point of a robot moves, which decide what contacts a stage may have.

use nalgebra::Vector3;

use crate::math::{Mask, Real};

use crate::planar::contact_detection::MARGIN;

use super::{LinkConstants, Workspace};

/// How far away pegs may matter to a stage.
#[derive(Debug, Clone, Copy)]
pub struct MotionBound<T> {
    /// Largest speed of any point of the robot, at the start of the stage or expected at its end \[m/s\].
    pub fastest: T,
    /// Largest displacement of any point of the robot from the start of the step to the predicted end \[m\].
    pub displacement: T,
}

impl<T: Real> MotionBound<T> {
    pub fn lane(&self, lane: usize) -> MotionBound<f64> {
        MotionBound { fastest: self.fastest.lane(lane), displacement: self.displacement.lane(lane) }
    }

    /// Gap below which a pair becomes a contact of a stage of coefficient `c`, if `moving` of its two bodies are links
    /// \[m\].
    #[inline(always)]
    pub fn contact_margin(&self, c: T, moving: f64, smallest_radius: T) -> T {
        // In this order the velocities of a diverged robot, which may be NaN, leave the least margin.
        let margin = (T::splat(2.0) * c * self.fastest).max(T::splat(MARGIN));
        // Fast enough to pass each other within the step.
        let is_fast = smallest_radius.lt(self.displacement);
        T::select(is_fast, margin.max(T::splat(moving) * self.displacement), margin)
    }
}

impl<T: Real> LinkConstants<T> {
    /// Bound on how far a point of the link moves between two poses, or on how much faster it is at one of
    /// two twists.
    #[inline(always)]
    pub fn farthest(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        let (x, y) = (to.x - from.x, to.y - from.y);
        (x * x + y * y).sqrt() + self.reach * (to.z - from.z).abs()
    }

    /// A coarser bound that takes no root.
    #[inline(always)]
    fn farther(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        (to.x - from.x).abs() + (to.y - from.y).abs() + self.reach * (to.z - from.z).abs()
    }
}

impl<T: Real> Workspace<T> {
    #[inline(always)]
    pub(super) fn measure_deviation(&mut self) {
        let fastest = self.farthest::<true>(&self.solution.twist, &self.motion.guess);
        self.result.deviation = fastest * self.stage.coefficient;
    }

    /// Bound on how far a point of the robot moves between poses, or on how much faster it is at one of two twists.
    #[inline(always)]
    pub(super) fn bound(&self, to: &[Vector3<T>], from: &[Vector3<T>]) -> T {
        let (near, mut bound) = (self.among_obstacles, T::zero());
        if near.any() {
            bound = self.farthest::<true>(to, from);
        }
        if (!near).any() {
            bound = T::select(near, bound, self.farthest::<false>(to, from));
        }
        bound
    }

    /// Bound on the speed of any point of the robot at a twist \[m/s\].
    #[inline(always)]
    pub(super) fn fastest(&self, twist: &[Vector3<T>]) -> T {
        self.bound(twist, &self.at_rest)
    }

    /// The largest of a bound over the links, sharp or coarse.
    #[inline(always)]
    fn farthest<const SHARP: bool>(&self, to: &[Vector3<T>], from: &[Vector3<T>]) -> T {
        let mut farthest = T::zero();
        for (link, (to, from)) in self.constants.iter().zip(to.iter().zip(from)) {
            farthest = farthest.max(if SHARP { link.farthest(to, from) } else { link.farther(to, from) });
        }
        farthest
    }
}
