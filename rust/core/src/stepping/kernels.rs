//! Parts of a step and solves of a stage for the instruction set of a width: [`Real::call`] inlines all of a kernel.

use crate::math::Real;

use super::stage::{SolvedStage, StageKernels};

/// Parts of a step; see the methods of [`StageKernels`].
#[derive(Debug, Clone, Copy)]
pub enum Operation<T: Real> {
    Begin,
    FollowWaves,
    Extrapolate { h: T },
    Predict { c: T, elapsed: T, pending: T::Mask },
    Evaluate { lanes: T::Mask },
    Keep { solved: T::Mask, again: T::Mask },
    Arrive,
}

/// Accuracy, limit and lanes of a solve.
#[derive(Debug, Clone, Copy)]
pub struct Request<T: Real> {
    pub tolerance: f64,
    pub max_iterations: u32,
    pub lanes: T::Mask,
}

/// Does a part of a step.
pub fn run<T: Real>(workspace: &mut impl StageKernels<T>, operation: Operation<T>) {
    T::call(
        #[inline(always)]
        move || match operation {
            Operation::Begin => workspace.begin(),
            Operation::FollowWaves => workspace.follow_waves(),
            Operation::Extrapolate { h } => workspace.extrapolate(h),
            Operation::Predict { c, elapsed, pending } => workspace.predict(c, elapsed, pending),
            Operation::Evaluate { lanes } => workspace.evaluate(lanes),
            Operation::Keep { solved, again } => workspace.keep(solved, again),
            Operation::Arrive => workspace.arrive(),
        },
    );
}

/// Solves a stage.
pub fn solve<T: Real>(workspace: &mut impl StageKernels<T>, request: Request<T>) -> SolvedStage<T> {
    let Request { tolerance, max_iterations, lanes } = request;
    T::call(
        #[inline(always)]
        move || workspace.solve(tolerance, max_iterations, lanes),
    )
}
