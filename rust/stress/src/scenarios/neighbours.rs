//! One sick robot in a fleet.

use snake_core::gait::{JointReference, Wave};
use snake_core::pegs::PegGrid;
use snake_core::planar::{PlanarState, is_sane};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_5, TABLE_7_5};
use snake_core::simulation::StepReport;
use snake_core::stepper::{Fleet, IntegratorConfig, Plant, Scripted};

use crate::case::pegs;
use crate::figures::Figures;

/// Robots side by side, one of which may fall sick.
pub trait Flock {
    /// `robots` robots that differ, advanced in steps of `step` \[s\].
    fn new(step: f64, robots: usize) -> Self;
    /// Puts `poison` into a velocity of one robot; `place` says into which.
    fn poison(&mut self, robot: usize, place: usize, poison: f64);
    fn advance(&mut self, duration: f64);
    /// What happened to a robot in the last interval; whether it diverged is told apart.
    fn report(&self, robot: usize) -> StepReport;
    /// Whether a robot is flagged and its state sane.
    fn is_contained(&self, robot: usize) -> bool;
    /// Whether a robot moves as its like in `other`, bit for bit.
    fn moves_alike(&self, other: &Self, robot: usize) -> bool;
    /// Takes a robot over from `other`.
    fn cure(&mut self, other: &Self, robot: usize);
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
            sick.poison(patient, period, poison);
        }
        healthy.advance(PERIOD);
        sick.advance(PERIOD);
        for k in 0..ROBOTS {
            figures.count(&healthy.report(k));
            let sound = if ill && k == patient { sick.is_contained(k) } else { sick.moves_alike(&healthy, k) };
            figures.broken += u64::from(!sound);
        }
        if ill {
            sick.cure(&healthy, patient);
        }
    }
    figures
}

type Undulator = Scripted<Wave>;

/// Robots in the plane.
pub struct PlanarFlock {
    plant: Plant,
    fleet: Fleet,
    robots: Vec<Undulator>,
}

impl Flock for PlanarFlock {
    fn new(step: f64, count: usize) -> Self {
        let config = IntegratorConfig { step: Some(step), ..IntegratorConfig::default() };
        let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
        let plant = Plant::new(robot, [0.2, 0.2], Default::default()).expect("the thesis's controller");
        Self { fleet: Fleet::new(config, &plant, count), robots: robots(&plant, count), plant }
    }

    fn poison(&mut self, robot: usize, place: usize, poison: f64) {
        self.robots[robot].body.state.twist[place % 11][place % 3] = poison;
    }

    fn advance(&mut self, duration: f64) {
        self.fleet.advance(&self.plant, &mut self.robots, duration, |_| true);
    }

    fn report(&self, robot: usize) -> StepReport {
        StepReport { diverged: false, ..StepReport::of(&self.robots[robot].body) }
    }

    fn is_contained(&self, robot: usize) -> bool {
        let body = &self.robots[robot].body;
        body.diverged && is_sane(&body.state.pose, &body.state.twist)
    }

    fn moves_alike(&self, other: &Self, robot: usize) -> bool {
        bits(&self.robots[robot].body.state) == bits(&other.robots[robot].body.state)
    }

    fn cure(&mut self, other: &Self, robot: usize) {
        self.robots[robot].body.clone_from(&other.robots[robot].body);
    }
}

/// Robots that differ in gait and in the number of pegs around them.
fn robots(plant: &Plant, count: usize) -> Vec<Undulator> {
    let undulator = |k: usize| {
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        let angles: Vec<f64> = (0..10).map(|joint| wave.target(joint, 0.0).angle).collect();
        Scripted::new(&plant.robot, PegGrid::new(&pegs(&TABLE_7_5[..k % 8])), START_7_5, &angles, wave)
    };
    (0..count).map(undulator).collect()
}

fn bits(state: &PlanarState) -> Vec<u64> {
    state.pose.iter().chain(&state.twist).flat_map(|v| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>()).collect()
}

/// Two full registers of eight and a rest.
const ROBOTS: usize = 19;

/// \[s\]
const PERIOD: f64 = 0.05;
