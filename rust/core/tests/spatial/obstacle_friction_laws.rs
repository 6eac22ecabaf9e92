//! Coulomb friction at obstacles in 3D: what slides, what sticks, and agreement with the plane.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::obstacles::{Obstacle, ObstacleGrid, Shape};
use snake_core::planar::Twist;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_core::simulation::{PlanarSimulation, SpatialSimulation};
use snake_core::slope::Slope;
use snake_core::spatial::{Pose, SpatialSystem, orientation_of, twist_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::flat::Still;
use snake_test_support::lanes::{alone_as_among_others, steps_ask_for_no_memory};
use snake_test_support::planar::{LIMP, ground, table_7_5};
use snake_test_support::spatial::{implicit, in_gait, undulation};

const RADIUS: f64 = 0.0525;

fn rough(shape: Shape, friction: f64) -> Obstacle {
    Obstacle { friction, ..Obstacle::endless(shape) }
}

/// Smooth ground that falls to -x and -y, with a wall along the x axis below the robot.
fn ledge(friction: f64) -> SceneConfig {
    let wall = rough(Shape::Segment { start: [-9.0, 0.0], end: [9.0, 0.0] }, friction);
    let slope = Slope { angle: 0.6, direction: 0.6 };
    SceneConfig { obstacles: vec![wall], slope, rolling_friction: 0.0, ..ground([0.0; 2]) }
}

fn lying(scene: &SceneConfig, step: f64) -> SpatialSimulation {
    let pd = ControllerConfig::default();
    let mut simulation =
        SpatialSimulation::new(&RobotConfig::default(), scene, &pd, &implicit(step, 2)).expect("admissible");
    let head = Pose { position: Vector3::new(0.0, RADIUS, 0.0), orientation: orientation_of(0.0, 0.0, 0.0) };
    simulation.place_chain(head, &[Vector2::zeros(); 10]);
    simulation.rest_on_ground();
    simulation
}

#[test]
fn a_robot_slides_along_a_rough_wall_as_in_the_plane() {
    for friction in [0.1, 0.5] {
        let scene = ledge(friction);
        let mut space = lying(&scene, 0.01);
        let pd = ControllerConfig::default();
        let mut plane =
            PlanarSimulation::new(&RobotConfig::default(), &scene, &pd, &ImplicitConfig::default()).unwrap();
        plane.place_chain(0.0, RADIUS, 0.0, &[0.0; 10]);
        for _ in 0..25 {
            let report = space.advance(0.02, &Still);
            assert!(!report.diverged && report.unconverged == 0 && report.fallbacks == 0, "{report:?}");
            plane.advance(0.02, &Still);
        }
        let push: Vector3<f64> = space.contact_impulse().iter().sum();
        assert!((push.x - friction * push.y).abs() < 1e-4 * push.y && push.y > 0.0, "{push:?}");
        let (there, here) = (plane.state().pose[5].xy(), space.state().pose[5].position);
        assert!((there - here.xy()).norm() < 1e-6, "{there:?} in the plane, {here:?} in 3D");
        let pull = 9.81 * 0.6_f64.sin() * (0.6_f64.cos() - friction * 0.6_f64.sin());
        let way = 0.5 * pull * 0.25;
        assert!((here.x - 5.0 * 0.122 + way).abs() < 1e-6, "slid to {} instead of {way}", here.x);
    }
}

/// A limp robot thrown at a rough wall, on ground without friction: friction acts at the surface of the links and turns them.
#[test]
fn a_robot_thrown_at_a_rough_wall_turns_as_in_the_plane() {
    let wall = rough(Shape::Segment { start: [-9.0, 0.0], end: [9.0, 0.0] }, 0.5);
    let scene = SceneConfig { obstacles: vec![wall], rolling_friction: 0.0, ..ground([0.0; 2]) };
    let robot = RobotConfig { links: 3, ..RobotConfig::default() };
    let (step, thrown) = (1e-3, [1.0, -1.0]);
    let mut space = SpatialSimulation::new(&robot, &scene, &LIMP, &implicit(step, 2)).expect("admissible");
    space.place_chain(
        Pose { position: Vector3::new(0.0, 0.15, 0.0), orientation: orientation_of(0.6, 0.0, 0.0) },
        &[Vector2::zeros(); 2],
    );
    space.rest_on_ground();
    let mut state = space.state().clone();
    state.twist.fill(twist_of(Vector3::new(thrown[0], thrown[1], 0.0), Vector3::zeros()));
    space.place(&state);
    let mut plane = PlanarSimulation::new(&robot, &scene, &LIMP, &implicit(step, 2)).unwrap();
    plane.place_chain(0.0, 0.15, 0.6, &[0.0; 2]);
    let mut state = plane.state().clone();
    state.twist.fill(Twist::new(thrown[0], thrown[1], 0.0));
    plane.place(&state);
    for _ in 0..200 {
        space.advance(step, &Still);
        plane.advance(step, &Still);
    }
    let turned = plane.state().pose[0].z - 0.6;
    let poses = plane.state().pose.iter().zip(&space.state().pose);
    let apart = poses.map(|(q, p)| (q.xy() - p.position.xy()).norm()).fold(0.0, f64::max);
    assert!(turned.abs() > 0.1, "turned by {turned}");
    assert!(apart < 2e-4, "{apart} m apart");
}

#[test]
fn a_robot_at_a_wall_rougher_than_the_slope_stays() {
    // Downhill is at the angle 0.6 from the wall's normal turned by a right angle: tan(pi/2 - 0.6) = 1.46.
    let mut simulation = lying(&ledge(1.6), 0.01);
    simulation.advance(0.5, &Still);
    let before = simulation.state().clone();
    let report = simulation.advance(3.0, &Still);
    assert_eq!(report.unconverged, 0);
    let moved = (simulation.state().pose[5].position - before.pose[5].position).norm();
    assert!(moved < 1e-6, "crept {moved} m");
}

/// Blocks that carry no end sphere hold a robot on a slope by the friction of their edges alone.
#[test]
fn rough_edges_hold_a_robot_on_a_slope() {
    let way = |friction: f64| {
        let block = |k: i32| {
            let shape = Shape::Box { size: [0.03, 1.0], x: 0.122 * f64::from(k), y: 0.0, angle: 0.0 };
            Obstacle { height: Some(0.1), ..rough(shape, friction) }
        };
        let slope = Slope { angle: 0.2, direction: PI / 2.0 };
        let scene = SceneConfig { obstacles: (0..5).map(block).collect(), slope, ..ground([0.2, 0.2]) };
        let robot = RobotConfig { links: 5, ..RobotConfig::default() };
        let pd = ControllerConfig::default();
        let mut simulation = SpatialSimulation::new(&robot, &scene, &pd, &implicit(0.01, 2)).expect("admissible");
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.0, 0.0, 0.0) };
        simulation.place_chain(head, &[Vector2::zeros(); 4]);
        simulation.rest_on_ground();
        assert!((simulation.state().pose[0].position.z - 0.1 - RADIUS).abs() < 1e-9);
        let report = simulation.advance(0.3, &Still);
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        (simulation.state().pose[2].position.y, simulation.min_gap())
    };
    // Without friction g sin(0.2) t^2 / 2; a cylinder that rolls on its edges moves less, one on smooth edges does not turn.
    let smooth = way(0.0);
    assert!((smooth.0 + 0.5 * 9.81 * 0.2_f64.sin() * 0.09).abs() < 1e-3, "{smooth:?}");
    let held = way(1.0);
    assert!(held.0.abs() < 0.7 * smooth.0.abs(), "{held:?}, smooth {smooth:?}");
    assert!(held.1 > -1e-3 && smooth.1 > -1e-3);
}

/// Among rough pegs: no step fails, none asks for memory, neighbours in lanes do not matter, friction takes energy.
#[test]
fn rough_pegs_are_solved_alike_alone_and_in_lanes() {
    let flat = Scene::new(&ground([0.2, 0.2])).unwrap();
    let robot = Robot::new(&RobotConfig::default()).unwrap();
    let system = SpatialSystem::new(robot, &flat, ControllerConfig::default()).unwrap();
    let robot = |k: usize| {
        let friction = 0.05 * (k % 5) as f64;
        let obstacles: Vec<_> = table_7_5().obstacles.into_iter().map(|peg| Obstacle { friction, ..peg }).collect();
        let start = [1.0247, 0.1416, 223.617_f64.to_radians()];
        in_gait(&system.robot, ObstacleGrid::of(&obstacles), start, undulation())
    };
    steps_ask_for_no_memory(&system, implicit(0.01, 2), [0.1, 0.4], (0..9).map(robot).collect());
    for (_, intervals) in alone_as_among_others(&system, implicit(0.01, 2), &[9, 13], &[0.1, 0.4], 9, robot) {
        assert!(intervals.iter().all(|one| !one.diverged && one.unconverged == 0), "{intervals:?}");
    }
}
