//! The arithmetic of [`StageWork`], compiled once for every width of register.

use crate::math::{Kernel, Real};
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};
use crate::solver::Outcome;
use crate::spatial::Certificate;

use super::stage_work::StageWork;

/// Numbers for which the parts of a step are compiled.
pub trait SpatialKernels: Real {
    fn run_part(work: &mut StageWork<Self>, part: Part<Self>);
    fn solve(solve: Solve<Self>) -> (Outcome<Self>, Certificate<Self>);
}

/// Parts of a step; see the methods of [`StageWork`].
#[derive(Debug, Clone, Copy)]
pub enum Part<T: Real> {
    Begin,
    Extrapolate { elapsed: T, share: f64, lead: f64 },
    Predict { c: T, elapsed: T },
    Evaluate { lanes: T::Mask },
    Keep { solved: T::Mask, again: T::Mask },
    Arrive,
}

/// The linear solves of a stage.
pub struct Solve<'a, T: Real> {
    pub work: &'a mut StageWork<T>,
    pub tolerance: f64,
    pub max_iterations: u32,
    pub lanes: T::Mask,
}

struct Run<'a, T: Real> {
    work: &'a mut StageWork<T>,
    part: Part<T>,
}

impl<T: Real> Kernel for Run<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let work = self.work;
        match self.part {
            Part::Begin => work.begin(),
            Part::Extrapolate { elapsed, share, lead } => work.extrapolate(elapsed, share, lead),
            Part::Predict { c, elapsed } => work.predict(c, elapsed),
            Part::Evaluate { lanes } => work.evaluate(lanes),
            Part::Keep { solved, again } => work.keep(solved, again),
            Part::Arrive => work.arrive(),
        }
    }
}

impl<T: Real> Kernel for Solve<'_, T> {
    type Output = (Outcome<T>, Certificate<T>);

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.work.solve(self.tolerance, self.max_iterations, self.lanes)
    }
}

macro_rules! compile_for {
    ($real:ty) => {
        impl SpatialKernels for $real {
            fn run_part(work: &mut StageWork<Self>, part: Part<Self>) {
                Self::run(Run { work, part });
            }

            fn solve(solve: Solve<Self>) -> (Outcome<Self>, Certificate<Self>) {
                Self::run(solve)
            }
        }
    };
}

compile_for!(f64);
#[cfg(target_arch = "x86_64")]
compile_for!(Wide4);
#[cfg(target_arch = "x86_64")]
compile_for!(Wide8);
