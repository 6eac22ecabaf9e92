//! What a robot model provides to the stepper: its data, its stage, and how its steps are divided.

use std::fmt::Debug;

use nalgebra::Vector2;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::gait::WaveJets;
use crate::math::Real;
use crate::robot::Robot;
use crate::solver::Outcome;

use super::ImplicitConfig;
use super::body::Body;
use super::energy::EnergyLedger;
use super::lanes::{Lanes, Members, NO_LANES};
use super::plan::Division;
use super::verdict::FallbackResult;

/// A robot model in stages: `planar::Planar` or `spatial::Spatial`. Everything is monomorphised.
pub trait Model: Debug + Clone + Copy + PartialEq + 'static {
    /// Robot, ground and controller: what no step changes.
    type System: Debug + Clone;
    type State: RobotState;
    type WarmStart: WarmStart;
    /// Reference of one joint.
    type Target: Debug + Clone + Copy + Default;
    /// How a step is divided where it cannot be taken whole.
    type Division: Division;
    /// The current stage of as many robots as `T` has lanes.
    type Work<T: Real>: StageWork<T, Model = Self>;

    /// Change of acceleration within a step that counts as abrupt \[m/s^2\].
    const ABRUPT_CHANGE: f64;
    /// Largest certified residual of a solved stage over its tolerance; see [`super::verdict`].
    const RESIDUAL_FACTOR: f64;

    /// The configuration with the model's own defaults.
    fn configured(config: ImplicitConfig) -> ImplicitConfig {
        config
    }

    fn robot(system: &Self::System) -> &Robot;

    /// Whether all joints move with their references: a robot placed in such motion has no start to resolve.
    fn follows(body: &Body<Self>, targets: &[Self::Target]) -> bool;

    /// Computes the reduced coordinates of the stages from the state, before an interval.
    fn to_reduced(_system: &Self::System, _body: &mut Body<Self>) {}

    /// Computes the state from the reduced coordinates of the stages, after an interval.
    fn from_reduced(_system: &Self::System, _body: &mut Body<Self>) {}
}

/// Configuration, velocity and time of one robot: plain data.
pub trait RobotState: Debug + Clone + PartialEq + Serialize + DeserializeOwned {
    /// A robot of `links` links at the origin, straight and at rest.
    fn zero(links: usize) -> Self;
    /// Copies without allocating.
    fn copy_from(&mut self, other: &Self);
    /// \[s\]
    fn time(&self) -> f64;
    fn set_time(&mut self, time: f64);
    /// All velocities become zero.
    fn stop(&mut self);
    /// Whether it is of a robot of `links` links.
    fn fits(&self, links: usize) -> bool;
}

/// Data that one step passes to the next besides the state.
pub trait WarmStart: Debug + Clone {
    /// The part of it that continues a run elsewhere.
    type Saved: Debug + Clone + PartialEq + Serialize + DeserializeOwned;

    fn new(links: usize) -> Self;
    /// The robot was placed: no earlier forces.
    fn clear(&mut self);
    fn save(&self) -> Self::Saved;
    fn resume(&mut self, saved: &Self::Saved);
    /// Whether `saved` is of a robot of `links` links among `pegs` pegs.
    fn fits(saved: &Self::Saved, links: usize, pegs: usize) -> bool;
}

/// A body with a reference for its joints: what a [`super::Fleet`] advances.
pub trait Driven {
    type Model: Model;

    fn body(&self) -> &Body<Self::Model>;
    fn body_mut(&mut self) -> &mut Body<Self::Model>;
    /// The reference of all joints at `time` \[s\].
    fn targets(&self, time: f64, targets: &mut [<Self::Model as Model>::Target]);
    /// The wave that all joints follow at `time` \[s\], if it is all they follow.
    fn travelling_wave(&self, _time: f64) -> Option<WaveJets> {
        None
    }
    /// The first time after `time` at which the reference jumps \[s\]; infinite if it never does.
    fn next_jump(&self, _time: f64) -> f64 {
        f64::INFINITY
    }
}

/// References of all joints of a model's robot.
pub trait Reference<M: Model> {
    fn targets(&self, time: f64, targets: &mut [M::Target]);
    fn travelling_wave(&self, _time: f64) -> Option<WaveJets> {
        None
    }
    fn next_jump(&self, time: f64) -> f64;
}

/// The current stage over lanes: the only stepping code of a model.
///
/// The first group of methods is arithmetic over lanes, compiled once for every width of register
/// ([`super::kernels`]) and `#[inline(always)]`; the second passes data between robots and their lanes.
pub trait StageWork<T: Real>: Debug + Clone {
    type Model: Model;

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

    fn new(system: &<Self::Model as Model>::System) -> Self;
    /// Gathers robots; lanes without one repeat the first.
    fn load<D: Driven<Model = Self::Model>>(&mut self, members: &Members<D>);
    /// Waves that robots follow at `end` after the start of the step; the lanes that have one.
    fn read_waves<D: Driven<Model = Self::Model>>(&mut self, _members: &Members<D>, _end: T) -> Lanes {
        NO_LANES
    }
    /// References and torque limits at `end` after the start of the step; `waving` lanes have their references.
    fn read_references<D: Driven<Model = Self::Model>>(&mut self, members: &Members<D>, end: T, waving: Lanes);
    /// Contacts with pegs at the predicted end.
    fn find_contacts<D: Driven<Model = Self::Model>>(&mut self, members: &mut Members<D>, pending: Lanes, elapsed: T);
    /// Solves the stage of one lane by the fallback; `None` if it is not made of numbers.
    fn fall_back(&mut self, lane: usize, tolerance: f64) -> Option<FallbackResult>;
    /// Records the forces of a lane's solution, before it is known whether it is kept.
    fn remember(&mut self, _lane: usize) {}
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    fn deviation(&self) -> T;
    /// Whether the stage ended so far from its prediction that it has to be predicted again.
    fn is_mispredicted(&self, lane: usize) -> bool;
    /// Collects the contact impulses on the robots of the `solved` lanes.
    fn collect_contact_impulses<D: Driven<Model = Self::Model>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    );
    /// Work of the kept stage.
    fn kept_energy(&self) -> &EnergyLedger<T>;
    /// Share of the tolerance for a deviation that a lane's step has; infinite if deviations do not count.
    fn deviation_share(&self, lane: usize, is_pushed: impl Fn() -> bool) -> f64;
    /// Whether the step takes a penetration too much deeper.
    fn sinks(&self, _lane: usize) -> bool {
        false
    }
    /// Keeps what the first stage of a step adds to the sums of a body, besides work and impulses of pegs.
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

/// Impulse of a peg or of another link on a link over a stage.
#[derive(Debug, Clone, Copy)]
pub struct ContactImpulse {
    pub lane: usize,
    pub link: usize,
    /// World frame \[N s\].
    pub impulse: Vector2<f64>,
    /// Whether it is of another link of the robot.
    pub is_internal: bool,
}
