//! A scripted robot of the spatial model (T ch. 4).

use snake_core::ConfigError;
use snake_core::gait::CardanGait;
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::joint_angle;
use snake_core::stepping::StepStatistics;

use crate::run::{RunConfig, Scripted};
use crate::samples::Samples;

/// A robot of the model with its gait.
pub struct SpatialRobot {
    simulation: SpatialSimulation,
    gait: CardanGait,
}

impl SpatialRobot {
    /// At its start.
    pub fn new(config: &RunConfig) -> Result<Self, ConfigError> {
        let RunConfig { robot, gait, integrator, start, .. } = config;
        let mut simulation = SpatialSimulation::new(robot, &config.scene(), &config.controller(), integrator)?;
        let start_up = config.controller().active_from;
        let gait = gait.spatial(simulation.robot().joint_count(), start_up).map_err(|e| e.inside("gait"))?;
        start.place(&mut simulation, &gait)?;
        Ok(Self { simulation, gait })
    }
}

impl Scripted for SpatialRobot {
    const COORDINATES: usize = 3;

    fn link_count(&self) -> usize {
        self.simulation.robot().link_count()
    }

    fn parts_of(&self, duration: f64) -> u32 {
        self.simulation.integrator().steps_in(duration)
    }

    fn advance(&mut self, duration: f64) -> StepStatistics {
        self.simulation.advance(duration, &self.gait)
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn add_contact_impulse(&self, sum: &mut [f64]) {
        for (sum, impulse) in sum.chunks_exact_mut(Self::COORDINATES).zip(self.simulation.contact_impulse()) {
            sum[0] += impulse.x;
            sum[1] += impulse.y;
        }
    }

    fn joint_gap(&self) -> f64 {
        self.simulation.joint_gap()
    }

    fn min_gap(&self) -> f64 {
        self.simulation.min_gap()
    }

    fn write(&mut self, samples: &mut Samples) {
        let (pose, links) = (&self.simulation.state().pose, self.link_count());
        let yaw = pose.iter().map(|q| q.axis()).map(|axis| axis.y.atan2(axis.x));
        let quaternion = pose.iter().map(|q| q.orientation).flat_map(|p| [p.w, p.i, p.j, p.k]);
        let joint_angle = pose.windows(2).flat_map(|q| <[f64; 2]>::from(joint_angle(&q[0], &q[1])));
        samples.put("position", &[links, 3], pose.iter().flat_map(|q| <[f64; 3]>::from(q.position)));
        samples.put("angle", &[links], yaw);
        samples.put("quaternion", &[links, 4], quaternion);
        samples.put("joint_angle", &[links - 1, 2], joint_angle);
        samples.put("joint_torque", &[links - 1, 2], self.simulation.joint_torque().iter().flatten().copied());
        samples.put("energy", &[], [self.simulation.energy()]);
    }
}
