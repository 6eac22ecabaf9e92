//! Gains, torque limits and backlash of each joint: links at either end of a heavy one, each against its own closed form.

use snake_core::control::ControllerConfig;
use snake_core::planar::Twist;
use snake_core::robot::{Motor, PerAxis, PerLink, RobotConfig};
use snake_core::scene::START_7_5;
use snake_core::simulation::PlanarSimulation;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{
    Hold, build, each_joint, ground, implicit, links, moving_chain, posture, table_7_5, uneven_joints,
};

/// Inertia of a link of Aiko about its joint.
const INERTIA: f64 = 1.32e-3 + (7.5 / 11.0) * 0.061 * 0.061;

/// Two links of Aiko at the ends of one that does not move.
fn anchored() -> RobotConfig {
    let mass = PerLink::Each(vec![7.5 / 11.0, 1e4, 7.5 / 11.0]);
    RobotConfig { mass, inertia: PerLink::Each(vec![1.32e-3, 1e4, 1.32e-3]), ..links(3) }
}

fn floating(robot: &RobotConfig, scheme: &ImplicitConfig, angles: [f64; 2]) -> PlanarSimulation {
    let mut simulation = build(robot, &ground([0.0, 0.0]), &ControllerConfig::default(), scheme);
    simulation.place_chain(0.0, 0.0, 0.0, &angles);
    simulation
}

/// `I phi'' = -k_P phi - k_D phi'`.
#[test]
fn each_joint_swings_at_its_own_gains() {
    let gains = [[20.0, 0.0], [5.0, 0.05]];
    let (kp, kd) = (each_joint(&gains.map(|gains| gains[0])), each_joint(&gains.map(|gains| gains[1])));
    let robot = RobotConfig { kp: Some(kp), kd: Some(kd), ..anchored() };
    let mut simulation = floating(&robot, &implicit(1e-4, 2), [0.1, -0.1]);
    for k in 1..=4 {
        simulation.advance(0.025, &Hold(0.0));
        let t = 0.025 * f64::from(k);
        for (joint, ([kp, kd], start)) in gains.into_iter().zip([0.1, -0.1]).enumerate() {
            let decay = 0.5 * kd / INERTIA;
            let rate = (kp / INERTIA - decay * decay).sqrt();
            let expected = start * (-decay * t).exp() * ((rate * t).cos() + decay / rate * (rate * t).sin());
            let angle = simulation.state().joint_angle(joint);
            assert!((angle - expected).abs() < 1e-4, "joint {joint} at {t}: {angle} for {expected}");
        }
    }
}

/// `I phi'' = tau` far from the reference.
#[test]
fn each_joint_gives_its_own_largest_torque() {
    let limits = [0.02, 0.05];
    let robot = RobotConfig { torque_limit: Some(each_joint(&limits)), ..anchored() };
    let mut simulation = floating(&robot, &implicit(1e-3, 2), [0.0; 2]);
    simulation.advance(0.05, &Hold(1.0));
    for (joint, limit) in limits.into_iter().enumerate() {
        assert!((simulation.joint_torque()[joint] + limit).abs() < 1e-12);
        let expected = 0.5 * limit / INERTIA * 0.05 * 0.05;
        let angle = simulation.state().joint_angle(joint);
        assert!((angle / expected - 1.0).abs() < 5e-4, "joint {joint}: {angle} for {expected}");
    }
}

/// `(I + J) omega' = stall (1 - omega / omega_0)` of each joint with its own numbers.
#[test]
fn each_joint_spins_up_along_the_line_of_its_own_motor() {
    let motors = [(0.4, 1.0, 0.0), (0.1, 2.0, 2e-3)].map(|(stall_torque, no_load_speed, rotor_inertia)| Motor {
        stall_torque,
        no_load_speed,
        rotor_inertia,
        ..Motor::default()
    });
    let motor = Some(PerAxis::Each(motors.map(PerLink::Same).into()));
    let mut simulation = floating(&RobotConfig { motor, ..anchored() }, &implicit(1e-4, 2), [0.0; 2]);
    simulation.advance(0.02, &Hold(1.0));
    let mut energy = 0.0;
    for (joint, motor) in motors.iter().enumerate() {
        let constant = (INERTIA + motor.rotor_inertia) * motor.no_load_speed / motor.stall_torque;
        let expected = motor.no_load_speed * (1.0 - f64::exp(-0.02 / constant));
        let rate = simulation.state().joint_rate(joint);
        assert!((rate / expected - 1.0).abs() < 2e-4, "joint {joint}: {rate} for {expected}");
        energy += 0.5 * (INERTIA + motor.rotor_inertia) * rate * rate;
    }
    assert!((simulation.kinetic_energy() / energy - 1.0).abs() < 2e-3, "links and rotors: {energy}");
}

/// A joint swings freely up to the end of its own play, and kinetic energy and that of the springs never grow.
#[test]
fn each_joint_has_its_own_play() {
    let (plays, gains, rate) = ([0.02, 0.2], [40.0, 10.0], 0.5);
    let robot =
        RobotConfig { backlash: each_joint(&plays), kp: Some(each_joint(&gains)), kd: Some(0.0.into()), ..anchored() };
    let mut simulation = floating(&robot, &implicit(1e-3, 1), [0.0; 2]);
    let head = Twist::new(0.0, 0.061 * rate, -rate);
    simulation.place(&moving_chain(simulation.robot(), &simulation.state().pose.clone(), head, &[0.0, rate]));
    let energy = |simulation: &PlanarSimulation| {
        let springs = gains.into_iter().enumerate().map(|(joint, kp)| {
            let motor = simulation.state().joint_angle(joint) - simulation.body().warm_start.backlash[joint];
            0.5 * kp * motor * motor
        });
        simulation.kinetic_energy() + springs.sum::<f64>()
    };
    let (start, mut before, mut farthest) = (energy(&simulation), energy(&simulation), [0.0_f64; 2]);
    for step in 1..=600 {
        simulation.advance(1e-3, &Hold(0.0));
        let now = energy(&simulation);
        assert!(now <= before + 1e-9 * start, "step {step}: {before:e}, then {now:e}");
        before = now;
        for (joint, farthest) in farthest.iter_mut().enumerate() {
            let at_end = 0.5 * plays[joint] / rate;
            let rate_now = simulation.state().joint_rate(joint);
            if 1e-3 * f64::from(step) < at_end - 2e-3 {
                // The heavy link gives way by the ratio of the masses, 7e-5.
                assert!((rate_now - rate).abs() < 1e-4, "joint {joint}, step {step}: {rate_now}");
                assert_eq!(simulation.joint_torque()[joint], 0.0);
            }
            *farthest = farthest.max(simulation.state().joint_angle(joint).abs());
        }
    }
    for (farthest, (play, kp)) in farthest.into_iter().zip(plays.into_iter().zip(gains)) {
        // The spring takes up the kinetic energy at most.
        let most = 0.5 * play + rate * (INERTIA / kp).sqrt();
        assert!(farthest > 0.5 * play && farthest < most + 1e-4, "{farthest} with {play}");
    }
}

/// Lists of equal values are what the controller and one number say, bit by bit.
#[test]
fn equal_joints_are_those_of_the_controller() {
    let pd = ControllerConfig { kp: 60.0, kd: 1.5, torque_limit: Some(3.0), ..ControllerConfig::default() };
    let one = RobotConfig { backlash: 0.03.into(), ..RobotConfig::default() };
    let same = |value: f64| Some(each_joint(&[value; 10]));
    let listed = RobotConfig {
        backlash: each_joint(&[0.03; 10]),
        kp: same(60.0),
        kd: same(1.5),
        torque_limit: same(3.0),
        friction_factor: PerLink::Each(vec![1.0; 11]),
        ..RobotConfig::default()
    };
    let run = |robot: &RobotConfig, pd: &ControllerConfig| {
        let wave = snake_core::gait::Wave::default();
        let mut simulation = build(robot, &table_7_5(), pd, &ImplicitConfig::default());
        simulation.place_chain(START_7_5[0], START_7_5[1], START_7_5[2], &posture(&wave, 10));
        simulation.advance(0.5, &wave);
        simulation.state().clone()
    };
    let by_controller = run(&one, &pd);
    assert_eq!(run(&listed, &ControllerConfig::default()), by_controller);
    assert_ne!(run(&uneven_joints(10), &pd), by_controller);
}

#[test]
fn refusals_name_the_joint() {
    let refused = |robot: RobotConfig| {
        let error = PlanarSimulation::new(
            &robot,
            &ground([0.2, 0.2]),
            &ControllerConfig::default(),
            &ImplicitConfig::default(),
        )
        .unwrap_err();
        error.field
    };
    assert_eq!(refused(RobotConfig { kp: Some(each_joint(&[1.0, -1.0])), ..links(3) }), "robot.kp[1]");
    assert_eq!(refused(RobotConfig { kd: Some(each_joint(&[1.0])), ..links(3) }), "robot.kd");
    assert_eq!(
        refused(RobotConfig { torque_limit: Some(each_joint(&[0.0, 1.0])), ..links(3) }),
        "robot.torque_limit[0]"
    );
    assert_eq!(refused(RobotConfig { backlash: each_joint(&[0.1, 9.0]), ..links(3) }), "robot.backlash[1]");
    let factor = PerLink::Each(vec![1.0, -1.0, 1.0]);
    assert_eq!(refused(RobotConfig { friction_factor: factor, ..links(3) }), "robot.friction_factor[1]");
    let io = PlanarSimulation::new(
        &RobotConfig { kp: Some(5.0.into()), ..links(3) },
        &ground([0.2, 0.2]),
        &ControllerConfig::io(),
        &ImplicitConfig::default(),
    );
    assert_eq!(io.unwrap_err().field, "robot.kp");
}
