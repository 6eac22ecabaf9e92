//! One faulty robot in a fleet.

use snake_core::gait::{Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Body, Fleet, PlanarSystem, Scripted};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_5, TABLE_7_5};
use snake_core::stepping::{ImplicitConfig, StepStatistics};

use crate::case::pegs;
use crate::figures::Figures;

/// Robots side by side, one of which may receive an invalid velocity.
pub trait TestFleet {
    type Robot: FaultyRobot;

    /// `robots` robots that differ, advanced in steps of `step` \[s\].
    fn new(step: f64, robots: usize) -> Self;
    fn advance(&mut self, duration: f64);
    fn robot(&self, robot: usize) -> &Self::Robot;
    fn robot_mut(&mut self, robot: usize) -> &mut Self::Robot;
}

/// A robot that may receive an invalid velocity.
pub trait FaultyRobot: Clone {
    /// Puts `poison` into a velocity; `place` chooses which.
    fn poison(&mut self, place: usize, poison: f64);
    /// Statistics of the last interval.
    fn statistics(&self) -> &StepStatistics;
    /// Whether the robot is flagged and its state plausible.
    fn is_contained(&self) -> bool;
    /// Bits of poses and twists.
    fn bits(&self) -> Vec<u64>;
}

/// Puts NaN or infinity into one robot of `ROBOTS` after a while, goes on for `periods` control periods, and compares
/// the others bit for bit with a healthy fleet; `broken` counts those that differ, and faulty robots that are not
/// flagged.
pub fn poisoned<F: TestFleet>(step: f64, poison: f64, periods: u64) -> Figures {
    let (mut healthy, mut faulty) = (F::new(step, ROBOTS), F::new(step, ROBOTS));
    let mut figures = Figures::default();
    for period in 0..periods as usize {
        let victim = (period * 5) % ROBOTS;
        let is_poisoned = period % 4 == 3;
        if is_poisoned {
            faulty.robot_mut(victim).poison(period, poison);
        }
        healthy.advance(PERIOD);
        faulty.advance(PERIOD);
        for k in 0..ROBOTS {
            let [robot, like] = [&faulty, &healthy].map(|fleet| fleet.robot(k));
            figures.count(&StepStatistics { diverged: false, ..*like.statistics() });
            let sound = if is_poisoned && k == victim { robot.is_contained() } else { robot.bits() == like.bits() };
            figures.broken += u64::from(!sound);
        }
        if is_poisoned {
            faulty.robot_mut(victim).clone_from(healthy.robot(victim));
        }
    }
    figures
}

type Undulator = Scripted<Wave>;

/// Robots in the plane.
pub struct PlanarTestFleet {
    system: PlanarSystem,
    fleet: Fleet,
    robots: Vec<Undulator>,
}

impl TestFleet for PlanarTestFleet {
    type Robot = Body;

    fn new(step: f64, count: usize) -> Self {
        let config = ImplicitConfig { step: Some(step), ..ImplicitConfig::default() };
        let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
        let system = PlanarSystem::new(robot, [0.2, 0.2], Default::default()).expect("the thesis's controller");
        Self { fleet: Fleet::new(config, &system, count), robots: robots(&system, count), system }
    }

    fn advance(&mut self, duration: f64) {
        self.fleet.advance(&self.system, self.robots.iter_mut().map(Undulator::driven), duration);
    }

    fn robot(&self, robot: usize) -> &Body {
        &self.robots[robot].body
    }

    fn robot_mut(&mut self, robot: usize) -> &mut Body {
        &mut self.robots[robot].body
    }
}

impl FaultyRobot for Body {
    fn poison(&mut self, place: usize, poison: f64) {
        self.state.twist[place % 11][place % 3] = poison;
    }

    fn statistics(&self) -> &StepStatistics {
        &self.statistics
    }

    fn is_contained(&self) -> bool {
        self.statistics.diverged && self.state.is_plausible()
    }

    fn bits(&self) -> Vec<u64> {
        self.state.pose.iter().chain(&self.state.twist).flatten().map(|x| x.to_bits()).collect()
    }
}

/// Robots that differ in gait and in the number of pegs around them.
fn robots(system: &PlanarSystem, count: usize) -> Vec<Undulator> {
    let undulator = |k: usize| {
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        let angles: Vec<f64> = (0..10).map(|joint| wave.target(joint, 0.0).angle).collect();
        Scripted::new(&system.robot, ObstacleGrid::of(&pegs(&TABLE_7_5[..k % 8])), START_7_5, &angles, wave)
    };
    (0..count).map(undulator).collect()
}

/// Two full registers of eight and a rest.
const ROBOTS: usize = 19;

/// \[s\]
const PERIOD: f64 = 0.05;
