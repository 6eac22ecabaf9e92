//! `simulate_minimal`: one scripted robot of the minimal model (T ch. 6), sampled.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::gait::Gait;
use snake_core::minimal::{FeedbackConfig, MinimalState, Model, NoiseConfig};
use snake_core::minimal::{MinimalConfig, MinimalSimulation};
use snake_core::robot::RobotConfig;
use snake_core::stepping::IntegratorConfig;
use snake_core::stepping::StepReport;

use crate::decode::decode;
use crate::gait::GaitConfig;
use crate::gate::detached;
use crate::ground::GroundConfig;
use crate::run::{Scripted, sampled};
use crate::samples::Samples;
use crate::start::PlaneStart;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunConfig {
    robot: RobotConfig,
    scene: GroundConfig,
    gait: GaitConfig,
    controller: FeedbackConfig,
    integrator: IntegratorConfig,
    start: PlaneStart,
    duration: f64,
    sample: f64,
    noise: NoiseConfig,
    seed: u64,
}

/// Simulates one robot; returns the fields of `Trajectory`.
///
/// # Errors
/// ConfigError, DivergenceError, or the exception of a signal handler.
#[pyfunction]
pub fn simulate_minimal<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    let run = || {
        let config: RunConfig = decode(config_json)?;
        sampled(MinimalRobot::new(&config)?, config.duration, config.sample)
    };
    detached(py, run)?.into_dict(py)
}

struct MinimalRobot {
    simulation: MinimalSimulation,
    gait: Gait,
}

impl MinimalRobot {
    /// At its start.
    fn new(config: &RunConfig) -> Result<Self, ConfigError> {
        let mut simulation = MinimalSimulation::new(&MinimalConfig {
            robot: config.robot.clone(),
            ground: config.scene.ground()?,
            friction_law: config.scene.law()?,
            controller: config.controller,
            integrator: config.integrator,
            noise: config.noise,
            seed: config.seed,
        })?;
        let gait = config
            .gait
            .planar(simulation.model().joint_count(), config.controller.active_from)
            .map_err(|e| e.inside("gait"))?;
        simulation.place(&state_at(&config.start, simulation.model(), &gait)?);
        Ok(Self { simulation, gait })
    }
}

/// O_2 lies half a link behind the CG of the first link.
fn state_at(start: &PlaneStart, model: &Model, gait: &Gait) -> Result<MinimalState, ConfigError> {
    let [x, y, heading] = start.head()?;
    let half = model.links[0].half_length;
    let mut state = MinimalState::zero(model.degrees());
    state.q[0] = x - half * heading.cos();
    state.q[1] = y - half * heading.sin();
    state.q[2] = heading;
    state.q[3..].copy_from_slice(&start.joint_angle(model.joint_count(), gait)?);
    Ok(state)
}

/// Parts of a sample interval are no longer, so that signals are heard \[s\].
const LONGEST_PART: f64 = 0.1;

impl Scripted for MinimalRobot {
    const COORDINATES: usize = 2;

    fn link_count(&self) -> usize {
        self.simulation.model().link_count()
    }

    fn parts_of(&self, duration: f64) -> u32 {
        (duration / LONGEST_PART).ceil().max(1.0) as u32
    }

    fn advance(&mut self, duration: f64) -> StepReport {
        let sane = self.simulation.advance(duration, &self.gait);
        StepReport::new(self.simulation.tally(), !sane)
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn write(&mut self, samples: &mut Samples) {
        let (poses, links) = (self.simulation.poses(), self.link_count());
        samples.put("position", &[links, 2], poses.iter().flat_map(|pose| [pose.x, pose.y]));
        samples.put("angle", &[links], poses.iter().map(|pose| pose.z));
        samples.put("energy", &[], [self.simulation.kinetic_energy()]);
        let state = self.simulation.state();
        samples.put("joint_angle", &[links - 1], state.phi().iter().copied());
        samples.put("joint_torque", &[links - 1], self.simulation.torque().iter().copied());
        samples.put("passive_velocity", &[3], state.passive_velocity().iter().copied());
    }
}
