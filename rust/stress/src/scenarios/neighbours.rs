//! One faulty robot in a fleet.

use snake_core::gait::{Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{self, Planar, PlanarSystem};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_5, Scene, TABLE_7_5};
use snake_core::stepping::{Body, Fleet, ImplicitConfig, Model, Scripted, StepStatistics};

use crate::case::pegs;
use crate::figures::Figures;

/// Robots side by side, one of which may receive an invalid velocity.
pub struct TestFleet<M: Model, R> {
    system: M::System,
    fleet: Fleet<M>,
    robots: Vec<Scripted<R, M>>,
    /// A component of a twist; a number chooses which.
    component: fn(&mut M::Twist, usize) -> &mut f64,
}

impl<M: Model, R: Reference<M::Target>> TestFleet<M, R> {
    /// Robots advanced in steps of `step` \[s\].
    pub fn new(
        step: f64,
        system: M::System,
        robots: Vec<Scripted<R, M>>,
        component: fn(&mut M::Twist, usize) -> &mut f64,
    ) -> Self {
        let config = ImplicitConfig { step: Some(step), ..ImplicitConfig::default() };
        Self { fleet: Fleet::new(config, &system, robots.len()), system, robots, component }
    }

    fn advance(&mut self) {
        self.fleet.advance(&self.system, self.robots.iter_mut().map(Scripted::driven), PERIOD);
    }
}

/// Puts NaN or infinity into one robot of a fleet after a while, goes on for `periods` control periods, and compares
/// the others with those of a healthy fleet; `broken` counts those that differ, and faulty robots that are not flagged
/// or not in a plausible state.
pub fn poisoned<M: Model, R: Reference<M::Target>>(
    [mut healthy, mut faulty]: [TestFleet<M, R>; 2],
    poison: f64,
    periods: u64,
) -> Figures {
    let mut figures = Figures::default();
    // Tells zeros of either sign apart, as their bits do.
    let text = |body: &Body<M>| format!("{:?}", body.state);
    for period in 0..periods as usize {
        let victim = (period * 5) % ROBOTS;
        let is_poisoned = period % 4 == 3;
        if is_poisoned {
            *(faulty.component)(&mut faulty.robots[victim].body.state.twist[period % 11], period) = poison;
        }
        healthy.advance();
        faulty.advance();
        for (k, (robot, like)) in faulty.robots.iter().zip(&healthy.robots).enumerate() {
            let (robot, like) = (&robot.body, &like.body);
            figures.count(&StepStatistics { diverged: false, ..like.statistics });
            let sound = if is_poisoned && k == victim {
                robot.statistics.diverged && robot.state.is_plausible()
            } else {
                text(robot) == text(like)
            };
            figures.broken += u64::from(!sound);
        }
        if is_poisoned {
            faulty.robots[victim].body.clone_from(&healthy.robots[victim].body);
        }
    }
    figures
}

/// Robots in the plane that differ in gait and in the number of pegs around them.
pub fn in_the_plane(step: f64) -> TestFleet<Planar, Wave> {
    let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
    let ground = Scene::new(&Default::default()).expect("level ground");
    let system = PlanarSystem::new(robot, &ground, Default::default()).expect("the thesis's controller");
    let undulator = |k: usize| {
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        let angles: Vec<f64> = (0..10).map(|joint| wave.target(joint, 0.0).angle).collect();
        planar::Scripted::new(&system.robot, ObstacleGrid::of(&pegs(&TABLE_7_5[..k % 8])), START_7_5, &angles, wave)
    };
    let robots = (0..ROBOTS).map(undulator).collect();
    TestFleet::new(step, system, robots, |twist, place| &mut twist[place % 3])
}

/// Two full registers of eight and a rest.
pub const ROBOTS: usize = 19;

/// \[s\]
const PERIOD: f64 = 0.05;
