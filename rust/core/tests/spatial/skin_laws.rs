//! Friction that differs forward and backward in 3D: deceleration, and stages against a dense solver and the fallback.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::laws::Skin;
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::scene::SceneConfig;
use snake_core::simulation::SpatialSimulation;
use snake_core::solver::{CoupledStage, SolveStatus};
use snake_core::spatial::{CoulombNewton, Fallback, Newton, Pose, Stage, certify, orientation_of, twist_of};
use snake_test_support::planar::{Random, ground};
use snake_test_support::spatial::implicit;
use snake_test_support::spatial_stage::{Dense, stacked};

use crate::stage::{blank, moving};

/// Link 1 is in front: a robot that moves against e_z of its links slides forward.
#[test]
fn a_robot_slides_forward_and_backward_against_its_own_coefficient() {
    let (h, yaw) = (2e-3, 0.3_f64);
    let scene = SceneConfig { friction_backward: Some(0.3), ..ground([0.1, 0.6]) };
    let still = CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) };
    let with = |friction_factor| RobotConfig { friction_factor, ..RobotConfig::default() };
    // Friction below the CGs shifts load from link to link, which their mean leaves out.
    let ends = PerLink::Each([[3.0].as_slice(), &[1.0; 9], &[3.0]].concat());
    for (robot, turn, mu, bound) in [
        (with(PerLink::Same(1.0)), std::f64::consts::PI, 0.1, 1e-6),
        (with(PerLink::Same(1.0)), 0.0, 0.3, 1e-6),
        (with(PerLink::Same(1.7)), 0.0, 0.3 * 1.7, 1e-6),
        (with(ends), 0.0, 0.3 * 15.0 / 11.0, 1e-2),
    ] {
        let pd = ControllerConfig::default();
        let mut simulation = SpatialSimulation::new(&robot, &scene, &pd, &implicit(h, 2)).expect("admissible");
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(yaw, 0.0, 0.0) };
        simulation.place_chain(head, &[Vector2::zeros(); 10]);
        simulation.rest_on_ground();
        let mut state = simulation.state().clone();
        let way = Vector3::new((yaw + turn).cos(), (yaw + turn).sin(), 0.0);
        let moving = twist_of(way * 0.5, Vector3::zeros());
        state.twist.fill(moving);
        simulation.place(&state);
        let speed = |simulation: &SpatialSimulation| simulation.state().twist[5].fixed_rows::<3>(0).dot(&way);
        let report = simulation.advance(0.06, &still);
        assert!(report.unconverged == 0, "{report:?}");
        let expected = 0.5 - mu * 9.81 * 0.06;
        assert!((speed(&simulation) - expected).abs() < bound, "{turn}: {} for {expected}", speed(&simulation));
        simulation.advance(1.0, &still);
        assert!(speed(&simulation).abs() < 1e-6);
    }
}

fn random_stage(random: &mut Random, links: usize, case: usize) -> Stage {
    let mut stage = moving(random, links);
    let along = [[0.1, 0.3], [0.4, 0.1], [0.01, 0.3]][case % 3];
    (stage.friction.sliding, stage.friction.skin) = Skin::of([along[0], 0.5], Some(along[1]));
    stage
}

#[test]
fn newton_and_dense_gauss_seidel_find_the_same_velocities() {
    let mut random = Random::new(61);
    for case in 0..40 {
        let stage = random_stage(&mut random, 2 + case % 4, case);
        let mut solution = blank(&stage);
        let outcome = Newton::new(stage.links.len()).solve_one(&stage, &mut solution, 1e-9, 300);
        assert!(outcome.converged, "case {case}: {:?}", certify(&stage, &solution));
        let apart = (stacked(&solution.twist) - Dense::new(&stage).solve(&stage)).amax();
        assert!(apart < 2e-6, "case {case}: {apart}, {:?}", certify(&stage, &solution));
    }
}

#[test]
fn every_random_stage_is_solved_and_certified_by_lanes_and_by_the_fallback() {
    let (mut random, mut coupled, mut noticed) = (Random::new(67), 0, 0);
    for case in 0..150 {
        let stage = random_stage(&mut random, 11, case);
        let mut fast = blank(&stage);
        let outcome = Newton::new(11).solve_one(&stage, &mut fast, 1e-8, 300);
        let certificate = certify(&stage, &fast);
        assert!(outcome.converged && certificate.residual() < 1e-5, "case {case}: {certificate:?}");
        let mut slow = blank(&stage);
        let (_, status) = Fallback::new(11).solve_hard(&stage, &mut slow, 1e-7, u32::MAX);
        assert_eq!(status, SolveStatus::Solved, "case {case}");
        let mut newton = blank(&stage);
        coupled += u32::from(CoulombNewton::new(11).continuation(&stage, &mut newton, 1e-9, u32::MAX).1);
        for other in [&slow, &newton] {
            let residual = certify(&stage, other).residual();
            let apart = (stacked(&fast.twist) - stacked(&other.twist)).amax();
            assert!(residual > 1e-5 || apart < 1e-4, "case {case}: {apart}");
        }
        let mut symmetric = stage.clone();
        symmetric.friction.skin = None;
        noticed += u32::from(certify(&symmetric, &fast).friction > 1e-5);
    }
    assert!(coupled > 140 && noticed > 100, "{coupled} {noticed}: another law has other forces");
}
