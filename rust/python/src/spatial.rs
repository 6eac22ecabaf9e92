//! A scripted robot of the spatial model (T ch. 4).

use nalgebra::Vector3;
use snake_core::ConfigError;
use snake_core::gait::{CardanGait, CardanTarget, Holding, JointTarget};
use snake_core::simulation::{Scheme, SchemeConfig, Simulation};
use snake_core::spatial::{Spatial, turning};
use snake_core::stepping::{Record, StepStatistics};

use crate::records::Layout;
use crate::run::{RunConfig, Scripted};
use crate::samples::Samples;

/// A robot of the model with its gait.
pub struct SpatialRobot<S> {
    simulation: Simulation<Spatial, S>,
    gait: Holding<CardanGait, CardanTarget>,
}

impl<S: Scheme<Spatial>> SpatialRobot<S> {
    /// The robot in its start posture, advanced by a method.
    pub fn new(config: &RunConfig, method: &impl SchemeConfig<Spatial, Scheme = S>) -> Result<Self, ConfigError> {
        let RunConfig { robot, start, .. } = config;
        let mut simulation = Simulation::new(robot, &config.scene(), &config.controller(), method)?;
        let gait = config.spatial_reference(simulation.robot())?;
        start.place(&mut simulation, &gait)?;
        if config.is_summed() {
            simulation.start_record();
        }
        // Waves pass by joints that only twist.
        let axes = simulation.robot().axes.iter().enumerate();
        let passed = axes.filter(|(_, axes)| axes.only_twists() && config.joint_trajectory.is_none());
        let held = config.robot.locked.iter().copied().chain(passed.map(|(joint, _)| joint)).map(|joint| {
            let of_axis = |angle| JointTarget { angle, ..JointTarget::default() };
            let [yaw, pitch] = simulation.joint_angle(joint).map(of_axis);
            (joint, CardanTarget { yaw, pitch })
        });
        let gait = Holding::new(gait, held);
        Ok(Self { simulation, gait })
    }
}

impl<S: Scheme<Spatial>> Scripted for SpatialRobot<S> {
    const COORDINATES: usize = 3;

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
        let impulses = self.simulation.contact_impulse().iter().flatten();
        sum.iter_mut().zip(impulses).for_each(|(sum, impulse)| *sum += impulse);
    }

    fn obstacle_impulse(&self) -> &[Vector3<f64>] {
        self.simulation.obstacle_impulse()
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
        let outside = self.simulation.min_gap();
        if self.simulation.robot().self_contact { outside.min(self.simulation.self_gap()) } else { outside }
    }

    fn write(&mut self, samples: &mut Samples) {
        let (pose, links) = (&self.simulation.state().pose, self.link_count());
        let yaw = pose.iter().map(|q| q.axis()).map(|axis| axis.y.atan2(axis.x));
        let quaternion = pose.iter().map(|q| q.orientation).flat_map(|p| [p.w, p.i, p.j, p.k]);
        let (robot, joints) = (self.simulation.robot(), 0..links - 1);
        let joint_angle = robot.of_axes(joints.map(|joint| self.simulation.joint_angle(joint)));
        let torques = self.simulation.joint_torque().iter().map(|torque| (*torque).into());
        samples.put("position", &[links, 3], pose.iter().flat_map(|q| <[f64; 3]>::from(q.position)));
        samples.put("angle", &[links], yaw);
        samples.put("quaternion", &[links, 4], quaternion);
        samples.put("joint_angle", &robot.joint_shape(), joint_angle);
        samples.put("joint_torque", &robot.joint_shape(), robot.of_axes(torques));
        samples.put("energy", &[], [self.simulation.energy()]);
        samples.put_movables(self.simulation.movables());
    }

    fn write_velocity(&mut self, samples: &mut Samples) {
        let (state, links) = (self.simulation.state(), self.link_count());
        let moving = || state.pose.iter().zip(&state.twist);
        let turning = moving().flat_map(|(q, u)| <[f64; 3]>::from(q.orientation * turning(u)));
        let robot = self.simulation.robot();
        let rates = robot.of_axes((0..links - 1).map(|joint| self.simulation.joint_rate(joint)));
        samples.put("velocity", &[links, 3], state.twist.iter().flat_map(|u| [u[0], u[1], u[2]]));
        samples.put("angular_velocity", &[links, 3], turning);
        samples.put("joint_rate", &robot.joint_shape(), rates);
        samples.put_movable_velocities(&state.movables);
    }

    fn layout(&self) -> Layout {
        let place = self.simulation.indices_of_obstacles();
        let robot = self.simulation.robot();
        let (joint_shape, axes) = (robot.joint_shape(), robot.axes.clone());
        Layout { coordinates: 3, contacts: 2, joint_shape, axes, normal: None, place }
    }

    fn record_mut(&mut self) -> Option<&mut Record> {
        self.simulation.record_mut()
    }
}
