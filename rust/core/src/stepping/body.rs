//! One robot among its pegs, as the schemes advance it.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::gait::{Reference, WaveJets};
use crate::interrupt::Interrupt;
use crate::pegs::PegGrid;
use crate::robot::Robot;

use super::model::{Driven, Model, RobotState, WarmStart};
use super::obstacle_impulses::ObstacleImpulses;
use super::{PlantParameters, Record, StepStatistics};

/// State, surroundings, warm start and counters of one robot.
#[derive(Debug, Clone)]
pub struct Body<M: Model> {
    pub state: M::State,
    /// Shared by the robots of a scene.
    pub pegs: Arc<PegGrid>,
    /// Of the calls that advance it.
    pub interrupt: Interrupt,
    pub warm_start: M::WarmStart,
    pub clock: Clock,
    /// Deviations of this robot from the system that all share.
    pub parameters: PlantParameters,
    /// Statistics since [`Self::begin`].
    pub statistics: StepStatistics,
    /// Impulse of the pegs on each link since [`Self::begin`], world frame \[N s\]; over an interval's length it is
    /// (T 7.6).
    pub contact_impulse: Vec<Vector3<f64>>,
    /// Impulse of each obstacle, by its number in the grid, on the robot since [`Self::begin`].
    pub obstacle_impulse: ObstacleImpulses,
    /// Impulse of the robot's other links on each link since [`Self::begin`], world frame \[N s\].
    pub self_contact_impulse: Vec<Vector3<f64>>,
    /// Impulse of the ground's normal forces on each link since [`Self::begin`] \[N s\]; zero in models without them.
    pub ground_impulse: Vec<f64>,
    /// What a run records besides, if it does.
    pub record: Option<Box<Record>>,
    /// States at the ends of the parts of steps since [`Self::begin`], if they are kept.
    pub path: Option<Vec<M::State>>,
    /// Linear solves of the last stage or step, see [`Model::SORTED_BY_STAGE`].
    pub(super) solves: u32,
    /// Cost of all parts of the present step in linear solves, the retaken ones included; see [`super::verdict`].
    pub(super) step_solves: u32,
    /// How often the stage of the present part has been postponed.
    pub(super) postponements: u32,
    /// Whether the state is that of a robot rather than of a diverged computation; set by the schemes.
    pub(crate) is_plausible: bool,
    /// Last plausible state.
    last_good: M::State,
}

/// Times since the events that the choice of steps depends on.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Clock {
    /// Time since the robot was placed \[s\].
    pub since_start: f64,
    /// Time since the reference last jumped \[s\].
    pub since_jump: f64,
    /// Whether a part of the last step had to be retaken, for whatever reason.
    pub was_divided: bool,
    pub last_part: LastPart,
}

/// What the part of a step that a robot has just tried says about the next one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct LastPart {
    /// \[s\]
    pub length: f64,
    pub is_euler: bool,
    /// How far its last stage ended from its prediction, over how far that of an accepted part of second order may; zero
    /// where such deviations do not count.
    pub abruptness: f64,
}

impl LastPart {
    /// Whether a part of second order and of this length would be rejected if forces changed as they just did. A
    /// deviation grows with the square of the length.
    pub fn rules_out(&self, length: f64) -> bool {
        let ratio = length / self.length;
        !self.is_euler && self.abruptness * ratio * ratio > 1.0
    }

    /// Whether forces changed so abruptly in an Euler step that a part of second order after it would hardly be accepted.
    pub fn was_abrupt(&self) -> bool {
        self.is_euler && self.abruptness > ABRUPT
    }
}

/// Abruptness of an Euler step after which the next part is not tried in second order.
const ABRUPT: f64 = 4.0;

impl<M: Model> Body<M> {
    pub fn new(robot: &Robot, pegs: PegGrid) -> Self {
        let links = robot.link_count();
        Self {
            state: M::State::zero(links),
            obstacle_impulse: ObstacleImpulses::zeros(pegs.len()),
            pegs: pegs.into(),
            interrupt: Interrupt::default(),
            warm_start: M::WarmStart::new(links),
            clock: Clock::default(),
            parameters: PlantParameters::default(),
            statistics: StepStatistics::default(),
            contact_impulse: vec![Vector3::zeros(); links],
            self_contact_impulse: vec![Vector3::zeros(); links],
            ground_impulse: vec![0.0; links],
            record: None,
            path: None,
            solves: 0,
            step_solves: 0,
            postponements: 0,
            is_plausible: true,
            last_good: M::State::zero(links),
        }
    }

    /// Clears forces and counters; the present state counts as good.
    pub fn clear_memory(&mut self) {
        self.begin();
        self.warm_start.clear();
        self.clock = Clock::default();
        self.solves = 0;
        self.postponements = 0;
    }

    /// Begins an interval of integration.
    pub fn begin(&mut self) {
        self.last_good.copy_from(&self.state);
        self.statistics = StepStatistics::default();
        self.step_solves = 0;
        if let Some(path) = &mut self.path {
            path.clear();
        }
        self.clear_impulses();
    }

    fn clear_impulses(&mut self) {
        self.contact_impulse.fill(Vector3::zeros());
        self.obstacle_impulse.clear(self.pegs.len());
        self.self_contact_impulse.fill(Vector3::zeros());
        self.ground_impulse.fill(0.0);
    }

    /// Time at which the present interval began \[s\].
    pub fn interval_start(&self) -> f64 {
        self.last_good.time()
    }

    /// If the state is implausible, resets the robot to its last plausible state, at rest, and flags it. The counters
    /// are kept.
    pub fn quarantine(&mut self) {
        if !self.is_plausible {
            self.state.copy_from(&self.last_good);
            self.state.stop();
            self.warm_start.clear();
            self.clock = Clock::default();
            self.solves = 0;
            self.statistics.clear_work();
            self.clear_impulses();
            self.is_plausible = true;
            self.statistics.diverged = true;
        }
    }
}

/// A body, owned or borrowed.
pub trait HasBody {
    type Model: Model;
    fn body(&self) -> &Body<Self::Model>;
    fn body_mut(&mut self) -> &mut Body<Self::Model>;
}

impl<M: Model> HasBody for Body<M> {
    type Model = M;

    fn body(&self) -> &Body<M> {
        self
    }

    fn body_mut(&mut self) -> &mut Body<M> {
        self
    }
}

impl<M: Model> HasBody for &mut Body<M> {
    type Model = M;

    fn body(&self) -> &Body<M> {
        self
    }

    fn body_mut(&mut self) -> &mut Body<M> {
        self
    }
}

/// A body that follows a reference; both may be borrowed.
#[derive(Debug, Clone)]
pub struct Scripted<R, B> {
    pub body: B,
    pub reference: R,
}

impl<B: HasBody, R: Reference<<B::Model as Model>::Target>> Driven for Scripted<R, B> {
    type Model = B::Model;

    fn body(&self) -> &Body<B::Model> {
        self.body.body()
    }

    fn body_mut(&mut self) -> &mut Body<B::Model> {
        self.body.body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [<B::Model as Model>::Target]) {
        self.reference.targets(time, targets);
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        self.reference.travelling_wave(time)
    }

    fn torques(&self, time: f64, torques: &mut [f64]) -> bool {
        self.reference.torques(time, torques)
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.reference.next_jump(time)
    }
}

#[cfg(test)]
mod tests {
    use super::LastPart;

    #[test]
    fn what_the_last_part_rules_out() {
        let half = |abruptness| LastPart { length: 0.0125, is_euler: false, abruptness };
        assert!(half(0.3).rules_out(0.025), "four times the deviation of half the length");
        assert!(!half(0.2).rules_out(0.025) && !half(0.9).rules_out(0.0125));
        assert!(!LastPart::default().rules_out(0.025), "nothing is known of a robot just placed");
        let euler = LastPart { is_euler: true, ..half(5.0) };
        assert!(euler.was_abrupt() && !euler.rules_out(0.025));
        assert!(!half(5.0).was_abrupt() && !LastPart { abruptness: 3.0, ..euler }.was_abrupt());
    }
}
