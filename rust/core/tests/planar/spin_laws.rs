//! Ground that resists the spin of links.

use snake_core::control::ControllerConfig;
use snake_core::planar::{Fallback, Newton, StageSolution, Twist, certify};
use snake_core::robot::RobotConfig;
use snake_core::scene::SceneConfig;
use snake_core::solver::SolveStatus;
use snake_test_support::planar::{Hold, LIMP, Random, build, ground, implicit, links, moving_chain};
use snake_test_support::planar_stage::{Kind, random_stage};

const MU: f64 = 0.3;
const RADIUS: f64 = 0.04;

/// Links that slide freely across themselves: only discs resist that they turn, as far as they slide along.
fn scene() -> SceneConfig {
    SceneConfig { spin_friction: RADIUS, ..ground([MU, 0.0]) }
}

/// `2/3 mu m g R <|sin|>`.
fn torque(robot: &RobotConfig) -> f64 {
    2.0 / 3.0 * MU * (7.5 / 11.0) * robot.gravity * RADIUS * std::f64::consts::FRAC_2_PI
}

/// A straight pair that turns about its middle as one body: `2 (Theta + m L^2 / 4) omega' = -2 T` until it stops.
#[test]
fn a_turning_pair_stops_when_the_closed_form_says() {
    let robot = links(2);
    let inertia = 1.32e-3 + 7.5 / 11.0 * 0.061 * 0.061;
    let (omega, deceleration) = (2.0, torque(&robot) / inertia);
    let stop = omega / deceleration;
    for (step, order) in [(1e-3, 1), (1e-3, 2), (2e-3, 2)] {
        let mut pair = build(&robot, &scene(), &LIMP, &implicit(step, order));
        pair.place_chain(0.0, 0.0, 0.4, &[0.0]);
        let across = Twist::new(0.4_f64.sin(), -(0.4_f64.cos()), 0.0) * (0.061 * omega);
        let head = across + Twist::new(0.0, 0.0, omega);
        let state = moving_chain(pair.robot(), &pair.state().pose, head, &[omega]);
        pair.place(&state);
        for share in [0.25, 0.5, 0.9] {
            let report = pair.advance(share * stop - pair.state().time, &Hold(0.0));
            assert_eq!(report.unconverged, 0);
            let expected = omega * (1.0 - share);
            for u in &pair.state().twist {
                assert!((u.z - expected).abs() < 2e-4 * omega, "order {order}, h {step}: {} of {expected}", u.z);
            }
        }
        pair.advance(1.1 * stop - pair.state().time, &Hold(0.0));
        let turned = pair.state().pose[0].z - 0.4;
        assert!((turned - 0.5 * omega * stop).abs() < 2.0 * omega * step, "{turned}");
        assert!(pair.state().twist.iter().all(|u| u.norm() < 1e-9), "at rest: {:?}", pair.state().twist);
    }
}

/// Below the largest moment nothing turns, above it links do.
#[test]
fn links_at_rest_resist_moments_up_to_the_largest_one() {
    let robot = links(2);
    let pd = ControllerConfig { kp: 1.0, kd: 0.0, ..ControllerConfig::default() };
    for (share, moves) in [(0.5, false), (0.99, false), (1.01, true)] {
        let mut pair = build(&robot, &scene(), &pd, &implicit(5e-3, 2));
        pair.place_chain(0.0, 0.0, 0.0, &[0.0]);
        let report = pair.advance(1.0, &Hold(share * torque(&robot)));
        assert!(report.unconverged == 0 && report.residual < 1e-8, "{report:?}");
        assert_eq!(pair.state().joint_angle(0).abs() > 1e-5, moves, "{share}: {}", pair.state().joint_angle(0));
        assert!(moves || pair.state().twist.iter().all(|u| u.norm() < 1e-12), "{:?}", pair.state().twist);
    }
}

#[test]
fn random_stages_with_spin_friction_are_solved_alike_by_two_methods() {
    let (mut random, mut stuck, mut turning, mut worst) = (Random::new(91), 0, 0, 0.0_f64);
    for trial in 0..200 {
        let (links, mass_ratio) = (2 + trial % 10, [1.0, 10.0][trial % 2]);
        let (stiff, limited, friction) = (trial % 3 > 0, trial % 5 == 0, trial % 7 > 0);
        let kind = Kind { links, contacts: trial % 4, stiff, limited, friction, mass_ratio, orthotropy: 3.0 };
        let mut stage = random_stage(kind, &mut random);
        let bound = |mass: f64, random: &mut Random| 0.2 * mass * 9.81 * stage.coefficient * random.between(0.0, 0.05);
        stage.spins = stage.links.iter().map(|link| bound(link.mass, &mut random)).collect();
        let mut ours = StageSolution::cold(&stage);
        let mut theirs = ours.clone();
        assert!(Newton::new(links).solve_one(&stage, &mut ours, 1e-9, 300).converged, "trial {trial}");
        let (_, status) = Fallback::new(links).solve_hard(&stage, &mut theirs, 1e-9);
        assert_eq!(status, SolveStatus::Solved, "trial {trial}");
        for (u, v) in ours.twist.iter().zip(&theirs.twist) {
            assert!(
                (u - v).norm() < 1e-6,
                "trial {trial}: {:?}, {:?}",
                certify(&stage, &ours),
                certify(&stage, &theirs)
            );
        }
        worst = worst.max(certify(&stage, &ours).residual()).max(certify(&stage, &theirs).residual());
        for (link, bound) in stage.spins.iter().enumerate() {
            let holds = ours.spin[link].abs() < 0.99 * bound;
            (stuck, turning) = (stuck + u32::from(holds), turning + u32::from(!holds));
            let mut off = ours.clone();
            off.spin[link] += 1e-4;
            assert!(certify(&stage, &off).residual() > 1e-5, "trial {trial}, link {link}");
        }
    }
    println!("{stuck} links stick, {turning} turn, residuals to {worst:.1e} m/s");
    assert!(stuck > 100 && turning > 100 && worst < 1e-7, "{stuck} {turning} {worst}");
}
