//! The plan of one robot's interval: equal steps, taken in parts where forces or references change abruptly.
//!
//! Each robot follows its own plan; those that have not reached the end of the interval are regrouped for every part,
//! so that robots at different depths of division share registers. How a step is divided is the model's [`Division`]:
//! [`super::Halving`] in the plane, [`super::Growing`] in 3D.

use std::fmt::Debug;

use super::ImplicitConfig;
use super::body::{Body, Clock};
use super::model::{Driven, Model, RobotState};
use super::start::end_before;

/// The equal steps of an interval.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// Length of a step \[s\].
    pub step: f64,
    pub steps: u32,
    /// The configured length of a step, by which starts are graded \[s\].
    pub configured: f64,
    /// Whether steps are Euler steps from the outset.
    pub is_euler: bool,
    /// How often a step is halved before it is taken in Euler steps, and how many of them replace the shortest part.
    pub halvings: u32,
    pub euler_steps: u32,
}

impl Interval {
    pub fn new(config: &ImplicitConfig, duration: f64) -> Self {
        let steps = config.steps_in(duration);
        Self {
            step: duration / f64::from(steps),
            steps,
            configured: config.step(),
            is_euler: config.order == 1,
            halvings: config.event_halvings() as u32,
            euler_steps: config.event_steps(),
        }
    }

    /// Shortest part of second order \[s\].
    pub fn shortest(&self) -> f64 {
        self.step / f64::from(1u32 << self.halvings)
    }
}

/// The next part of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// \[s\]
    pub length: f64,
    /// An Euler step instead of one of second order.
    pub is_euler: bool,
    /// Whether it may be rejected because it takes a penetration too deep; steps of second order always may.
    pub may_fail: bool,
}

/// What a finished part ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    Nothing,
    /// The reference jumps here.
    Jump,
    Step,
}

/// How a step is divided into parts.
pub trait Division: Debug + Clone + Copy + Send {
    /// Begins a step at `time`; `next_jump` returns the latest end of a part that begins at a time.
    fn begin_step(interval: &Interval, time: f64, clock: &mut Clock, next_jump: impl Fn(f64) -> f64) -> Self;
    fn next_part(&mut self, interval: &Interval, time: f64, clock: &mut Clock, next_jump: impl Fn(f64) -> f64) -> Part;
    /// Accepts the part; returns what ends with it, and resets the clock where the reference jumps.
    fn accept(&mut self, interval: &Interval, part: &Part, clock: &mut Clock) -> Ends;
    /// The part has to be retaken in shorter parts.
    fn reject(&mut self, interval: &Interval, part: &Part, clock: &mut Clock);
}

/// Position of a robot within its interval, and the part it takes next.
#[derive(Debug, Clone, Copy)]
pub struct StepPlan<V> {
    /// Whole steps done.
    steps: u32,
    /// `None` between steps.
    division: Option<V>,
    pub part: Part,
    /// Linear solves of the robot's last stage or step, see [`Model::SORTED_BY_STAGE`].
    solves: u32,
    /// Time since the interval began \[s\].
    progress: f64,
}

impl<V: Division> StepPlan<V> {
    pub fn at_start() -> Self {
        Self {
            steps: 0,
            division: None,
            part: Part { length: 0.0, is_euler: false, may_fail: false },
            solves: 0,
            progress: 0.0,
        }
    }

    pub fn has_ended(&self, interval: &Interval) -> bool {
        self.steps == interval.steps
    }

    /// Chooses the next part.
    pub fn choose_part<D: Driven>(&mut self, interval: &Interval, robot: &mut D) {
        let (time, mut clock) = (robot.body().state.time(), robot.body().clock);
        let next_jump = |time: f64| end_before(time, |time| robot.next_jump(time));
        let division = self.division.get_or_insert_with(|| V::begin_step(interval, time, &mut clock, next_jump));
        self.part = division.next_part(interval, time, &mut clock, next_jump);
        robot.body_mut().clock = clock;
        self.solves = robot.body().solves;
        self.progress = time - robot.body().interval_start();
    }

    /// Time from the beginning of the interval to that of the next part \[s\], and linear solves of the last stage or step.
    pub fn position(&self) -> (f64, u32) {
        (self.progress, self.solves)
    }

    /// Accepts the part: the robot has moved on by its length.
    pub fn accept<M: Model>(&mut self, interval: &Interval, body: &mut Body<M>) {
        let Some(division) = &mut self.division else { return };
        if division.accept(interval, &self.part, &mut body.clock) == Ends::Step {
            self.division = None;
            self.end_step(interval, body);
        }
    }

    /// The part is retaken.
    pub fn reject<M: Model>(&mut self, interval: &Interval, body: &mut Body<M>) {
        let Some(division) = &mut self.division else { return };
        body.statistics.events += u32::from(!self.part.is_euler);
        division.reject(interval, &self.part, &mut body.clock);
    }

    /// Sets the time without accumulated round-off and quarantines a diverged robot.
    fn end_step<M: Model>(&mut self, interval: &Interval, body: &mut Body<M>) {
        self.steps += 1;
        body.statistics.steps += 1;
        body.step_solves = 0;
        body.state.set_time(body.interval_start() + interval.step * f64::from(self.steps));
        body.quarantine();
    }
}
