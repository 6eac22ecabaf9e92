//! A scripted robot of the minimal model (T ch. 6).

use snake_core::ConfigError;
use snake_core::gait::{Gait, Holding, JointTarget};
use snake_core::robot::{Axes, Robot};
use snake_core::scene::Scene;
use snake_core::stepping::{Record, StepStatistics};
use snake_thesis::minimal::{FrictionLaw, Ground, MinimalConfig, MinimalSimulation, MinimalState, Model};

use crate::records::Layout;
use crate::run::{RunConfig, Scripted};
use crate::samples::Samples;

/// A robot of the model with its gait.
pub struct MinimalRobot {
    simulation: MinimalSimulation,
    gait: Holding<Gait, JointTarget>,
    /// Normal force at each contact point of each link \[N\].
    normal: Vec<f64>,
}

impl MinimalRobot {
    /// The robot in its start posture.
    pub fn new(config: &RunConfig) -> Result<Self, ConfigError> {
        let scene = config.scene();
        Scene::new(&scene).map_err(|e| e.inside("scene"))?;
        let mut simulation = MinimalSimulation::new(&MinimalConfig {
            robot: config.robot.clone(),
            ground: Ground::of(&scene),
            friction_law: FrictionLaw::of(&scene),
            controller: config.controller(),
            integrator: config.integrator,
            noise: config.noise.unwrap_or_default(),
            seed: config.seed,
        })?;
        let gait = config.planar_reference(simulation.model().joint_count())?;
        let state = state_at(config, simulation.model(), &gait)?;
        simulation.place(&state);
        let gait = Holding::new(gait, config.held_joints(state.phi()));
        if config.is_summed() {
            simulation.start_record()?;
        }
        let gravity = -scene.slope.acceleration(Robot::new(&config.robot)?.gravity).z;
        let normal = simulation.model().links.iter().map(|link| 0.5 * link.mass * gravity).collect();
        Ok(Self { simulation, gait, normal })
    }
}

/// O_2 lies half a link behind the CG of the first link.
fn state_at(config: &RunConfig, model: &Model, gait: &Gait) -> Result<MinimalState, ConfigError> {
    let start = &config.start;
    let [x, y, heading] = start.in_plane(config.on())?;
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

    fn advance(&mut self, duration: f64) -> StepStatistics {
        let sane = self.simulation.advance(duration, &self.gait);
        StepStatistics { diverged: !sane, ..*self.simulation.statistics() }
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn write(&mut self, samples: &mut Samples) {
        let (poses, links) = (self.simulation.poses(), self.link_count());
        samples.put("position", &[links, 2], poses.iter().flat_map(|pose| [pose.x, pose.y]));
        samples.put("angle", &[links], poses.iter().map(|pose| pose.z));
        samples.put("energy", &[], [self.simulation.energy()]);
        let state = self.simulation.state();
        samples.put("joint_angle", &[links - 1], state.phi().iter().copied());
        samples.put("joint_torque", &[links - 1], self.simulation.torque().iter().copied());
        samples.put("passive_velocity", &[3], state.passive_velocity().iter().copied());
    }

    fn write_velocity(&mut self, samples: &mut Samples) {
        let links = self.link_count();
        let twists: Vec<_> = self.simulation.twists().collect();
        samples.put("velocity", &[links, 2], twists.iter().flat_map(|u| [u.x, u.y]));
        samples.put("angular_velocity", &[links], twists.iter().map(|u| u.z));
        samples.put("joint_rate", &[links - 1], self.simulation.state().phi_rate().iter().copied());
    }

    fn layout(&self) -> Layout {
        let joints = self.link_count() - 1;
        let (joint_shape, axes) = (vec![joints], vec![Axes::Yaw; joints]);
        Layout { coordinates: 2, contacts: 2, joint_shape, axes, normal: Some(self.normal.clone()), place: Vec::new() }
    }

    fn record_mut(&mut self) -> Option<&mut Record> {
        self.simulation.record_mut()
    }
}
