//! Backlash of the joints: what a robot does within it, at its ends, and beyond.

use std::f64::consts::FRAC_PI_2;

use snake_core::control::{ControlLaw, ControllerConfig};
use snake_core::gait::{JointTarget, Reference, Wave};
use snake_core::laws::Stribeck;
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Fallback, Fleet, Newton, PlanarState, PlanarSystem, Scripted, StageSolution, Twist, certify};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Peg, START_7_5, Scene, SceneConfig, TABLE_7_5};
use snake_core::simulation::PlanarSimulation;
use snake_core::solver::SolveStatus;
use snake_core::stepping::{ImplicitConfig, PlantParameters};
use snake_test_support::planar::{Hold, LIMP, Random, build, ground, implicit, links, swinging_pair, uneven_joints};
use snake_test_support::planar_stage::{self as dense, Kind};

/// Four degrees from end to end.
const PLAY: f64 = 4.0 * std::f64::consts::PI / 180.0;

fn loose(count: usize) -> RobotConfig {
    RobotConfig { backlash: PLAY.into(), ..links(count) }
}

/// The implicit methods, with steps that resolve what a motor does.
fn fine_schemes() -> [(&'static str, ImplicitConfig); 2] {
    [("implicit 1", implicit(1e-5, 1)), ("implicit 2", implicit(2e-5, 2))]
}

/// Inside the play no torque passes: the motion is that of a robot without motors, bit for bit, until the end is
/// reached.
#[test]
fn within_its_play_a_joint_swings_as_if_there_were_no_motor() {
    let rate = 1.0;
    for scheme in [implicit(1e-3, 1), implicit(1e-3, 2)] {
        let mut loose = swinging_pair(&loose(2), &ControllerConfig::default(), rate, &scheme);
        let mut limp = swinging_pair(&links(2), &LIMP, rate, &scheme);
        let within = (0.5 * PLAY / rate / 1e-3) as usize - 1;
        for _ in 0..within {
            loose.advance(1e-3, &Hold(0.0));
            limp.advance(1e-3, &Hold(0.0));
            assert_eq!(loose.state(), limp.state());
            assert_eq!(loose.joint_torque(), [0.0]);
        }
        loose.advance(5e-3, &Hold(0.0));
        assert!(loose.state().joint_rate(0) < 0.9 * rate, "the end of the play must be felt");
    }
}

/// At the end of its play a joint of inertia I = Theta / 2 meets spring and damper of its motor: I x'' = -k_P x - k_D
/// x' until the torque, which can only push, vanishes. With the roots l_1, l_2 that is at t = 2 ln(l_2 / l_1) / (l_1 -
/// l_2), and the joint leaves with (l_1 e^(l_1 t) - l_2 e^(l_2 t)) / (l_1 - l_2) of its rate: thrown back at 8.6 % for
/// the thesis's gains.
#[test]
fn the_end_of_the_play_throws_a_joint_back_as_its_motor_does() {
    let inertia = 0.5 * 1.32e-3;
    let ControllerConfig { kp, kd, .. } = ControllerConfig::default();
    let root = (kd * kd - 4.0 * kp * inertia).sqrt();
    let (a, b) = ((-kd + root) / (2.0 * inertia), (-kd - root) / (2.0 * inertia));
    let t = 2.0 * (b / a).ln() / (a - b);
    let expected = (a * (a * t).exp() - b * (b * t).exp()) / (a - b);
    assert!((expected + 0.0861).abs() < 1e-4);
    for (name, scheme) in fine_schemes() {
        let mut pair = swinging_pair(&loose(2), &ControllerConfig::default(), 2.0, &scheme);
        pair.advance(0.5 * PLAY / 2.0 + 3.0 * t, &Hold(0.0));
        let ratio = pair.state().joint_rate(0) / 2.0;
        println!("{name}: {ratio:.5}, expected {expected:.5}");
        // The pair bends by 2 degrees, which changes its inertia by a tenth of a percent.
        assert!((ratio - expected).abs() < 2e-3, "{name}: {ratio}");
    }
}

/// With a motor at rest the kinetic energy and that of its spring, k_P phi_m^2 / 2, never grow, however long the steps:
/// the end of the play is inelastic.
#[test]
fn play_never_creates_energy() {
    for kd in [0.0, 0.02, 2.0] {
        for step in [2e-4, 5e-3, 5e-2] {
            let pd = ControllerConfig { kd, ..ControllerConfig::default() };
            let mut pair = swinging_pair(&loose(2), &pd, 3.0, &implicit(step, 1));
            let energy = |pair: &PlanarSimulation| {
                let motor = pair.state().joint_angle(0) - pair.body().warm_start.backlash[0];
                pair.kinetic_energy() + 0.5 * pd.kp * motor * motor
            };
            let (start, mut before) = (energy(&pair), energy(&pair));
            for _ in 0..400 {
                pair.advance(step, &Hold(0.0));
                let now = energy(&pair);
                assert!(now <= before + 1e-12 * start, "k_D {kd}, step {step}: {before:e} then {now:e}");
                before = now;
            }
            println!("k_D {kd}, step {step}: {:.2e} of the energy left", before / start);
        }
    }
}

/// The two-stage scheme extrapolates over the ends of the play, so a step may create energy of order h^2 that the next
/// one takes; over a run it is lost all the same.
#[test]
fn a_rattling_joint_comes_to_rest_in_the_two_stage_scheme_too() {
    for step in [2e-4, 5e-3, 5e-2] {
        let mut pair = swinging_pair(&loose(2), &ControllerConfig::default(), 3.0, &implicit(step, 2));
        let start = pair.kinetic_energy();
        let mut most: f64 = 0.0;
        for _ in 0..400 {
            pair.advance(step, &Hold(0.0));
            most = most.max(pair.kinetic_energy());
        }
        let (left, angle) = (pair.kinetic_energy() / start, pair.state().joint_angle(0));
        println!("step {step}: at most {:.3}, in the end {left:.1e} of the energy, at {angle:.4} rad", most / start);
        assert!(most <= 1.0001 * start && left < 0.05 && angle.abs() < 0.6 * PLAY);
    }
}

/// A reference that rises at a constant rate from pi / 2.
struct Ramp(f64);

impl Reference<JointTarget> for Ramp {
    fn target(&self, _joint: usize, time: f64) -> JointTarget {
        JointTarget { angle: FRAC_PI_2 + self.0 * time, rate: self.0, acceleration: 0.0 }
    }
}

/// mu m g L / 2, the friction at the CGs of a bent pair per sin(phi / 2) (see friction_laws.rs).
const FRICTION: f64 = 0.2 * (7.5 / 11.0) * 9.81 * 0.5 * 0.122;

/// A pair on the ground hangs at the end of its play: it starts once the reference is ahead by half the play and by
/// T(phi) / k_P, and lags by that from then on, to either side.
#[test]
fn a_loaded_joint_lags_by_half_its_play_and_the_load_over_the_gain() {
    let pd = ControllerConfig { kp: 5.0, kd: 0.1, ..ControllerConfig::default() };
    for rate in [0.1, -0.1] {
        for (name, scheme) in [("implicit 1", implicit(2e-3, 1)), ("implicit 2", implicit(2e-3, 2))] {
            let unlimited = RobotConfig { joint_limit: Some(f64::INFINITY.into()), ..loose(2) };
            let mut pair = build(&unlimited, &ground([0.2, 0.2]), &pd, &scheme);
            pair.place_chain(0.0, 0.0, 0.0, &[FRAC_PI_2]);
            let load = |phi: f64| FRICTION * (0.5 * phi).sin();
            let lead = 0.5 * PLAY + (load(FRAC_PI_2) - pd.kd * 0.1) / pd.kp;
            let starts = lead / 0.1;
            pair.advance(starts - 0.01, &Ramp(rate));
            assert!((pair.state().joint_angle(0) - FRAC_PI_2).abs() < 1e-7, "{name}: before its time");
            pair.advance(1.0, &Ramp(rate));
            let phi = pair.state().joint_angle(0);
            let lag = (FRAC_PI_2 + rate * pair.state().time - phi).abs();
            let expected = 0.5 * PLAY + load(phi) / pd.kp;
            println!("{name}: lags by {lag:.5} rad, expected {expected:.5}");
            // The load changes by cot(phi / 2) / 2 of itself a radian: 1e-4 rad a tenth of a radian.
            assert!((lag - expected).abs() < 1e-4, "{name}");
        }
    }
}

/// |D| <= tau_max and |phi - phi_m| <= d / 2, whatever the step; torque passes at the ends alone.
#[test]
fn play_and_torque_stay_within_their_limits_and_torque_takes_contact() {
    for step in [1e-3, 1e-2, 5e-2] {
        for order in [1, 2] {
            let pd = ControllerConfig { torque_limit: Some(1.5), ..ControllerConfig::default() };
            let mut robot = build(&loose(6), &ground([0.2, 0.5]), &pd, &implicit(step, order));
            let (mut saturated, mut free) = (0, 0);
            for k in 0..200 {
                let report = robot.advance(step, &Hold(if (k / 20) % 2 == 0 { 0.5 } else { -0.5 }));
                assert!(!report.diverged && report.residual < 1e-8, "order {order}, h {step}, step {k}: {report:?}");
                for (torque, e) in robot.joint_torque().iter().zip(&robot.body().warm_start.backlash) {
                    assert!(torque.abs() <= 1.5 * (1.0 + 1e-14) && e.abs() <= 0.5 * PLAY * (1.0 + 1e-12));
                    // The thesis's sign: a positive tau_C drives phi down, from the upper end of the play.
                    assert!(*torque == 0.0 || (e * torque.signum() - 0.5 * PLAY).abs() < 1e-12, "{torque} at {e}");
                    saturated += u32::from(torque.abs() > 1.499);
                    free += u32::from(*torque == 0.0);
                }
            }
            assert!(saturated > 10 && free > 10, "{saturated} {free}: both must come about");
        }
    }
}

/// Newton's method, the fallback and full matrices find the same velocity of a stage with play.
#[test]
fn all_solvers_agree_on_stages_with_play() {
    let mut random = Random::new(71);
    let (mut compared, mut swallowed) = (0, 0);
    for case in 0..200 {
        let kind = Kind {
            links: [2, 5, 8][case % 3],
            contacts: [0, 2, 4][(case / 3) % 3],
            stiff: true,
            limited: case % 4 < 2,
            friction: !case.is_multiple_of(5),
            mass_ratio: 3.0,
            orthotropy: 3.0,
        };
        let mut stage = dense::random_stage(kind, &mut random);
        dense::loosen(&mut stage, &mut random);
        let mut ours = StageSolution::cold(&stage);
        let mut theirs = ours.clone();
        theirs.twist.fill(Twist::repeat(f64::NAN));
        let newton = Newton::new(kind.links).solve_one(&stage, &mut ours, 1e-9, 500);
        assert_eq!(
            Fallback::new(kind.links).solve_hard(&stage, &mut theirs, 1e-9).1,
            SolveStatus::Solved,
            "case {case}"
        );
        if !newton.converged {
            continue;
        }
        let gaps = certify(&stage, &ours).gap.sqrt() + certify(&stage, &theirs).gap.sqrt();
        let distance = |a: &[Twist], b: &[Twist]| {
            let d = dense::stacked(a) - dense::stacked(b);
            (0.5 * d.dot(&(dense::mass_matrix(&stage) * &d))).sqrt()
        };
        let apart = distance(&ours.twist, &theirs.twist);
        assert!(apart <= gaps + 1e-7, "case {case}: {apart:e} against {gaps:e}");
        if let Some(slow) = dense::solve(&stage, 1e-11) {
            assert!(distance(&ours.twist, &slow) < 1e-6, "case {case}");
            compared += 1;
        }
        swallowed += ours.actuator.iter().filter(|&&drive| drive == 0.0).count();
    }
    println!("{compared} compared with full matrices, {swallowed} drives swallowed");
    assert!(compared > 100 && swallowed > 50);
}

/// Robots with and without play, each with its own.
fn crowd(system: &PlanarSystem, count: usize) -> Vec<Scripted<Wave>> {
    let one = |k: usize| {
        let pegs: Vec<Peg> = TABLE_7_5.iter().take(k % 8).map(|&peg| peg.into()).collect();
        let wave = Wave { omega: 1.0 + 0.2 * k as f64, ..Wave::default() };
        let angles = snake_test_support::planar::posture(&wave, 10);
        let mut robot = Scripted::new(&system.robot, ObstacleGrid::new(&pegs), START_7_5, &angles, wave);
        robot.body.parameters = PlantParameters { backlash: 0.02 * (k % 4) as f64, ..PlantParameters::default() };
        robot
    };
    (0..count).map(one).collect()
}

fn run(system: &PlanarSystem, robots: &mut [Scripted<Wave>], width: usize) -> Vec<PlanarState> {
    let mut fleet = Fleet::new(ImplicitConfig::default(), system, width);
    for _ in 0..20 {
        fleet.advance(system, robots.iter_mut().map(Scripted::driven), 0.05);
    }
    robots.iter().map(|robot| robot.body.state.clone()).collect()
}

/// In lanes a robot moves as alone, bit for bit; one without play as if nobody had any.
#[test]
fn neighbours_with_play_do_not_matter() {
    let pd = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    let scene = Scene::new(&ground([0.2, 0.2])).unwrap();
    let system = PlanarSystem::new(Robot::new(&uneven_joints(10)).unwrap(), &scene, pd).unwrap();
    let together = run(&system, &mut crowd(&system, 11), 13);
    for (k, among_others) in together.iter().enumerate() {
        let mut one = crowd(&system, 11).swap_remove(k);
        let alone = run(&system, std::slice::from_mut(&mut one), 1).remove(0);
        assert_eq!(*among_others, alone, "robot {k}");
        let mut tight = crowd(&system, 11).swap_remove(k);
        tight.body.parameters = PlantParameters::default();
        let tight = run(&system, std::slice::from_mut(&mut tight), 1).remove(0);
        assert_eq!(tight == alone, k % 4 == 0, "robot {k}: play must show, and only where there is some");
    }
}

/// Where a joint stands in its play is part of the state.
#[test]
fn a_restored_robot_goes_on_bit_for_bit() {
    let course = || {
        build(
            &loose(11),
            &snake_test_support::planar::table_7_5(),
            &ControllerConfig::default(),
            &ImplicitConfig::default(),
        )
    };
    let mut first = course();
    first.place_chain(
        START_7_5[0],
        START_7_5[1],
        START_7_5[2],
        &snake_test_support::planar::posture(&Wave::default(), 10),
    );
    first.advance(0.5, &Wave::default());
    let mut second = course();
    second.restore(&first.snapshot());
    first.advance(0.5, &Wave::default());
    second.advance(0.5, &Wave::default());
    assert_eq!(first.state(), second.state());
}

/// Five degrees of play and friction that loses three tenths at 2 cm/s: steps of 25 ms follow those of 1 ms. Kinks at
/// the ends of the play and where links come to rest leave more than smooth motion does.
#[test]
fn long_steps_follow_short_ones() {
    let stribeck = Stribeck { drop: 0.3, speed: 0.02 };
    let robot = RobotConfig { backlash: 5f64.to_radians().into(), ..RobotConfig::default() };
    let course = SceneConfig { stribeck, ..snake_test_support::planar::table_7_5() };
    let open = SceneConfig { friction: [0.2, 0.5], stribeck, ..SceneConfig::default() };
    for (name, scene, start) in
        [("course", course, START_7_5), ("open ground", open, snake_test_support::planar::START_FREE)]
    {
        let end = |scheme: ImplicitConfig| {
            let mut aiko = build(&robot, &scene, &ControllerConfig::default(), &scheme);
            aiko.place_chain(start[0], start[1], start[2], &snake_test_support::planar::posture(&Wave::default(), 10));
            let report = aiko.advance(5.0, &Wave::default());
            assert_eq!(report.unconverged, 0, "{name}: {report:?}");
            aiko.state().pose[5].xy()
        };
        let fine = end(implicit(1e-3, 2));
        let error = (end(ImplicitConfig::default()) - fine).norm();
        println!("{name}: {:.3} mm", 1e3 * error);
        assert!(error < 5e-4, "{name}: {error:e}");
    }
}

/// An input-output linearising controller has no motor angle.
#[test]
fn backlash_is_refused_where_unsupported() {
    let io = ControllerConfig { law: ControlLaw::Io, ..ControllerConfig::default() };
    let refused = PlanarSimulation::new(&loose(4), &ground([0.2, 0.2]), &io, &ImplicitConfig::default());
    assert_eq!(refused.unwrap_err().field, "robot.backlash");
    for play in [-0.1, 2.0, f64::NAN] {
        let error = Robot::new(&RobotConfig { backlash: play.into(), ..RobotConfig::default() }).unwrap_err();
        assert_eq!(error.field, "backlash");
    }
}
