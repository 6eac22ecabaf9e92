//! What holds when a robot touches itself in 3D.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanTarget, JointTarget, Reference};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, SpatialScripted, SpatialState, SpatialSystem, orientation_of, twist_of};
use snake_test_support::allocation::REQUESTS;
use snake_test_support::lanes::alone_as_among_others;
use snake_test_support::planar::{Hold, LIMP, build, ground, implicit as planar_implicit, moving_chain};
use snake_test_support::spatial::{DEGREE, implicit, undulation};

/// Joints turn as far as the links let them.
fn solid(links: usize) -> RobotConfig {
    RobotConfig { links, self_contact: true.into(), joint_limit: Some(f64::INFINITY.into()), ..RobotConfig::default() }
}

fn hollow(links: usize) -> RobotConfig {
    RobotConfig { self_contact: false.into(), ..solid(links) }
}

/// A reference that never changes, one yaw and one pitch for all joints.
#[derive(Debug, Clone, Copy)]
struct Bend {
    yaw: f64,
    pitch: f64,
}

impl Reference<CardanTarget> for Bend {
    fn target(&self, _: usize, _: f64) -> CardanTarget {
        let hold = |angle| JointTarget { angle, ..JointTarget::default() };
        CardanTarget { yaw: hold(self.yaw), pitch: hold(self.pitch) }
    }
}

fn robot(config: &RobotConfig, friction: [f64; 2], pd: &ControllerConfig, step: f64) -> SpatialSimulation {
    let scene = SceneConfig { rolling_friction: if friction[0] > 0.0 { 0.02 } else { 0.0 }, ..ground(friction) };
    SpatialSimulation::new(config, &scene, pd, &implicit(step, 2)).expect("admissible")
}

fn weak() -> ControllerConfig {
    ControllerConfig { torque_limit: Some(5.0), ..ControllerConfig::default() }
}

fn flat(yaw: f64) -> Pose {
    Pose { position: Vector3::zeros(), orientation: orientation_of(yaw, 0.0, 0.0) }
}

/// Joints driven to where links would overlap by centimetres. Returns the smallest gap of two links on the way.
fn coil(config: &RobotConfig, to: Bend, heading: f64, steps: u32) -> (SpatialSimulation, f64) {
    let mut simulation = robot(config, [0.2, 0.2], &weak(), 1e-2);
    simulation.place_chain(flat(heading), &vec![Vector2::zeros(); config.links - 1]);
    simulation.rest_on_ground();
    let mut smallest = f64::INFINITY;
    for _ in 0..steps {
        simulation.advance(1e-2, &to);
        smallest = smallest.min(simulation.self_gap());
    }
    (simulation, smallest)
}

#[test]
fn a_robot_that_coils_up_does_not_pass_through_itself() {
    for to in [Bend { yaw: 1.1, pitch: 0.0 }, Bend { yaw: 1.2, pitch: 0.15 }] {
        let (simulation, gap) = coil(&solid(11), to, 0.0, 200);
        assert!(gap > -1e-3, "penetration of {} m", -gap);
        assert!(!simulation.body().statistics.diverged);
        let (_, without) = coil(&hollow(11), to, 0.0, 200);
        assert!(without < -0.02, "the same motion without self-contact overlaps by {} m", -without);
    }
}

#[test]
fn a_coiled_robot_pressed_on_itself_stands_still() {
    let to = Bend { yaw: 1.1, pitch: 0.0 };
    let (mut simulation, _) = coil(&solid(11), to, 0.0, 500);
    let before = simulation.state().clone();
    let report = simulation.advance(5.0, &to);
    let moved = farthest(&before, simulation.state(), |p| p);
    assert!(moved < 1e-6, "moved by {moved} m in five seconds");
    assert_eq!(report.unconverged, 0);
    let pressed = simulation.self_contact_impulse().iter().map(|impulse| impulse.norm()).fold(0.0, f64::max);
    assert!(pressed / 5.0 > 1.0, "{} N", pressed / 5.0);
}

#[test]
fn impulses_between_links_cancel() {
    let to = Bend { yaw: 1.2, pitch: 0.15 };
    let (mut simulation, _) = coil(&solid(11), to, 0.0, 60);
    let mut touched = false;
    for _ in 0..60 {
        simulation.advance(1e-2, &to);
        let impulses = simulation.self_contact_impulse();
        touched |= impulses.iter().any(|impulse| impulse.norm() > 0.0);
        assert!(impulses.iter().sum::<Vector3<f64>>().norm() < 1e-12);
    }
    assert!(touched);
}

/// Three links in a U, in the air, whose outer ones swing towards each other like in a mirror; `hand` is 1 or -1.
fn swinging_u(head: Pose, hand: f64, drift: Vector3<f64>, spin: f64) -> SpatialSimulation {
    let mut simulation = robot(&solid(3), [0.0, 0.0], &LIMP, STEP);
    simulation.place_chain(head, &[Vector2::new(hand * 80.0 * DEGREE, 0.0); 2]);
    let mut state = simulation.state().clone();
    let (centre, middle) = (state.pose.iter().map(|p| p.position).sum::<Vector3<f64>>() / 3.0, state.pose[1]);
    for (i, (pose, twist)) in state.pose.iter().zip(&mut state.twist).enumerate() {
        // Links 1 and 3 turn about their joints with the middle one.
        let side = i as f64 - 1.0;
        let omega = Vector3::z() * (hand * side);
        let joint = middle.position + middle.axis() * (side * 0.061);
        let swing = omega.cross(&(pose.position - joint));
        let turn = Vector3::z() * spin;
        let velocity = drift + swing + turn.cross(&(pose.position - centre));
        *twist = twist_of(velocity, pose.orientation.inverse_transform_vector(&(omega + turn)));
    }
    simulation.place(&state);
    simulation
}

/// Returns the robot after the impact, and its motion before.
fn closing_u(head: Pose, hand: f64, drift: Vector3<f64>, spin: f64) -> (SpatialSimulation, (Vector3<f64>, f64)) {
    let mut simulation = swinging_u(head, hand, drift, spin);
    let before = motion(&simulation);
    for _ in 0..400 {
        simulation.advance(STEP, &STRAIGHT);
    }
    (simulation, before)
}

/// Of the limp robots in the air \[s\].
const STEP: f64 = 1e-3;
const STRAIGHT: Bend = Bend { yaw: 0.0, pitch: 0.0 };

fn in_the_air(heading: f64) -> Pose {
    Pose { position: Vector3::new(0.0, 0.0, 50.0), ..flat(heading) }
}

const DRIFT: Vector3<f64> = Vector3::new(0.3, -0.2, 0.0);
const SPIN: f64 = 0.5;

/// Momentum, and kinetic energy beside that of the CG.
fn motion(simulation: &SpatialSimulation) -> (Vector3<f64>, f64) {
    let (robot, state) = (simulation.robot(), simulation.state());
    let momentum: Vector3<f64> =
        robot.links.iter().zip(&state.twist).map(|(link, u)| u.fixed_rows::<3>(0) * link.mass).sum();
    let of_centre = momentum.norm_squared() / (2.0 * robot.total_mass());
    (momentum, state.kinetic_energy(robot) - of_centre)
}

/// What is left after the inelastic impact is the motion of a rigid body, and without angular momentum that of its CG.
#[test]
fn an_impact_of_two_rods_is_inelastic() {
    let (simulation, (_, before)) = closing_u(in_the_air(0.0), 1.0, Vector3::zeros(), 0.0);
    let (_, after) = motion(&simulation);
    assert!(simulation.self_gap().abs() < 1e-4, "gap {}", simulation.self_gap());
    assert!(after < 1e-3 * before, "{after} J of {before} J left");
}

/// The energy of an inelastic impact without friction falls by half the impulse times the closing velocity; that of the
/// motion before and after it stays.
#[test]
fn an_impact_of_two_rods_keeps_the_momentum_and_takes_half_the_impulse_times_the_closing_velocity() {
    let mut simulation = swinging_u(in_the_air(0.0), 1.0, DRIFT, SPIN);
    let (expected, before) = motion(&simulation);
    let (mut closing, mut impulse, mut gap) = (0.0, 0.0, simulation.self_gap());
    while impulse == 0.0 {
        simulation.advance(STEP, &STRAIGHT);
        impulse = largest_impulse(&simulation);
        let next = simulation.self_gap();
        if impulse == 0.0 {
            (closing, gap) = ((gap - next) / STEP, next);
        }
    }
    // The gap closes in one part of a step, the approach ends in the next.
    for _ in 0..3 {
        simulation.advance(STEP, &STRAIGHT);
        impulse += largest_impulse(&simulation);
    }
    let (momentum, after) = motion(&simulation);
    // Weight adds to the vertical part.
    assert!((momentum - expected).xy().norm() < 1e-8, "{momentum} {expected}");
    let lost = 0.5 * impulse * closing;
    assert!((before - after - lost).abs() < 0.01 * lost, "{} J lost, {lost} J expected", before - after);
}

/// Size of the impulse between two links of the last interval \[N s\].
fn largest_impulse(simulation: &SpatialSimulation) -> f64 {
    simulation.self_contact_impulse().iter().map(|impulse| impulse.norm()).fold(0.0, f64::max)
}

/// On ground without friction the spatial robot that lies flat is the planar one.
#[test]
fn a_flat_fold_moves_as_in_the_planar_model() {
    let (step, links) = (2e-3, 7);
    let mut plane = build(&solid(links), &ground([0.0, 0.0]), &LIMP, &planar_implicit(step, 2));
    plane.place_chain(0.0, 0.0, 0.3, &[0.8; 6]);
    let pose: Vec<planar::Pose> = plane.state().pose.clone();
    let omega = [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5];
    let state = moving_chain(plane.robot(), &pose, planar::Twist::new(0.1, -0.05, -1.5), &omega);
    plane.place(&state);

    let mut space = robot(&solid(links), [0.0, 0.0], &LIMP, step);
    space.place_chain(flat(0.3), &[Vector2::new(0.8, 0.0); 6]);
    space.rest_on_ground();
    let mut flat_state = space.state().clone();
    for ((pose, twist), (q, u)) in
        flat_state.pose.iter_mut().zip(&mut flat_state.twist).zip(state.pose.iter().zip(&state.twist))
    {
        assert!((pose.position.xy() - q.xy()).norm() < 1e-12, "the same posture");
        let turn = pose.orientation.inverse_transform_vector(&(Vector3::z() * u.z));
        *twist = twist_of(u.xy().push(0.0), turn);
    }
    space.place(&flat_state);

    let mut pushed = [0.0, 0.0];
    for _ in 0..150 {
        plane.advance(step, &Hold(0.0));
        space.advance(step, &Bend { yaw: 0.0, pitch: 0.0 });
        pushed[0] += plane.self_contact_impulse().iter().map(|impulse| impulse.norm()).sum::<f64>();
        pushed[1] += space.self_contact_impulse().iter().map(|impulse| impulse.norm()).sum::<f64>();
    }
    let poses = plane.state().pose.iter().zip(&space.state().pose);
    let apart = poses.map(|(q, p)| (q.xy() - p.position.xy()).norm()).fold(0.0, f64::max);
    assert!(pushed[0] > 0.01 && (pushed[0] - pushed[1]).abs() < 0.02 * pushed[0], "{pushed:?} N s");
    assert!(apart < 2e-4, "{apart} m apart");
}

fn farthest(a: &SpatialState, b: &SpatialState, image: impl Fn(Vector3<f64>) -> Vector3<f64>) -> f64 {
    a.pose.iter().zip(&b.pose).map(|(a, b)| (image(a.position) - b.position).norm()).fold(0.0, f64::max)
}

#[test]
fn an_impact_does_not_depend_on_the_direction_the_robot_lies_in() {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7);
    let (along, _) = closing_u(in_the_air(0.0), 1.0, DRIFT, SPIN);
    let (turned, _) = closing_u(in_the_air(0.7), 1.0, rotation * DRIFT, SPIN);
    let apart = farthest(along.state(), turned.state(), |p| rotation * p);
    assert!(apart < 1e-7, "{apart} m apart");
}

#[test]
fn self_contact_has_no_handedness() {
    let mirrored = |p: Vector3<f64>| Vector3::new(p.x, -p.y, p.z);
    let (left, _) = closing_u(in_the_air(0.0), 1.0, DRIFT, SPIN);
    let (right, _) = closing_u(in_the_air(0.0), -1.0, mirrored(DRIFT), -SPIN);
    let apart = farthest(left.state(), right.state(), mirrored);
    assert!(apart < 1e-7, "{apart} m apart");
}

/// Counted from its other end, a robot moves alike.
#[test]
fn self_contact_does_not_depend_on_which_end_is_the_first() {
    let mut placed = robot(&solid(3), [0.0, 0.0], &LIMP, 1e-3);
    placed.place_chain(in_the_air(0.0), &[Vector2::new(80.0 * DEGREE, 0.0); 2]);
    let last = placed.state().pose[2];
    let heading = last.axis().y.atan2(last.axis().x) + PI;
    let (forwards, _) = closing_u(in_the_air(0.0), 1.0, DRIFT, SPIN);
    let backwards = Pose { position: last.position, ..in_the_air(heading) };
    let (mut backwards, _) = closing_u(backwards, -1.0, DRIFT, SPIN);
    backwards.body_mut().state.pose.reverse();
    let apart = farthest(forwards.state(), backwards.state(), |p| p);
    assert!(apart < 1e-7, "{apart} m apart");
}

/// A helix that is let down onto itself: links that cross others carry each other.
#[test]
fn a_helix_let_down_on_itself_is_carried_by_itself() {
    let mut simulation = robot(&solid(11), [0.3, 0.3], &weak(), 1e-2);
    simulation.place_chain(flat(0.0), &[Vector2::new(40.0, -18.0) * DEGREE; 10]);
    simulation.rest_on_ground();
    assert!(simulation.self_gap() > 0.01, "the helix is open: {} m", simulation.self_gap());
    let closed = Bend { yaw: 40.0 * DEGREE, pitch: -6.0 * DEGREE };
    let mut smallest = f64::INFINITY;
    for _ in 0..200 {
        simulation.advance(1e-2, &closed);
        smallest = smallest.min(simulation.self_gap());
    }
    let report = simulation.advance(1.0, &closed);
    assert!(report.unconverged == 0 && !report.diverged, "{report:?}");
    assert!(smallest > -1e-3, "{smallest} m");
    let lifted = simulation.self_contact_impulse().iter().map(|impulse| impulse.z).fold(0.0, f64::max);
    assert!(lifted > 1.0, "the links below carry {lifted} N");
    // Its last joints settle by 44 um within seven seconds; then it stands.
    let before = simulation.state().clone();
    simulation.advance(8.0, &closed);
    let settled = simulation.state().clone();
    simulation.advance(4.0, &closed);
    let [crept, moved] = [(&before, &settled), (&settled, simulation.state())].map(|(a, b)| farthest(a, b, |p| p));
    assert!(crept < 1e-4 && moved < 1e-12, "{crept} m in eight seconds, {moved} m in four more");
}

/// Robots whose gait does not fold them do not pay for self-contact, and do not move otherwise by a bit.
#[test]
fn a_robot_that_does_not_touch_itself_moves_as_without_self_contact() {
    let gait = undulation();
    let run = |config: &RobotConfig| {
        let mut simulation = robot(config, [0.2, 0.5], &ControllerConfig::default(), 1e-2);
        simulation.place_chain(flat(0.0), &posture_of(&gait));
        simulation.rest_on_ground();
        simulation.advance(1.0, &gait);
        simulation.state().clone()
    };
    assert_eq!(run(&solid(11)), run(&hollow(11)));
}

fn posture_of(gait: &impl Reference<CardanTarget>) -> Vec<Vector2<f64>> {
    (0..10).map(|joint| gait.target(joint, 0.0)).map(|at| Vector2::new(at.yaw.angle, at.pitch.angle)).collect()
}

/// Robots that coil up, each at its own pace, so that their contacts come and go at different places and times.
#[test]
fn the_width_of_the_registers_does_not_matter_where_robots_touch_themselves() {
    let scene = Scene::new(&ground([0.2, 0.3])).expect("admissible");
    let system = SpatialSystem::new(Robot::new(&solid(11)).expect("admissible"), &scene, weak()).expect("admissible");
    let coiling = |k: usize| {
        let bend = Bend { yaw: 0.3 + 0.1 * k as f64, pitch: 0.02 * (k % 3) as f64 };
        SpatialScripted::new(&system.robot, ObstacleGrid::new(&[]), flat(0.0), &[Vector2::zeros(); 10], bend)
    };
    let alone = alone_as_among_others(&system, implicit(0.02, 2), &[9, 13], &[0.1; 10], 9, coiling);
    let pressed = alone.iter().filter(|(body, _)| body.warm_start.last.contacts.pressed_pairs(usize::MAX) > 0);
    assert!((2..9).contains(&pressed.count()), "some robots touch themselves, some do not");
}

#[test]
fn self_contact_does_not_allocate() {
    let to = Bend { yaw: 1.2, pitch: 0.15 };
    let (mut simulation, _) = coil(&solid(11), to, 0.0, 100);
    let before = REQUESTS.get();
    for _ in 0..30 {
        simulation.advance(1e-2, &to);
    }
    assert_eq!(REQUESTS.get() - before, 0);
}
