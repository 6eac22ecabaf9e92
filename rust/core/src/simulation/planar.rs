use crate::capabilities::ModelName;
use crate::contact::{PlacedLink, link_pair_gap, obstacle_gap, self_gap, visit_movable_pairs};
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::obstacles::Patches;
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
        let system = PlanarSystem::new(robot, scene.friction, *controller).map_err(|e| e.inside("controller"))?;
        let system = system.covered_with(scene.sliding()).resisting_spin(scene.spin_friction);
        let system = system.on_ground_with(scene.stribeck).with_patches(Patches::new(&scene.patches));
        Ok(system.on_slope(scene.slope))
    }

    fn place_initially<S: Scheme<Self>>(simulation: &mut Simulation<Self, S>) {
        let joints = simulation.robot().joint_count();
        simulation.place_chain(0.0, 0.0, 0.0, &vec![0.0; joints]);
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

    /// Kinetic and potential energy, the latter zero with every CG at the height of the origin and springs slack \[J\].
    pub fn energy(&self) -> f64 {
        let pull = self.system.pull();
        let links = self.system.robot.links.iter().zip(&self.body.state.pose);
        let work = links.map(|(link, pose)| link.mass * pull.dot(&pose.xy())).sum::<f64>();
        self.kinetic_energy() - self.body.parameters.mass * work + self.potential_of_movables(&pull.push(0.0))
    }

    /// Smallest gap now of a link to an obstacle, or of an obstacle that can be pushed to another or to its stop \[m\];
    /// infinite without obstacles nearby.
    pub fn min_gap(&self) -> f64 {
        let Body { state, obstacles, .. } = &self.body;
        let mut smallest = f64::INFINITY;
        for (pose, link) in state.pose.iter().zip(&self.system.robot.links) {
            smallest = smallest.min(obstacle_gap(pose, link, obstacles));
        }
        let nodes = self.system.nodes(obstacles);
        let pose = |node: usize| match state.pose.get(node) {
            Some(pose) => *pose,
            None => state.movables[node - state.pose.len()].pose,
        };
        smallest = smallest.min(self.gap_of_movables());
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

    /// Smallest gap of two links that are not neighbours now \[m\]; infinite where none are close to each other.
    pub fn self_gap(&self) -> f64 {
        self_gap(&self.system.robot.links, &self.body.state.pose, 0.0)
    }

    /// Widest gap of a joint now \[m\].
    pub fn joint_gap(&self) -> f64 {
        largest_joint_gap(&self.system.robot, &self.body.state.pose)
    }
}
