//! One robot with steps as long as an accuracy allows.
//!
//! * A step is that of order 2. Its second stage is predicted by a straight line through the velocities u_A and u_1;
//!   how far the stage ends from there, as a way of the robot's points, is a second difference of the velocity times
//!   the step, of the same order h^3 as the error of the step, and it costs nothing. It sees whatever bends the
//!   velocity: acceleration, stick-slip, a contact that opens.
//! * A contact that closes is a jump of the velocity somewhere in the step, by which the extrapolated impulses would
//!   bounce (T 3.58 != D6). The step is then an Euler step, and its error at most the jump times its
//!   length: halving bisects for the impact until that is allowed.
//! * A step may err by a share of the tolerance times `10/s h + 0.03`: so much a second, and so much at every kink.

use crate::planar::pace::Trial;
use crate::planar::{Driven, Plant};
use crate::stepping::lanes::lanes_of;
use crate::stepping::sdirk::GAMMA;
use crate::stepping::{IntegratorConfig, Method};

use super::Group;

/// Workspace of the adaptive scheme, for one robot at a time.
#[derive(Debug, Clone)]
pub struct Adaptive {
    group: Group<f64>,
    /// Unit of what a step may err \[m\].
    share: f64,
    /// Longest step \[s\].
    longest: f64,
}

impl Adaptive {
    pub fn new(config: IntegratorConfig, plant: &Plant) -> Self {
        let accuracy = (SOLVER_ACCURACY * config.tolerance()).clamp(SHARPEST_SOLVER, BLUNTEST_SOLVER);
        let stages = IntegratorConfig { method: Method::Implicit, tolerance: Some(accuracy), ..config };
        Self { group: Group::new(stages, plant), share: calibrated(config.tolerance()), longest: config.step() }
    }

    /// Integrates over `duration`; the last step ends exactly there.
    pub fn advance<D: Driven>(&mut self, plant: &Plant, robot: &mut D, duration: f64) {
        robot.body_mut().begin();
        let mut left = duration;
        while left > 0.0 {
            let h = self.step(plant, robot, left);
            let body = robot.body_mut();
            body.tally.steps += 1;
            left = if h == left { 0.0 } else { left - h };
            body.state.time = body.interval_start() + (duration - left);
            body.contain();
            if body.diverged {
                return;
            }
        }
    }

    /// One step, tried shorter and shorter until it stands; returns its length.
    fn step<D: Driven>(&mut self, plant: &Plant, robot: &mut D, left: f64) -> f64 {
        loop {
            let mut pace = robot.body().warm_start.pace;
            let h = pace.fit(left, self.longest);
            let trial = self.attempt(plant, robot, h);
            pace.learn(h, trial);
            robot.body_mut().warm_start.pace = pace;
            if trial.stands(h) {
                self.accept(plant, robot, h, trial);
                return h;
            }
        }
    }

    /// Tries a step of second order, and where a contact closes in it an Euler step.
    fn attempt<D: Driven>(&mut self, plant: &Plant, robot: &mut D, h: f64) -> Trial {
        let allowed = self.share * (PER_SECOND * h + PER_STEP);
        match self.sdirk_step(plant, robot, h) {
            Some(deviation) => Trial::Smooth(deviation / allowed),
            None => Trial::Impact(self.euler_step(plant, robot, h) / (self.share * PER_IMPACT)),
        }
    }

    /// How far the second stage ends from its prediction \[m\]; `None` where a contact closes.
    fn sdirk_step<D: Driven>(&mut self, plant: &Plant, robot: &mut D, h: f64) -> Option<f64> {
        let (group, fleet) = (&mut self.group, std::slice::from_mut(robot));
        let (lanes, c) = (lanes_of(&ALONE), GAMMA * h);
        group.load(plant, fleet, &ALONE);
        // How far stages end from their predictions is wanted without pegs, too.
        group.work.among_pegs = true;
        group.begin_first_stage();
        group.run_stage(plant, fleet, &ALONE, lanes, c, c);
        if group.closing[0] {
            return None;
        }
        group.keep_first_stage();
        group.begin_second_stage(h);
        group.run_stage(plant, fleet, &ALONE, lanes, c, h);
        (!group.closing[0]).then_some(group.deviation)
    }

    /// How much the velocity changes in an Euler step, as a way of the robot's points over the step \[m\].
    fn euler_step<D: Driven>(&mut self, plant: &Plant, robot: &mut D, h: f64) -> f64 {
        let (group, fleet) = (&mut self.group, std::slice::from_mut(robot));
        group.begin_first_stage();
        group.run_stage(plant, fleet, &ALONE, lanes_of(&ALONE), h, h);
        group.deviation
    }

    fn accept<D: Driven>(&mut self, plant: &Plant, robot: &mut D, h: f64, trial: Trial) {
        let (fleet, lanes) = (std::slice::from_mut(robot), lanes_of(&ALONE));
        match trial {
            Trial::Smooth(_) => self.group.add_first_stage(fleet, &ALONE, lanes),
            Trial::Impact(_) => fleet[0].body_mut().tally.events += 1,
        }
        self.group.accept(plant, fleet, &ALONE, lanes, h);
    }
}

/// Tolerance proportionality: a sharper tolerance resolves more kinks, whose errors add up, so with shares in
/// proportion errors would go with the tolerance to the power 5/6 only.
fn calibrated(tolerance: f64) -> f64 {
    SHARE * tolerance * (tolerance / 1e-3).powf(0.2)
}

/// The members of a group of one.
const ALONE: [usize; 1] = [0];

/// What a step may err, in shares: for each second of its length \[1/s\], for being a step, and for taking an impact;
/// and the share of a tolerance of 1 mm. Chosen so that the error after a few seconds of motion is about the tolerance,
/// see docs/method.md and `rust/core/tests/planar/adaptive_accuracy.rs`.
const PER_SECOND: f64 = 10.0;
const PER_STEP: f64 = 0.03;
const PER_IMPACT: f64 = 0.1;
const SHARE: f64 = 1.3;

/// Accuracy of the stages' velocities over that of positions \[1/s\], and its limits \[m/s\].
const SOLVER_ACCURACY: f64 = 1e-3;
const SHARPEST_SOLVER: f64 = 1e-10;
const BLUNTEST_SOLVER: f64 = 1e-8;
