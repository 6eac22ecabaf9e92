//! One sick robot in a fleet.

use snake_core::gait::{JointReference, Wave};
use snake_core::pegs::PegGrid;
use snake_core::planar::{Body, Fleet, PlanarSystem, Scripted, is_plausible};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_5, TABLE_7_5};
use snake_core::stepping::{ImplicitConfig, StepStatistics};

use crate::case::pegs;
use crate::figures::Figures;

/// Robots side by side, one of which may fall sick.
pub trait Flock {
    type Patient: Patient;

    /// `robots` robots that differ, advanced in steps of `step` \[s\].
    fn new(step: f64, robots: usize) -> Self;
    fn advance(&mut self, duration: f64);
    fn robot(&self, robot: usize) -> &Self::Patient;
    fn robot_mut(&mut self, robot: usize) -> &mut Self::Patient;
}

/// A robot that may fall sick.
pub trait Patient: Clone {
    /// Puts `poison` into a velocity; `place` says into which.
    fn poison(&mut self, place: usize, poison: f64);
    /// What happened in the last interval; whether the robot diverged is told apart.
    fn statistics(&self) -> &StepStatistics;
    /// Whether the robot is flagged and its state sane.
    fn is_contained(&self) -> bool;
    /// Of poses and twists.
    fn bits(&self) -> Vec<u64>;
}

/// Puts NaN or infinity into one robot of `ROBOTS` after a while, goes on for `periods` control periods, and
/// compares the others bit for bit with a healthy fleet; `broken` counts what differs, and a sick robot unnoticed.
pub fn poisoned<F: Flock>(step: f64, poison: f64, periods: u64) -> Figures {
    let (mut healthy, mut sick) = (F::new(step, ROBOTS), F::new(step, ROBOTS));
    let mut figures = Figures::default();
    for period in 0..periods as usize {
        let patient = (period * 5) % ROBOTS;
        let ill = period % 4 == 3;
        if ill {
            sick.robot_mut(patient).poison(period, poison);
        }
        healthy.advance(PERIOD);
        sick.advance(PERIOD);
        for k in 0..ROBOTS {
            let [robot, like] = [&sick, &healthy].map(|flock| flock.robot(k));
            figures.count(&StepStatistics { diverged: false, ..*like.statistics() });
            let sound = if ill && k == patient { robot.is_contained() } else { robot.bits() == like.bits() };
            figures.broken += u64::from(!sound);
        }
        if ill {
            sick.robot_mut(patient).clone_from(healthy.robot(patient));
        }
    }
    figures
}

type Undulator = Scripted<Wave>;

/// Robots in the plane.
pub struct PlanarFlock {
    system: PlanarSystem,
    fleet: Fleet,
    robots: Vec<Undulator>,
}

impl Flock for PlanarFlock {
    type Patient = Body;

    fn new(step: f64, count: usize) -> Self {
        let config = ImplicitConfig { step: Some(step), ..ImplicitConfig::default() };
        let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
        let system = PlanarSystem::new(robot, [0.2, 0.2], Default::default()).expect("the thesis's controller");
        Self { fleet: Fleet::new(config, &system, count), robots: robots(&system, count), system }
    }

    fn advance(&mut self, duration: f64) {
        self.fleet.advance(&self.system, &mut self.robots, duration, |_| true);
    }

    fn robot(&self, robot: usize) -> &Body {
        &self.robots[robot].body
    }

    fn robot_mut(&mut self, robot: usize) -> &mut Body {
        &mut self.robots[robot].body
    }
}

impl Patient for Body {
    fn poison(&mut self, place: usize, poison: f64) {
        self.state.twist[place % 11][place % 3] = poison;
    }

    fn statistics(&self) -> &StepStatistics {
        &self.statistics
    }

    fn is_contained(&self) -> bool {
        self.statistics.diverged && is_plausible(&self.state.pose, &self.state.twist)
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
        Scripted::new(&system.robot, PegGrid::new(&pegs(&TABLE_7_5[..k % 8])), START_7_5, &angles, wave)
    };
    (0..count).map(undulator).collect()
}

/// Two full registers of eight and a rest.
const ROBOTS: usize = 19;

/// \[s\]
const PERIOD: f64 = 0.05;
