//! A robot moves the same, bit for bit, alone and in the lanes of a register among others.

use snake_core::control::{ControlLaw, ControllerConfig};
use snake_core::gait::{Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Fleet, PlanarState, PlanarSystem, Scripted};
use snake_core::robot::{Motor, Robot, RobotConfig};
use snake_core::scene::{Peg, START_7_5, TABLE_7_5};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{Hold, posture, table_7_5};

type Undulator = Scripted<Wave>;

fn system(friction: [f64; 2]) -> PlanarSystem {
    plant_under(ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() }, friction)
}

fn plant_under(controller: ControllerConfig, friction: [f64; 2]) -> PlanarSystem {
    PlanarSystem::new(Robot::new(&RobotConfig::default()).unwrap(), friction, controller).unwrap()
}

/// Robots that differ in gait and in the number of pegs around them.
fn robots(system: &PlanarSystem, count: usize) -> Vec<Undulator> {
    let undulator = |k: usize| {
        let pegs: Vec<Peg> = TABLE_7_5.iter().take(k % 8).map(|&peg| peg.into()).collect();
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        let angles: Vec<f64> = (0..10).map(|joint| wave.target(joint, 0.0).angle).collect();
        Scripted::new(&system.robot, ObstacleGrid::new(&pegs), START_7_5, &angles, wave)
    };
    (0..count).map(undulator).collect()
}

fn run(system: &PlanarSystem, config: ImplicitConfig, robots: &mut [Undulator], width: usize) -> Vec<PlanarState> {
    let mut fleet = Fleet::new(config, system, width);
    for _ in 0..20 {
        fleet.advance(system, robots.iter_mut().map(Scripted::driven), 0.05);
    }
    robots.iter().map(|robot| robot.body.state.clone()).collect()
}

#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter() {
    for (friction, order) in [([0.2, 0.2], 2), ([0.05, 0.6], 2), ([0.2, 0.0], 1)] {
        let system = system(friction);
        let config = ImplicitConfig { step: Some(0.0125), order, ..ImplicitConfig::default() };
        let alone: Vec<PlanarState> = (0..13)
            .map(|k| run(&system, config, std::slice::from_mut(&mut robots(&system, 13)[k]), 1).remove(0))
            .collect();
        for width in [1, 2, 13] {
            assert_eq!(run(&system, config, &mut robots(&system, 13), width), alone, "fleet made for {width} robots");
        }
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
    let (system, config) = (plant_under(io, [0.2, 0.2]), ImplicitConfig::default());
    let alone: Vec<PlanarState> =
        (0..9).map(|k| run(&system, config, std::slice::from_mut(&mut robots(&system, 9)[k]), 1).remove(0)).collect();
    for width in [2, 9] {
        assert_eq!(run(&system, config, &mut robots(&system, 9), width), alone, "fleet made for {width} robots");
    }
}

#[test]
fn so_it_is_with_motors() {
    let motor =
        Motor { stall_torque: 3.0, no_load_speed: 2.0, rotor_inertia: 1e-3, gear_friction: 0.3, ..Motor::default() };
    let robot = RobotConfig { motor: Some(motor.into()), limp: vec![3], ..RobotConfig::default() };
    let controller = ControllerConfig::default();
    let system = PlanarSystem::new(Robot::new(&robot).unwrap(), [0.2, 0.2], controller).unwrap();
    let config = ImplicitConfig::default();
    let alone: Vec<PlanarState> =
        (0..9).map(|k| run(&system, config, std::slice::from_mut(&mut robots(&system, 9)[k]), 1).remove(0)).collect();
    for width in [2, 9] {
        assert!(run(&system, config, &mut robots(&system, 9), width) == alone, "fleet made for {width} robots");
    }
}

/// Robots that jam among rough pegs, where solves that give up friction at obstacles in one lane run beside others.
#[test]
fn so_it_is_among_rough_pegs() {
    let system = plant_under(ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() }, [0.2, 0.2]);
    let jamming = || -> Vec<Undulator> {
        let undulator = |k: usize| {
            let mut obstacles = table_7_5().obstacles;
            obstacles.iter_mut().for_each(|obstacle| obstacle.friction = 0.3 + 0.1 * k as f64);
            let wave = Wave { omega: 2.0 + 0.4 * k as f64, ..Wave::default() };
            Scripted::new(&system.robot, ObstacleGrid::of(&obstacles), START_7_5, &posture(&wave, 10), wave)
        };
        (0..9).map(undulator).collect()
    };
    let run = |robots: &mut [Undulator], width: usize| -> Vec<(PlanarState, u32)> {
        let mut fleet = Fleet::new(ImplicitConfig::default(), &system, width);
        let mut fallbacks = vec![0; robots.len()];
        for _ in 0..60 {
            fleet.advance(&system, robots.iter_mut().map(Scripted::driven), 0.05);
            fallbacks.iter_mut().zip(&*robots).for_each(|(sum, robot)| *sum += robot.body.statistics.fallbacks);
        }
        robots.iter().map(|robot| robot.body.state.clone()).zip(fallbacks).collect()
    };
    let alone: Vec<_> = (0..9).map(|k| run(std::slice::from_mut(&mut jamming()[k]), 1).remove(0)).collect();
    assert!(alone.iter().filter(|(_, fallbacks)| *fallbacks > 0).count() > 2, "too few stages are hard");
    for width in [2, 9] {
        assert!(run(&mut jamming(), width) == alone, "fleet made for {width} robots");
    }
}

/// Robots that coil up, each at its own pace, so that their contacts come and go at different places and times.
#[test]
fn so_it_is_where_robots_touch_themselves() {
    let config = RobotConfig::default();
    let controller = ControllerConfig { torque_limit: Some(6.0), ..ControllerConfig::default() };
    let system = PlanarSystem::new(Robot::new(&config).unwrap(), [0.2, 0.3], controller).unwrap();
    let coiling = || -> Vec<Scripted<Hold>> {
        let robot = |k: usize| {
            let angle = (0.85 + 0.04 * k as f64) * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            Scripted::new(&system.robot, ObstacleGrid::new(&[]), [0.0; 3], &[0.0; 10], Hold(angle))
        };
        (0..9).map(robot).collect()
    };
    let run = |robots: &mut [Scripted<Hold>], width: usize| -> Vec<PlanarState> {
        let mut fleet = Fleet::new(ImplicitConfig::default(), &system, width);
        for _ in 0..40 {
            fleet.advance(&system, robots.iter_mut().map(Scripted::driven), 0.05);
        }
        assert!(robots.iter().all(|robot| robot.body.self_contact_impulse.iter().any(|impulse| impulse.norm() > 0.0)));
        robots.iter().map(|robot| robot.body.state.clone()).collect()
    };
    let alone: Vec<PlanarState> = (0..9).map(|k| run(std::slice::from_mut(&mut coiling()[k]), 1).remove(0)).collect();
    for width in [2, 9] {
        assert_eq!(run(&mut coiling(), width), alone, "fleet made for {width} robots");
    }
}

#[test]
fn a_robot_that_diverges_leaves_its_neighbours_untouched() {
    let system = system([0.2, 0.2]);
    let config = ImplicitConfig::default();
    let sound = run(&system, config, &mut robots(&system, 9), 9);
    let mut with_a_sick_one = robots(&system, 9);
    with_a_sick_one[4].body.state.twist[3].x = f64::NAN;
    let mut fleet = Fleet::new(config, &system, 9);
    fleet.advance(&system, with_a_sick_one.iter_mut().map(Scripted::driven), 0.05);
    assert!(
        with_a_sick_one[4].body.statistics.diverged
            && with_a_sick_one.iter().filter(|robot| robot.body.statistics.diverged).count() == 1
    );
    for _ in 1..20 {
        let others = with_a_sick_one.iter_mut().enumerate().filter(|(robot, _)| *robot != 4);
        fleet.advance(&system, others.map(|(_, robot)| robot.driven()), 0.05);
    }
    for k in (0..9).filter(|&k| k != 4) {
        assert_eq!(with_a_sick_one[k].body.state, sound[k]);
    }
}
