//! Laws of mechanics that the spatial model must keep: free flight, rolling, sliding, sticking, falling.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanTarget, JointTarget, Reference};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Peg, SceneConfig};
use snake_core::simulation::Simulation;
use snake_core::spatial::{Pose, Spatial, SpatialState, StackedTwist, inertia, orientation_of, turning};
use snake_test_support::planar::{LIMP, Random, ground, links};
use snake_thesis::ThesisConfig;
use snake_thesis::spatial::{SpatialThesis, smooth_force, travel};

use crate::thesis;

const G: f64 = 9.81;
const RADIUS: f64 = 0.0525;

/// A reference that never changes: the same yaw and pitch for all joints.
struct Hold(f64, f64);

impl Reference<CardanTarget> for Hold {
    fn target(&self, _joint: usize, _time: f64) -> CardanTarget {
        let still = |angle| JointTarget { angle, rate: 0.0, acceleration: 0.0 };
        CardanTarget { yaw: still(self.0), pitch: still(self.1) }
    }
}

fn limp(robot: &RobotConfig, scene: &SceneConfig, integrator: &ThesisConfig) -> Simulation<Spatial, SpatialThesis> {
    Simulation::new(robot, scene, &LIMP, integrator).expect("admissible")
}

fn straight(height: f64, pitch: f64, roll: f64) -> Pose {
    Pose { position: Vector3::new(0.0, 0.0, height), orientation: orientation_of(0.3, pitch, roll) }
}

/// Linear momentum, and angular momentum about the common CG, frame I.
fn momentum(robot: &Robot, state: &SpatialState) -> (Vector3<f64>, Vector3<f64>) {
    let links = || robot.links.iter().zip(&state.pose).zip(&state.twist);
    let centre = links().map(|((link, q), _)| q.position * link.mass).sum::<Vector3<f64>>() / robot.total_mass();
    let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
    for ((link, q), u) in links() {
        let p = u.fixed_rows::<3>(0) * link.mass;
        linear += p;
        angular += (q.position - centre).cross(&p) + q.orientation * inertia(link).component_mul(&turning(u));
    }
    (linear, angular)
}

/// A free symmetric body: e_z^B turns about the constant angular momentum at |L| / Theta_psi, and the angular velocity
/// in the body turns about e_z^B at (Theta_rho / Theta_psi - 1) omega_z.
#[test]
fn a_free_link_precesses_as_euler_says() {
    let link = Robot::new(&RobotConfig::default()).unwrap().links[0];
    let (h, steps) = (1e-5, 50_000);
    let mut q = straight(0.0, 0.4, 0.2);
    let mut u = StackedTwist::new(0.0, 0.0, 0.0, 3.0, -1.0, 8.0);
    let start = turning(&u);
    let l = q.orientation * inertia(&link).component_mul(&start);
    let axis = q.axis();
    for _ in 0..steps {
        // Heun's method: second order, so that 5e4 steps of 1e-5 s err by about 1e-8.
        let slope = |u: &StackedTwist| {
            turning(&smooth_force(&link, &Vector3::new(0.0, 0.0, -G), u)).component_div(&inertia(&link))
        };
        let first = slope(&u);
        let mut ahead = u;
        let mut turn = ahead.fixed_rows_mut::<3>(3);
        turn += first * h;
        let mean = (first + slope(&ahead)) * 0.5;
        q = travel(&q, &u, 0.5 * h);
        let mut turn = u.fixed_rows_mut::<3>(3);
        turn += mean * h;
        q = travel(&q, &u, 0.5 * h);
    }
    let time = h * f64::from(steps);
    let spin = (link.roll_inertia / link.inertia - 1.0) * start.z * time;
    let about_z = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), spin);
    assert!((turning(&u) - about_z * start).norm() < 1e-6, "{} {}", turning(&u), about_z * start);
    let about_l = UnitQuaternion::from_scaled_axis(l / link.inertia * time);
    assert!((q.axis() - about_l * axis).norm() < 1e-6);
    assert!((q.orientation * inertia(&link).component_mul(&turning(&u)) - l).norm() < 1e-6 * l.norm());
}

/// A chain that bends as it falls: gravity gives all its linear momentum, and nothing gives angular momentum.
#[test]
fn momentum_of_a_flying_chain_follows_gravity_alone() {
    let controller = ControllerConfig { kp: 2.0, kd: 0.01, ..ControllerConfig::default() };
    let spun = |h: f64| {
        let (robot, scene) = (links(5), ground([0.2, 0.2]));
        let mut simulation =
            Simulation::<Spatial, _>::new(&robot, &scene, &controller, &thesis(h, 1e-12)).expect("admissible");
        simulation.place_chain(straight(50.0, 0.3, 0.1), &[Vector2::new(0.5, -0.3); 4]);
        let robot = simulation.robot().clone();
        let mut energy = 0.0_f64;
        for _ in 0..20 {
            simulation.advance(0.01, &Hold(-0.4, 0.6));
            let (linear, _) = momentum(&robot, simulation.state());
            energy = energy
                .max(simulation.state().kinetic_energy(&robot) - linear.norm_squared() / robot.total_mass() / 2.0);
        }
        let (linear, angular) = momentum(&robot, simulation.state());
        let expected = Vector3::new(0.0, 0.0, -robot.total_mass() * G * 0.2);
        assert!((linear - expected).norm() < 1e-9, "joints and actuators are internal: {linear}");
        assert!(energy > 0.1, "the actuators did bend the chain: {energy} J");
        assert!(simulation.joint_gap() < 1e-13, "round-off of 50 m");
        angular.norm()
    };
    let (coarse, fine) = (spun(2e-4), spun(1e-4));
    println!("angular momentum from nothing: {coarse:.1e} and {fine:.1e} kg m^2/s");
    assert!(fine < 4e-4 && fine < 0.6 * coarse, "explicit gyroscopic terms and the projection err by O(h)");
}

/// A cylinder that rolls without slipping loses m v' = -mu_V m g / (1 + Theta_rho / (m r^2)) and stops after
/// v^2 / (2 a).
#[test]
fn a_rolling_cylinder_stops_where_rolling_friction_stops_it() {
    let scene = SceneConfig { rolling_friction: 0.05, ..ground([0.6, 0.6]) };
    let mut simulation = limp(&links(3), &scene, &thesis(2.5e-4, 1e-9));
    simulation.place_chain(straight(RADIUS, 0.0, 0.0), &[Vector2::zeros(); 2]);
    let link = simulation.robot().links[0];
    let mut state = simulation.state().clone();
    let speed = 0.4;
    let sideways = state.pose[0].axis().cross(&Vector3::z());
    for u in &mut state.twist {
        let v = sideways * speed;
        *u = StackedTwist::new(v.x, v.y, 0.0, 0.0, 0.0, speed / RADIUS);
    }
    simulation.place(&state);
    let rate = 0.05 * G / (1.0 + link.roll_inertia / (link.mass * RADIUS * RADIUS));
    let (time, distance) = (speed / rate, speed * speed / (2.0 * rate));
    simulation.advance(0.5 * time, &Hold(0.0, 0.0));
    let halfway = simulation.state().pose[1].position - state.pose[1].position;
    assert!((halfway.dot(&sideways) - 0.75 * distance).abs() < 1e-3 * distance);
    simulation.advance(0.6 * time, &Hold(0.0, 0.0));
    let travelled = simulation.state().pose[1].position - state.pose[1].position;
    assert!((travelled.dot(&sideways) - distance).abs() < 1e-3 * distance, "{} {distance}", travelled.dot(&sideways));
    let left = simulation.state().twist[1].norm();
    assert!(left < 1e-5, "it rests, to the tolerance of the iteration: {left:e}");
}

/// A straight robot sliding along its axis is a block: it stops after v^2 / (2 mu g), with the mu of that direction.
#[test]
fn a_sliding_robot_stops_after_the_distance_of_coulomb() {
    let mut simulation = limp(&links(4), &ground([0.3, 0.8]), &thesis(2.5e-4, 1e-9));
    simulation.place_chain(straight(RADIUS, 0.0, 0.0), &[Vector2::zeros(); 3]);
    let mut state = simulation.state().clone();
    let speed = 1.0;
    let axis = state.pose[0].axis();
    state.twist.fill(StackedTwist::new(axis.x * speed, axis.y * speed, 0.0, 0.0, 0.0, 0.0));
    simulation.place(&state);
    simulation.advance(1.2 * speed / (0.3 * G), &Hold(0.0, 0.0));
    let travelled = simulation.state().pose[2].position - state.pose[2].position;
    let distance = speed * speed / (2.0 * 0.3 * G);
    assert!((travelled - axis * distance).norm() < 1e-3 * distance, "{}", travelled.norm());
    assert!(simulation.state().twist[2].norm() < 1e-7, "it rests");
}

/// Torques too weak to move a link: 0.02 N m on an arm of 0.16 m pushes with 0.13 N, friction holds 1.3 N a link.
#[test]
fn friction_holds_a_robot_that_pushes_too_weakly() {
    let controller = ControllerConfig { kp: 0.05, kd: 0.0, ..ControllerConfig::default() };
    let scene = ground([0.2, 0.2]);
    let mut simulation = Simulation::<Spatial, _>::new(&links(4), &scene, &controller, &thesis(2.5e-4, 1e-11)).unwrap();
    simulation.place_chain(straight(RADIUS, 0.0, 0.0), &[Vector2::zeros(); 3]);
    simulation.advance(0.1, &Hold(0.4, 0.0));
    let before = simulation.state().clone();
    simulation.advance(2.0, &Hold(0.4, 0.0));
    for (q, p) in simulation.state().pose.iter().zip(&before.pose) {
        let crept = (q.position - p.position).xy().norm();
        assert!(crept < 1e-7, "{crept:e} m in 2 s: the tolerance of the iteration, not a creeping law");
    }
}

/// Falling flat, the robot loses all its speed at once and keeps no more than the penetration of one step.
#[test]
fn a_flat_drop_is_inelastic() {
    for step in [2.5e-4, 1e-3] {
        let mut simulation = limp(&links(6), &ground([0.2, 0.2]), &thesis(step, 1e-9));
        let height = 0.2;
        simulation.place_chain(straight(RADIUS + height, 0.0, 0.7), &[Vector2::zeros(); 5]);
        let fall = (2.0 * height / G).sqrt();
        simulation.advance(fall + 0.05, &Hold(0.0, 0.0));
        let speed = G * fall;
        assert!(simulation.state().twist.iter().all(|u| u.norm() < 1e-5), "at rest right after the impact");
        let gap = simulation.min_gap();
        assert!(gap <= 0.0 && gap > -speed * step, "velocity-level contact leaves at most a step's way: {gap:e}");
    }
}

/// A limp robot thrown at the ground at random never gains energy, and comes to rest on the ground.
#[test]
fn energy_never_grows_in_a_fall_and_the_robot_ends_at_rest() {
    let mut random = Random::new(70);
    for trial in 0..3 {
        let mut simulation = limp(&links(5), &ground([0.3, 0.5]), &thesis(2.5e-4, 1e-7));
        let angles: Vec<_> = (0..4).map(|_| Vector2::from_fn(|_, _| random.between(-0.5, 0.5))).collect();
        simulation.place_chain(straight(0.5, random.between(-0.5, 0.5), random.angle()), &angles);
        let mut last = simulation.energy();
        let start = last;
        for _ in 0..300 {
            let report = simulation.advance(0.01, &Hold(0.0, 0.0));
            assert!(!report.diverged);
            let energy = simulation.energy();
            assert!(energy < last + 2e-3 * start, "trial {trial}: {last} to {energy} J, O(h) per impact at most");
            last = energy;
        }
        let kinetic = simulation.state().kinetic_energy(simulation.robot());
        assert!(kinetic < 1e-3, "trial {trial}: {kinetic:e} J left");
        assert!(simulation.min_gap() > -5e-3);
    }
}

/// The whole scene turned and shifted in the plane: so is the motion, to what round-off grows to.
#[test]
fn motion_turns_and_shifts_with_the_scene() {
    let peg = Peg { radius: 0.05, x: 0.3966, y: 0.0092 };
    let run = |turn: f64, shift: Vector2<f64>| {
        let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let hub = about * Vector3::new(peg.x, peg.y, 0.0);
        let moved = Peg { x: hub.x + shift.x, y: hub.y + shift.y, ..peg };
        let scene = SceneConfig { obstacles: vec![moved.into()], ..ground([0.2, 0.5]) };
        let controller = ControllerConfig { kp: 5.0, kd: 0.2, ..ControllerConfig::default() };
        let mut simulation =
            Simulation::<Spatial, _>::new(&links(4), &scene, &controller, &thesis(2.5e-4, 1e-6)).unwrap();
        // A micrometre deep: round-off would otherwise choose which contacts are closed in the first step.
        let head = Pose { position: shift.push(RADIUS - 1e-6), orientation: about * orientation_of(0.3, 0.0, 0.0) };
        simulation.place_chain(head, &[Vector2::zeros(); 3]);
        let mut pushed = 0.0;
        for _ in 0..30 {
            simulation.advance(0.01, &Hold(-0.3, 0.0));
            pushed += simulation.contact_impulse().iter().map(|impulse| impulse.norm()).sum::<f64>();
        }
        let end = simulation.state().pose[3].position - shift.push(0.0);
        (about.inverse() * end, pushed)
    };
    let (one, pushed) = run(0.0, Vector2::zeros());
    assert!(pushed > 0.1, "the peg takes part: {pushed}");
    for (turn, shift) in [(1.0, Vector2::zeros()), (0.0, Vector2::new(3.0, -2.0)), (-2.4, Vector2::new(-1.0, 0.5))] {
        let (other, _) = run(turn, shift);
        assert!((one - other).norm() < 1e-9, "{one} {other}");
    }
}

/// Turned about by half a turn at a time, a straight robot rolls over its whole outline and ends as it began.
#[test]
fn a_robot_rolls_through_360_degrees() {
    let scene = SceneConfig { rolling_friction: 0.0, ..ground([0.5, 0.5]) };
    let mut simulation = limp(&links(3), &scene, &thesis(2.5e-4, 1e-9));
    simulation.place_chain(straight(RADIUS, 0.0, 0.0), &[Vector2::zeros(); 2]);
    let mut state = simulation.state().clone();
    let rate = 2.0 * PI;
    let sideways = state.pose[0].axis().cross(&Vector3::z()) * (rate * RADIUS);
    state.twist.fill(StackedTwist::new(sideways.x, sideways.y, 0.0, 0.0, 0.0, rate));
    simulation.place(&state);
    simulation.advance(1.0, &Hold(0.0, 0.0));
    for (q, p) in simulation.state().pose.iter().zip(&state.pose) {
        assert!((q.position - p.position - sideways).norm() < 1e-4, "one circumference");
        assert!(q.orientation.angle_to(&p.orientation) < 1e-3);
    }
}
