//! Stages and the steps that are made of them, compiled once for every width of register.
//!
//! [`Real::run`] switches the instruction set on and inlines all of a kernel. Without the non-generic functions that
//! [`compile_kernels!`] writes, every crate that steps robots would compile all of it again.

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

/// A model whose kernels are compiled for the width of `T`.
pub trait Compiled<T: Real>: Model {
    fn run(workspace: &mut Self::Workspace<T>, operation: Operation<T>);
    fn solve(workspace: &mut Self::Workspace<T>, request: Request<T>) -> SolvedStage<T>;
    fn group(config: &ImplicitConfig, system: &Self::System) -> Box<Group<Self, T>>;
    fn advance(group: &mut Group<Self, T>, run: &mut Run<Self>);
}

/// A model whose kernels are compiled for every width.
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

pub struct RunOperation<'a, T: Real, W> {
    pub workspace: &'a mut W,
    pub operation: Operation<T>,
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

pub struct Solve<'a, T: Real, W> {
    pub workspace: &'a mut W,
    pub request: Request<T>,
}

impl<T: Real, W: StageKernels<T>> Kernel for Solve<'_, T, W> {
    type Output = SolvedStage<T>;

    #[inline(always)]
    fn run(self) -> SolvedStage<T> {
        let Request { tolerance, max_iterations, lanes } = self.request;
        self.workspace.solve(tolerance, max_iterations, lanes)
    }
}

/// Compiles the kernels of a model for every width.
macro_rules! compile_kernels {
    ($model:ty) => {
        $crate::stepping::kernels::compile_kernels!($model, f64);
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        $crate::stepping::kernels::compile_kernels!($model, $crate::math::Wide4);
        #[cfg(target_arch = "x86_64")]
        $crate::stepping::kernels::compile_kernels!($model, $crate::math::Wide8);
    };
    ($model:ty, $real:ty) => {
        impl $crate::stepping::kernels::Compiled<$real> for $model {
            fn run(
                workspace: &mut <$model as $crate::stepping::Model>::Workspace<$real>,
                operation: $crate::stepping::kernels::Operation<$real>,
            ) {
                <$real as $crate::math::Real>::run($crate::stepping::kernels::RunOperation { workspace, operation });
            }

            fn solve(
                workspace: &mut <$model as $crate::stepping::Model>::Workspace<$real>,
                request: $crate::stepping::kernels::Request<$real>,
            ) -> $crate::stepping::SolvedStage<$real> {
                <$real as $crate::math::Real>::run($crate::stepping::kernels::Solve { workspace, request })
            }

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
pub(crate) use compile_kernels;
