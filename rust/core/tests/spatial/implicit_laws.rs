//! Laws of mechanics that the implicit scheme of the spatial model keeps: friction, rolling, impacts, rest, free
//! flight.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, CardanTarget, Gait, JointTarget, Reference, Wave};
use snake_core::robot::RobotConfig;
use snake_core::scene::SceneConfig;
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, SpatialState, orientation_of, turning, twist_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{Random, ground};
use snake_test_support::spatial::{DEGREE, implicit, straight, undulation};

const GRAVITY: f64 = 9.81;
const RADIUS: f64 = 0.0525;

/// All joints straight, for ever.
fn still() -> CardanGait {
    CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) }
}

fn robot(scene: &SceneConfig, pd: &ControllerConfig, step: f64, order: u32) -> SpatialSimulation {
    SpatialSimulation::new(&RobotConfig::default(), scene, pd, &implicit(step, order)).expect("admissible")
}

/// Sets all links in motion with the same velocity and angular velocity, frame I; the chain is straight.
fn push(simulation: &mut SpatialSimulation, velocity: Vector3<f64>, spin: Vector3<f64>) {
    let mut state = simulation.state().clone();
    let centre = state.pose[5].position;
    for (pose, twist) in state.pose.iter().zip(&mut state.twist) {
        let v = velocity + spin.cross(&(pose.position - centre));
        *twist = twist_of(v, pose.orientation.inverse_transform_vector(&spin));
    }
    simulation.place(&state);
}

/// Advances and asserts that every stage was solved to its tolerance.
fn run(simulation: &mut SpatialSimulation, gait: &impl Reference<CardanTarget>, duration: f64) {
    let report = simulation.advance(duration, gait);
    assert!(!report.diverged && report.unconverged == 0, "{report:?}");
}

#[test]
fn the_default_step_is_25_milliseconds_however_a_run_is_divided() {
    for duration in [0.1, 0.05, 0.025] {
        let default = ImplicitConfig::default();
        let (robot, scene, pd) = (RobotConfig::default(), ground([0.2, 0.2]), ControllerConfig::default());
        let mut simulation = SpatialSimulation::new(&robot, &scene, &pd, &default).expect("admissible");
        let parts = simulation.steps_in(duration);
        let taken: u32 = (0..parts).map(|_| simulation.advance(duration / f64::from(parts), &still()).steps).sum();
        assert_eq!([parts, taken], [(duration / 0.025) as u32; 2], "in {duration} s");
    }
}

#[test]
fn a_sliding_robot_stops_after_v_squared_over_2_mu_g() {
    for (friction, step) in [([0.2, 0.2], 0.01), ([0.4, 0.1], 0.005), ([0.2, 0.2], 0.001)] {
        let mut simulation = robot(&ground(friction), &ControllerConfig::default(), step, 2);
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.3, 0.0, 0.0) };
        simulation.place_chain(head, &[Vector2::zeros(); 10]);
        simulation.rest_on_ground();
        let (speed, start) = (0.5, simulation.state().pose[5].position);
        push(&mut simulation, Vector3::new(0.3_f64.cos(), 0.3_f64.sin(), 0.0) * speed, Vector3::zeros());
        run(&mut simulation, &still(), 1.0);
        let expected = speed * speed / (2.0 * friction[0] * GRAVITY);
        let distance = (simulation.state().pose[5].position - start).norm();
        assert!((distance - expected).abs() < 2e-4 * step / 0.001 * expected, "{distance} instead of {expected}");
        let speed = simulation.state().twist.iter().map(|u| u.norm()).fold(0.0, f64::max);
        assert!(speed < 1e-6, "{speed} m/s left");
    }
}

/// A rolling cylinder loses the energy m v^2 / 2 + Theta omega^2 / 2 to the work mu_V N per way.
#[test]
fn a_rolling_robot_stops_after_the_way_that_rolling_friction_gives() {
    let mut simulation = straight(&implicit(0.005, 2));
    let link = simulation.robot().links[0];
    let (speed, start) = (0.2, simulation.state().pose[5].position);
    // The centre line points to -x; v = omega x R e_z.
    push(&mut simulation, Vector3::new(0.0, speed, 0.0), Vector3::new(-speed / RADIUS, 0.0, 0.0));
    run(&mut simulation, &still(), 3.0);
    let expected = speed * speed * (1.0 + link.roll_inertia / (link.mass * RADIUS * RADIUS)) / (2.0 * 0.02 * GRAVITY);
    let way = simulation.state().pose[5].position - start;
    assert!((way.y - expected).abs() < 1e-3 * expected && way.x.abs() < 1e-6, "{way:?} instead of {expected}");
    let turned = (simulation.state().pose[5].orientation * Vector3::y()).z.acos();
    assert!((turned - (way.y / RADIUS).rem_euclid(2.0 * PI)).abs() < 1e-3, "rolls without slip: {turned}");
}

/// Joints that push less than friction holds move nothing.
#[test]
fn stuck_links_do_not_creep() {
    struct Bent;
    impl Reference<CardanTarget> for Bent {
        fn target(&self, joint: usize, _: f64) -> CardanTarget {
            let angle = if joint.is_multiple_of(2) { 0.03 } else { -0.02 };
            CardanTarget { yaw: JointTarget { angle, ..JointTarget::default() }, ..CardanTarget::default() }
        }
    }
    let pd = ControllerConfig { kp: 1.0, kd: 0.1, ..ControllerConfig::default() };
    let mut simulation = robot(&ground([0.2, 0.2]), &pd, 0.01, 2);
    simulation.place_chain(
        Pose { position: Vector3::zeros(), orientation: orientation_of(0.0, 0.0, 0.0) },
        &[Vector2::zeros(); 10],
    );
    simulation.rest_on_ground();
    run(&mut simulation, &Bent, 0.5);
    let before = simulation.state().clone();
    run(&mut simulation, &Bent, 10.0);
    let moved = largest_way(&before, simulation.state());
    assert!(moved < 2e-8, "crept {moved} m in 10 s");
}

fn largest_way(a: &SpatialState, b: &SpatialState) -> f64 {
    a.pose.iter().zip(&b.pose).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max)
}

/// Aiko let go at an angle over the ground, its actuators off (T 7.3.1).
fn dropped(tilt: f64, roll: f64, step: f64, order: u32) -> SpatialSimulation {
    let pd = ControllerConfig { active_from: 1e9, ..ControllerConfig::default() };
    let mut simulation = robot(&ground([0.2, 0.5]), &pd, step, order);
    let head = Pose { position: Vector3::new(0.0, 0.0, 0.3525), orientation: orientation_of(PI, tilt, roll) };
    simulation.place_chain(head, &[Vector2::zeros(); 10]);
    simulation
}

/// Whatever the step, the robot comes to lie on the ground, energy never rises, and no penetration stays.
#[test]
fn a_dropped_robot_comes_to_lie_on_the_ground() {
    for step in [2.5e-4, 1e-3, 4e-3, 1e-2] {
        let mut simulation = dropped(30.0 * DEGREE, 0.0, step, 2);
        let mut energy = simulation.energy();
        for _ in 0..50 {
            run(&mut simulation, &still(), 0.04);
            let now = simulation.energy();
            assert!(now < energy + 1e-3 * energy, "step {step}: energy rises from {energy} to {now}");
            energy = now;
        }
        for pose in &simulation.state().pose {
            assert!((pose.position.z - RADIUS).abs() < 2e-5, "step {step}: height {}", pose.position.z);
        }
        assert!(simulation.min_gap() > -2e-5, "step {step}: penetration {}", -simulation.min_gap());
        assert!(simulation.joint_gap() < 1e-13);
    }
}

/// Links of a limp chain whip down at tens of radians a second and turn on visibly within a step: the ground holds them
/// all the same.
#[test]
fn links_that_whip_down_do_not_sink() {
    let bends: Vec<_> =
        (0..10).map(|j| 0.6 * Vector2::new((2.3 * f64::from(j)).sin(), (1.7 * f64::from(j)).cos())).collect();
    for step in [0.025, 0.01] {
        let limp = ControllerConfig { kp: 0.0, kd: 0.0, ..ControllerConfig::default() };
        let mut simulation = robot(&ground([0.2, 0.2]), &limp, step, 2);
        let head = Pose { position: Vector3::new(0.0, 0.0, 1.2), orientation: orientation_of(PI, -0.5, 0.0) };
        simulation.place_chain(head, &bends);
        for _ in 0..50 {
            run(&mut simulation, &still(), step);
            assert!(simulation.min_gap() > -5e-4, "step {step}: penetration {}", -simulation.min_gap());
        }
    }
}

/// Nor do those of chains that tumble down, crooked and spinning.
#[test]
fn chains_that_tumble_down_do_not_sink() {
    for (seed, friction, kd) in [(9, 0.2, 0.05), (3, 0.0, 0.0)] {
        let limp = ControllerConfig { kp: 0.0, kd, ..ControllerConfig::default() };
        let mut simulation = robot(&ground([friction; 2]), &limp, 0.025, 2);
        tumble(&mut simulation, seed);
        for _ in 0..40 {
            run(&mut simulation, &still(), 0.025);
            assert!(simulation.min_gap() > -6e-4, "seed {seed}: penetration {}", -simulation.min_gap());
        }
    }
}

/// A chain bent at random in the air, in rigid motion.
fn tumble(simulation: &mut SpatialSimulation, seed: u64) {
    let mut numbers = Random::new(seed);
    let bends: Vec<_> = (0..10).map(|_| Vector2::new(numbers.between(-1.0, 1.0), numbers.between(-1.0, 1.0))).collect();
    let orientation = orientation_of(numbers.angle(), numbers.between(-1.0, 1.0), numbers.angle());
    simulation.place_chain(Pose { position: Vector3::zeros(), orientation }, &bends);
    simulation.rest_on_ground();
    let lift = numbers.between(0.05, 1.0);
    let mut vector = |low: f64, high: f64| Vector3::from_fn(|_, _| numbers.between(low, high));
    let (spin, velocity) = (vector(-3.0, 3.0), vector(-1.0, 1.0));
    let mut state = simulation.state().clone();
    let centre = state.pose.iter().map(|pose| pose.position).sum::<Vector3<f64>>() / state.pose.len() as f64;
    for (pose, twist) in state.pose.iter_mut().zip(&mut state.twist) {
        let v = velocity + spin.cross(&(pose.position - centre));
        *twist = twist_of(v, pose.orientation.inverse_transform_vector(&spin));
        pose.position.z += lift;
    }
    simulation.place(&state);
}

/// An inelastic impact of the whole chain at once: the normal impulses take exactly the momentum of the fall.
#[test]
fn a_flat_drop_takes_the_momentum_of_the_fall() {
    for step in [1e-3, 1e-2] {
        let mut simulation = dropped(0.0, 0.0, step, 2);
        run(&mut simulation, &still(), 1.0);
        let state = simulation.state();
        let speed = state.twist.iter().map(|u| u.norm()).fold(0.0, f64::max);
        assert!(speed < 1e-9, "at rest at once: {speed}");
        assert!(state.pose.iter().all(|pose| (pose.position.z - RADIUS).abs() < 1e-6));
        let fallen = 11.0 * 7.5 / 11.0 * GRAVITY * 0.3;
        let lost = simulation.robot().total_mass() * GRAVITY * 0.3525 - simulation.energy();
        assert!((lost - fallen).abs() < 1e-5 * fallen, "{lost} J lost instead of {fallen}");
    }
}

/// 22 contacts carry 12 freedoms: the pose at rest stays where it is.
#[test]
fn actuators_do_not_act_in_a_step_that_ends_when_they_are_switched_on() {
    let pd = ControllerConfig { active_from: 0.1, ..ControllerConfig::default() };
    for (step, order) in [(0.05, 1), (0.025, 1), (0.025, 2), (0.01, 2)] {
        let mut simulation = robot(&ground([0.0, 0.0]), &pd, step, order);
        for _ in 0..2 {
            run(&mut simulation, &undulation(), 0.05);
            let off = simulation.joint_torque().iter().all(|torque| torque.norm() == 0.0);
            assert!(off, "step {step}, order {order}");
        }
        run(&mut simulation, &undulation(), 0.01);
        let on = simulation.joint_torque().iter().any(|torque| torque.norm() > 1.0);
        assert!(on, "step {step}, order {order}");
    }
}

#[test]
fn a_robot_at_rest_does_not_drift() {
    let mut simulation = straight(&implicit(0.01, 2));
    run(&mut simulation, &still(), 1.0);
    let before = simulation.state().clone();
    for _ in 0..10 {
        assert_eq!(simulation.advance(20.0, &still()).iterations, 0, "what stands needs no linear solve");
    }
    let moved = largest_way(&before, simulation.state());
    assert!(moved < 1e-15, "drifted {moved} m in 200 s");
}

/// Motors that straighten a bent robot leave contacts at rest that are all but slipping, some of which are solved anew
/// at every stage; nothing moves all the same.
#[test]
fn a_robot_that_has_straightened_itself_does_not_drift() {
    let mut numbers = Random::new(5);
    let mut rest = 0;
    for case in 0..8 {
        let tilt = if case < 4 { 0.0 } else { 0.1 };
        let mut bend =
            || Vector2::new(numbers.between(-0.5, 0.5), if tilt > 0.0 { numbers.between(-tilt, tilt) } else { 0.0 });
        let posture: Vec<_> = (0..10).map(|_| bend()).collect();
        let mut simulation = robot(&ground([0.2, 0.2]), &ControllerConfig::default(), 0.01, 2);
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(numbers.angle(), 0.0, 0.0) };
        simulation.place_chain(head, &posture);
        simulation.rest_on_ground();
        run(&mut simulation, &still(), 2.0);
        let before = simulation.state().clone();
        let report = simulation.advance(1.0, &still());
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        println!("case {case}: {} linear solves, {} fallbacks", report.iterations, report.fallbacks);
        rest += u32::from(report.iterations == 0);
        let moved = largest_way(&before, simulation.state());
        assert!(moved < 1e-10, "case {case}: drifted {moved} m in a second");
        let stood = simulation.ground_impulse().to_vec();
        simulation.place(&before);
        let report = simulation.advance(1.0, &still());
        let other = stood.iter().zip(simulation.ground_impulse()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("case {case}: normal forces of a robot that has just been placed there differ by {other:.1e} N");
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        // Statics do not determine how 22 supports share the weight, and multipliers of hard stages, which move many times, keep
        // their sum only. Each link balances to m v / c, 2.3e-4 N for the tolerance v and the stages of these steps.
        let weight = simulation.robot().total_mass() * GRAVITY;
        for force in [stood.iter().sum::<f64>(), simulation.ground_impulse().iter().sum()] {
            assert!((force - weight).abs() < 5e-4, "case {case}: the ground carries {force} N instead of {weight} N");
        }
        assert!(largest_way(&before, simulation.state()) < 1e-10, "case {case}: drifts once it has been placed there");
    }
    assert!(rest >= 7, "{rest} of 8 stand without a solve");
}

/// Soft joints that friction holds away from their references do not creep there.
#[test]
fn a_soft_robot_does_not_creep() {
    let mut numbers = Random::new(3);
    for case in 0..4 {
        let bends: Vec<_> =
            (0..10).map(|_| Vector2::new(numbers.between(-0.6, 0.6), numbers.between(-0.6, 0.6))).collect();
        let soft = ControllerConfig { kp: 20.0, kd: 2.0, ..ControllerConfig::default() };
        let mut simulation = robot(&ground([0.2, 0.5]), &soft, 0.01, 2);
        let head = Pose { position: Vector3::new(0.0, 0.0, 0.5), orientation: orientation_of(PI, 0.0, 0.0) };
        simulation.place_chain(head, &bends);
        run(&mut simulation, &still(), 10.0);
        let before = simulation.state().clone();
        run(&mut simulation, &still(), 10.0);
        let moved = largest_way(&before, simulation.state());
        assert!(moved < 1e-7, "case {case}: crept {moved} m in ten seconds");
    }
}

/// Without ground and with free joints nothing but gravity acts: momentum, angular momentum and energy stay.
#[test]
fn free_flight_keeps_momentum_angular_momentum_and_energy() {
    let drift = |step: f64| {
        let pd = ControllerConfig { active_from: 1e9, ..ControllerConfig::default() };
        let mut simulation = robot(&ground([0.2, 0.2]), &pd, step, 2);
        let head = Pose { position: Vector3::new(0.0, 0.0, 100.0), orientation: orientation_of(0.4, 0.3, 0.2) };
        simulation.place_chain(head, &[Vector2::zeros(); 10]);
        push(&mut simulation, Vector3::new(1.0, -2.0, 3.0), Vector3::new(1.5, 2.0, -1.0));
        let before = (momenta(&simulation), simulation.energy());
        run(&mut simulation, &still(), 1.0);
        let after = (momenta(&simulation), simulation.energy());
        let impulse = Vector3::new(0.0, 0.0, -simulation.robot().total_mass() * GRAVITY);
        assert!((after.0.0 - before.0.0 - impulse).norm() < 1e-9, "linear momentum");
        ((after.0.1 - before.0.1).norm(), (after.1 - before.1).abs())
    };
    let (coarse, fine) = (drift(0.01), drift(0.005));
    println!("angular momentum and energy drift by {coarse:?}, in half the step {fine:?}");
    assert!(coarse.0 < 1e-3 && coarse.1 < 2e-2 && fine.0 < 0.4 * coarse.0 && fine.1 < 0.4 * coarse.1);
}

/// Linear momentum, and angular momentum about the centre of mass.
fn momenta(simulation: &SpatialSimulation) -> (Vector3<f64>, Vector3<f64>) {
    let (state, robot) = (simulation.state(), simulation.robot());
    let centre = state.pose.iter().map(|pose| pose.position).sum::<Vector3<f64>>() / state.pose.len() as f64;
    let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
    for ((link, pose), u) in robot.links.iter().zip(&state.pose).zip(&state.twist) {
        let v: Vector3<f64> = u.fixed_rows::<3>(0).into();
        let spin = turning(u).component_mul(&Vector3::new(link.inertia, link.inertia, link.roll_inertia));
        linear += v * link.mass;
        angular += (pose.position - centre).cross(&v) * link.mass + pose.orientation * spin;
    }
    (linear, angular)
}

/// Nothing depends on where the robot lies and which way it points; nor, for isotropic friction, on which side is up,
/// with the references turned accordingly.
#[test]
fn motion_does_not_depend_on_place_heading_or_side() {
    let advance = |yaw: f64, roll: f64, place: Vector3<f64>, sign: f64| {
        let gait = CardanGait {
            yaw: Gait::Wave(Wave { amplitude: 0.5 * sign, ..Wave::default() }),
            pitch: Gait::Wave(Wave { amplitude: 0.1 * sign, phase: 0.5 * PI, ..Wave::default() }),
        };
        let mut simulation = robot(&ground([0.2, 0.2]), &ControllerConfig::default(), 0.005, 1);
        let head = Pose { position: place, orientation: orientation_of(yaw, 0.0, roll) };
        simulation.place_chain(head, &[Vector2::zeros(); 10]);
        simulation.rest_on_ground();
        run(&mut simulation, &gait, 1.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -yaw);
        let flat = Vector3::new(place.x, place.y, 0.0);
        simulation.state().pose.iter().map(|pose| turn * (pose.position - flat)).collect::<Vec<_>>()
    };
    let upright = advance(0.0, 0.0, Vector3::zeros(), 1.0);
    for (other, what) in [
        (advance(2.0, 0.0, Vector3::new(3.0, -1.0, 0.0), 1.0), "turned and moved"),
        (advance(0.0, PI, Vector3::zeros(), -1.0), "upside down"),
    ] {
        let apart = upright.iter().zip(&other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{what}: {apart} m apart");
    }
}

/// Started on its side, upside down, rest on its tail or tangled in pegs, the robot moves on.
#[test]
fn odd_starts_are_survived() {
    let pegs = [[0.05, 0.061, 0.1026], [0.05, -0.2, -0.1026], [0.02, -0.4, 0.0726]];
    for (pitch, roll) in [(0.0, 0.5 * PI), (0.0, PI), (0.5 * PI, 0.0), (-0.5 * PI, 0.3), (0.3, 1.0)] {
        for obstacles in [vec![], pegs.iter().map(|&peg| peg.into()).collect()] {
            let scene = SceneConfig { obstacles, ..ground([0.2, 0.2]) };
            let mut simulation = robot(&scene, &ControllerConfig::default(), 0.01, 2);
            let head = Pose { position: Vector3::zeros(), orientation: orientation_of(PI, pitch, roll) };
            simulation.place_chain(head, &[Vector2::zeros(); 10]);
            simulation.rest_on_ground();
            for _ in 0..10 {
                let report = simulation.advance(0.3, &undulation());
                assert!(!report.diverged, "pitch {pitch}, roll {roll}: {report:?}");
                assert!(report.unconverged == 0, "pitch {pitch}, roll {roll}: {report:?}");
            }
            assert!(simulation.min_gap() > -1e-3, "pitch {pitch}, roll {roll}: {}", simulation.min_gap());
            let unit = |pose: &Pose| (pose.orientation.quaternion().norm() - 1.0).abs();
            assert!(simulation.state().pose.iter().map(unit).fold(0.0, f64::max) < 1e-14);
        }
    }
}
