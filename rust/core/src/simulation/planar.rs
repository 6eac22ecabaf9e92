use crate::capabilities::ModelName;
use crate::contact::{PlacedLink, link_pair_gap, obstacle_gap, self_gap, visit_movable_pairs};
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::planar::{Planar, PlanarSystem, Pose, Twist, assemble_chain, largest_joint_gap};
use crate::robot::Robot;
use crate::scene::Scene;
use crate::stepping::Body;

use super::{Scheme, SimulatedModel, Simulation, Snapshot};

/// A planar robot in a scene under a joint controller.
pub type PlanarSimulation = Simulation<Planar>;

/// The changing part of a [`PlanarSimulation`].
pub type PlanarSnapshot = Snapshot<Planar>;

impl SimulatedModel for Planar {
    const NAME: ModelName = ModelName::Planar;

    fn system(robot: Robot, scene: &Scene, controller: &ControllerConfig) -> Result<PlanarSystem, ConfigError> {
        PlanarSystem::new(robot, scene, *controller).map_err(|e| e.inside("controller"))
    }

    fn place_initially<S: Scheme<Self>>(simulation: &mut Simulation<Self, S>) {
        let joints = simulation.robot().joint_count();
        simulation.place_chain(0.0, 0.0, 0.0, &vec![0.0; joints]);
    }

    fn energy<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        let Simulation { system, body, .. } = simulation;
        let pull = system.pull();
        let links = system.robot.links.iter().zip(&body.state.pose);
        let work = links.map(|(link, pose)| link.mass * pull.dot(&pose.xy())).sum::<f64>();
        simulation.kinetic_energy() - body.parameters.mass * work + simulation.potential_of_movables(&pull.push(0.0))
    }

    fn min_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        let Simulation { system, body: Body { state, obstacles, .. }, .. } = simulation;
        let mut smallest = simulation.gap_of_movables();
        for (pose, link) in state.pose.iter().zip(&system.robot.links) {
            smallest = smallest.min(obstacle_gap(pose, link, obstacles));
        }
        let nodes = system.nodes(obstacles);
        let pose = |node: usize| match state.pose.get(node) {
            Some(pose) => *pose,
            None => state.movables[node - state.pose.len()].pose,
        };
        visit_movable_pairs(
            nodes,
            |node| pose(node).xy(),
            0.0,
            |first, second| {
                let placed = [first, second].map(|node| PlacedLink::new(nodes.get(node), pose(node)));
                smallest = smallest.min(link_pair_gap([&placed[0], &placed[1]]));
            },
        );
        smallest
    }

    fn self_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        self_gap(&simulation.system.robot.links, &simulation.body.state.pose, 0.0)
    }

    fn joint_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64 {
        largest_joint_gap(&simulation.system.robot, &simulation.body.state.pose)
    }
}

impl<S: Scheme<Planar>> Simulation<Planar, S> {
    /// Places the robot at rest at time 0: CG of link 1, its absolute angle, and all joint angles.
    pub fn place_chain(&mut self, x: f64, y: f64, heading: f64, joint_angle: &[f64]) {
        let state = &mut self.body.state;
        state.time = 0.0;
        state.twist.fill(Twist::zeros());
        assemble_chain(&self.system.robot, Pose::new(x, y, heading), joint_angle, &mut state.pose);
        self.place_movables();
        self.clear_memory();
    }

    /// tau_C of each joint in the last step, thesis sign (T 3.51) \[N m\].
    pub fn joint_torque(&self) -> &[f64] {
        &self.body.warm_start.joint_torque
    }

    /// Of links, rotors and what they push \[J\].
    pub fn kinetic_energy(&self) -> f64 {
        let (robot, state) = (&self.system.robot, &self.body.state);
        let rates = (0..robot.joint_count()).map(|joint| state.joint_rate(joint));
        self.body.parameters.mass * state.kinetic_energy(robot)
            + robot.rotor_energy(1, rates)
            + self.kinetic_energy_of_movables()
    }
}
