//! A robot moves the same, bit for bit, alone and in the lanes of a register among others.

use snake_core::control::{ControlLaw, ControllerConfig};
use snake_core::gait::Wave;
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{PlanarSystem, Scripted};
use snake_core::robot::{Motor, Robot, RobotConfig};
use snake_core::scene::{Peg, START_7_5, Scene, TABLE_7_5};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::lanes::{self, alone_as_among_others};
use snake_test_support::planar::{self, Hold, posture, table_7_5};

fn system(friction: [f64; 2]) -> PlanarSystem {
    plant_under(ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() }, friction)
}

fn ground(friction: [f64; 2]) -> Scene {
    Scene::new(&planar::ground(friction)).unwrap()
}

fn plant_under(controller: ControllerConfig, friction: [f64; 2]) -> PlanarSystem {
    PlanarSystem::new(Robot::new(&RobotConfig::default()).unwrap(), &ground(friction), controller).unwrap()
}

/// Robots that differ in gait and in the number of pegs around them.
fn robot(system: &PlanarSystem, k: usize) -> Scripted<Wave> {
    let pegs: Vec<Peg> = TABLE_7_5.iter().take(k % 8).map(|&peg| peg.into()).collect();
    let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
    Scripted::new(&system.robot, ObstacleGrid::new(&pegs), START_7_5, &posture(&wave, 10), wave)
}

#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter() {
    for (friction, order) in [([0.2, 0.2], 2), ([0.05, 0.6], 2), ([0.2, 0.0], 1)] {
        let system = system(friction);
        let config = ImplicitConfig { step: Some(0.0125), order, ..ImplicitConfig::default() };
        alone_as_among_others(&system, config, &[1, 9, 13, 100], &[0.05; 20], 13, |k| robot(&system, k));
    }
}

#[test]
fn so_it_is_under_input_output_linearisation() {
    let io = ControllerConfig {
        law: ControlLaw::Io,
        kp: 4e5,
        kd: 2.4e3,
        torque_limit: Some(10.0),
        ..ControllerConfig::default()
    };
    let system = plant_under(io, [0.2, 0.2]);
    alone_as_among_others(&system, ImplicitConfig::default(), &[9, 13], &[0.05; 20], 9, |k| robot(&system, k));
}

#[test]
fn so_it_is_with_motors() {
    let motor =
        Motor { stall_torque: 3.0, no_load_speed: 2.0, rotor_inertia: 1e-3, gear_friction: 0.3, ..Motor::default() };
    let config = RobotConfig { motor: Some(motor.into()), limp: vec![3], ..RobotConfig::default() };
    let controller = ControllerConfig::default();
    let system = PlanarSystem::new(Robot::new(&config).unwrap(), &ground([0.2, 0.2]), controller).unwrap();
    alone_as_among_others(&system, ImplicitConfig::default(), &[9, 13], &[0.05; 20], 9, |k| robot(&system, k));
}

/// Robots that jam among rough pegs, where solves that give up friction at obstacles in one lane run beside others.
#[test]
fn so_it_is_among_rough_pegs() {
    let system = system([0.2, 0.2]);
    let jamming = |k: usize| {
        let mut obstacles = table_7_5().obstacles;
        obstacles.iter_mut().for_each(|obstacle| obstacle.friction = 0.6 + 0.1 * k as f64);
        let wave = Wave { omega: 2.0 + 0.4 * k as f64, ..Wave::default() };
        Scripted::new(&system.robot, ObstacleGrid::of(&obstacles), START_7_5, &posture(&wave, 10), wave)
    };
    let alone = alone_as_among_others(&system, ImplicitConfig::default(), &[9, 13], &[0.05; 60], 9, jamming);
    let hard = alone.iter().filter(|(_, intervals)| intervals.iter().any(|interval| interval.fallbacks > 0));
    assert!(hard.count() > 2, "too few stages are hard");
}

/// Robots that coil up, each at its own pace, so that their contacts come and go at different places and times.
#[test]
fn so_it_is_where_robots_touch_themselves() {
    let controller = ControllerConfig { torque_limit: Some(6.0), ..ControllerConfig::default() };
    let system = plant_under(controller, [0.2, 0.3]);
    let coiling = |k: usize| {
        let angle = (0.85 + 0.04 * k as f64) * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        Scripted::new(&system.robot, ObstacleGrid::new(&[]), [0.0; 3], &[0.0; 10], Hold(angle))
    };
    let alone = alone_as_among_others(&system, ImplicitConfig::default(), &[9, 13], &[0.05; 40], 9, coiling);
    assert!(alone.iter().all(|(body, _)| body.impulses.self_contact.iter().any(|impulse| impulse.norm() > 0.0)));
}

#[test]
fn a_robot_that_diverges_leaves_its_neighbours_untouched() {
    let system = system([0.2, 0.2]);
    let robot = |k| robot(&system, k);
    lanes::a_robot_that_diverges_leaves_its_neighbours_untouched(
        &system,
        ImplicitConfig::default(),
        &[0.05; 20],
        robot,
        |twist| twist.x = f64::NAN,
    );
}
