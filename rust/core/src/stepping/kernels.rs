//! Stages and the steps that are made of them, compiled once for every width of register.
//!
//! [`Real::run`] switches the instruction set on and inlines all of a kernel. Without the non-generic functions that
//! [`compile_stepping!`] writes, every crate that steps robots would compile all of it again.

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::math::Wide4;
#[cfg(target_arch = "x86_64")]
use crate::math::Wide8;
use crate::math::{Kernel, Real};

use super::ImplicitConfig;
use super::fleet::Run;
use super::group::Group;
use super::model::Model;
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

/// A model of which the steps are compiled for the width of `T`.
pub trait Compiled<T: Real>: Model {
    /// [`Group::new`].
    fn group(config: &ImplicitConfig, system: &Self::System) -> Box<Group<Self, T>>;
    /// [`Run::advance`].
    fn advance(group: &mut Group<Self, T>, run: &mut Run<Self>);
}

/// A model of which the steps are compiled for every width.
#[cfg(target_arch = "x86_64")]
pub trait CompiledModel: Compiled<f64> + Compiled<Wide4> + Compiled<Wide8> {}
#[cfg(target_arch = "x86_64")]
impl<M: Compiled<f64> + Compiled<Wide4> + Compiled<Wide8>> CompiledModel for M {}
#[cfg(target_arch = "aarch64")]
pub trait CompiledModel: Compiled<f64> + Compiled<Wide4> {}
#[cfg(target_arch = "aarch64")]
impl<M: Compiled<f64> + Compiled<Wide4>> CompiledModel for M {}
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub trait CompiledModel: Compiled<f64> {}
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
impl<M: Compiled<f64>> CompiledModel for M {}

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

/// Compiles the steps of a model for every width.
macro_rules! compile_stepping {
    ($model:ty) => {
        $crate::stepping::kernels::compile_stepping!($model, f64);
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        $crate::stepping::kernels::compile_stepping!($model, $crate::math::Wide4);
        #[cfg(target_arch = "x86_64")]
        $crate::stepping::kernels::compile_stepping!($model, $crate::math::Wide8);
    };
    ($model:ty, $real:ty) => {
        impl $crate::stepping::kernels::Compiled<$real> for $model {
            fn group(
                config: &$crate::stepping::ImplicitConfig,
                system: &<$model as $crate::stepping::Model>::System,
            ) -> Box<$crate::stepping::Group<$model, $real>> {
                Box::new($crate::stepping::Group::new(config, system))
            }

            fn advance(group: &mut $crate::stepping::Group<$model, $real>, run: &mut $crate::stepping::Run<$model>) {
                run.advance(group);
            }
        }
    };
}
pub(crate) use compile_stepping;
