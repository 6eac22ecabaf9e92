//! The arithmetic of [`StageWork`], compiled once for every width of register.

use nalgebra::Vector3;

use crate::contact::Outcome;
use crate::math::{Kernel, Real, add_scaled, select_into};
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};
use crate::planar::{Certificate, certify, is_sane, travel};

use super::stage_work::StageWork;
use super::works::Works;

/// The kernels below for one width of register, compiled once, here.
pub trait StageKernels: Real {
    fn predict(work: &mut StageWork<Self>, start: &[Vector3<Self>]) -> Outlook<Self>;
    fn solve(solve: Solve<Self>) -> (Outcome<Self>, Certificate<Self>);
    fn keep(work: &mut StageWork<Self>, solved: Self::Mask, again: Self::Mask);
    fn extrapolate(extrapolate: Extrapolate<Self>);
    fn finish(work: &mut StageWork<Self>, start: &[Vector3<Self>]) -> Arrival<Self>;
}

macro_rules! compile_for {
    ($real:ty) => {
        impl StageKernels for $real {
            fn predict(work: &mut StageWork<Self>, start: &[Vector3<Self>]) -> Outlook<Self> {
                Self::run(Predict { work, start })
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

            fn finish(work: &mut StageWork<Self>, start: &[Vector3<Self>]) -> Arrival<Self> {
                Self::run(Finish { work, start })
            }
        }
    };
}

compile_for!(f64);
#[cfg(target_arch = "x86_64")]
compile_for!(Wide4);
#[cfg(target_arch = "x86_64")]
compile_for!(Wide8);

/// Predicts the end configuration of the stage.
struct Predict<'a, T: Real> {
    work: &'a mut StageWork<T>,
    /// Poses at the start of the step.
    start: &'a [Vector3<T>],
}

/// How far away pegs may matter to a stage.
#[derive(Debug, Clone, Copy)]
pub struct Outlook<T> {
    /// Largest speed of any point of the robot, at the start of the stage or expected at its end \[m/s\].
    pub fastest: T,
    /// Largest way of any point of the robot from the start of the step to the predicted end \[m\].
    pub lead: T,
}

impl<T: Real> Kernel for Predict<'_, T> {
    type Output = Outlook<T>;

    #[inline(always)]
    fn run(self) -> Outlook<T> {
        let Self { work, start } = self;
        let c = T::splat(work.stage.coefficient);
        travel(&work.half_length, &work.base, &work.guess, c, &mut work.predicted, &mut work.heading);
        let at_rest = Vector3::new(T::zero(), T::zero(), T::zero());
        let (mut fastest, mut lead) = (T::zero(), T::zero());
        for (i, link) in work.constants.iter().enumerate().filter(|_| work.in_field) {
            fastest = fastest.max(link.farthest(&work.guess[i], &at_rest));
            fastest = fastest.max(link.farthest(&work.reference[i], &at_rest));
            lead = lead.max(link.farthest(&work.predicted[i], &start[i]));
        }
        Outlook { fastest, lead }
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
        if work.in_field {
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
    /// Poses at the start of the step.
    start: &'a [Vector3<T>],
}

/// Where a step has led.
#[derive(Debug, Clone, Copy)]
pub struct Arrival<T: Real> {
    /// Largest way of any point of the robot \[m\].
    pub travelled: T,
    /// Whether the state is that of a robot rather than of a diverged computation.
    pub sane: T::Mask,
}

impl<T: Real> Kernel for Finish<'_, T> {
    type Output = Arrival<T>;

    #[inline(always)]
    fn run(self) -> Arrival<T> {
        let Self { work, start } = self;
        let c = T::splat(work.stage.coefficient);
        travel(&work.half_length, &work.base, &work.kept_twist, c, &mut work.end, &mut work.heading);
        let mut travelled = T::zero();
        for (link, (end, start)) in work.constants.iter().zip(work.end.iter().zip(start)).filter(|_| work.in_field) {
            travelled = travelled.max(link.farthest(end, start));
        }
        Arrival { travelled, sane: is_sane(&work.end, &work.kept_twist) }
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
