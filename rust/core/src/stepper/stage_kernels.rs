//! The arithmetic of a stage over lanes: what surrounds the solver.

use nalgebra::{Vector2, Vector3};

use crate::contact::Outcome;
use crate::math::{Kernel, Real, add_scaled, select_into};
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};
use crate::planar::{
    Certificate, Heading, Newton, Stage, StageJoint, StageLink, StageSolution, certify, is_sane, travel,
};

use super::free_play::FreePlay;
use super::io_drive::{IoDrive, Situation};
use super::weakening::Weakening;
use super::works::Works;

/// Data of the stage at hand, for as many robots as `T` has lanes.
#[derive(Debug, Clone)]
pub struct StageWork<T: Real> {
    /// Constants of the links, in every lane.
    pub constants: Vec<LinkConstants<T>>,
    pub half_length: Vec<T>,
    /// q_B, u_R and the expected end velocity of the stage.
    pub base: Vec<Vector3<T>>,
    pub reference: Vec<Vector3<T>>,
    pub guess: Vec<Vector3<T>>,
    /// Expected end configuration.
    pub predicted: Vec<Vector3<T>>,
    pub heading: Vec<Heading<T>>,
    /// Joint references at the end of the stage (angle, rate, acceleration), and gains k_P, k_D.
    pub target: Vec<[T; 3]>,
    pub gains: [T; 2],
    pub torque_limit: T,
    /// Whether any robot is among pegs; without them nobody asks how far a robot moves.
    pub in_field: bool,
    /// Input-output linearisation instead of PD.
    pub io: Option<IoDrive<T>>,
    pub free_play: FreePlay<T>,
    pub weakening: Weakening<T>,
    /// Forces of the last stage.
    pub friction_force: Vec<Vector2<T>>,
    pub contact_force: Vec<T>,
    pub drive_torque: Vec<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    pub newton: Newton<T>,
    /// End configuration.
    pub end: Vec<Vector3<T>>,
    /// Works of the solved stage \[J\].
    pub works: Works<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    /// Solution lane by lane, once it stands: some lanes may need another prediction.
    pub kept_twist: Vec<Vector3<T>>,
    pub kept_drive: Vec<T>,
    pub kept_works: Works<T>,
}

#[derive(Debug, Clone, Copy)]
pub struct LinkConstants<T> {
    pub mass: T,
    pub inertia: T,
    pub reach: T,
    /// mu m g \[N\].
    pub friction: Vector2<T>,
}

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

impl<T: Real> LinkConstants<T> {
    /// Bound on how far a point of the link moves between two poses, or on how much faster it is at one of
    /// two twists.
    #[inline(always)]
    fn farthest(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        let (x, y) = (to.x - from.x, to.y - from.y);
        (x * x + y * y).sqrt() + self.reach * (to.z - from.z).abs()
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

impl<T: Real> StageWork<T> {
    #[inline(always)]
    fn fill_links(&mut self) {
        let c = T::splat(self.stage.coefficient);
        self.stage.links.clear();
        for (i, link) in self.constants.iter().enumerate() {
            self.stage.links.push(StageLink {
                heading: self.heading[i],
                reference: self.reference[i],
                mass: link.mass,
                inertia: link.inertia,
                half_length: self.half_length[i],
                friction: Vector2::new(link.friction.x * c, link.friction.y * c),
            });
        }
        if self.weakening.is_any {
            self.weakening.weaken(&mut self.stage.links);
        }
    }

    #[inline(always)]
    fn fill_joints(&mut self) {
        let Some(io) = &mut self.io else { return self.fill_pd() };
        let situation = Situation {
            heading: &self.heading,
            base: &self.base,
            reference: &self.reference,
            guess: &self.guess,
            target: &self.target,
            gains: self.gains,
            torque_limit: self.torque_limit,
            coefficient: T::splat(self.stage.coefficient),
        };
        io.fill(&situation, &mut self.stage.joints);
    }

    /// The PD torque (T 3.51 != D3) at the end of the stage, where phi = phi_base + c omega_J, is linear in
    /// omega_J.
    #[inline(always)]
    fn fill_pd(&mut self) {
        let c = T::splat(self.stage.coefficient);
        let [kp, kd] = self.gains;
        self.stage.joints.clear();
        for (j, [angle, rate, _]) in self.target.iter().enumerate() {
            let error = *angle - (self.base[j + 1].z - self.base[j].z);
            self.stage.joints.push(StageJoint {
                drive: c * (kp * error + kd * *rate),
                stiffness: c * (c * kp + kd),
                limit: c * self.torque_limit,
                slack: T::zero(),
            });
        }
        if self.free_play.is_any {
            self.free_play.loosen(c, kd, &mut self.stage.joints);
        }
    }

    #[inline(always)]
    fn load_forces(&mut self) {
        let c = T::splat(self.stage.coefficient);
        self.solution.twist.copy_from_slice(&self.guess);
        for (impulse, force) in self.solution.friction.iter_mut().zip(&self.friction_force) {
            *impulse = Vector2::new(force.x * c, force.y * c);
        }
        for (impulse, torque) in self.solution.drive.iter_mut().zip(&self.drive_torque) {
            *impulse = *torque * c;
        }
        self.solution.contact.clear();
        for force in &self.contact_force {
            self.solution.contact.push(*force * c);
        }
    }

    #[inline(always)]
    fn measure_deviation(&mut self) {
        let mut fastest = T::zero();
        for (link, (u, guess)) in self.constants.iter().zip(self.solution.twist.iter().zip(&self.guess)) {
            fastest = fastest.max(link.farthest(u, guess));
        }
        self.deviation = fastest * T::splat(self.stage.coefficient);
    }

    #[inline(always)]
    fn store_forces(&mut self) {
        let per_second = T::splat(1.0) / T::splat(self.stage.coefficient);
        for (force, impulse) in self.friction_force.iter_mut().zip(&self.solution.friction) {
            *force = Vector2::new(impulse.x * per_second, impulse.y * per_second);
        }
        for (force, impulse) in self.contact_force.iter_mut().zip(&self.solution.contact) {
            *force = *impulse * per_second;
        }
    }
}
