//! `simulate`: one scripted robot of the planar model, sampled.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use snake_core::ConfigError;
use snake_core::gait::Gait;
use snake_core::simulation::PlanarSimulation;
use snake_core::stepping::IntegratorConfig;
use snake_core::stepping::StepReport;

use crate::decode::decode;
use crate::gate::detached;
use crate::run::{RunConfig, Scripted, sampled};
use crate::samples::Samples;
use crate::start::PlaneStart;

/// Simulates one robot; returns the fields of `Trajectory`.
///
/// # Errors
/// ConfigError, DivergenceError, or the exception of a signal handler.
#[pyfunction]
pub fn simulate<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    let run = || {
        let config: RunConfig<PlaneStart> = decode(config_json)?;
        sampled(PlanarRobot::new(&config)?, config.duration, config.sample)
    };
    detached(py, run)?.into_dict(py)
}

struct PlanarRobot {
    simulation: PlanarSimulation,
    gait: Gait,
    integrator: IntegratorConfig,
}

impl PlanarRobot {
    /// At its start.
    fn new(config: &RunConfig<PlaneStart>) -> Result<Self, ConfigError> {
        let RunConfig { robot, scene, gait, controller, integrator, start, .. } = config;
        let mut simulation = PlanarSimulation::new(robot, scene, controller, integrator)?;
        let joints = simulation.robot().joint_count();
        let gait = gait.planar(joints, controller.active_from).map_err(|e| e.inside("gait"))?;
        let [x, y, heading] = start.head()?;
        simulation.place_chain(x, y, heading, &start.joint_angle(joints, &gait)?);
        Ok(Self { simulation, gait, integrator: *integrator })
    }
}

impl Scripted for PlanarRobot {
    const COORDINATES: usize = 2;

    fn link_count(&self) -> usize {
        self.simulation.robot().link_count()
    }

    fn parts_of(&self, duration: f64) -> u32 {
        self.integrator.steps_in(duration)
    }

    fn advance(&mut self, duration: f64) -> StepReport {
        self.simulation.advance(duration, &self.gait)
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn add_contact_impulse(&self, sum: &mut [f64]) {
        let impulses = self.simulation.contact_impulse().iter().flatten();
        sum.iter_mut().zip(impulses).for_each(|(sum, impulse)| *sum += impulse);
    }

    fn joint_gap(&self) -> f64 {
        self.simulation.joint_gap()
    }

    fn min_gap(&self) -> f64 {
        self.simulation.min_gap()
    }

    fn write(&mut self, samples: &mut Samples) {
        let (state, links) = (self.simulation.state(), self.link_count());
        samples.put("position", &[links, 2], state.pose.iter().flat_map(|pose| [pose.x, pose.y]));
        samples.put("angle", &[links], state.pose.iter().map(|pose| pose.z));
        samples.put("joint_angle", &[links - 1], (0..links - 1).map(|joint| state.joint_angle(joint)));
        samples.put("joint_torque", &[links - 1], self.simulation.joint_torque().iter().copied());
        samples.put("energy", &[], [self.simulation.kinetic_energy()]);
    }
}
