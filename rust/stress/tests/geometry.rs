//! The judge of penetration: its distances are those of the simulator, and it sees what passes through something.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, PlanarRobot, SpatialRobot};
use snake_core::obstacles::{Obstacle, Shape};
use snake_core::planar::{self, assemble_chain};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::SceneConfig;
use snake_core::simulation::{PlanarSimulation, Simulation, SpatialSimulation};
use snake_core::spatial;
use snake_core::stepping::ImplicitConfig;
use snake_stress::geometry::{Surroundings, capsules, gap_to_stops};
use snake_stress::observable::{Observable, least_gap};
use snake_stress::scenarios::environments::{everywhere, everywhere_in_space, random_steps};

fn obstacles() -> Vec<Obstacle> {
    let walls = [
        Shape::Segment { start: [-0.5, 0.4], end: [0.6, 0.5] },
        Shape::Box { size: [0.3, 0.2], x: -0.6, y: -0.3, angle: 0.7 },
        // Clockwise.
        Shape::Polygon { vertices: vec![[0.5, -0.2], [0.3, -0.6], [0.1, -0.3]] },
    ];
    walls.into_iter().map(Obstacle::endless).chain([[0.1, -0.4, 0.2].into(), [0.05, 0.8, 0.0].into()]).collect()
}

/// Compares with the penetration that a simulation measures; returns whether there is one that is not too deep to compare.
fn agrees<M: Observable>(simulation: &Simulation<M>, robot: &Robot, around: &Surroundings) -> bool {
    let own = around.gaps(&capsules(robot, &simulation.state().pose)).least();
    let theirs = least_gap(simulation);
    if theirs < -0.9 * robot.links[0].radius {
        return false;
    }
    assert!((own.min(0.0) - theirs.min(0.0)).abs() < 1e-12, "{own} {theirs}");
    theirs < 0.0
}

#[test]
fn gaps_in_the_plane_are_those_of_the_simulator() {
    let scene = SceneConfig { obstacles: obstacles(), ..SceneConfig::default() };
    let (controller, integrator) = (ControllerConfig::default(), ImplicitConfig::default());
    let mut simulation = PlanarSimulation::new(&RobotConfig::default(), &scene, &controller, &integrator).unwrap();
    let (robot, around) = (simulation.robot().clone(), Surroundings::new(&scene.obstacles));
    let mut rng = Rng::new(1, 0);
    let mut place = || {
        let joint_angle: Vec<f64> = (1..robot.links.len()).map(|_| rng.around_zero(1.2)).collect();
        simulation.place_chain(rng.around_zero(1.0), rng.around_zero(1.0), rng.around_zero(3.0), &joint_angle);
        agrees(&simulation, &robot, &around)
    };
    assert!((0..3000).filter(|_| place()).count() > 300);
}

#[test]
fn gaps_in_space_are_those_of_the_simulator() {
    let scene = SceneConfig { obstacles: obstacles(), ..SceneConfig::default() };
    let (controller, integrator) = (ControllerConfig::default(), ImplicitConfig::default());
    let mut simulation = SpatialSimulation::new(&RobotConfig::default(), &scene, &controller, &integrator).unwrap();
    let (robot, around) = (simulation.robot().clone(), Surroundings::new(&scene.obstacles));
    let mut rng = Rng::new(2, 0);
    let mut place = || {
        let position = Vector3::new(rng.around_zero(1.0), rng.around_zero(1.0), 0.6 * rng.unit());
        let orientation = UnitQuaternion::new(Vector3::from_fn(|_, _| rng.around_zero(3.0)));
        let joint_angle: Vec<Vector2<f64>> =
            (1..robot.links.len()).map(|_| Vector2::from_fn(|_, _| rng.around_zero(1.0))).collect();
        simulation.place_chain(spatial::Pose { position, orientation }, &joint_angle);
        agrees(&simulation, &robot, &around)
    };
    assert!((0..3000).filter(|_| place()).count() > 300);
}

/// Aiko straight along x, its middle at this place.
fn straight(robot: &Robot, x: f64, y: f64) -> Vec<planar::Pose> {
    let mut pose = vec![planar::Pose::zeros(); robot.links.len()];
    assemble_chain(robot, planar::Pose::new(x - 0.61, y, 0.0), &vec![0.0; robot.links.len() - 1], &mut pose);
    pose
}

#[test]
fn a_robot_that_jumps_over_something_passed_through_it() {
    let robot = Robot::new(&RobotConfig::default()).unwrap();
    let passed = |obstacle: Obstacle, from: f64, to: f64| {
        let [start, end] = [from, to].map(|y| straight(&robot, 0.0, y));
        Surroundings::new(&[obstacle]).passed_through(&robot, &start, &end)
    };
    let wall = || Obstacle::endless(Shape::Segment { start: [0.02, 0.0], end: [0.02, 0.01] });
    let peg = || Obstacle::from([0.02, 0.3, 0.0]);
    for obstacle in [wall, peg] {
        assert!(passed(obstacle(), -0.1, 0.1), "{:?}", obstacle());
        assert!(!passed(obstacle(), -0.2, -0.08), "{:?}", obstacle());
    }
}

#[test]
fn joints_beyond_their_limits_are_found() {
    let robot = Robot::new(&RobotConfig { links: 3, joint_limit: Some(1.2.into()), ..RobotConfig::default() }).unwrap();
    let lever = 0.5 * robot.links[0].length;
    for bend in [0.4_f64, 1.3, -1.3] {
        let gap = lever * (1.2 - bend.abs());
        let mut flat = vec![planar::Pose::zeros(); 3];
        assemble_chain(&robot, planar::Pose::new(0.1, 0.2, 0.3), &[0.1, bend], &mut flat);
        assert!((gap_to_stops(&robot, &flat) - gap).abs() < 1e-12);
        for angle in [Vector2::new(bend, 0.1), Vector2::new(-0.2, bend)] {
            let head =
                spatial::Pose { position: Vector3::zeros(), orientation: spatial::orientation_of(0.4, 0.3, 0.2) };
            let mut pose = vec![head; 3];
            spatial::assemble_chain(&robot, head, &[Vector2::zeros(), angle], &mut pose);
            assert!((gap_to_stops(&robot, &pose) - gap).abs() < 1e-12, "{angle}");
        }
    }
}

#[test]
fn links_that_do_not_touch_each_other_are_found_deep_inside_each_other() {
    let hollow = |mut config: EnvConfig| {
        config.robot.self_contact = Some(false);
        config
    };
    let planar = everywhere(ActionMode::Joints).swap_remove(1);
    let spatial = everywhere_in_space(ActionMode::Joints).swap_remove(0);
    for (solid, figures) in [
        (true, random_steps::<PlanarRobot>(&planar.config, 8_000, 1)),
        (false, random_steps::<PlanarRobot>(&hollow(planar.config), 8_000, 1)),
        (true, random_steps::<SpatialRobot>(&spatial.config, 1_600, 1)),
        (false, random_steps::<SpatialRobot>(&hollow(spatial.config), 1_600, 1)),
    ] {
        // Between the ends of parts links move by less than their width: what passes through something is found inside it.
        assert_eq!((figures.penetration < 1e-3, figures.tunnels), (solid, 0), "{figures:?}");
    }
}
