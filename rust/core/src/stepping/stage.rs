//! The current stage over lanes, which a model provides in three parts: arithmetic, input and output.

use std::fmt::Debug;

use nalgebra::Vector3;

use crate::contact::Source;
use crate::math::Real;
use crate::solver::Outcome;

use super::body::Body;
use super::closing::Closing;
use super::energy::EnergyLedger;
use super::lanes::{Lanes, Members, NO_LANES};
use super::model::Model;
use super::record::StageRecord;
use super::verdict::{Effort, FallbackResult};

/// Arithmetic over lanes, inlined into [`super::kernels`]: every method is `#[inline(always)]`.
pub trait StageKernels<T: Real>: Send + Sync {
    /// Base, guess and reference velocity of a stage that starts with the step.
    fn begin(&mut self);
    /// Joint references along travelling waves.
    fn follow_waves(&mut self) {}
    /// Base, guess and reference velocity of the second stage of steps of lengths `h`.
    fn extrapolate(&mut self, h: T);
    /// Predicts the end of a stage of coefficient `c` that ends `elapsed` after the start of the step.
    fn predict(&mut self, c: T, elapsed: T, pending: T::Mask);
    /// Solves the stage from the last forces and certifies the solution.
    fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> SolvedStage<T>;
    /// What follows from the solution: forces, work and deviation from the prediction.
    fn evaluate(&mut self, lanes: T::Mask);
    /// Keeps the solution in the `solved` lanes; in those to be solved `again` it becomes the next guess.
    fn keep(&mut self, solved: T::Mask, again: T::Mask);
    /// End configuration of the step.
    fn arrive(&mut self);
}

/// Robots and their references into lanes.
pub trait StageInput<T: Real>: Sized {
    type Model: Model;

    fn new(system: &<Self::Model as Model>::System) -> Self;
    /// Gathers robots; lanes without one repeat the first.
    fn load(&mut self, members: &Members<Self::Model>);
    /// Waves that robots follow at `end` after the start of the step; the lanes that have one.
    fn read_waves(&mut self, _members: &Members<Self::Model>, _end: T) -> Lanes {
        NO_LANES
    }
    /// Takes the guesses of the members whose stage was postponed.
    fn take_guesses(&mut self, members: &mut Members<Self::Model>);
    /// References and torque limits at `end` after the start of the step; `waving` lanes have their references.
    fn read_references(&mut self, members: &Members<Self::Model>, end: T, waving: Lanes);
    /// Contacts with obstacles and between links at the predicted end.
    fn find_contacts(&mut self, members: &mut Members<Self::Model>, pending: Lanes);
}

/// What follows from a solved stage, lane by lane.
pub trait StageOutput<T: Real> {
    type Model: Model;

    /// Solves the stage of one lane by the fallback as far as `effort` allows; `None` if it has a value that is not finite,
    /// or too many contacts between links for that.
    fn fall_back(&mut self, lane: usize, tolerance: f64, effort: Effort) -> Option<FallbackResult>;
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    fn deviation(&self) -> T;
    /// Whether the stage ended so far from its prediction that it has to be predicted again.
    fn is_mispredicted(&self, lane: usize) -> bool;
    /// Passes the solution of a lane's stage on as the guess with which it is solved again later.
    fn postpone(&mut self, lane: usize, body: &mut Body<Self::Model>);
    /// Keeps the forces of contacts as the next initial guess, and collects the contact impulses on the robots of the `solved`
    /// lanes.
    fn collect_contact_impulses(
        &mut self,
        members: &mut Members<Self::Model>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    );
    /// Reads the ground's impulses and the actuators' work of a lane's solved stage.
    fn record(&self, lane: usize, record: &mut StageRecord);
    /// Work of the kept stage.
    fn kept_energy(&self) -> &EnergyLedger<T>;
    /// Closings of the contacts of a lane's robot in the part at hand.
    fn closing(&self, lane: usize) -> Closing;
    /// Ends the steps of the given lanes, before it is known which of them are accepted: measures penetrations, and keeps
    /// what predicts the next step in any case.
    fn end_step(&mut self, members: &mut Members<Self::Model>, lanes: Lanes);
    /// Whether the step takes a penetration too deep: a shorter one has to be tried.
    fn sinks(&self, lane: usize) -> bool;
    /// Whether it takes one so deep that the robot is flagged if there is no shorter step.
    fn sinks_beyond_recovery(&self, lane: usize) -> bool;
    /// Keeps what the first stage of a step adds to the sums of a body, besides work and contact impulses.
    fn keep_first_stage(&mut self) {}
    /// Adds it, weighted.
    fn add_first_stage(&self, _lane: usize, _weight: f64, _body: &mut Body<Self::Model>) {}
    /// The end of the step becomes the state of a lane's robot.
    fn accept(&mut self, system: &<Self::Model as Model>::System, lane: usize, body: &mut Body<Self::Model>);
}

/// How the stages of a register were solved, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct SolvedStage<T: Real> {
    pub outcome: Outcome<T>,
    /// Certified residual \[m/s\].
    pub residual: T,
    /// Duality gap \[J\]; zero where the model has none.
    pub gap: T,
}

/// Impulse of an obstacle or of another link on a link over a stage.
#[derive(Debug, Clone, Copy)]
pub struct ContactImpulse {
    pub lane: usize,
    pub link: usize,
    /// World frame \[N s\]; without a z part in the plane.
    pub impulse: Vector3<f64>,
    pub source: Source,
}
