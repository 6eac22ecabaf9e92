//! A scripted robot of the planar model (T ch. 3).

use snake_core::ConfigError;
use snake_core::gait::Gait;
use snake_core::simulation::PlanarSimulation;
use snake_core::stepping::{IntegratorConfig, StepStatistics};

use crate::run::{RunConfig, Scripted};
use crate::samples::Samples;

/// A robot of the model with its gait.
pub struct PlanarRobot {
    simulation: PlanarSimulation,
    gait: Gait,
    integrator: IntegratorConfig,
}

impl PlanarRobot {
    /// At its start.
    pub fn new(config: &RunConfig) -> Result<Self, ConfigError> {
        let RunConfig { robot, gait, integrator, start, .. } = config;
        let mut simulation = PlanarSimulation::new(robot, &config.scene(), &config.controller(), integrator)?;
        let joints = simulation.robot().joint_count();
        let gait = gait.planar(joints, config.controller().active_from).map_err(|e| e.inside("gait"))?;
        let [x, y, heading] = start.in_plane(config.on())?;
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

    fn advance(&mut self, duration: f64) -> StepStatistics {
        self.simulation.advance(duration, &self.gait)
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn add_contact_impulse(&self, sum: &mut [f64]) {
        let impulses = self.simulation.contact_impulse().iter().flatten();
        sum.iter_mut().zip(impulses).for_each(|(sum, impulse)| *sum += impulse);
    }

    fn add_self_contact_impulse(&self, sum: &mut [f64]) -> bool {
        let impulses = self.simulation.self_contact_impulse().iter().flatten();
        sum.iter_mut().zip(impulses).for_each(|(sum, impulse)| *sum += impulse);
        self.simulation.robot().self_contact
    }

    fn joint_gap(&self) -> f64 {
        self.simulation.joint_gap()
    }

    fn min_gap(&self) -> f64 {
        let to_pegs = self.simulation.min_gap();
        if self.simulation.robot().self_contact { to_pegs.min(self.simulation.self_gap()) } else { to_pegs }
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
