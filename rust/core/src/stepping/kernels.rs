//! Parts of a step and solves of a stage for the instruction set of a width: [`Real::run`] inlines all of a kernel.

use crate::math::{Kernel, Real};

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
    T::run(RunOperation { workspace, operation });
}

/// Solves a stage.
pub fn solve<T: Real>(workspace: &mut impl StageKernels<T>, request: Request<T>) -> SolvedStage<T> {
    T::run(Solve { workspace, request })
}

struct RunOperation<'a, T: Real, W> {
    workspace: &'a mut W,
    operation: Operation<T>,
}

impl<T: Real, W: StageKernels<T>> Kernel for RunOperation<'_, T, W> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let workspace = self.workspace;
        match self.operation {
            Operation::Begin => workspace.begin(),
            Operation::FollowWaves => workspace.follow_waves(),
            Operation::Extrapolate { h } => workspace.extrapolate(h),
            Operation::Predict { c, elapsed, pending } => workspace.predict(c, elapsed, pending),
            Operation::Evaluate { lanes } => workspace.evaluate(lanes),
            Operation::Keep { solved, again } => workspace.keep(solved, again),
            Operation::Arrive => workspace.arrive(),
        }
    }
}

struct Solve<'a, T: Real, W> {
    workspace: &'a mut W,
    request: Request<T>,
}

impl<T: Real, W: StageKernels<T>> Kernel for Solve<'_, T, W> {
    type Output = SolvedStage<T>;

    #[inline(always)]
    fn run(self) -> SolvedStage<T> {
        let Request { tolerance, max_iterations, lanes } = self.request;
        self.workspace.solve(tolerance, max_iterations, lanes)
    }
}
