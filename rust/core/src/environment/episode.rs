//! Bookkeeping of one episode: where it started, what it has cost, whether the robot is stuck.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::stepping::StepStatistics;

use super::config::{Energy, EnvConfig, Termination};
use super::goal::{Goal, Target};
use super::motion::{Motion, wrap_angle};
use super::reward::{RewardTerms, RewardWeights, Transition};
use super::signal::Summary;

/// What decides reward and end of an episode; constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    pub period: f64,
    pub max_steps: u32,
    pub corridor_half_width: f64,
    /// Weight m g of the robot \[N\].
    pub robot_weight: f64,
    pub weights: RewardWeights,
    /// What the energy counts.
    pub energy: Energy,
    pub termination: Termination,
}

impl Rules {
    pub fn new(config: &EnvConfig, robot_weight: f64) -> Self {
        Self {
            period: config.control_period,
            max_steps: config.max_episode_steps,
            corridor_half_width: config.corridor_half_width,
            robot_weight,
            weights: config.reward_weights,
            energy: config.energy,
            termination: config.termination,
        }
    }
}

/// An episode so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    pub steps: u32,
    pub goal: Goal,
    /// Mass of the robot relative to the nominal one.
    mass: f64,
    /// Motion at the last control instant.
    pub motion: Motion,
    /// Energy so far \[J\].
    energy: f64,
    /// Steps in a row in which the CG was slow, and all steps that counted as jammed.
    slow_steps: u32,
    jammed_steps: u32,
    pub summary: Summary,
}

impl Episode {
    /// An episode that begins with the robot's motion as given, with the commanded speed, if there is one; `mass` is
    /// relative to the nominal one.
    pub fn begin(target: Target, speed: Option<f64>, motion: Motion, mass: f64) -> Self {
        let goal = Goal::new(target, motion.position, speed);
        let summary = Summary {
            lateral_offset: goal.lateral_offset(motion.position),
            heading_error: wrap_angle(motion.heading - goal.bearing(motion.position)),
            ..Summary::default()
        };
        Self { steps: 0, goal, mass, motion, energy: 0.0, slow_steps: 0, jammed_steps: 0, summary }
    }

    /// Records one control period. After a divergence `motion` is the last good one and the
    /// work of the broken period does not count.
    pub fn record(
        &mut self,
        rules: &Rules,
        motion: Motion,
        report: &StepStatistics,
        action_change: f64,
        contacts: u32,
    ) {
        self.steps += 1;
        let moved = motion.position - self.motion.position;
        let commanded = self.goal.speed.map(|speed| {
            let (sin, cos) = self.bearing().sin_cos();
            Vector2::new(cos, sin) * (speed * rules.period)
        });
        let progress = self.goal.advance(self.motion.position, motion.position);
        let Rules { period, energy, .. } = *rules;
        let works = [report.positive_actuator_work, report.actuator_work, report.electrical_work];
        let [work, net_work, drawn] = if report.diverged { [0.0; 3] } else { works };
        self.energy += match energy {
            Energy::Mechanical => work,
            Energy::Electrical => drawn,
        };
        self.note_speed(rules, moved.norm() / rules.period);
        let before = std::mem::replace(&mut self.motion, motion);
        let reached = !report.diverged && self.distance() >= self.goal.span();
        let first_time = reached && !self.summary.is_success;
        let transition = Transition {
            before,
            after: motion,
            progress,
            commanded,
            positive_work: work,
            action_change,
            contacts,
            success: first_time,
        };
        let term_values = transition.term_values();
        self.summary = Summary {
            reward: RewardTerms::new(&rules.weights, &term_values),
            term_values,
            progress,
            positive_work: work,
            motor_power: net_work / period,
            electrical_power: drawn / period,
            is_success: reached || self.summary.is_success,
            contacts,
            residual: report.residual,
            iterations: report.iterations,
            unconverged: report.unconverged,
            fallbacks: report.fallbacks,
            diverged: report.diverged,
            penetrated: report.penetrated,
            ..self.so_far(rules)
        };
    }

    /// Distance towards the goal covered since the start \[m\].
    pub fn distance(&self) -> f64 {
        self.goal.covered(self.motion.position)
    }

    /// Share of the way to the goal that is left.
    pub fn remaining(&self) -> f64 {
        1.0 - self.distance() / self.goal.span()
    }

    /// Angle from +x to the goal direction \[rad\].
    pub fn bearing(&self) -> f64 {
        self.goal.bearing(self.motion.position)
    }

    /// The goal is reached or the corridor left, where that ends an episode.
    pub fn is_terminated(&self, rules: &Rules) -> bool {
        let Termination { is_success, left_corridor } = rules.termination;
        is_success && self.summary.is_success || left_corridor && self.summary.left_corridor
    }

    /// Time is up, as Gymnasium's `TimeLimit` has it: also in a step that terminates. Or the computation broke, or
    /// left a link inside an obstacle, which says nothing about the value of the state.
    pub fn is_truncated(&self, rules: &Rules) -> bool {
        self.steps >= rules.max_steps || self.summary.diverged || self.summary.penetrated
    }

    fn note_speed(&mut self, rules: &Rules, speed: f64) {
        self.slow_steps = if speed < JAM_SPEED { self.slow_steps + 1 } else { 0 };
        self.jammed_steps += u32::from(self.is_jammed(rules));
    }

    fn is_jammed(&self, rules: &Rules) -> bool {
        f64::from(self.slow_steps) * rules.period > JAM_TIME * (1.0 + 1e-9)
    }

    /// The part of the summary that does not depend only on the last period.
    fn so_far(&self, rules: &Rules) -> Summary {
        let time = f64::from(self.steps) * rules.period;
        let distance = self.distance();
        let weight = self.mass * rules.robot_weight;
        let position = self.motion.position;
        Summary {
            distance,
            lateral_offset: self.goal.lateral_offset(position),
            heading_error: wrap_angle(self.motion.heading - self.bearing()),
            speed: distance / time,
            energy: self.energy,
            cost_of_transport: self.energy / (weight * distance.abs().max(SHORTEST_DISTANCE)),
            jam: self.is_jammed(rules),
            jam_ratio: f64::from(self.jammed_steps) / f64::from(self.steps),
            left_corridor: self.goal.is_left(position, rules.corridor_half_width),
            time,
            ..Summary::default()
        }
    }
}

/// A robot is jammed when its CG moves slower than this \[m/s\] for longer than this \[s\].
const JAM_SPEED: f64 = 0.02;
const JAM_TIME: f64 = 0.3;

/// Shorter distances count as this one in the cost of transport \[m\].
const SHORTEST_DISTANCE: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: Target = Target::Line { distance: 2.0, centre_line: 0.1 };

    fn rules() -> Rules {
        Rules::new(&EnvConfig::default(), 73.6)
    }

    fn at(x: f64, y: f64) -> Motion {
        Motion { position: Vector2::new(x, y), velocity: Vector2::zeros(), heading: 0.0, yaw_rate: 0.0 }
    }

    fn report(work: f64) -> StepStatistics {
        StepStatistics { positive_actuator_work: work, ..StepStatistics::default() }
    }

    #[test]
    fn a_robot_is_jammed_after_more_than_three_tenths_of_a_second_below_two_centimetres_a_second() {
        let rules = rules();
        let mut episode = Episode::begin(LINE, None, at(0.0, 0.1), 1.0);
        // 0.05 s per step: six slow steps are 0.3 s, the seventh exceeds them.
        for step in 1..=8 {
            episode.record(&rules, at(0.0009 * f64::from(step), 0.1), &report(0.0), 0.0, 0);
            assert_eq!(episode.summary.jam, step > 6, "step {step}");
        }
        assert_eq!(episode.summary.jam_ratio, 2.0 / 8.0);
        episode.record(&rules, at(0.1, 0.1), &report(0.0), 0.0, 0);
        assert!(!episode.summary.jam);
    }

    #[test]
    fn success_needs_the_goal_distance_and_pays_once() {
        let rules = rules();
        let mut episode = Episode::begin(LINE, None, at(0.5, 0.1), 1.0);
        episode.record(&rules, at(2.4999, 0.1), &report(1.0), 0.0, 0);
        assert!(!episode.summary.is_success && !episode.is_terminated(&rules));
        episode.record(&rules, at(2.5, 0.1), &report(1.0), 0.0, 0);
        assert!(episode.summary.is_success && episode.is_terminated(&rules));
        assert_eq!(episode.summary.reward.get("success"), rules.weights.get("success"));
        assert!((episode.summary.cost_of_transport - 2.0 / (73.6 * 2.0)).abs() < 1e-15);
        let on = Rules { termination: Termination { is_success: false, left_corridor: false }, ..rules };
        episode.record(&on, at(2.6, 5.0), &report(1.0), 0.0, 0);
        assert!(episode.summary.is_success && episode.summary.left_corridor && !episode.is_terminated(&on));
        assert_eq!(episode.summary.reward.get("success"), Some(0.0));
    }

    #[test]
    fn the_rewards_of_progress_add_up_to_the_distance() {
        let rules = rules();
        let mut episode = Episode::begin(LINE, None, at(0.0, 0.1), 1.0);
        let mut sum = 0.0;
        for x in [0.1, -0.2, 0.4, 0.7] {
            episode.record(&rules, at(x, 0.1), &report(0.0), 0.0, 0);
            sum += episode.summary.reward.get("progress").unwrap();
        }
        assert!((sum - rules.weights.get("progress").unwrap() * episode.distance()).abs() < 1e-12);
    }

    #[test]
    fn the_corridor_is_left_to_either_side_of_its_centre_line() {
        let rules = rules();
        for (y, outside) in [(0.89, false), (0.91, true), (-0.69, false), (-0.71, true)] {
            let mut episode = Episode::begin(LINE, None, at(0.0, 0.1), 1.0);
            episode.record(&rules, at(0.0, y), &report(0.0), 0.0, 0);
            assert_eq!(episode.summary.left_corridor, outside, "y = {y}");
        }
    }

    #[test]
    fn nothing_is_infinite_before_the_robot_has_moved() {
        let rules = rules();
        let mut episode = Episode::begin(LINE, None, at(0.0, 0.1), 1.0);
        assert!(episode.summary.signals().iter().all(|value| value.is_finite()));
        episode.record(&rules, at(0.0, 0.1), &report(3.0), 0.5, 0);
        assert!(episode.summary.signals().iter().all(|value| value.is_finite()));
    }

    #[test]
    fn a_divergence_truncates_and_costs_nothing() {
        let rules = rules();
        let mut episode = Episode::begin(LINE, None, at(0.0, 0.1), 1.0);
        let broken = StepStatistics { positive_actuator_work: f64::NAN, diverged: true, ..StepStatistics::default() };
        episode.record(&rules, at(0.0, 0.1), &broken, 0.0, 0);
        assert!(episode.is_truncated(&rules) && !episode.is_terminated(&rules) && episode.summary.diverged);
        assert!(episode.summary.signals().iter().all(|value| value.is_finite()));
    }
}
