//! A fleet whose robots are at different phases of their motion.

use snake_core::gait::Reference;
use snake_core::stepping::{Fleet, ImplicitConfig, Model, Scripted, StepStatistics};

use crate::clock::{Spent, spent};
use crate::reference::{RobotOf, Sampled, SystemOf};

/// Simulated time over which a fleet is timed \[s\]: with [`STAGGER`] its robots cover five seconds.
pub const WINDOW: f64 = 0.6;

/// Robots in a fleet, and the time by which each is ahead of the one before \[s\].
pub const ROBOTS: usize = 64;
const STAGGER: f64 = 0.07;

/// `count` robots of one scenario, robot k by k * 0.07 s ahead.
pub fn staggered<S: Sampled>(scenario: &S, system: &SystemOf<S>, count: usize) -> Vec<RobotOf<S>> {
    let mut robots = vec![scenario.at_start(system); count];
    let mut fleet = Fleet::new(ImplicitConfig::default(), system, count);
    for k in 1..count {
        // Robot k takes part in the first k of all moves.
        fleet.advance(system, robots[k..].iter_mut().map(Scripted::driven), STAGGER);
    }
    robots
}

/// One window of a fleet: its time on this thread, and the work of all robots together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    pub spent: Spent,
    pub steps: f64,
    /// Linear solves.
    pub iterations: f64,
    /// Steps, and parts of steps, retaken because a peg's force changed abruptly.
    pub events: f64,
}

/// Lets a fleet that starts from `robots` move for one window.
pub fn time_window<M: Model, R: Reference<M::Target> + Clone>(
    system: &M::System,
    fleet: &mut Fleet<M>,
    robots: &[Scripted<R, M>],
) -> Window {
    let mut moving = robots.to_vec();
    let ((), spent) = spent(|| fleet.advance(system, moving.iter_mut().map(Scripted::driven), WINDOW));
    let sum =
        |count: fn(&StepStatistics) -> u32| moving.iter().map(|robot| f64::from(count(&robot.body.statistics))).sum();
    Window {
        spent,
        steps: sum(|tally| tally.steps),
        iterations: sum(|tally| tally.iterations),
        events: sum(|tally| tally.events),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn robots_are_staggered_over_the_five_seconds_that_are_judged() {
        let scenario = &scenes::all()[0];
        let system = scenario.system().unwrap();
        let robots = staggered(scenario, &system, ROBOTS);
        for (k, robot) in robots.iter().enumerate() {
            assert!((robot.body.state.time - STAGGER * k as f64).abs() < 1e-9);
        }
        let end = robots[ROBOTS - 1].body.state.time + WINDOW;
        assert!((end - scenes::DURATION).abs() < 0.02, "{end}");
    }
}
