//! Motors of the joints: torque-speed line, inertia of the rotor, friction of the gear.

use nalgebra::Vector3;
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::planar::{Fallback, Newton, Planar, Stage, StageSolution, Twist, certify};
use snake_core::robot::{Motor, RobotConfig};
use snake_core::rows::MotorRow;
use snake_core::scene::START_7_5;
use snake_core::simulation::PlanarSimulation;
use snake_core::solver::SolveStatus;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::flat::work_of_motors_goes_into_links_rotors_and_friction;
use snake_test_support::planar::{
    Hold, LIMP, Random, build, ground, implicit, links, posture, random_motor, swinging_pair, table_7_5,
};
use snake_test_support::planar_stage::{self as dense, Kind};

fn motor() -> Motor {
    Motor { stall_torque: 0.4, no_load_speed: 1.0, ..Motor::default() }
}

/// Inertia of a joint of two free links of Aiko that are nearly straight.
const PAIR: f64 = 0.5 * 1.32e-3;

fn driven(count: usize, motor: Motor) -> RobotConfig {
    RobotConfig { motor: Some(motor.into()), joint_limit: Some(f64::INFINITY.into()), ..links(count) }
}

fn pair(motor: Motor, pd: &ControllerConfig, rate: f64, scheme: &ImplicitConfig) -> PlanarSimulation {
    swinging_pair(&driven(2, motor), pd, rate, scheme)
}

/// A joint that its motor turns as fast as it can: `(I + J) omega' = stall (1 - omega / omega_0)`, so `omega = omega_0 (1 -
/// exp(-t / T))` with `T = (I + J) omega_0 / stall`, where J is the square of the gear's ratio times the rotor's inertia.
#[test]
fn a_free_joint_spins_up_along_the_torque_speed_line() {
    for (rotor_inertia, gear_ratio) in [(0.0, 1.0), (1e-5, 10.0)] {
        let motor = Motor { rotor_inertia, gear_ratio, ..motor() };
        let constant = (PAIR + rotor_inertia * gear_ratio * gear_ratio) * motor.no_load_speed / motor.stall_torque;
        for (order, bound) in [(1, 5e-3), (2, 2e-5)] {
            let mut pair = pair(motor, &ControllerConfig::default(), 0.0, &implicit(1e-2 * constant, order));
            for spans in [0.5, 1.0, 2.0] {
                pair.advance(spans * constant - pair.state().time, &Hold(1.0));
                let expected = motor.no_load_speed * (1.0 - f64::exp(-spans));
                let error = pair.state().joint_rate(0) / expected - 1.0;
                assert!(error.abs() < bound, "J {rotor_inertia:e}, order {order}, {spans} T: {error:e}");
            }
        }
    }
}

/// Whatever the reference asks for, a motor that drives stays below its line, and one that brakes below its limit.
#[test]
fn torques_stay_below_the_line_in_driving_and_below_the_limit_in_braking() {
    let motor = Motor { stall_torque: 3.0, no_load_speed: 4.0, ..motor() };
    let (limit, mut counts) = (2.0, [0; 3]);
    let pd = ControllerConfig { torque_limit: Some(limit), ..ControllerConfig::default() };
    for (step, order) in [(1e-3, 1), (1e-2, 1), (1e-3, 2), (1e-2, 2)] {
        let mut robot = build(&driven(6, motor), &ground([0.2, 0.5]), &pd, &implicit(step, order));
        for k in 0..400 {
            let report = robot.advance(step, &Hold(if (k / 20) % 2 == 0 { 0.5 } else { -0.5 }));
            assert!(!report.diverged && report.residual < 1e-8, "order {order}, h {step}, step {k}: {report:?}");
            for joint in 0..5 {
                // The sign of the thesis is the other one.
                let (torque, rate) = (-robot.joint_torque()[joint], robot.state().joint_rate(joint));
                let line = (motor.stall_torque * (1.0 - rate.abs() / motor.no_load_speed)).max(0.0);
                let most = if torque * rate > 0.0 { line.min(limit) } else { limit };
                assert!(torque.abs() <= most + 1e-9, "order {order}, h {step}: {torque} at {rate}");
                let at_limit = torque.abs() > 0.999 * limit;
                let on_line = torque * rate > 0.0 && line < 0.99 * limit && torque.abs() > 0.999 * line && line > 0.0;
                let faster = rate.abs() > motor.no_load_speed && torque == 0.0;
                for (count, is_there) in counts.iter_mut().zip([at_limit, on_line, faster]) {
                    *count += u32::from(is_there);
                }
            }
        }
    }
    println!("at the limit, on the line, faster than it: {counts:?}");
    assert!(counts[0] > 50 && counts[1] > 50 && counts[2] > 0, "all must occur: {counts:?}");
}

/// A gear with friction b slows a joint without drive at b / (I + J), to rest after omega (I + J) / b, and keeps it there
/// against anything weaker. It takes the kinetic energy of links and rotor.
#[test]
fn the_friction_of_a_gear_stops_a_joint_and_holds_it() {
    let motor = Motor { rotor_inertia: 1e-3, gear_friction: 0.05, ..motor() };
    let (inertia, rate) = (PAIR + 1e-3, 0.3);
    let end = rate * inertia / motor.gear_friction;
    for order in [1, 2] {
        let mut pair = pair(motor, &LIMP, rate, &implicit(1e-4, order));
        let start = pair.kinetic_energy();
        assert!((start - 0.5 * inertia * rate * rate).abs() < 1e-12);
        let report = pair.advance(0.5 * end, &Hold(0.0));
        assert!((pair.state().joint_rate(0) - 0.5 * rate).abs() < 1e-3 * rate, "{}", pair.state().joint_rate(0));
        assert!((report.friction_work + 0.75 * start).abs() < 1e-2 * start, "{report:?} of {start:e}");
        pair.advance(0.6 * end, &Hold(0.0));
        let at = pair.state().joint_angle(0);
        pair.advance(10.0, &Hold(0.0));
        assert!(pair.state().joint_rate(0).abs() < 1e-9, "{:e}", pair.state().joint_rate(0));
        assert!((pair.state().joint_angle(0) - at).abs() < 1e-9);
    }
    // A spring pulls at the joint that sticks: it yields when the spring is stronger than the gear.
    let pd = ControllerConfig { kp: 1.0, kd: 0.0, ..ControllerConfig::default() };
    for (reference, moves) in [(0.049, false), (0.051, true)] {
        let mut pair = pair(motor, &pd, 0.0, &implicit(1e-3, 2));
        pair.advance(1.0, &Hold(reference));
        let angle = pair.state().joint_angle(0);
        assert!(if moves { angle > 1e-4 } else { angle.abs() < 1e-9 }, "{reference}: {angle:e}");
    }
}

/// The damping d of a gear slows a joint without drive as exp(-t d / I), and takes its energy.
#[test]
fn the_damping_of_a_gear_slows_a_joint_exponentially() {
    let motor = Motor { gear_damping: 0.01, ..Motor::default() };
    let mut pair = pair(motor, &LIMP, 0.3, &implicit(1e-4, 2));
    let start = pair.kinetic_energy();
    let report = pair.advance(PAIR / motor.gear_damping, &Hold(0.0));
    let ratio = pair.state().joint_rate(0) / 0.3;
    assert!((ratio - f64::exp(-1.0)).abs() < 1e-5, "{ratio}");
    let lost = start - pair.kinetic_energy();
    assert!((report.friction_work + lost).abs() < 1e-5 * start, "{report:?}, {lost:e} of {start:e}");
}

#[test]
fn work_goes_into_links_rotors_and_friction() {
    work_of_motors_goes_into_links_rotors_and_friction::<Planar>(&[4e-3, 2e-3, 1e-3], &[0.0; 10]);
}

/// Stages with motors and backlash: two methods agree within their duality gaps, the certificate accepts both, and finds
/// an impulse off its law.
#[test]
fn stages_with_motors_are_solved_alike_by_two_methods() {
    let mut random = Random::new(77);
    let (mut on_line, mut stuck, mut left_to_fallback, mut worst) = (0, 0, 0, 0.0_f64);
    for case in 0..300 {
        let kind = Kind {
            links: [2, 5, 11][case % 3],
            contacts: [0, 3][(case / 3) % 2],
            stiff: case.is_multiple_of(2),
            limited: case % 4 < 2,
            friction: true,
            mass_ratio: 10.0,
            orthotropy: 30.0,
        };
        let mut stage = dense::random_stage(kind, &mut random);
        with_motors(&mut stage, case % 5 == 0, &mut random);
        let (mut ours, mut theirs) = (StageSolution::cold(&stage), StageSolution::cold(&stage));
        // From nothing the fallback takes the interior point method.
        ours.twist.fill(Twist::repeat(f64::NAN));
        let closing = Fallback::new(stage.links.len()).solve_hard(&stage, &mut ours, 1e-9).1;
        assert_eq!(closing, SolveStatus::Solved, "case {case}: {:?}", certify(&stage, &ours));
        if !Newton::new(stage.links.len()).solve_one(&stage, &mut theirs, 1e-9, 500).converged {
            left_to_fallback += 1;
            continue;
        }
        let d = dense::stacked(&ours.twist) - dense::stacked(&theirs.twist);
        let distance = (0.5 * d.dot(&(dense::mass_matrix(&stage) * &d))).sqrt();
        let gaps: f64 = [&ours, &theirs].iter().map(|solution| certify(&stage, solution).gap.sqrt()).sum();
        assert!(distance <= gaps + 1e-7, "case {case}: {distance:e} against {gaps:e}");
        worst = worst.max(certify(&stage, &theirs).residual());
        for (j, motor) in stage.motors.iter().enumerate() {
            let rate = theirs.twist[j + 1].z - theirs.twist[j].z;
            let line = (motor.stall - motor.fall * rate.abs()).max(0.0);
            let drives = theirs.actuator[j] * rate > 0.0;
            on_line += usize::from(drives && line > 0.0 && (theirs.actuator[j].abs() - line).abs() < 1e-12);
            stuck += usize::from(theirs.gear[j].abs() < 0.99 * motor.friction && rate.abs() < 1e-8);
            let (mut first, mut second) = (theirs.clone(), theirs.clone());
            first.actuator[j] += 1e-3;
            second.gear[j] += 1e-3;
            for off in [first, second] {
                assert!(certify(&stage, &off).residual() > 1e-4, "case {case}, joint {j}");
            }
        }
    }
    println!("{on_line} joints on their lines, {stuck} stuck, worst residual {worst:.1e} m/s; {left_to_fallback} left");
    assert!(on_line > 100 && stuck > 30 && worst < 1e-7 && left_to_fallback < 10);
}

fn with_motors(stage: &mut Stage, plays: bool, random: &mut Random) {
    for joint in &mut stage.joints {
        let size = joint.drive.abs() + joint.stiffness;
        let motor = random_motor(size, random);
        joint.limit = joint.limit.min(motor.stall);
        joint.slack = if plays { random.between(0.0, 0.3) * size } else { 0.0 };
        let loose = MotorRow { friction: 0.0, inertia: 0.0, damping: 0.0, ..motor };
        stage.motors.push(if plays { loose } else { motor });
    }
}

/// Among rough pegs, where stages are no optimisation problem.
#[test]
fn motors_go_with_friction_at_obstacles() {
    let motor = Motor { stall_torque: 6.0, no_load_speed: 5.0, rotor_inertia: 5e-4, gear_friction: 0.2, ..motor() };
    let mut scene = table_7_5();
    scene.obstacles.iter_mut().for_each(|peg| peg.friction = 0.4);
    let robot = RobotConfig { motor: Some(motor.into()), ..links(11) };
    let mut robot = build(&robot, &scene, &ControllerConfig::default(), &implicit(5e-3, 2));
    let [x, y, heading] = START_7_5;
    robot.place_chain(x, y, heading, &posture(&Wave::default(), 10));
    let report = robot.advance(3.0, &Wave::default());
    assert!(report.unconverged == 0 && report.residual < 1e-5, "{report:?}");
    let force: Vector3<f64> = robot.body().impulses.contact.iter().sum();
    assert!(force.norm() > 0.1, "pegs must be met");
}
