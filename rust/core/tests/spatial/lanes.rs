//! A robot in 3D moves the same, bit for bit, alone and in the lanes of a register among others.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::{Motor, Robot, RobotConfig};
use snake_core::scene::{Peg, START_SPATIAL_7_5, Scene, SceneConfig, TABLE_7_5};
use snake_core::spatial::{Pose, SpatialFleet, SpatialScripted, SpatialState, SpatialSystem, orientation_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::spatial::{implicit, in_gait, sidewinding, undulation};

type CardanRobot = SpatialScripted<CardanGait>;

fn system(friction: [f64; 2]) -> SpatialSystem {
    system_of(&RobotConfig::default(), friction)
}

fn system_of(robot: &RobotConfig, friction: [f64; 2]) -> SpatialSystem {
    let scene = Scene::new(&SceneConfig { friction, ..SceneConfig::default() }).unwrap();
    let controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    SpatialSystem::new(Robot::new(robot).unwrap(), &scene, controller).unwrap()
}

/// Robots that differ in gait, in height above the ground, and in the number of pegs around them.
fn robots(system: &SpatialSystem, count: usize) -> Vec<CardanRobot> {
    let robot = |k: usize| {
        let pegs: Vec<Peg> = TABLE_7_5.iter().take(k % 8).map(|&peg| peg.into()).collect();
        let gait = if k % 3 == 1 { sidewinding() } else { undulation() };
        let mut robot = in_gait(&system.robot, ObstacleGrid::new(&pegs), START_SPATIAL_7_5, gait);
        robot.body.state.pose.iter_mut().for_each(|pose| pose.position.z += 0.002 * (k % 5) as f64);
        robot
    };
    (0..count).map(robot).collect()
}

fn run(system: &SpatialSystem, config: ImplicitConfig, robots: &mut [CardanRobot], width: usize) -> Vec<SpatialState> {
    let mut fleet = SpatialFleet::new(config, system, width);
    for _ in 0..10 {
        fleet.advance(system, robots.iter_mut().map(SpatialScripted::driven), 0.05);
    }
    robots.iter().map(|robot| robot.body.state.clone()).collect()
}

/// Pegs, robots in the air and on the ground, anisotropic friction with fallbacks, and friction along one axis alone.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter() {
    for (friction, step, order) in [([0.2, 0.2], 0.025, 2), ([0.05, 0.9], 0.05, 2), ([0.2, 0.0], 0.0125, 1)] {
        let system = system(friction);
        let alone: Vec<SpatialState> = (0..13)
            .map(|k| run(&system, implicit(step, order), &mut robots(&system, 13)[k..=k], 1).remove(0))
            .collect();
        for width in [1, 2, 13] {
            let together = run(&system, implicit(step, order), &mut robots(&system, 13), width);
            for (k, (together, alone)) in together.iter().zip(&alone).enumerate() {
                assert_eq!(together, alone, "robot {k} in a fleet made for {width}, friction {friction:?}");
            }
        }
    }
}

#[test]
fn so_it_is_with_motors() {
    let motor =
        Motor { stall_torque: 3.0, no_load_speed: 2.0, rotor_inertia: 1e-3, gear_friction: 0.3, ..Motor::default() };
    let system =
        system_of(&RobotConfig { motor: Some(motor.into()), limp: vec![3], ..RobotConfig::default() }, [0.2, 0.2]);
    let alone: Vec<SpatialState> =
        (0..9).map(|k| run(&system, implicit(0.025, 2), &mut robots(&system, 9)[k..=k], 1).remove(0)).collect();
    for width in [2, 9] {
        assert!(run(&system, implicit(0.025, 2), &mut robots(&system, 9), width) == alone, "fleet made for {width}");
    }
}

/// A stage that Newton's method gives up while neighbours go on is handed to the fallback as it would be alone.
#[test]
fn lanes_that_are_given_up_do_not_depend_on_neighbours_either() {
    let system = system([2.0, 2.0]);
    let advance = |robots: &mut [CardanRobot]| {
        let mut fleet = SpatialFleet::new(implicit(0.01, 2), &system, robots.len());
        fleet.advance(&system, robots.iter_mut().map(SpatialScripted::driven), 0.1);
        robots.iter().map(|robot| robot.body.statistics.fallbacks).sum::<u32>()
    };
    let mut together = jolted(&system);
    assert!(advance(&mut together) > 20, "many stages must be given up");
    for (k, together) in together.iter().enumerate() {
        let mut alone = jolted(&system);
        advance(&mut alone[k..=k]);
        assert_eq!(together.body.state, alone[k].body.state, "robot {k}");
        assert_eq!(together.body.statistics.residual, alone[k].body.statistics.residual, "robot {k}");
    }
}

/// Robots that lie in curves of their own, far from what their motors ask for.
fn jolted(system: &SpatialSystem) -> Vec<CardanRobot> {
    let jolted = |k: usize| {
        let posture: Vec<_> = (0..10).map(|j| Vector2::new(0.5 * (1.0 + (7 * j + 13 * k) as f64).sin(), 0.0)).collect();
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.3, 0.0, 0.0) };
        let yaw = Gait::Wave(Wave { amplitude: 0.1 * k as f64, ..Wave::default() });
        CardanRobot::new(
            &system.robot,
            ObstacleGrid::new(&[]),
            head,
            &posture,
            CardanGait { yaw, pitch: Gait::Wave(Wave::still()) },
        )
    };
    (0..9).map(jolted).collect()
}

#[test]
fn a_robot_that_diverges_leaves_its_neighbours_untouched() {
    let system = system([0.2, 0.2]);
    let config = implicit(0.025, 2);
    let sound = run(&system, config, &mut robots(&system, 9), 9);
    let mut with_a_sick_one = robots(&system, 9);
    with_a_sick_one[4].body.state.twist[3].x = f64::NAN;
    let mut fleet = SpatialFleet::new(config, &system, 9);
    fleet.advance(&system, with_a_sick_one.iter_mut().map(SpatialScripted::driven), 0.05);
    let diverged: Vec<usize> = (0..9).filter(|&k| with_a_sick_one[k].body.statistics.diverged).collect();
    assert_eq!(diverged, [4]);
    let sick = &with_a_sick_one[4].body.state;
    assert!(sick.is_plausible(), "a robot that diverged rests where it was last good");
    for _ in 1..10 {
        let others = with_a_sick_one.iter_mut().enumerate().filter(|(robot, _)| *robot != 4);
        fleet.advance(&system, others.map(|(_, robot)| robot.driven()), 0.05);
    }
    for k in (0..9).filter(|&k| k != 4) {
        assert_eq!(with_a_sick_one[k].body.state, sound[k]);
    }
}
