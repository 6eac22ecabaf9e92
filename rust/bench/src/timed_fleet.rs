//! Robots of one scene, whose steps are timed.

use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::gait::{Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{self, Planar};
use snake_core::scene::START_FREE;
use snake_core::stepping::{Fleet, ImplicitConfig, Model, Scripted};

use crate::fleet::{ROBOTS, WINDOW, Window, staggered, time_window};
use crate::reference::Sampled;
use crate::scenes::aiko;

/// Robots of one scene.
pub struct TimedFleet<M: Model, R> {
    system: M::System,
    fleet: Fleet<M>,
    robots: Vec<Scripted<R, M>>,
}

impl<M: Model, R: Reference<M::Target> + Clone> TimedFleet<M, R> {
    pub fn new<S: Sampled<Model = M, Gait = R>>(scenario: &S) -> Result<Self, ConfigError> {
        let system = scenario.system()?;
        let robots = staggered(scenario, &system, ROBOTS);
        let fleet = Fleet::new(ImplicitConfig::default(), &system, ROBOTS);
        Ok(Self { system, fleet, robots })
    }

    pub fn window(&mut self) -> Window {
        time_window(&self.system, &mut self.fleet, &self.robots)
    }

    pub fn us_per_step(&mut self) -> f64 {
        let window = self.window();
        1e6 * window.spent.cpu / window.steps
    }
}

impl TimedFleet<Planar, Wave> {
    /// Robots that rock about a posture with all joints at `bend`, at different phases.
    pub fn coiled(bend: f64) -> Result<Self, ConfigError> {
        let mut scenario = aiko("coil", "", &[], [0.2, 0.2], START_FREE);
        scenario.controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
        let system = scenario.system()?;
        let robot = |k: usize| {
            let wave = Wave { amplitude: 0.05, omega: 3.0, beta: 0.0, gamma: bend, phase: 0.1 * k as f64 };
            let straight = vec![0.0; system.robot.joint_count()];
            planar::Scripted::new(&system.robot, ObstacleGrid::of(&[]), scenario.start, &straight, wave)
        };
        let mut robots: Vec<_> = (0..ROBOTS).map(robot).collect();
        let mut fleet = Fleet::new(ImplicitConfig::default(), &system, ROBOTS);
        fleet.advance(&system, robots.iter_mut().map(Scripted::driven), SETTLED);
        Ok(Self { system, fleet, robots })
    }

    /// Mean number of pairs of links that press on each other in a window.
    pub fn pressed_pairs(&mut self) -> f64 {
        let mut moving = self.robots.clone();
        let mut count = 0;
        for _ in 0..SAMPLES {
            self.fleet.advance(&self.system, moving.iter_mut().map(Scripted::driven), WINDOW / SAMPLES as f64);
            for robot in &moving {
                count += robot.body.warm_start.self_contacts.pressed_pairs(robot.body.state.pose.len());
            }
        }
        count as f64 / (SAMPLES * ROBOTS) as f64
    }
}

/// Time after which a robot that was straight has coiled \[s\].
const SETTLED: f64 = 4.0;

/// Instants of a window at which pressed links are counted.
const SAMPLES: usize = 8;
