//! What holds for robots on, at and over obstacles of finite height.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, CardanTarget, Gait, Reference, Wave};
use snake_core::obstacles::{Obstacle, ObstacleGrid, Shape};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Peg, Scene, SceneConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, SpatialScripted, SpatialState, SpatialSystem, orientation_of, twist_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::lanes::{alone_as_among_others, steps_ask_for_no_memory};
use snake_test_support::planar::{LIMP, ground, table_7_5};
use snake_test_support::spatial::{implicit, sidewinding, undulation};

const RADIUS: f64 = 0.0525;

fn still() -> CardanGait {
    CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) }
}

fn box_of(size: [f64; 2], x: f64, y: f64, height: f64) -> Obstacle {
    Obstacle { height: Some(height), ..Obstacle::endless(Shape::Box { size, x, y, angle: 0.0 }) }
}

fn peg_of(radius: f64, x: f64, y: f64, height: f64) -> Obstacle {
    Obstacle { height: Some(height), ..Obstacle::endless(Shape::Circle(Peg { radius, x, y })) }
}

fn among(obstacles: Vec<Obstacle>) -> SceneConfig {
    SceneConfig { obstacles, ..ground([0.2, 0.2]) }
}

fn head(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    Pose { position: Vector3::new(x, y, z), orientation: orientation_of(yaw, 0.0, 0.0) }
}

/// A robot of `links` in the posture of the gait, at rest on what is under it.
fn resting(
    links: usize,
    scene: &SceneConfig,
    pd: &ControllerConfig,
    head: Pose,
    gait: &CardanGait,
) -> SpatialSimulation {
    let robot = RobotConfig { links, ..RobotConfig::default() };
    // Fine enough that two solves of one motion differ by no more than the tests compare.
    let method = ImplicitConfig { tolerance: Some(1e-7), ..implicit(0.01, 2) };
    let mut simulation = SpatialSimulation::new(&robot, scene, pd, &method).expect("admissible");
    let at = |joint| gait.target(joint, 0.0);
    let posture: Vec<_> = (0..links - 1).map(|j| Vector2::new(at(j).yaw.angle, at(j).pitch.angle)).collect();
    simulation.place_chain(head, &posture);
    simulation.rest_on_ground();
    simulation
}

fn farthest(a: &SpatialState, b: &SpatialState, map: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> f64 {
    a.pose.iter().zip(&b.pose).map(|(a, b)| (map(&a.position) - b.position).norm()).fold(0.0, f64::max)
}

fn speed(simulation: &SpatialSimulation) -> f64 {
    simulation.state().twist.iter().map(|u| u.norm()).fold(0.0, f64::max)
}

fn lowest(simulation: &SpatialSimulation) -> f64 {
    simulation.state().pose.iter().map(|pose| pose.position.z).fold(f64::INFINITY, f64::min)
}

/// Advances in control periods; returns the smallest gap on the way.
fn run(simulation: &mut SpatialSimulation, gait: &impl Reference<CardanTarget>, duration: f64) -> f64 {
    let mut smallest = f64::INFINITY;
    for _ in 0..(duration / 0.02).round() as u32 {
        let report = simulation.advance(0.02, gait);
        assert!(!report.diverged && !report.penetrated, "{report:?}");
        smallest = smallest.min(simulation.min_gap());
    }
    smallest
}

/// The same motion and forces, half a metre higher.
#[test]
fn a_top_face_carries_a_robot_as_the_ground_does() {
    let pd = ControllerConfig::default();
    for gait in [undulation(), sidewinding()] {
        let mut below = resting(11, &ground([0.2, 0.2]), &pd, head(1.0, 0.0, 0.0, PI), &gait);
        let scene = among(vec![box_of([5.0, 4.0], 0.2, 0.1, 0.5)]);
        let mut above = resting(11, &scene, &pd, head(1.0, 0.0, 0.0, PI), &gait);
        assert!((lowest(&above) - lowest(&below) - 0.5).abs() < 1e-9);
        for _ in 0..25 {
            below.advance(0.02, &gait);
            above.advance(0.02, &gait);
            for (a, b) in above.body().impulses.top.iter().zip(below.ground_impulse()) {
                assert!((a - b).abs() < 1e-6 * 0.02 * 9.81 * 7.5, "impulses {a} and {b}");
            }
            assert!(above.ground_impulse().iter().all(|impulse| *impulse == 0.0));
        }
        let apart = farthest(below.state(), above.state(), |p| p + Vector3::z() * 0.5);
        assert!(apart < 1e-7, "apart by {apart} m after half a second");
    }
}

/// Without friction at the obstacle its edges only hold the robot up; the ground's friction on the faces keeps it still.
#[test]
fn a_robot_on_stairs_rests_without_sinking() {
    let stairs = vec![box_of([1.0, 2.0], 0.5, 0.0, 0.1), box_of([0.5, 2.0], 0.75, 0.0, 0.2)];
    let limp = ControllerConfig { kp: 20.0, kd: 2.0, ..ControllerConfig::default() };
    let mut simulation = resting(11, &among(stairs), &limp, head(0.8, 0.05, 0.0, PI), &still());
    assert!((lowest(&simulation) - 0.2 - RADIUS).abs() < 1e-6, "lifted onto the upper step");
    let smallest = run(&mut simulation, &still(), 6.0);
    assert!(smallest > -1e-3, "sank by {} m", -smallest);
    let before = simulation.state().clone();
    run(&mut simulation, &still(), 2.0);
    let moved = farthest(&before, simulation.state(), |p| *p);
    assert!(moved < 1e-5 && speed(&simulation) < 1e-4, "moved by {moved} m at {} m/s", speed(&simulation));
    let heights: Vec<f64> = simulation.state().pose.iter().map(|pose| pose.position.z).collect();
    assert!(heights[0] > 0.2 && heights[10] < 0.15, "lies on the steps: {heights:?}");
}

/// Pegs that reach less high than a link's centre line: the robot rolls over them.
#[test]
fn a_robot_crosses_pegs_lower_than_its_radius() {
    let pegs: Vec<_> =
        (0..40).map(|k| peg_of(0.03, 0.25 * f64::from(k % 8) - 0.4, 0.35 * f64::from(k / 8) - 0.9, 0.02)).collect();
    let gait = sidewinding();
    let mut simulation = resting(11, &among(pegs), &ControllerConfig::default(), head(0.9, 0.0, 0.0, PI), &gait);
    let start = simulation.state().clone();
    let smallest = run(&mut simulation, &gait, 8.0);
    assert!(smallest > -1e-3, "sank by {} m", -smallest);
    let way = farthest(&start, simulation.state(), |p| *p);
    assert!(way > 0.4, "went {way} m");
}

/// A limp chain without friction thrown against edges: it rises over low ones and drops over high ones. Steps of second
/// order gain about the cube of the angle by which links turn in them: at a tenth of the step the gain all but vanishes.
#[test]
fn energy_does_not_grow_at_an_edge() {
    let smooth = |obstacles| SceneConfig { friction: [0.0; 2], rolling_friction: 0.0, ..among(obstacles) };
    let cases = [
        (vec![box_of([0.3, 3.0], 0.0, 0.0, 0.03)], 0.4, 0.0),
        (vec![peg_of(0.1, 0.0, 0.02, 0.03)], 0.4, 0.0),
        (vec![box_of([0.2, 0.2], -0.5, 0.03, 0.2)], -0.3, 0.25),
        (vec![peg_of(0.1, -0.5, 0.03, 0.2)], -0.3, 0.25),
    ];
    for ((obstacles, x, z), (step, gain)) in cases.iter().flat_map(|case| [(case, (1e-2, 1e-2)), (case, (1e-3, 2e-4))])
    {
        let robot = RobotConfig { links: 6, ..RobotConfig::default() };
        let scene = smooth(obstacles.clone());
        let mut simulation = SpatialSimulation::new(&robot, &scene, &LIMP, &implicit(step, 2)).expect("admissible");
        simulation.place_chain(head(*x, 0.0, RADIUS + z, 0.4), &[Vector2::zeros(); 5]);
        let mut state = simulation.state().clone();
        state.twist.fill(twist_of(Vector3::new(-0.8, 0.1, 0.0), Vector3::zeros()));
        simulation.place(&state);
        let mut energy = simulation.energy();
        let mut hit = false;
        for _ in 0..150 {
            simulation.advance(0.01, &still());
            let next = simulation.energy();
            assert!(next < (1.0 + gain) * energy, "{obstacles:?}, step {step}: from {energy} J to {next} J");
            hit |= simulation.contact_impulse().iter().any(|impulse| impulse.z > 0.0);
            assert!(simulation.min_gap() > -1e-3, "{obstacles:?}: sank by {} m", -simulation.min_gap());
            energy = next;
        }
        assert!(hit, "{obstacles:?}: no edge was touched");
    }
}

/// Obstacles higher than the robot reaches push as those without end.
#[test]
fn high_obstacles_are_endless_ones() {
    let endless = table_7_5();
    let high = |height| {
        let obstacles = endless.obstacles.iter().map(|one| Obstacle { height, ..one.clone() }).collect();
        SceneConfig { obstacles, ..endless.clone() }
    };
    let gait = undulation();
    let place = head(1.0247, 0.1416, 0.0, 223.617_f64.to_radians());
    let mut runs = [endless.clone(), high(None), high(Some(3.0))].map(|scene| {
        let mut simulation = resting(11, &scene, &ControllerConfig::default(), place, &gait);
        simulation.advance(1.0, &gait);
        simulation
    });
    assert_eq!(runs[0].state(), runs[1].state(), "to the bit");
    let apart = farthest(runs[0].state(), runs[2].state(), |p| *p);
    assert!(apart < 1e-6, "apart by {apart} m");
    assert!(runs[0].contact_impulse().iter().any(|impulse| impulse.norm() > 0.0));
    assert!(!runs[2].advance(0.02, &gait).penetrated);
}

/// Turned about the vertical, and seen in a mirror, a robot falls over an edge the same way.
#[test]
fn direction_and_hand_of_an_edge_do_not_matter() {
    let fall = |turn: f64, hand: f64| {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let place = |x: f64, y: f64| rotation * Vector3::new(x, hand * y, 0.0);
        let corners = [[-0.2, -0.3], [0.2, -0.25], [0.25, 0.3], [-0.2, 0.3]].map(|[x, y]| place(x, y));
        let vertices = corners.iter().map(|corner| [corner.x, corner.y]).collect();
        let wedge = Obstacle { height: Some(0.15), ..Obstacle::endless(Shape::Polygon { vertices }) };
        let peg = place(0.5, 0.1);
        let scene = among(vec![wedge, peg_of(0.05, peg.x, peg.y, 0.04)]);
        let start = place(0.7, 0.05);
        let yaw = turn + hand * (PI + 0.2);
        let mut simulation = resting(6, &scene, &LIMP, head(start.x, start.y, 0.0, yaw), &still());
        simulation.advance(0.5, &still());
        simulation.state().clone()
    };
    let reference = fall(0.0, 1.0);
    let turn = 0.8;
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    let apart = farthest(&reference, &fall(turn, 1.0), |p| rotation * p);
    assert!(apart < 1e-6, "turned: apart by {apart} m");
    let apart = farthest(&reference, &fall(0.0, -1.0), |p| Vector3::new(p.x, -p.y, p.z));
    assert!(apart < 1e-6, "mirrored: apart by {apart} m");
}

/// Robots on steps of different heights, side by side in lanes, move as alone; and no step asks for memory.
#[test]
fn lanes_and_memory_on_steps_are_as_on_the_ground() {
    let scene = Scene::new(&ground([0.2, 0.2])).unwrap();
    let robot = Robot::new(&RobotConfig::default()).unwrap();
    let system = SpatialSystem::new(robot, &scene, ControllerConfig::default()).unwrap();
    let robot = |k: usize| {
        let height = 0.02 * k as f64;
        let steps = [box_of([0.6, 2.0], 0.5, 0.0, 0.1 + height), peg_of(0.1, -0.2, 0.0, 0.05 + height)];
        let pegs = ObstacleGrid::of(&steps[..k % 3]);
        let posture = [Vector2::new(0.1, 0.0); 10];
        SpatialScripted::new(&system.robot, pegs, head(0.7, 0.0, 0.0, PI), &posture, sidewinding())
    };
    steps_ask_for_no_memory(&system, implicit(0.01, 2), [0.1, 0.3], (0..9).map(robot).collect());
    alone_as_among_others(&system, implicit(0.01, 2), &[9, 13], &[0.1, 0.3], 9, robot);
}

/// Chains that spin about a level axis, thrown at the upper edge of a block high above the ground in steps so long that no
/// division resolves them: who ends a step more than a millimetre inside is flagged in it.
#[test]
fn links_left_deep_in_a_block_are_flagged() {
    let block = box_of([0.5, 3.0], 0.0, 0.0, 50.0);
    let (mut flagged, mut deepest) = (0, 0.0_f64);
    for spin in [50.0, 150.0] {
        for speed in [60.0, 120.0] {
            let robot = RobotConfig { links: 3, ..RobotConfig::default() };
            let scene = SceneConfig { friction: [0.0; 2], ..among(vec![block.clone()]) };
            let mut simulation = SpatialSimulation::new(&robot, &scene, &LIMP, &implicit(0.05, 1)).expect("admissible");
            simulation.place_chain(head(0.9, 0.0, 50.0, 0.0), &[Vector2::zeros(); 2]);
            let mut state = simulation.state().clone();
            let centre = state.pose[1].position;
            let turn = Vector3::y() * spin;
            for (pose, twist) in state.pose.iter().zip(&mut state.twist) {
                let velocity = Vector3::new(-speed, 0.0, 0.0) + turn.cross(&(pose.position - centre));
                *twist = twist_of(velocity, pose.orientation.inverse_transform_vector(&turn));
            }
            simulation.place(&state);
            let mut was_inside = false;
            for _ in 0..10 {
                let report = simulation.advance(0.05, &still());
                let depth = -simulation.min_gap();
                assert!(report.penetrated || was_inside || depth < 1e-3 + 1e-9, "{depth} m, {report:?}");
                (flagged, deepest) = (flagged + u32::from(report.penetrated), deepest.max(depth));
                was_inside = depth > 1e-3;
            }
        }
    }
    assert!(flagged > 0, "deepest {deepest} m");
}
