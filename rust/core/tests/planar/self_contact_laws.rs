//! What holds when a robot touches itself.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DVector, Vector2, Vector3};
use snake_core::contact::{PlacedLink, link_pair_gap};
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::planar::{PlanarState, Pose, Twist};
use snake_core::robot::{PerLink, Robot, RobotConfig};
use snake_core::simulation::PlanarSimulation;
use snake_test_support::allocation::REQUESTS;
use snake_test_support::planar::{Hold, LIMP, Random, build, ground, implicit, momentum, moving_chain, posture};
use snake_test_support::planar_stage::{after_impact, stacked};

fn solid(links: usize) -> RobotConfig {
    RobotConfig { links, ..RobotConfig::default() }
}

/// Seven links bent into a C, without friction or actuators, whose ends move towards each other.
fn closing_ring(step: f64) -> PlanarSimulation {
    let mut simulation = build(&solid(7), &ground([0.0, 0.0]), &LIMP, &implicit(step, 2));
    simulation.place_chain(0.0, 0.0, 0.3, &[0.8; 6]);
    let pose: Vec<Pose> = simulation.state().pose.clone();
    let state =
        moving_chain(simulation.robot(), &pose, Twist::new(0.1, -0.05, -1.5), &[-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5]);
    simulation.place(&state);
    simulation
}

fn angular_momentum_and_linear(simulation: &PlanarSimulation) -> (Vector2<f64>, f64) {
    momentum(simulation.robot(), simulation.state())
}

#[test]
fn an_impact_of_two_links_keeps_momentum_and_creates_no_energy() {
    let mut simulation = closing_ring(2e-3);
    let (linear, angular) = angular_momentum_and_linear(&simulation);
    let mut energy = simulation.kinetic_energy();
    let (before, mut touched) = (energy, false);
    for _ in 0..300 {
        simulation.advance(2e-3, &Hold(0.0));
        touched |= simulation.self_contact_impulse().iter().any(|impulse| impulse.norm() > 0.0);
        let now = simulation.kinetic_energy();
        // The scheme between events is not algebraically stable: energies may rise by what one step's order leaves.
        assert!(now < energy + 1e-6 * before, "{now} after {energy}");
        energy = energy.min(now);
        assert!(simulation.self_gap() > -1e-4, "{}", simulation.self_gap());
    }
    let (linear_after, angular_after) = angular_momentum_and_linear(&simulation);
    assert!(touched && energy < 0.95 * before, "an inelastic impact: {energy} of {before}");
    assert!((linear - linear_after).norm() < 1e-9, "{linear} {linear_after}");
    // Forces act at the predicted configuration, which the end of a step leaves by an order of the step.
    assert!((angular - angular_after).abs() < 1e-3 * angular.abs().max(1e-2), "{angular} {angular_after}");
}

/// A chain whose first and last link touch, bent by `shape` times a common factor. Returns the factor.
pub fn closed_by(simulation: &mut PlanarSimulation, shape: &[f64]) -> f64 {
    let (mut open, mut closed) = (0.5 / shape.len() as f64, 6.0 / shape.len() as f64);
    for _ in 0..60 {
        let middle = 0.5 * (open + closed);
        let joints: Vec<f64> = shape.iter().map(|angle| angle * middle).collect();
        simulation.place_chain(0.1, -0.2, 0.4, &joints);
        if simulation.self_gap() > 0.0 { open = middle } else { closed = middle }
    }
    open
}

/// Gradient of the distance of two links by their poses, from differences of the published one.
fn gradient_of_gap(robot: &Robot, pose: &[Pose], [i, j]: [usize; 2]) -> DVector<f64> {
    let mut gradient = DVector::zeros(3 * pose.len());
    let gap = |pose: &[Pose]| link_pair_gap([i, j].map(|k| PlacedLink::new(&robot.links[k], pose[k])).each_ref());
    for (link, axis) in [i, j].into_iter().flat_map(|link| (0..3).map(move |axis| (link, axis))) {
        let moved = |by: f64| {
            let mut pose = pose.to_vec();
            pose[link][axis] += by;
            gap(&pose)
        };
        gradient[3 * link + axis] = (moved(1e-6) - moved(-1e-6)) / 2e-6;
    }
    gradient
}

/// The halves of a chain meet with any velocities of their links: velocities after the impact are those of full matrices,
/// and the energy falls by half the impulse times the closing velocity.
#[test]
fn two_halves_of_a_chain_that_meet_move_on_as_the_projection_on_the_constraints() {
    let mut random = Random::new(41);
    for links in [5, 6, 8, 11] {
        for case in 0..4 {
            let shape: Vec<f64> = (1..links).map(|_| random.between(0.85, 1.15)).collect();
            for order in [1, 2] {
                let mut simulation = build(&solid(links), &ground([0.0, 0.0]), &LIMP, &implicit(1e-6, order));
                let factor = closed_by(&mut simulation, &shape);
                assert!(shape.iter().all(|angle| angle * factor < FRAC_PI_2), "within the limits of the joints");
                let pose: Vec<Pose> = simulation.state().pose.clone();
                let w = gradient_of_gap(simulation.robot(), &pose, [0, links - 1]);
                let head = Twist::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), random.between(-1.0, 1.0));
                let omega: Vec<f64> = (1..links).map(|_| random.between(-1.0, 1.0)).collect();
                let mut state = moving_chain(simulation.robot(), &pose, head, &omega);
                if w.dot(&stacked(&state.twist)) > 0.0 {
                    state.twist.iter_mut().for_each(|u| *u = -*u);
                }
                let closing = w.dot(&stacked(&state.twist));
                let exact = after_impact(simulation.robot(), &state, &w);
                simulation.place(&state);
                let before = simulation.kinetic_energy();
                simulation.advance(4e-6, &Hold(0.0));
                // omega^2 h over four steps, and an impulse resolved to 1e-10.
                let defect = (stacked(&simulation.state().twist) - stacked(&exact)).amax();
                assert!(defect < 1e-4, "{links} links, case {case}, order {order}: {defect:e}");
                let lost = before - simulation.kinetic_energy();
                let expected = -0.5 * closing * simulation.self_contact_impulse()[0].norm();
                assert!((lost - expected).abs() < 1e-4 * before, "{links} links: {lost} J lost, {expected} J expected");
            }
        }
    }
}

#[test]
fn impulses_between_links_cancel() {
    let mut simulation = closing_ring(5e-3);
    for _ in 0..60 {
        simulation.advance(5e-3, &Hold(0.0));
        let sum: Vector3<f64> = simulation.self_contact_impulse().iter().sum();
        assert!(sum.norm() < 1e-12, "{sum}");
    }
}

/// Joints driven to where links would overlap by centimetres: links end up pressed against each other.
fn coil(robot: &RobotConfig) -> (PlanarSimulation, f64) {
    let limited = ControllerConfig { torque_limit: Some(5.0), ..ControllerConfig::default() };
    let mut simulation = build(robot, &ground([0.2, 0.2]), &limited, &implicit(1e-2, 2));
    simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 10]);
    let mut smallest = f64::INFINITY;
    for _ in 0..300 {
        simulation.advance(1e-2, &Hold(1.1));
        smallest = smallest.min(simulation.self_gap());
    }
    (simulation, smallest)
}

#[test]
fn a_robot_that_coils_up_does_not_pass_through_itself() {
    let (solid, gap) = coil(&solid(11));
    assert!(gap > -1e-3, "penetration of {} m", -gap);
    assert!(!solid.body().statistics.diverged);
    let (_, without) = coil(&RobotConfig { self_contact: Some(false), ..RobotConfig::default() });
    assert!(without < -0.02, "the same motion without self-contact overlaps by {} m", -without);
}

#[test]
fn a_coiled_robot_pressed_on_itself_stands_still() {
    let (mut simulation, _) = coil(&solid(11));
    simulation.advance(5.0, &Hold(1.1));
    let before = simulation.state().pose.clone();
    let statistics = simulation.advance(10.0, &Hold(1.1));
    let moved = before.iter().zip(&simulation.state().pose).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(moved < 1e-9, "moved by {moved} m in ten seconds");
    assert_eq!(statistics.unconverged, 0);
    let pressed = simulation.self_contact_impulse().iter().map(|impulse| impulse.norm()).fold(0.0, f64::max);
    assert!(pressed / 10.0 > 1.0, "{} N", pressed / 10.0);
}

/// A mirrored robot moves as the mirror image.
#[test]
fn self_contact_has_no_handedness() {
    let run = |sign: f64| {
        let mut simulation = build(&solid(11), &ground([0.2, 0.3]), &ControllerConfig::default(), &implicit(1e-2, 2));
        simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 10]);
        for _ in 0..60 {
            simulation.advance(1e-2, &Hold(1.1 * sign));
        }
        simulation.state().clone()
    };
    let (left, right): (PlanarState, PlanarState) = (run(1.0), run(-1.0));
    for (a, b) in left.pose.iter().zip(&right.pose) {
        assert!((a.x - b.x).abs() < 1e-6 && (a.y + b.y).abs() < 1e-6 && (a.z + b.z).abs() < 1e-5, "{a} {b}");
    }
}

/// Robots whose gait does not fold them do not pay for self-contact, and do not move otherwise by a bit.
#[test]
fn a_robot_that_does_not_touch_itself_moves_as_without_self_contact() {
    let wave = Wave::default();
    let run = |robot: &RobotConfig| {
        let mut simulation = build(robot, &ground([0.2, 0.5]), &ControllerConfig::default(), &implicit(1e-2, 2));
        simulation.place_chain(0.0, 0.0, 0.0, &posture(&wave, 10));
        simulation.advance(3.0, &wave);
        simulation.state().clone()
    };
    assert_eq!(run(&solid(11)), run(&RobotConfig { self_contact: Some(false), ..RobotConfig::default() }));
}

#[test]
fn self_contact_does_not_allocate() {
    let (mut simulation, _) = coil(&solid(11));
    let before = REQUESTS.get();
    for _ in 0..50 {
        simulation.advance(1e-2, &Hold(1.1));
    }
    assert_eq!(REQUESTS.get() - before, 0);
}

/// The ends of three links bent into a U swing towards each other, symmetrically, while the robot moves along its axis
/// of symmetry. After the inelastic impact nothing can turn: all moves on with the common velocity P / M.
#[test]
fn two_rods_that_meet_head_on_keep_their_momentum_and_lose_the_rest() {
    let robot = RobotConfig { links: 3, joint_limit: Some(f64::INFINITY.into()), ..RobotConfig::default() };
    let mut simulation = build(&robot, &ground([0.0, 0.0]), &LIMP, &implicit(2e-3, 2));
    simulation.place_chain(0.0, 0.0, FRAC_PI_2, &[-1.4; 2]);
    let pose: Vec<Pose> = simulation.state().pose.clone();
    let axis = Vector2::new(-pose[1].z.sin(), pose[1].z.cos());
    // The joint at link 2 has the velocity of that link, so link 1 moves with it and turns about the joint.
    let (arm, omega) = (0.5 * simulation.robot().links[0].length, 2.0);
    let swing = Vector2::new(-pose[0].z.sin(), pose[0].z.cos()) * (-arm * omega);
    let head = axis * 0.1 + swing;
    let state = moving_chain(simulation.robot(), &pose, Twist::new(head.x, head.y, omega), &[0.0, -omega]);
    simulation.place(&state);
    let (linear, _) = angular_momentum_and_linear(&simulation);
    let (before, gap) = (simulation.kinetic_energy(), simulation.self_gap());
    simulation.advance(0.3, &Hold(0.0));
    let (after, _) = angular_momentum_and_linear(&simulation);
    assert!(gap > 0.0 && simulation.self_gap().abs() < 2e-4, "{gap} m before, {} m after", simulation.self_gap());
    assert!((after - linear).norm() < 1e-10, "{linear} {after}");
    let common = 0.5 * linear.norm_squared() / simulation.robot().total_mass();
    let energy = simulation.kinetic_energy();
    assert!(
        before > 1.2 * common && (energy - common).abs() < 1e-6 * common,
        "{before} J before, {energy} after, {common}"
    );
}

/// Links so short that those next but one overlap in the straight robot could only be pressed through each other.
#[test]
fn links_that_no_posture_parts_are_refused() {
    let simulation = |length, self_contact| {
        let robot = RobotConfig { length: PerLink::Same(length), self_contact, ..RobotConfig::default() };
        PlanarSimulation::new(&robot, &ground([0.2, 0.2]), &LIMP, &implicit(1e-2, 2))
    };
    let reach = 0.0393 + 0.0525;
    let refused = simulation(reach - 1e-6, None).map(drop).unwrap_err();
    assert_eq!(refused.field, "robot.length[1]");
    assert!(simulation(reach + 1e-6, None).is_ok() && simulation(0.05, Some(false)).is_ok());
}

/// A coil in a turned frame: where it ends, turned back.
fn coiled(turn: f64) -> Vec<Pose> {
    // Without a limit links collide at hundreds of radians per second, which magnifies round-off.
    let limited = ControllerConfig { torque_limit: Some(2.0), ..ControllerConfig::default() };
    let mut simulation = build(&solid(11), &ground([0.2, 0.3]), &limited, &implicit(1e-2, 2));
    simulation.place_chain(0.0, 0.0, turn, &[0.0; 10]);
    simulation.advance(0.6, &Hold(1.1));
    assert!(simulation.self_contact_impulse().iter().any(|impulse| impulse.norm() > 0.0));
    let back = nalgebra::Rotation2::new(-turn);
    let turned = simulation.state().pose.iter().map(|pose| {
        let position = back * pose.xy();
        Pose::new(position.x, position.y, pose.z - turn)
    });
    turned.collect()
}

#[test]
fn self_contact_has_no_direction() {
    let straight = coiled(0.0);
    for turn in [0.7, 2.5, -1.9] {
        for (a, b) in straight.iter().zip(&coiled(turn)) {
            assert!((a - b).norm() < 1e-6, "{a} {b}");
        }
    }
}
