use nalgebra::Vector2;

use crate::capabilities::ModelName;
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::robot::Robot;
use crate::scene::Scene;
use crate::spatial::{
    End, LinkAxis, Pose, Spatial, SpatialSystem, StackedTwist, assemble_chain, axis_angles, axis_rates, ground_gap,
    largest_joint_gap, movable_gap, obstacle_gap, rest_on, self_gap,
};
use crate::stepping::Body;

use super::{Scheme, SimulatedModel, Simulation, Snapshot};

/// A spatial robot in a scene under a joint controller.
pub type SpatialSimulation = Simulation<Spatial>;

/// The changing part of a [`SpatialSimulation`].
pub type SpatialSnapshot = Snapshot<Spatial>;

impl SimulatedModel for Spatial {
    const NAME: ModelName = ModelName::Spatial;

    fn system(robot: Robot, scene: &Scene, controller: &ControllerConfig) -> Result<SpatialSystem, ConfigError> {
        SpatialSystem::new(robot, scene, *controller).map_err(|e| e.inside("controller"))
    }

    fn place_initially<S: Scheme<Self>>(simulation: &mut Simulation<Self, S>) {
        let joints = simulation.robot().joint_count();
        simulation.place_chain(Pose::identity(), &vec![Vector2::zeros(); joints]);
        simulation.rest_on_ground();
    }

    fn energy<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        let Simulation { system, body: Body { state, warm_start, parameters, .. }, .. } = simulation;
        let rotors = system.robot.rotor_energy(2, warm_start.velocity.rate.iter().flatten().copied());
        let links = state.kinetic_energy(&system.robot) + state.potential_energy(&system.robot, &system.gravity);
        parameters.mass * links
            + rotors
            + simulation.kinetic_energy_of_movables()
            + simulation.potential_of_movables(&system.gravity)
    }

    fn min_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        let Simulation { system, body: Body { state, obstacles, .. }, .. } = simulation;
        let nodes = obstacles.nodes(&system.robot.links);
        let mut smallest = simulation.gap_of_movables().min(movable_gap(nodes, state));
        for (pose, link) in state.pose.iter().zip(&system.robot.links) {
            let at = LinkAxis::of(pose);
            for end in End::BOTH {
                let centre = at.position + at.axis * end.along(link);
                // Infinitely low where faces of a field carry the robot otherwise than the ground does.
                let ground = obstacles.field_ground(&centre.xy()).unwrap_or(0.0);
                smallest = smallest.min(ground_gap(link, pose, end) - ground);
            }
            obstacles.visit_obstacles(&pose.position.xy(), link.reach(), |obstacle| {
                smallest = smallest.min(obstacle_gap(link, &at, obstacles, obstacle));
            });
        }
        smallest
    }

    fn self_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        self_gap(&simulation.system.robot.links, &simulation.body.state.pose)
    }

    fn joint_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        largest_joint_gap(&simulation.system.robot, &simulation.body.state.pose)
    }
}

impl<S: Scheme<Spatial>> Simulation<Spatial, S> {
    /// Places the robot at rest at time 0: pose of link 1 and (yaw, pitch) of all joints.
    pub fn place_chain(&mut self, head: Pose, joint_angle: &[Vector2<f64>]) {
        let state = &mut self.body.state;
        state.time = 0.0;
        state.twist.fill(StackedTwist::zeros());
        assemble_chain(&self.system.robot, head, joint_angle, &mut state.pose);
        self.place_movables();
        self.clear_memory();
    }

    /// Lifts or lowers the robot until it rests on the ground, or on the obstacles with a top face that are under it.
    pub fn rest_on_ground(&mut self) {
        rest_on(&self.system.robot, &self.body.obstacles, &mut self.body.state.pose);
        self.clear_memory();
    }

    /// Impulse of the ground's normal forces on each link during the last `advance` \[N s\].
    pub fn ground_impulse(&self) -> &[f64] {
        &self.body.impulses.ground
    }

    /// Angles of a joint about its axes, zero about one that it does not have \[rad\].
    pub fn joint_angle(&self, joint: usize) -> [f64; 2] {
        let pose = &self.body.state.pose;
        axis_angles(self.robot().axes[joint], &pose[joint], &pose[joint + 1])
    }

    /// And their rates \[rad/s\].
    pub fn joint_rate(&self, joint: usize) -> [f64; 2] {
        let link = |link: usize| (&self.body.state.pose[link], &self.body.state.twist[link]);
        axis_rates(self.robot().axes[joint], link(joint), link(joint + 1))
    }

    /// tau_C = (yaw, pitch) of each joint in the last step (T 4.89) \[N m\].
    pub fn joint_torque(&self) -> &[Vector2<f64>] {
        &self.body.warm_start.last.joint_torque
    }
}
