//! The arithmetic of [`StageWork`], compiled once for every width of register.

use nalgebra::Vector3;

use crate::gait::turned;
use crate::math::{Kernel, Mask, Real, add_scaled, select_into};
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};
use crate::planar::{Certificate, certify, is_sane, travel};
use crate::solver::Outcome;

use super::stage_work::{Outlook, StageWork};
use crate::stepping::energy::Works;

/// The kernels below for one width of register, compiled once, here.
pub trait StageKernels: Real {
    fn undulate(work: &mut StageWork<Self>);
    fn predict(work: &mut StageWork<Self>, start: &[Vector3<Self>], pending: Self::Mask);
    fn solve(solve: Solve<Self>) -> (Outcome<Self>, Certificate<Self>);
    fn keep(work: &mut StageWork<Self>, solved: Self::Mask, again: Self::Mask);
    fn extrapolate(extrapolate: Extrapolate<Self>);
    fn finish(work: &mut StageWork<Self>) -> Arrival<Self>;
}

macro_rules! compile_for {
    ($real:ty) => {
        impl StageKernels for $real {
            fn undulate(work: &mut StageWork<Self>) {
                Self::run(Undulate { work });
            }

            fn predict(work: &mut StageWork<Self>, start: &[Vector3<Self>], pending: Self::Mask) {
                Self::run(Predict { work, start, pending });
            }

            fn solve(solve: Solve<Self>) -> (Outcome<Self>, Certificate<Self>) {
                Self::run(solve)
            }

            fn keep(work: &mut StageWork<Self>, solved: Self::Mask, again: Self::Mask) {
                Self::run(Keep { work, solved, again });
            }

            fn extrapolate(extrapolate: Extrapolate<Self>) {
                Self::run(extrapolate);
            }

            fn finish(work: &mut StageWork<Self>) -> Arrival<Self> {
                Self::run(Finish { work })
            }
        }
    };
}

compile_for!(f64);
#[cfg(target_arch = "x86_64")]
compile_for!(Wide4);
#[cfg(target_arch = "x86_64")]
compile_for!(Wide8);

/// Joint references along the wave, whose phase is turned from joint to joint.
struct Undulate<'a, T: Real> {
    work: &'a mut StageWork<T>,
}

impl<T: Real> Kernel for Undulate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let StageWork { wave, target, .. } = self.work;
        let (mut phase, phase_shift) = (wave.phase.sin_cos(), wave.phase_shift.value.sin_cos());
        for (joint, target) in target.iter_mut().enumerate() {
            *target = wave.joint(joint, phase);
            phase = turned(phase, phase_shift);
        }
    }
}

/// Predicts the end configuration of the stage, and in the `pending` lanes how far away pegs may matter to it.
struct Predict<'a, T: Real> {
    work: &'a mut StageWork<T>,
    /// Poses at the start of the step.
    start: &'a [Vector3<T>],
    pending: T::Mask,
}

impl<T: Real> Kernel for Predict<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { work, start, pending } = self;
        let c = T::splat(work.stage.coefficient);
        travel(&work.half_length, &work.base, &work.guess, c, &mut work.predicted, &mut work.heading);
        if work.has_pegs {
            let fastest = work.fastest(&work.guess).max(work.fastest(&work.reference));
            let lead = work.bound(&work.predicted, start);
            let Outlook { fastest: last_fastest, lead: last_lead } = work.outlook;
            work.outlook = Outlook {
                fastest: T::select(pending, fastest, last_fastest),
                lead: T::select(pending, lead, last_lead),
            };
        }
    }
}

/// Builds links and joints of the stage, solves it from the last forces, and judges the solution.
pub struct Solve<'a, T: Real> {
    pub work: &'a mut StageWork<T>,
    pub tolerance: f64,
    pub max_iterations: u32,
    pub lanes: T::Mask,
}

impl<T: Real> Kernel for Solve<'_, T> {
    type Output = (Outcome<T>, Certificate<T>);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let work = self.work;
        work.fill_links();
        work.fill_joints();
        work.load_forces();
        let StageWork { stage, solution, newton, .. } = work;
        let outcome = newton.solve(stage, solution, self.tolerance, self.max_iterations, self.lanes);
        let certificate = certify(stage, solution);
        work.works = Works::of(stage, solution);
        work.store_forces();
        if work.among_pegs.any() {
            work.measure_deviation();
        }
        (outcome, certificate)
    }
}

/// Keeps the solution in the lanes where it stands; where not, it becomes the next guess.
struct Keep<'a, T: Real> {
    work: &'a mut StageWork<T>,
    solved: T::Mask,
    again: T::Mask,
}

impl<T: Real> Kernel for Keep<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { work, solved, again } = self;
        for (i, u) in work.solution.twist.iter().enumerate() {
            select_into(&mut work.kept_twist[i], solved, u);
            select_into(&mut work.guess[i], again, u);
        }
        for (kept, drive) in work.kept_drive.iter_mut().zip(&work.solution.drive) {
            *kept = T::select(solved, *drive, *kept);
        }
        work.kept_works.select_into(solved, &work.works);
        if work.free_play.is_any {
            work.free_play.end_stage(T::splat(work.stage.coefficient), &work.stage.joints, &work.kept_twist);
        }
    }
}

/// End configuration q_B + c u of the solved stage.
struct Finish<'a, T: Real> {
    work: &'a mut StageWork<T>,
}

/// Where a step has led.
#[derive(Debug, Clone, Copy)]
pub struct Arrival<T: Real> {
    /// Largest way of any point of the robot from where it was predicted \[m\].
    pub astray: T,
    /// Whether the state is that of a robot rather than of a diverged computation.
    pub sane: T::Mask,
}

impl<T: Real> Kernel for Finish<'_, T> {
    type Output = Arrival<T>;

    #[inline(always)]
    fn run(self) -> Arrival<T> {
        let Self { work } = self;
        let c = T::splat(work.stage.coefficient);
        travel(&work.half_length, &work.base, &work.kept_twist, c, &mut work.end, &mut work.heading);
        let astray = if work.has_pegs { work.bound(&work.end, &work.predicted) } else { T::zero() };
        Arrival { astray, sane: is_sane(&work.end, &work.kept_twist) }
    }
}

/// Prepares the second stage of the SDIRK from the first: base, reference velocity, guess and torques.
pub struct Extrapolate<'a, T: Real> {
    pub work: &'a mut StageWork<T>,
    /// q_A, u_A.
    pub start_pose: &'a [Vector3<T>],
    pub start_twist: &'a [Vector3<T>],
    /// Time from t_A to the base of the second stage.
    pub elapsed: f64,
    /// Weights of the first stage's change of velocity in the reference and in the guess.
    pub reference: f64,
    pub guess: f64,
    /// The same in the slip from which friction bounds follow.
    pub slip: f64,
}

impl<T: Real> Kernel for Extrapolate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let work = self.work;
        let (to_reference, to_guess) = (T::splat(self.reference), T::splat(self.guess));
        for (i, u) in self.start_twist.iter().enumerate() {
            let end = &work.kept_twist[i];
            let change = Vector3::new(end.x - u.x, end.y - u.y, end.z - u.z);
            work.reference[i] = add_scaled(u, &change, to_reference);
            work.guess[i] = add_scaled(u, &change, to_guess);
        }
        if work.free_play.is_any {
            work.free_play.extrapolate(to_reference);
        }
        if work.weakening.is_any {
            work.weakening.extrapolate(self.start_twist, &work.kept_twist, T::splat(self.slip));
        }
        let per_second = T::splat(1.0 / work.stage.coefficient);
        for (torque, impulse) in work.drive_torque.iter_mut().zip(&work.kept_drive) {
            *torque = *impulse * per_second;
        }
        let elapsed = T::splat(self.elapsed);
        let StageWork { half_length, kept_twist, base, heading, .. } = work;
        travel(half_length, self.start_pose, kept_twist, elapsed, base, heading);
    }
}
