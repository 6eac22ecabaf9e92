//! One robot among its obstacles, as the schemes advance it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::gait::Reference;
use crate::interrupt::Interrupt;
use crate::obstacles::ObstacleGrid;
use crate::robot::Robot;

use super::closing::Closing;
use super::link_impulses::LinkImpulses;
use super::model::{Model, WarmStart};
use super::obstacle_impulses::ObstacleImpulses;
use super::state::{RobotState, StateOf};
use super::{PlantParameters, Record, StepStatistics};

/// State, surroundings, warm start and counters of one robot.
#[derive(Debug, Clone)]
pub struct Body<M: Model> {
    pub state: StateOf<M>,
    /// Shared by the robots of a scene.
    pub obstacles: Arc<ObstacleGrid>,
    /// Of the calls that advance it.
    pub interrupt: Interrupt,
    pub warm_start: M::WarmStart,
    pub clock: Clock,
    pub(super) trial: Trial,
    /// Deviations of this robot from the system that all share.
    pub parameters: PlantParameters,
    /// Statistics since [`Self::begin`].
    pub statistics: StepStatistics,
    /// Impulses on the links since [`Self::begin`].
    pub impulses: LinkImpulses,
    /// Impulse of each obstacle, by its number in the grid, on the robot since [`Self::begin`].
    pub obstacle_impulse: ObstacleImpulses,
    /// What a run records besides, if it does.
    pub record: Option<Box<Record>>,
    /// States at the ends of the parts of steps since [`Self::begin`], if they are kept.
    pub path: Option<Vec<StateOf<M>>>,
    /// Linear solves of the last stage.
    pub(super) solves: u32,
    /// Cost of all parts of the present step in linear solves, the retaken ones included; see [`super::verdict`].
    pub(super) step_solves: u32,
    /// Whether a stage of the present step was relaxed.
    pub(super) has_relaxed: bool,
    /// How often the stage of the present part has been postponed.
    pub(super) postponements: u32,
    /// Whether the state is that of a robot rather than of a diverged computation; set by the schemes.
    pub is_plausible: bool,
    /// Last plausible state.
    last_good: StateOf<M>,
}

/// What the last part says of the next one: with it a run continues elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Clock {
    /// Longest part of second order to be tried next \[s\]; zero for a robot that was just placed.
    pub next: f64,
    /// Whether it ends where an open contact is forecast to close.
    pub ends_at_closing: bool,
    /// Time that is taken in Euler parts first \[s\].
    pub euler_time: f64,
}

/// What became of the part that was just tried.
#[derive(Debug, Clone, Copy, Default)]
pub struct Trial {
    /// How far its last stage ended from its prediction, over how far that of an accepted part may.
    pub deviation: f64,
    pub closing: Closing,
}

impl<M: Model> Body<M> {
    pub fn new(robot: &Robot, obstacles: ObstacleGrid) -> Self {
        let links = robot.link_count();
        let mut state = RobotState::zero(links);
        state.place_movables(obstacles.movables());
        Self {
            last_good: state.clone(),
            state,
            obstacle_impulse: ObstacleImpulses::zeros(obstacles.total()),
            obstacles: obstacles.into(),
            interrupt: Interrupt::default(),
            warm_start: M::WarmStart::new(links),
            clock: Clock::default(),
            trial: Trial::default(),
            parameters: PlantParameters::default(),
            statistics: StepStatistics::default(),
            impulses: LinkImpulses::zeros(links),
            record: None,
            path: None,
            solves: 0,
            step_solves: 0,
            has_relaxed: false,
            postponements: 0,
            is_plausible: true,
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

    /// Begins a step, with its own budget.
    pub(super) fn begin_step(&mut self) {
        (self.step_solves, self.has_relaxed) = (0, false);
    }

    /// Begins an interval of integration.
    pub fn begin(&mut self) {
        self.last_good.copy_from(&self.state);
        self.statistics = StepStatistics::default();
        self.begin_step();
        if let Some(path) = &mut self.path {
            path.clear();
        }
        self.clear_impulses();
    }

    fn clear_impulses(&mut self) {
        self.impulses.clear();
        self.obstacle_impulse.clear(self.obstacles.total());
    }

    /// Time at which the present interval began \[s\].
    pub fn interval_start(&self) -> f64 {
        self.last_good.time
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

/// A body and the reference that its joints follow: what schemes advance.
pub struct Driven<'a, M: Model> {
    pub body: &'a mut Body<M>,
    pub reference: &'a dyn Reference<M::Target>,
}

/// A body that owns the reference that its joints follow.
#[derive(Debug, Clone)]
pub struct Scripted<R, M: Model> {
    pub body: Body<M>,
    pub reference: R,
}

impl<R: Reference<M::Target>, M: Model> Scripted<R, M> {
    pub fn driven(&mut self) -> Driven<'_, M> {
        Driven { body: &mut self.body, reference: &self.reference }
    }
}
