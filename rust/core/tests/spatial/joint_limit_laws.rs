//! What holds when an axis of a Cardan joint meets its limit.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanTarget, JointTarget, Reference};
use snake_core::planar;
use snake_core::robot::{AxesConfig, OneJoint, PerAxis, PerLink, RobotConfig};
use snake_core::scene::SceneConfig;
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, SpatialState, joint_angle, joint_axes, orientation_of, turning, twist_of};
use snake_test_support::planar::{Hold, LIMP, build, ground, implicit as planar_implicit, moving_chain};
use snake_test_support::spatial::{implicit, undulation};

const LIMIT: f64 = 0.9;

fn limited(links: usize) -> RobotConfig {
    RobotConfig { links, joint_limit: Some(LIMIT.into()), ..RobotConfig::default() }
}

/// A reference that never changes, (yaw, pitch) of all joints.
#[derive(Debug, Clone, Copy)]
struct Bend([f64; 2]);

impl Reference<CardanTarget> for Bend {
    fn target(&self, _: usize, _: f64) -> CardanTarget {
        let hold = |angle| JointTarget { angle, ..JointTarget::default() };
        CardanTarget { yaw: hold(self.0[0]), pitch: hold(self.0[1]) }
    }
}

const STRAIGHT: Bend = Bend([0.0; 2]);

fn angles(simulation: &SpatialSimulation) -> Vec<Vector2<f64>> {
    simulation.state().pose.windows(2).map(|pair| joint_angle(&pair[0], &pair[1])).collect()
}

fn farthest(simulation: &SpatialSimulation) -> f64 {
    angles(simulation).iter().map(|angle| angle.amax()).fold(0.0, f64::max)
}

/// A limp robot without weight far above the ground, at these joint angles, whose link 1 has this angular velocity, and
/// whose joints have these rates.
fn flying(
    config: &RobotConfig,
    joint_angle: &[Vector2<f64>],
    spin: Vector3<f64>,
    rate: &[Vector2<f64>],
    step: f64,
) -> SpatialSimulation {
    let config = RobotConfig { gravity: 1e-12, ..config.clone() };
    let mut simulation =
        SpatialSimulation::new(&config, &ground([0.0; 2]), &LIMP, &implicit(step, 2)).expect("admissible");
    let head = Pose { position: Vector3::new(0.3, -0.2, 50.0), orientation: orientation_of(0.0, 0.0, 0.0) };
    simulation.place_chain(head, joint_angle);
    let mut state = simulation.state().clone();
    let (mut velocity, mut omega) = (Vector3::new(0.02, 0.01, -0.01), spin);
    for i in 0..state.pose.len() {
        let pose = state.pose[i];
        if i > 0 {
            let before = state.pose[i - 1];
            let (near, far) = (before.axis(), pose.axis());
            let half = 0.5 * simulation.robot().links[i].length;
            let axes = joint_axes(&before, &pose);
            velocity += omega.cross(&(near * half));
            omega += axes.yaw * rate[i - 1].x + axes.pitch * rate[i - 1].y;
            velocity += omega.cross(&(far * half));
        }
        state.twist[i] = twist_of(velocity, pose.orientation.inverse_transform_vector(&omega));
    }
    simulation.place(&state);
    simulation
}

/// Momentum, and angular momentum about the robot's CG.
fn momenta(simulation: &SpatialSimulation) -> (Vector3<f64>, Vector3<f64>) {
    let (robot, SpatialState { pose, twist, .. }) = (simulation.robot(), simulation.state());
    let mass = robot.total_mass();
    let weighted = |of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
        robot.links.iter().enumerate().map(|(i, link)| of(i) * link.mass).sum()
    };
    let velocity = |i: usize| twist[i].fixed_rows::<3>(0).into_owned();
    let centre = weighted(&|i| pose[i].position) / mass;
    let mut turning_momentum = Vector3::zeros();
    for (i, link) in robot.links.iter().enumerate() {
        let inertia = Vector3::new(link.inertia, link.inertia, link.roll_inertia);
        turning_momentum += pose[i].orientation * turning(&twist[i]).component_mul(&inertia);
        turning_momentum += (pose[i].position - centre).cross(&velocity(i)) * link.mass;
    }
    (weighted(&velocity), turning_momentum)
}

/// Two links that fold up about one axis of their joint meet the stop inelastically: they go on as one rigid body with
/// the momentum and the angular momentum that they had.
#[test]
fn two_links_that_meet_their_stop_go_on_as_one_body() {
    for (axis, side) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
        let about = |angle: f64| if axis == 0 { Vector2::new(angle, 0.0) } else { Vector2::new(0.0, angle) };
        let axes = joint_axes(&flat(), &flat());
        let normal = [axes.yaw, axes.pitch][axis];
        let mut simulation = flying(&limited(2), &[about(side * 0.7)], normal * -side, &[about(side * 2.0)], 2e-3);
        let kinetic = |simulation: &SpatialSimulation| simulation.state().kinetic_energy(simulation.robot());
        let before = kinetic(&simulation);
        let (linear, angular) = momenta(&simulation);
        for _ in 0..150 {
            simulation.advance(2e-3, &STRAIGHT);
            assert!(farthest(&simulation) < LIMIT + 1e-4, "{}", farthest(&simulation));
        }
        assert!((angles(&simulation)[0][axis] - side * LIMIT).abs() < 1e-4, "the joint is at its stop");
        let (after, spin) = momenta(&simulation);
        assert!((after - linear).norm() < 1e-9 && (spin - angular).norm() < 1e-7, "{angular} {spin}");
        let (robot, pose) = (simulation.robot(), &simulation.state().pose);
        let centre = (pose[0].position + pose[1].position) / 2.0;
        let inertia: f64 = (robot.links.iter().zip(pose))
            .map(|(link, pose)| link.inertia + link.mass * (pose.position - centre).norm_squared())
            .sum();
        let rigid = 0.5 * (after.norm_squared() / robot.total_mass() + spin.norm_squared() / inertia);
        let lost = before - rigid;
        let error = (kinetic(&simulation) - rigid).abs();
        assert!(lost > 0.1 * before && error < 1e-3 * lost, "{before} {rigid} {error}");
    }
}

/// A robot that lies straight on the ground.
fn lying(config: &RobotConfig, scene: &SceneConfig, pd: &ControllerConfig, step: f64) -> SpatialSimulation {
    let mut simulation = SpatialSimulation::new(config, scene, pd, &implicit(step, 2)).expect("admissible");
    simulation.place_chain(flat(), &vec![Vector2::zeros(); config.links - 1]);
    simulation.rest_on_ground();
    simulation
}

fn flat() -> Pose {
    Pose { position: Vector3::zeros(), orientation: orientation_of(0.0, 0.0, 0.0) }
}

/// A limp chain that flails in the air: its stops take energy and no momentum.
#[test]
fn stops_take_energy_and_no_momentum() {
    let zigzag = |j: i32| f64::from(1 - 2 * (j % 2));
    let bent: Vec<_> = (0..5).map(|j| Vector2::new(0.6 * zigzag(j), -0.1)).collect();
    let rate: Vec<_> = (0..5).map(|j| Vector2::new(8.0 * zigzag(j), 2.0 * f64::from(j - 2))).collect();
    let mut simulation = flying(&limited(6), &bent, Vector3::z() * -4.0, &rate, 1e-3);
    let (linear, angular) = momenta(&simulation);
    let mut energy = simulation.state().kinetic_energy(simulation.robot());
    let (first, mut stopped) = (energy, false);
    for _ in 0..400 {
        let report = simulation.advance(1e-3, &STRAIGHT);
        assert!(!report.diverged && report.unconverged == 0);
        let now = simulation.state().kinetic_energy(simulation.robot());
        assert!(now < energy + 1e-5 * first, "{energy} {now}");
        assert!(farthest(&simulation) < LIMIT + 2e-3, "{}", farthest(&simulation));
        stopped |= farthest(&simulation) > LIMIT - 1e-3;
        energy = now;
    }
    let (after, turned) = momenta(&simulation);
    assert!(stopped && energy < 0.998 * first, "{first} {energy}");
    assert!((after - linear).norm() < 1e-9, "{linear} {after}");
    assert!((turned - angular).norm() < 1e-3 * angular.norm(), "{angular} {turned}");
}

/// Controllers that ask for more than the limit press both axes on their stops and no farther.
#[test]
fn joints_rest_on_their_stops() {
    for wanted in [[-1.1, 0.0], [0.0, 1.1], [1.1, 1.2]] {
        let scene = SceneConfig { rolling_friction: 0.02, ..ground([0.2, 0.2]) };
        let pd = ControllerConfig { torque_limit: Some(20.0), ..ControllerConfig::default() };
        let config = RobotConfig { self_contact: Some(false), ..limited(4) };
        let mut simulation = lying(&config, &scene, &pd, 1e-2);
        let mut unconverged = 0;
        for _ in 0..300 {
            unconverged += simulation.advance(1e-2, &Bend(wanted)).unconverged;
            assert!(farthest(&simulation) < LIMIT + 1e-5, "{wanted:?}: {}", farthest(&simulation));
        }
        for angle in angles(&simulation) {
            for axis in 0..2 {
                let stop = wanted[axis].clamp(-LIMIT, LIMIT);
                assert!((angle[axis] - stop).abs() < 1e-2, "{wanted:?}: {angle}");
                assert!(stop == 0.0 || (angle[axis] - stop).abs() < 1e-6, "{wanted:?}: {angle}");
            }
        }
        assert_eq!(unconverged, 0, "{wanted:?}");
        assert!(
            simulation.state().kinetic_energy(simulation.robot()) < 1e-6,
            "{wanted:?}: {}",
            simulation.state().kinetic_energy(simulation.robot())
        );
    }
}

#[test]
fn joints_have_right_angles_for_limits_unless_others_are_chosen() {
    let largest = |joint_limit| {
        let robot = RobotConfig { links: 3, joint_limit, self_contact: Some(false), ..RobotConfig::default() };
        let pd = ControllerConfig::default();
        let mut simulation = lying(&robot, &ground([0.1, 0.1]), &pd, 1e-2);
        simulation.advance(3.0, &Bend([1.8, 0.0]));
        farthest(&simulation)
    };
    assert!((largest(None) - FRAC_PI_2).abs() < 1e-6);
    assert!((largest(Some(1.2.into())) - 1.2).abs() < 1e-6);
    assert!(largest(Some(f64::INFINITY.into())) > 1.7);
}

/// A joint with hardly any room strikes both stops of both axes.
#[test]
fn a_joint_of_narrow_range_stays_between_its_stops() {
    let robot = RobotConfig { links: 2, joint_limit: Some(0.02.into()), ..RobotConfig::default() };
    let pd = ControllerConfig { kp: 200.0, kd: 0.1, ..ControllerConfig::default() };
    let mut simulation = lying(&robot, &ground([0.0, 0.0]), &pd, 1e-2);
    for wanted in [[0.5, 0.0], [-0.5, 0.5], [0.5, -0.5]] {
        for _ in 0..40 {
            simulation.advance(1e-2, &Bend(wanted));
            assert!(farthest(&simulation) < 0.02 + 1e-4, "{}", farthest(&simulation));
        }
        let yaw = angles(&simulation)[0].x;
        assert!((yaw - 0.02_f64.copysign(wanted[0])).abs() < 1e-6, "{yaw}");
    }
}

/// Far from their limits joints move as without them, bit for bit.
#[test]
fn a_limit_that_no_joint_meets_changes_nothing() {
    let run = |joint_limit: f64| {
        let robot = RobotConfig { joint_limit: Some(joint_limit.into()), ..RobotConfig::default() };
        let pd = ControllerConfig::default();
        let mut simulation = lying(&robot, &ground([0.2, 0.5]), &pd, 1e-2);
        simulation.advance(1.0, &Bend([0.5, 0.1]));
        simulation.state().clone()
    };
    assert_eq!(run(1.0), run(f64::INFINITY));
}

/// Multipliers of stops that hold back actuators begin near their impulses: friction radii need not settle again once they
/// move.
#[test]
fn stops_that_are_met_take_no_more_solves() {
    let solves = |joint_limit: f64| {
        let robot = RobotConfig { joint_limit: Some(joint_limit.into()), ..RobotConfig::default() };
        let mut simulation = lying(&robot, &ground([0.2, 0.2]), &ControllerConfig::default(), 1e-3);
        let report = simulation.advance(2.0, &undulation());
        assert!(report.unconverged == 0, "{report:?}");
        f64::from(report.iterations)
    };
    let [apart, met] = [FRAC_PI_2, 0.65].map(solves);
    println!("{met} solves instead of {apart}");
    assert!(met < 1.1 * apart, "{met} {apart}");
}

/// Limp links that swing on frictionless ground strike their stops as in the planar model.
#[test]
fn stops_act_as_in_the_plane() {
    let (step, rates) = (2.5e-4, [5.0, -4.0, 3.0]);
    let mut flat_robot = build(&limited(4), &ground([0.0, 0.0]), &LIMP, &planar_implicit(step, 2));
    flat_robot.place_chain(0.0, 0.0, 0.0, &[0.2; 3]);
    let pose: Vec<planar::Pose> = flat_robot.state().pose.clone();
    let state = moving_chain(flat_robot.robot(), &pose, planar::Twist::new(0.1, -0.2, 1.0), &rates);
    flat_robot.place(&state);
    let scene = SceneConfig { rolling_friction: 0.0, ..ground([0.0, 0.0]) };
    let mut simulation = SpatialSimulation::new(&limited(4), &scene, &LIMP, &implicit(step, 2)).expect("admissible");
    let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.0, 0.0, 0.0) };
    simulation.place_chain(head, &[Vector2::new(0.2, 0.0); 3]);
    simulation.rest_on_ground();
    let mut lifted = simulation.state().clone();
    for (i, (pose, twist)) in lifted.pose.iter().zip(&mut lifted.twist).enumerate() {
        let u = &state.twist[i];
        let omega = pose.orientation.inverse_transform_vector(&(Vector3::z() * u.z));
        *twist = twist_of(Vector3::new(u.x, u.y, 0.0), omega);
    }
    simulation.place(&lifted);
    let mut stopped = 0.0_f64;
    for _ in 0..2000 {
        flat_robot.advance(step, &Hold(0.0));
        simulation.advance(step, &STRAIGHT);
        stopped = stopped.max(farthest(&simulation));
    }
    assert!(stopped > LIMIT - 1e-3, "a joint met its stop");
    for (flat, pose) in flat_robot.state().pose.iter().zip(&simulation.state().pose) {
        assert!((flat.xy() - pose.position.xy()).norm() < 1e-4, "{flat} {}", pose.position);
    }
}

/// Each joint is held at its own stops, on either side, about the axes that it has.
#[test]
fn joints_have_limits_of_their_own() {
    let limits = [PerLink::Each(vec![-0.3, 0.7]), PerLink::Same(0.5), PerLink::Each(vec![0.0, 0.9])];
    let names = ["both", "yaw", "pitch"].map(|name| OneJoint::Named(name.to_owned()));
    let robot = RobotConfig {
        links: 4,
        joint_limit: Some(PerAxis::Each(limits.into())),
        axes: AxesConfig::Each(names.into()),
        self_contact: Some(false),
        ..RobotConfig::default()
    };
    let pd = ControllerConfig { kp: 20.0, kd: 0.5, ..ControllerConfig::default() };
    for (wanted, bounds) in
        [(1.2, [[0.7, 0.7], [0.5, 0.0], [0.0, 0.9]]), (-1.2, [[-0.3, -0.3], [-0.5, 0.0], [0.0, 0.0]])]
    {
        let mut simulation = SpatialSimulation::new(
            &RobotConfig { gravity: 1e-9, ..robot.clone() },
            &ground([0.0; 2]),
            &pd,
            &implicit(1e-2, 2),
        )
        .expect("admissible");
        let head = Pose { position: Vector3::new(0.0, 0.0, 9.0), orientation: orientation_of(0.0, 0.0, 0.0) };
        simulation.place_chain(head, &[Vector2::zeros(); 3]);
        for _ in 0..300 {
            let report = simulation.advance(1e-2, &Bend([wanted; 2]));
            assert_eq!(report.unconverged, 0);
        }
        for (joint, bounds) in bounds.iter().enumerate() {
            let angle = simulation.joint_angle(joint);
            assert!(
                (0..2).all(|axis| (angle[axis] - bounds[axis]).abs() < 2e-6),
                "{wanted}: {angle:?} of joint {joint}"
            );
        }
    }
}

#[test]
fn limits_that_cross_are_named() {
    let limits = |third: PerLink| PerAxis::Each(vec![PerLink::Same(f64::INFINITY), PerLink::Same(1.0), third]);
    for wrong in [vec![0.2, 0.5], vec![0.5, -0.5], vec![0.0, 0.0], vec![0.5], vec![f64::NAN, 1.0]] {
        let error = limits(PerLink::Each(wrong.clone())).bounds(3).expect_err("refused");
        assert_eq!((error.field.as_str(), error.value), ("joint_limit[2]", format!("{wrong:?}")));
    }
    assert_eq!(limits(PerLink::Same(-1.0)).bounds(3).expect_err("refused").field, "joint_limit[2]");
    assert_eq!(limits(PerLink::Same(1.0)).bounds(4).expect_err("refused").field, "joint_limit");
}
