//! Joints with chosen axes: kinematics against finite differences, stages against full matrices and the judge, and what
//! chains of hinges keep in flight and on the ground.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::robot::{Axes, AxesConfig, LOCK_STIFFNESS, OneJoint, PerLink, Robot, RobotConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{
    ChainShape, ChainVelocity, Configuration, Fallback, Frame, Newton, Pose, Stage, StageDrive, Twist, assemble_chain,
    axis_angles, axis_rates, certify, orientation_of, turning, twist_of,
};
use snake_test_support::planar::{LIMP, Random, ground};
use snake_test_support::spatial::{implicit, undulation};
use snake_test_support::spatial_stage::{Dense, stacked};

use super::stage::{blank, moving, off_centre};

fn all(name: &str) -> AxesConfig {
    AxesConfig::Same(name.to_owned())
}

/// A joint of each kind in turn, the oblique ones about random axes.
fn mixed(joints: usize, random: &mut Random) -> AxesConfig {
    let mut joint = |j: usize| match ["yaw", "pitch", "both", "roll"].get(j % 5) {
        Some(name) => OneJoint::Named((*name).to_owned()),
        None => OneJoint::About((0..3).map(|_| random.between(-1.0, 1.0)).collect()),
    };
    AxesConfig::Each((0..joints).map(&mut joint).collect())
}

/// Yaw and pitch in turn, as in most robots of modules.
fn alternating(joints: usize) -> AxesConfig {
    AxesConfig::Each((0..joints).map(|j| OneJoint::Named(["yaw", "pitch"][j % 2].to_owned())).collect())
}

fn robot(axes: AxesConfig, links: usize) -> RobotConfig {
    RobotConfig { links, axes, joint_limit: Some(f64::INFINITY.into()), ..RobotConfig::default() }
}

fn drawn_rates(axes: &[Axes], size: f64, random: &mut Random) -> Vec<[f64; 2]> {
    let of_axis = |axes: &Axes, axis: usize, value: f64| if axes.has(axis) { value } else { 0.0 };
    axes.iter().map(|axes| [0, 1].map(|axis| of_axis(axes, axis, random.between(-size, size)))).collect()
}

fn drawn_vector(size: f64, random: &mut Random) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.between(-size, size))
}

/// Positions of the placed links, the same by quaternions, and twists by central differences of both.
#[test]
fn links_lie_and_move_as_their_joints_turn() {
    let mut random = Random::new(41);
    let robot = Robot::new(&robot(mixed(10, &mut random), 11)).expect("admissible");
    let shape = ChainShape::new(&robot);
    let start = Configuration {
        position: drawn_vector(1.0, &mut random),
        orientation: {
            let q = UnitQuaternion::from_scaled_axis(drawn_vector(2.0, &mut random)).into_inner();
            [q.w, q.i, q.j, q.k]
        },
        angle: drawn_rates(&robot.axes, 1.3, &mut random),
        moved: Vec::new(),
    };
    let head = Twist { linear: drawn_vector(1.0, &mut random), angular: drawn_vector(2.0, &mut random) };
    let velocity = ChainVelocity { head, rate: drawn_rates(&robot.axes, 2.0, &mut random), moved: Vec::new() };
    let placed = |time: f64| {
        let mut configuration = start.clone();
        configuration.travel(&start, &velocity, time);
        let mut frames = vec![Frame::origin(); 11];
        configuration.place_links(&shape, &mut frames);
        let [w, x, y, z] = configuration.orientation;
        let orientation = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        let angle: Vec<Vector2<f64>> = configuration.angle.iter().map(|angle| (*angle).into()).collect();
        let mut pose = [Pose::identity(); 11];
        assemble_chain(&robot, Pose { position: configuration.position, orientation }, &angle, &mut pose);
        for (frame, pose) in frames.iter().zip(&pose) {
            assert!((frame.position - pose.position).norm() < 1e-14);
            assert!(
                frame
                    .axes
                    .iter()
                    .zip(pose.rotation().column_iter())
                    .all(|(axis, column)| (axis - column).norm() < 2e-15)
            );
        }
        pose
    };
    let mut frames = vec![Frame::origin(); 11];
    start.place_links(&shape, &mut frames);
    let mut twist = vec![Twist::zero(); 11];
    velocity.twists(&frames, &shape, &mut twist);
    let (h, now) = (1e-5, placed(0.0));
    let (before, after) = (placed(-h), placed(h));
    for (i, twist) in twist.iter().enumerate() {
        let linear = (after[i].position - before[i].position) / (2.0 * h);
        let angular = (after[i].orientation * before[i].orientation.inverse()).scaled_axis() / (2.0 * h);
        assert!((linear - twist.linear).norm() < 1e-8 && (angular - twist.angular).norm() < 1e-8, "link {i}");
    }
    for (j, axes) in robot.axes.iter().enumerate() {
        let stacked =
            |i: usize| twist_of(twist[i].linear, now[i].orientation.inverse_transform_vector(&twist[i].angular));
        let angles = axis_angles(*axes, &now[j], &now[j + 1]);
        let rates = axis_rates(*axes, (&now[j], &stacked(j)), (&now[j + 1], &stacked(j + 1)));
        for axis in 0..2 {
            assert!((angles[axis] - start.angle[j][axis]).abs() < 1e-14, "angle {axis} of joint {j}");
            assert!((rates[axis] - velocity.rate[j][axis]).abs() < 1e-13, "rate {axis} of joint {j}");
        }
    }
}

/// A stage in motion whose joints have random axes of all kinds.
pub fn hinged(random: &mut Random, links: usize) -> Stage {
    let mut stage = moving(random, links);
    stage.axes = mixed(links - 1, random).expand(links - 1).expect("admissible");
    stage.axes.rotate_left(random.below(links - 1));
    for (axes, drives) in stage.axes.iter().zip(&mut stage.joints) {
        (0..2).filter(|axis| !axes.has(*axis)).for_each(|axis| drives[axis] = StageDrive::none());
    }
    stage
}

#[test]
fn newton_fallback_and_dense_gauss_seidel_agree_on_hinges() {
    let mut random = Random::new(43);
    for trial in 0..40 {
        let links = 2 + trial % 6;
        let mut stage = hinged(&mut random, links);
        off_centre(&mut stage, trial);
        let slow = Dense::new(&stage).solve(&stage);
        let mut fast = blank(&stage);
        assert!(Newton::new(links).solve_one(&stage, &mut fast, 1e-9, 300).converged);
        let mut hard = blank(&stage);
        Fallback::new(links).solve_hard(&stage, &mut hard, 1e-8, u32::MAX);
        for solution in [&fast, &hard] {
            assert!(certify(&stage, solution).residual() < 1e-8, "trial {trial}: {:?}", certify(&stage, solution));
            let apart = (stacked(&solution.twist) - &slow).amax();
            assert!(apart < 2e-6, "trial {trial}: {apart}");
        }
    }
}

/// What turns about an axis that a joint does not have opens the joint, whoever says so.
#[test]
fn the_judge_sees_turns_about_axes_that_are_not_there() {
    let mut random = Random::new(44);
    let stage = hinged(&mut random, 9);
    let mut solution = blank(&stage);
    assert!(Newton::new(9).solve_one(&stage, &mut solution, 1e-9, 300).converged);
    for j in (0..8).filter(|j| stage.axes[*j] != Axes::Both) {
        let mut turned = solution.clone();
        turned.twist[j + 1].angular += stage.links[j + 1].axes.iter().sum::<Vector3<f64>>() * 1e-3;
        assert!(certify(&stage, &turned).joint > 1e-5, "joint {j}");
        let absent = usize::from(stage.axes[j].has(0));
        let mut driven = solution.clone();
        driven.actuator[j][absent] = 1e-5;
        assert!(certify(&stage, &driven).actuator > 1e-6, "joint {j}");
    }
}

/// A cardan joint whose pitch is held by the stiffness of a locked joint moves as a hinge, within that stiffness.
#[test]
fn a_hinge_is_a_cardan_joint_with_a_locked_axis() {
    let mut random = Random::new(45);
    for (axes, absent) in [(Axes::Yaw, 1), (Axes::Pitch, 0)] {
        let mut stage = moving(&mut random, 6);
        let mut solution = blank(&stage);
        let c = stage.coefficient;
        for drives in &mut stage.joints {
            drives[absent] =
                StageDrive { stiffness: LOCK_STIFFNESS * c * c, limit: f64::INFINITY, ..StageDrive::none() };
        }
        assert!(Newton::new(6).solve_one(&stage, &mut solution, 1e-8, 300).converged);
        stage.axes = vec![axes; 5];
        stage.joints.iter_mut().for_each(|drives| drives[absent] = StageDrive::none());
        let mut hinges = blank(&stage);
        assert!(Newton::new(6).solve_one(&stage, &mut hinges, 1e-8, 300).converged);
        let apart = (stacked(&solution.twist) - stacked(&hinges.twist)).amax();
        let moments: f64 = solution.actuator.iter().map(|impulse| impulse[absent].abs()).sum();
        let given_way = moments / (LOCK_STIFFNESS * c * c);
        assert!(apart < 2.0 * given_way + 1e-8, "{axes}: {apart} instead of {given_way}");
        assert!(hinges.rate.iter().all(|rate| rate[absent] == 0.0));
    }
}

/// A limp robot without weight far from the ground, bent and turning at random.
fn flying(config: RobotConfig, step: f64, random: &mut Random) -> SpatialSimulation {
    let config = RobotConfig { gravity: 1e-12, self_contact: Some(false), ..config };
    let scene = ground([0.0; 2]);
    let mut simulation = SpatialSimulation::new(&config, &scene, &LIMP, &implicit(step, 2)).expect("admissible");
    let axes = simulation.robot().axes.clone();
    let angle = drawn_rates(&axes, 0.5, random).into_iter().map(Vector2::from).collect::<Vec<_>>();
    let rate = drawn_rates(&axes, 1.0, random);
    let head = Pose { position: Vector3::new(0.3, -0.2, 50.0), orientation: orientation_of(0.4, 0.1, 0.2) };
    simulation.place_chain(head, &angle);
    let mut state = simulation.state().clone();
    let (mut velocity, mut omega) = (Vector3::new(0.02, 0.01, -0.01), drawn_vector(1.0, random));
    for i in 0..state.pose.len() {
        let far = state.pose[i];
        if i > 0 {
            let near = state.pose[i - 1];
            let [rear, front] = [simulation.robot().links[i - 1].arms()[1], simulation.robot().links[i].arms()[0]];
            velocity += omega.cross(&(near.axis() * rear));
            omega += match axes[i - 1] {
                Axes::About(axis) => near.orientation * Vector3::from(axis) * (rate[i - 1][0] + rate[i - 1][1]),
                _ => near.orientation * Vector3::y() * rate[i - 1][0] + far.orientation * Vector3::x() * rate[i - 1][1],
            };
            velocity += omega.cross(&(far.axis() * front));
        }
        state.twist[i] = twist_of(velocity, far.orientation.inverse_transform_vector(&omega));
    }
    simulation.place(&state);
    simulation
}

/// Momentum, and angular momentum about the robot's CG.
fn momenta(simulation: &SpatialSimulation) -> (Vector3<f64>, Vector3<f64>) {
    let (mut momentum, mut spin) = (Vector3::zeros(), Vector3::zeros());
    let links = simulation.robot().links.iter().zip(&simulation.state().pose);
    let weighted: Vector3<f64> = links.map(|(link, pose)| pose.position * link.mass).sum();
    let centre = weighted / simulation.robot().total_mass();
    for ((link, pose), twist) in
        simulation.robot().links.iter().zip(&simulation.state().pose).zip(&simulation.state().twist)
    {
        let p = twist.fixed_rows::<3>(0) * link.mass;
        let inertia = Vector3::new(link.inertia, link.inertia, link.roll_inertia);
        momentum += p;
        spin += (pose.position - centre).cross(&p) + pose.orientation * turning(twist).component_mul(&inertia);
    }
    (momentum, spin)
}

#[test]
fn limp_chains_of_hinges_keep_momenta_and_energy_in_flight() {
    let mut random = Random::new(46);
    for axes in [alternating(10), mixed(10, &mut random)] {
        let (mut lost, mut turned) = (Vec::new(), Vec::new());
        for step in [2e-3, 1e-3] {
            let offsets = (0..11).map(|i| 0.04 * f64::from(i * i).sin()).collect();
            let config = RobotConfig { cg_offset: PerLink::Each(offsets), ..robot(axes.clone(), 11) };
            let mut simulation = flying(config, step, &mut Random::new(47));
            let (before, energy) = (momenta(&simulation), simulation.energy());
            let still = CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) };
            let report = simulation.advance(1.0, &still);
            assert!(report.unconverged == 0, "{report:?}");
            let after = momenta(&simulation);
            assert!((after.0 - before.0).norm() < 1e-11, "{before:?}, {after:?}");
            turned.push((after.1 - before.1).norm() / before.1.norm());
            assert!(simulation.joint_gap() < 1e-13);
            for (j, axes) in simulation.robot().axes.iter().enumerate() {
                let [near, far] = [&simulation.state().pose[j], &simulation.state().pose[j + 1]];
                let mut closed = [*near, *far];
                let angle = axis_angles(*axes, near, far).into();
                let pair = Robot {
                    axes: vec![*axes],
                    links: vec![simulation.robot().links[0]; 2],
                    ..simulation.robot().clone()
                };
                assemble_chain(&pair, *near, &[angle], &mut closed);
                assert!(
                    closed[1].orientation.angle_to(&far.orientation) < 1e-13,
                    "joint {j} turns about no axis of its own"
                );
            }
            lost.push((simulation.energy() - energy).abs() / energy);
        }
        println!("energy changes by {lost:?}, angular momentum by {turned:?}");
        assert!(
            [&lost, &turned].iter().all(|error| error[1] < 1e-6 && error[1] < 0.35 * error[0]),
            "{lost:?}, {turned:?}"
        );
    }
}

/// A limp hinge along the links passes no moment about itself: straight links spin on, each as it did.
#[test]
fn limp_roll_joints_transmit_no_moment_about_their_axis() {
    let config = RobotConfig { gravity: 1e-12, ..robot(all("roll"), 4) };
    let mut simulation =
        SpatialSimulation::new(&config, &ground([0.0; 2]), &LIMP, &implicit(0.01, 2)).expect("admissible");
    let head = Pose { position: Vector3::new(0.0, 0.0, 9.0), orientation: orientation_of(0.4, 0.1, 0.2) };
    simulation.place_chain(head, &[Vector2::zeros(); 3]);
    let spins = [1.0, -2.0, 0.5, 3.0];
    let mut state = simulation.state().clone();
    for (twist, spin) in state.twist.iter_mut().zip(spins) {
        *twist = twist_of(Vector3::new(0.1, 0.2, 0.3), Vector3::z() * spin);
    }
    simulation.place(&state);
    simulation.advance(1.0, &undulation());
    for (twist, spin) in simulation.state().twist.iter().zip(spins) {
        assert!((turning(twist) - Vector3::z() * spin).norm() < 1e-9, "{twist:?} instead of {spin}");
    }
    for (pose, j) in simulation.state().pose.windows(2).zip(0..) {
        let turned = axis_angles(Axes::ROLL, &pose[0], &pose[1])[0];
        let expected = spins[j + 1] - spins[j];
        let apart = (turned - expected).rem_euclid(std::f64::consts::TAU);
        assert!(apart.min(std::f64::consts::TAU - apart) < 1e-9, "joint {j}: {turned}");
    }
}

/// On flat ground under a planar gait pitch joints have nothing to do but share out the loads, and with them friction,
/// which stiff ones do as rigid hinges.
#[test]
fn hinges_and_cardan_joints_undulate_alike_on_flat_ground() {
    let run = |axes: AxesConfig, friction: [f64; 2], stiffer: f64| {
        let (scene, pd) = (ground(friction), ControllerConfig::default());
        let pd = ControllerConfig { kp: pd.kp * stiffer, kd: pd.kd * stiffer, ..pd };
        let mut simulation =
            SpatialSimulation::new(&robot(axes, 11), &scene, &pd, &implicit(0.01, 2)).expect("admissible");
        let gait = undulation();
        let posture: Vec<_> =
            (0..10).map(|j| Vector2::new(snake_core::gait::Reference::target(&gait, j, 0.0).yaw.angle, 0.0)).collect();
        simulation
            .place_chain(Pose { position: Vector3::zeros(), orientation: orientation_of(0.3, 0.0, 0.0) }, &posture);
        simulation.rest_on_ground();
        assert_eq!(simulation.advance(2.0, &gait).unconverged, 0);
        simulation.state().clone()
    };
    let apart = |friction: [f64; 2], stiffer: f64| {
        let cardan = run(AxesConfig::default(), friction, stiffer);
        let hinges = run(all("yaw"), friction, stiffer);
        cardan.pose.iter().zip(&hinges.pose).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max)
    };
    let (smooth, rough) = (apart([0.0; 2], 1.0), apart([0.1, 0.5], 1e6));
    println!("{smooth:.1e} m apart without friction, {rough:.1e} m with it");
    assert!(smooth < 1e-12 && rough < 2e-4);
}

#[test]
fn axes_are_named_or_vectors_and_faults_name_the_joint() {
    let error = |axes: AxesConfig| Robot::new(&robot(axes, 4)).expect_err("refused");
    let about = |vector: [f64; 3]| {
        AxesConfig::Each([[0.0, 3.0, 0.0], vector, [2.0, 0.0, 0.0]].map(|axis| OneJoint::About(axis.into())).into())
    };
    assert_eq!(error(about([0.0; 3])).field, "axes[1]");
    assert_eq!(error(about([f64::NAN, 0.0, 1.0])).field, "axes[1]");
    assert_eq!(error(alternating(4)).field, "axes");
    let robot = Robot::new(&robot(about([0.0, 0.0, 4.0]), 4)).expect("admissible");
    assert_eq!(robot.axes, [Axes::Yaw, Axes::ROLL, Axes::Pitch]);
    assert_eq!(robot.axis_list().collect::<Vec<_>>(), [(0, 0), (1, 0), (2, 1)]);
}
