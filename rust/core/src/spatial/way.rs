//! One robot's way through an interval: equal steps, taken in parts where forces or references change abruptly.
//!
//! * A step in which forces change abruptly is halved and halved again, and at last taken as Euler steps.
//! * A step in which the joints' reference jumps, as soft start lets it, ends a part there: forces of the time before
//!   are no guess at those after. Parts then double, beginning with a short one that resolves how the joints jump after
//!   it.
//! * The first parts after a robot was placed are short.

use crate::stepping::IntegratorConfig;
use crate::stepping::start::{end_before, first_step, longest_step};

use super::SpatialDriven;

/// The equal steps of an interval, and how they are divided.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// Length of a step \[s\].
    pub step: f64,
    steps: u32,
    /// The configured length of a step, by which starts are graded \[s\].
    configured: f64,
    /// Whether steps are Euler steps from the outset.
    euler: bool,
    /// Shortest part of a step tried with second order \[s\], and how many Euler steps replace it.
    shortest: f64,
    euler_steps: f64,
}

impl Interval {
    pub fn new(config: &IntegratorConfig, duration: f64) -> Self {
        let steps = config.steps_in(duration);
        let step = duration / f64::from(steps);
        Self {
            step,
            steps,
            configured: config.step(),
            euler: config.order == 1,
            shortest: step / f64::from(1 << config.event_halvings()),
            euler_steps: f64::from(config.event_steps()),
        }
    }
}

/// Where a robot is within its interval, and what it tries next.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Whole steps done.
    steps: u32,
    /// How much of the present step is done \[s\].
    done: f64,
    /// Length of the part at hand \[s\].
    pub length: f64,
    /// Where it ends.
    end: End,
    /// Longest part to be tried \[s\].
    next: f64,
    /// Euler steps at hand, if any.
    euler: Option<Euler>,
}

/// What bounds a part of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Nothing,
    Step,
    Euler,
    Jump,
}

/// Part of a step that is taken in Euler steps.
#[derive(Debug, Clone, Copy)]
struct Euler {
    /// Where it ends, after the start of the step \[s\].
    end: f64,
    /// Length of its steps, which are halved where links sink \[s\].
    step: f64,
}

impl Way {
    pub fn new(interval: &Interval) -> Self {
        let mut way = Self { steps: 0, done: 0.0, length: 0.0, end: End::Nothing, next: 0.0, euler: None };
        way.begin_step(interval);
        way
    }

    fn begin_step(&mut self, interval: &Interval) {
        self.done = 0.0;
        self.next = interval.step;
        self.euler = interval.euler.then_some(Euler { end: interval.step, step: interval.step });
    }

    pub fn has_ended(&self, interval: &Interval) -> bool {
        self.steps == interval.steps
    }

    pub fn is_euler(&self) -> bool {
        self.euler.is_some()
    }

    /// Whether the Euler step at hand may still be halved.
    pub fn may_fail(&self) -> bool {
        self.euler.is_some_and(|euler| self.length > euler.step * SHORTEST_EULER)
    }

    /// Chooses the next part.
    pub fn plan<D: SpatialDriven>(&mut self, interval: &Interval, robot: &D) {
        let (time, motion) = (robot.body().state.time, &robot.body().motion);
        let (mut left, mut longest);
        (left, self.end, longest) = match self.euler {
            Some(Euler { end, step }) => (end - self.done, End::Euler, step),
            None => (interval.step - self.done, End::Step, longest_step(interval.configured, motion.elapsed)),
        };
        let to_jump = end_before(time, |time| robot.next_jump(time)) - time;
        if to_jump < left {
            (left, self.end) = (to_jump, End::Jump);
        }
        if self.euler.is_none() {
            longest = longest.min(first_step(interval.configured) + motion.calm);
        }
        // Two equal parts rather than a long and a tiny one.
        let wanted = self.next.min(longest);
        (self.length, self.end) = match wanted / left {
            ALMOST..=f64::INFINITY => (left, self.end),
            0.5..ALMOST => (0.5 * left, End::Nothing),
            _ => (wanted, End::Nothing),
        };
    }

    /// The part stands: the robot has moved on by its length.
    pub fn accept<D: SpatialDriven>(&mut self, interval: &Interval, robot: &mut D) {
        self.done += self.length;
        self.next = 2.0 * self.length;
        match self.end {
            End::Nothing => {}
            End::Jump => robot.body_mut().motion.calm = 0.0,
            End::Euler if interval.step - self.done > (1.0 - ALMOST) * interval.step => {
                (self.euler, self.next) = (None, interval.step);
            }
            End::Euler | End::Step => self.end_step(interval, robot),
        }
    }

    /// Sets the time free of accumulated round-off and takes a diverged robot out.
    fn end_step<D: SpatialDriven>(&mut self, interval: &Interval, robot: &mut D) {
        self.steps += 1;
        self.begin_step(interval);
        let body = robot.body_mut();
        body.tally.steps += 1;
        body.state.time = body.interval_start() + interval.step * f64::from(self.steps);
        if !body.motion.speed.is_sane() {
            body.contain();
        }
    }

    /// The part does not do: it is tried shorter, or at last in Euler steps.
    pub fn reject(&mut self, interval: &Interval) {
        self.next = 0.5 * self.length;
        if self.euler.is_none() && self.next < ALMOST * interval.shortest {
            self.next = self.length / interval.euler_steps;
            self.euler = Some(Euler { end: self.done + self.length, step: self.next });
        }
    }
}

/// Share of what is left from which on a part takes all of it.
const ALMOST: f64 = 0.999;

/// Shortest Euler step for links that sink, over the first one tried.
const SHORTEST_EULER: f64 = 1.0 / 64.0 + 1e-3;
