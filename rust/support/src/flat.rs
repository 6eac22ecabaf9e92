//! Robots that lie flat, in the plane or on the ground in 3D: what holds of both.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Reference, Wave};
use snake_core::planar::Planar;
use snake_core::robot::{Motor, RobotConfig};
use snake_core::scene::SceneConfig;
use snake_core::simulation::{SimulatedModel, Simulation};
use snake_core::spatial::{Pose, Spatial, orientation_of};
use snake_core::stepping::ImplicitConfig;

use crate::planar::{ground, links};
use crate::{planar, spatial};

/// Nothing drives the joints: their references are zero.
pub struct Still;

impl<T: Default> Reference<T> for Still {
    fn target(&self, _: usize, _: f64) -> T {
        T::default()
    }
}

/// A model whose robot can lie flat.
pub trait Flat: SimulatedModel {
    type Gait: Reference<Self::Target> + Clone;

    /// Lateral undulation (T 7.3).
    fn undulation() -> Self::Gait;
    /// Angles of the joints about the vertical at first \[rad\].
    fn yaws(gait: &Self::Gait, joints: usize) -> Vec<f64>;
    fn implicit(step: f64, order: u32) -> ImplicitConfig;
    /// Puts the robot at rest: CG and heading of link 1, and the angles of the joints about the vertical.
    fn lie(simulation: &mut Simulation<Self>, start: [f64; 3], yaws: &[f64]);
}

impl Flat for Planar {
    type Gait = Wave;

    fn undulation() -> Wave {
        Wave::default()
    }

    fn yaws(gait: &Wave, joints: usize) -> Vec<f64> {
        planar::posture(gait, joints)
    }

    fn implicit(step: f64, order: u32) -> ImplicitConfig {
        planar::implicit(step, order)
    }

    fn lie(simulation: &mut Simulation<Self>, [x, y, heading]: [f64; 3], yaws: &[f64]) {
        simulation.place_chain(x, y, heading, yaws);
    }
}

impl Flat for Spatial {
    type Gait = CardanGait;

    fn undulation() -> CardanGait {
        spatial::undulation()
    }

    fn yaws(gait: &CardanGait, joints: usize) -> Vec<f64> {
        (0..joints).map(|joint| gait.target(joint, 0.0).yaw.angle).collect()
    }

    fn implicit(step: f64, order: u32) -> ImplicitConfig {
        spatial::implicit(step, order)
    }

    fn lie(simulation: &mut Simulation<Self>, [x, y, heading]: [f64; 3], yaws: &[f64]) {
        let head = Pose { position: Vector3::new(x, y, 0.0), orientation: orientation_of(heading, 0.0, 0.0) };
        simulation.place_chain(head, &yaws.iter().map(|yaw| Vector2::new(*yaw, 0.0)).collect::<Vec<_>>());
        simulation.rest_on_ground();
    }
}

pub fn lying<M: Flat>(
    robot: &RobotConfig,
    scene: &SceneConfig,
    pd: &ControllerConfig,
    config: &ImplicitConfig,
    (start, yaws): ([f64; 3], &[f64]),
) -> Simulation<M> {
    let mut simulation = Simulation::new(robot, scene, pd, config).expect("admissible");
    M::lie(&mut simulation, start, yaws);
    simulation
}

/// Work of the motors is the energy of links and rotors, and what friction on the ground and in gears took, but for a defect
/// that shrinks with the steps.
pub fn work_of_motors_goes_into_links_rotors_and_friction<M: Flat>(steps: &[f64], yaws: &[f64; 10]) {
    let motor = Motor {
        stall_torque: 8.0,
        no_load_speed: 6.0,
        rotor_inertia: 1e-3,
        gear_ratio: 2.0,
        gear_friction: 0.1,
        ..Motor::default()
    };
    let robot = RobotConfig { motor: Some(motor.into()), ..links(11) };
    let (scene, pd) = (ground([0.2, 0.2]), ControllerConfig::default());
    let defect = |step: &f64| {
        let mut simulation = lying::<M>(&robot, &scene, &pd, &M::implicit(*step, 2), ([0.0; 3], yaws));
        let before = simulation.energy();
        let report = simulation.advance(1.0, &M::undulation());
        assert!(report.unconverged == 0 && report.friction_work < 0.0, "{report:?}");
        let stored = simulation.energy() - before - report.friction_work;
        (report.actuator_work - stored).abs() / report.actuator_work
    };
    let defects: Vec<f64> = steps.iter().map(defect).collect();
    println!("relative defect of the energy balance in steps of {steps:?} s: {defects:?}");
    assert!(defects.last().is_some_and(|last| *last < 0.02 && *last < defects[0]));
}
