//! What holds when a joint meets its limit.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::planar::{Pose, Twist};
use snake_core::robot::{PerAxis, PerLink, RobotConfig};
use snake_core::simulation::PlanarSimulation;
use snake_test_support::planar::{Hold, LIMP, build, ground, implicit, momentum, moving_chain};

const LIMIT: f64 = 0.9;

fn limited(links: usize) -> RobotConfig {
    RobotConfig { links, joint_limit: Some(LIMIT.into()), ..RobotConfig::default() }
}

fn bend(simulation: &PlanarSimulation, joint: usize) -> f64 {
    let pose = &simulation.state().pose;
    pose[joint + 1].z - pose[joint].z
}

/// Two links that fold up about their joint without friction meet the stop inelastically: they go on as one rigid body
/// with the momentum and the angular momentum that they had.
#[test]
fn two_links_that_meet_their_stop_go_on_as_one_body() {
    for side in [1.0, -1.0] {
        let mut simulation = build(&limited(2), &ground([0.0, 0.0]), &LIMP, &implicit(2e-3, 2));
        simulation.place_chain(0.1, -0.2, 0.4, &[side * 0.7]);
        let pose: Vec<Pose> = simulation.state().pose.clone();
        let state = moving_chain(simulation.robot(), &pose, Twist::new(0.2, 0.1, -side), &[side * 2.0]);
        simulation.place(&state);
        let before = simulation.kinetic_energy();
        let (linear, angular) = momentum(simulation.robot(), simulation.state());
        for _ in 0..150 {
            simulation.advance(2e-3, &Hold(0.0));
            assert!(side * bend(&simulation, 0) < LIMIT + 1e-4, "{}", bend(&simulation, 0));
        }
        let (after, turning) = momentum(simulation.robot(), simulation.state());
        assert!(
            (after - linear).norm() < 1e-9 && (turning - angular).abs() < 1e-4 * angular.abs(),
            "{angular} {turning}"
        );
        let (robot, state) = (simulation.robot(), simulation.state());
        let mass = robot.total_mass();
        let centre: Vector2<f64> =
            robot.links.iter().zip(&state.pose).map(|(link, q)| q.xy() * link.mass).sum::<Vector2<f64>>() / mass;
        let inertia: f64 = robot
            .links
            .iter()
            .zip(&state.pose)
            .map(|(link, q)| link.inertia + link.mass * (q.xy() - centre).norm_squared())
            .sum();
        let spin = turning - (centre.x * after.y - centre.y * after.x);
        let rigid = 0.5 * (after.norm_squared() / mass + spin * spin / inertia);
        // Angular momentum is kept to an order of the step, and the energy with it.
        let lost = before - rigid;
        assert!(lost > 0.1 * before && (simulation.kinetic_energy() - rigid).abs() < 1e-3 * lost, "{before} {rigid}");
    }
}

/// A controller that asks for more than the limit presses the joints on their stops and no farther.
#[test]
fn joints_rest_on_their_stops() {
    let mut simulation = build(&limited(6), &ground([0.2, 0.2]), &ControllerConfig::default(), &implicit(1e-2, 2));
    simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 5]);
    for _ in 0..200 {
        simulation.advance(1e-2, &Hold(-1.1));
        (0..5).for_each(|joint| assert!(bend(&simulation, joint) > -LIMIT - 1e-5, "{}", bend(&simulation, joint)));
    }
    (0..5).for_each(|joint| assert!((bend(&simulation, joint) + LIMIT).abs() < 1e-6, "{}", bend(&simulation, joint)));
    assert!(simulation.kinetic_energy() < 1e-12);
    assert_eq!(simulation.body().statistics.unconverged, 0);
}

#[test]
fn joints_have_right_angles_for_limits_unless_others_are_chosen() {
    let largest = |robot: &RobotConfig| {
        let mut simulation = build(robot, &ground([0.1, 0.1]), &ControllerConfig::default(), &implicit(1e-2, 2));
        simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 2]);
        simulation.advance(3.0, &Hold(1.8));
        bend(&simulation, 0).max(bend(&simulation, 1))
    };
    let links =
        |joint_limit| RobotConfig { links: 3, joint_limit, self_contact: Some(false), ..RobotConfig::default() };
    assert!((largest(&links(None)) - FRAC_PI_2).abs() < 1e-6);
    assert!((largest(&links(Some(1.2.into()))) - 1.2).abs() < 1e-6);
    assert!(largest(&links(Some(f64::INFINITY.into()))) > 1.7);
}

/// A joint with hardly any room strikes both of its stops.
#[test]
fn a_joint_of_narrow_range_stays_between_its_stops() {
    let robot = RobotConfig { links: 2, joint_limit: Some(0.02.into()), ..RobotConfig::default() };
    let pd = ControllerConfig { kp: 200.0, kd: 0.1, ..ControllerConfig::default() };
    let mut simulation = build(&robot, &ground([0.0, 0.0]), &pd, &implicit(1e-2, 2));
    simulation.place_chain(0.0, 0.0, 0.0, &[0.0]);
    for wanted in [0.5, -0.5, 0.5] {
        for _ in 0..20 {
            simulation.advance(1e-2, &Hold(wanted));
            assert!(bend(&simulation, 0).abs() < 0.02 + 1e-4, "{}", bend(&simulation, 0));
        }
        assert!((bend(&simulation, 0) - 0.02_f64.copysign(wanted)).abs() < 1e-6, "{}", bend(&simulation, 0));
    }
}

/// Far from their limits joints move as without them, bit for bit.
#[test]
fn a_limit_that_no_joint_meets_changes_nothing() {
    let run = |joint_limit: f64| {
        let robot = RobotConfig { joint_limit: Some(joint_limit.into()), ..RobotConfig::default() };
        let mut simulation = build(&robot, &ground([0.2, 0.5]), &ControllerConfig::default(), &implicit(1e-2, 2));
        simulation.place_chain(0.0, 0.0, 0.0, &[0.1; 10]);
        simulation.advance(1.0, &Hold(0.5));
        simulation.state().clone()
    };
    assert_eq!(run(1.0), run(f64::INFINITY));
}

/// A stage whose prediction is far from a stop, and which ends beyond it, is predicted again.
#[test]
fn a_reference_that_jumps_does_not_carry_joints_past_their_limit() {
    for order in [1, 2] {
        let mut simulation =
            build(&limited(4), &ground([0.2, 0.2]), &ControllerConfig::default(), &implicit(25e-3, order));
        simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 3]);
        for _ in 0..8 {
            simulation.advance(25e-3, &Hold(1.4));
            let farthest = (0..3).map(|joint| bend(&simulation, joint).abs()).fold(0.0, f64::max);
            assert!(farthest < LIMIT + 1e-4, "order {order}: {farthest}");
        }
        assert!(bend(&simulation, 0) > LIMIT - 1e-4);
    }
}

/// Each joint is held at its own stops, on either side.
#[test]
fn joints_have_limits_of_their_own() {
    let limits = vec![PerLink::Each(vec![-0.3, 0.7]), PerLink::Same(f64::INFINITY), PerLink::Same(0.5)];
    let robot = RobotConfig {
        links: 4,
        joint_limit: Some(PerAxis::Each(limits)),
        self_contact: Some(false),
        ..RobotConfig::default()
    };
    let pd = ControllerConfig { kp: 20.0, kd: 0.5, ..ControllerConfig::default() };
    for (wanted, bounds) in [(1.2, [0.7, 1.2, 0.5]), (-1.2, [-0.3, -1.2, -0.5])] {
        let mut simulation = build(&robot, &ground([0.0, 0.0]), &pd, &implicit(1e-2, 2));
        simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 3]);
        for _ in 0..300 {
            assert_eq!(simulation.advance(1e-2, &Hold(wanted)).unconverged, 0);
        }
        for (joint, bound) in bounds.into_iter().enumerate() {
            let angle = simulation.state().joint_angle(joint);
            assert!((angle - bound).abs() < 2e-4, "{wanted}: {angle} of joint {joint}");
        }
    }
}
