//! A scripted robot of the planar model (T ch. 3).

use nalgebra::Vector3;
use snake_core::ConfigError;
use snake_core::gait::{Gait, Holding, JointTarget};
use snake_core::planar::Planar;
use snake_core::robot::Axes;
use snake_core::simulation::{Scheme, SchemeConfig, Simulation};
use snake_core::stepping::{Record, StepStatistics};

use crate::records::Layout;
use crate::run::{RunConfig, Scripted};
use crate::samples::Samples;

/// A robot of the model with its gait.
pub struct PlanarRobot<S> {
    simulation: Simulation<Planar, S>,
    gait: Holding<Gait, JointTarget>,
}

impl<S: Scheme<Planar>> PlanarRobot<S> {
    /// The robot in its start posture, advanced by a method.
    pub fn new(config: &RunConfig, method: &impl SchemeConfig<Planar, Scheme = S>) -> Result<Self, ConfigError> {
        let RunConfig { robot, start, .. } = config;
        let mut simulation = Simulation::new(robot, &config.scene(), &config.controller(), method)?;
        let joints = simulation.robot().joint_count();
        let gait = config.planar_reference(joints)?;
        let [x, y, heading] = start.in_plane(config.on())?;
        let joint_angle = start.joint_angle(joints, &gait)?;
        simulation.place_chain(x, y, heading, &joint_angle);
        if config.is_summed() {
            simulation.start_record();
        }
        let gait = Holding::new(gait, config.held_joints(&joint_angle));
        Ok(Self { simulation, gait })
    }
}

impl<S: Scheme<Planar>> Scripted for PlanarRobot<S> {
    const COORDINATES: usize = 2;

    fn link_count(&self) -> usize {
        self.simulation.robot().link_count()
    }

    fn parts_of(&self, duration: f64) -> u32 {
        self.simulation.steps_in(duration)
    }

    fn advance(&mut self, duration: f64) -> StepStatistics {
        self.simulation.advance(duration, &self.gait)
    }

    fn time(&self) -> f64 {
        self.simulation.state().time
    }

    fn add_contact_impulse(&self, sum: &mut [f64]) {
        let impulses = self.simulation.contact_impulse().iter().flat_map(|impulse| [impulse.x, impulse.y]);
        sum.iter_mut().zip(impulses).for_each(|(sum, impulse)| *sum += impulse);
    }

    fn obstacle_impulse(&self) -> &[Vector3<f64>] {
        self.simulation.obstacle_impulse()
    }

    fn add_self_contact_impulse(&self, sum: &mut [f64]) -> bool {
        for (sum, impulse) in sum.chunks_exact_mut(Self::COORDINATES).zip(self.simulation.self_contact_impulse()) {
            sum[0] += impulse.x;
            sum[1] += impulse.y;
        }
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
        samples.put("energy", &[], [self.simulation.energy()]);
        samples.put_movables(self.simulation.movables());
    }

    fn write_velocity(&mut self, samples: &mut Samples) {
        let (state, links) = (self.simulation.state(), self.link_count());
        samples.put("velocity", &[links, 2], state.twist.iter().flat_map(|u| [u.x, u.y]));
        samples.put("angular_velocity", &[links], state.twist.iter().map(|u| u.z));
        samples.put("joint_rate", &[links - 1], (0..links - 1).map(|joint| state.joint_rate(joint)));
        samples.put_movable_velocities(&state.movables);
    }

    fn layout(&self) -> Layout {
        let system = self.simulation.system();
        let normal = system.robot.links.iter().map(|link| link.mass * system.normal_gravity());
        let place = self.simulation.indices_of_obstacles();
        let joints = self.link_count() - 1;
        let (joint_shape, axes) = (vec![joints], vec![Axes::Yaw; joints]);
        Layout { coordinates: 2, contacts: 1, joint_shape, axes, normal: Some(normal.collect()), place }
    }

    fn record_mut(&mut self) -> Option<&mut Record> {
        self.simulation.record_mut()
    }
}
