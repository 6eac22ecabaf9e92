//! Hard stage problems, saved from simulations, that every solver must close.
//!
//! `snake-stress --dump FOLDER` writes such files. Those in which contacts contradict each other (the robot is
//! squeezed from both sides and asked to open both) have no solution; the fallback must say so.

use snake_core::planar::{Fallback, InteriorPoint, Newton, Stage, StageSolution, certify};
use snake_core::rows::SavedStage;
use snake_core::solver::SolveStatus;
use snake_test_support::golden::{
    CONTRADICTORY, Golden, RELATIVE_GAP, TOLERANCE, closed_by_fallback, disagreement, golden, solvable,
};
use snake_test_support::planar_stage as dense;

#[test]
fn a_saved_stage_is_read_exactly_as_it_was_written() {
    for Golden { name, stage } in golden() {
        let written = serde_json::to_string(&SavedStage { name, stage: &stage }).unwrap();
        assert_eq!(serde_json::from_str::<SavedStage<Stage>>(&written).unwrap().stage, stage);
    }
}

/// What a simulation does: Newton's method, and the fallback where it does not arrive.
#[test]
fn every_golden_stage_is_closed_by_newton_or_the_fallback() {
    for Golden { name, stage } in solvable() {
        let mut solution = StageSolution::cold(&stage);
        let newton = Newton::new(stage.links.len()).solve_one(&stage, &mut solution, TOLERANCE, 200);
        let alone = certify(&stage, &solution).gap / stage.energy();
        let (solves, closing) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut solution, TOLERANCE);
        let certificate = certify(&stage, &solution);
        let gap = certificate.gap / stage.energy();
        println!(
            "{name}: Newton {} after {}, gap {alone:.0e}; fallback {solves} more, gap {gap:.0e}, residual {:.0e} m/s",
            if newton.converged { "arrives" } else { "gives up" },
            newton.iterations,
            certificate.residual()
        );
        assert_eq!(closing, SolveStatus::Solved, "{name}");
        assert!(gap < RELATIVE_GAP && certificate.residual() < 100.0 * TOLERANCE, "{name}: {certificate:?}");
    }
}

/// The interior point method alone, from nothing and without a polish.
#[test]
fn every_golden_stage_is_closed_by_the_interior_point_method() {
    for golden in solvable() {
        let stage = &golden.stage;
        let mut solution = StageSolution::cold(stage);
        let descent = InteriorPoint::new(stage.links.len()).solve(stage, &mut solution, TOLERANCE);
        let certificate = certify(stage, &solution);
        let gap = certificate.gap / stage.energy();
        println!("{}: {} linear solves, gap {gap:.0e}", golden.name, descent.solves);
        assert!(gap < RELATIVE_GAP && descent.solves <= 400, "{}: {certificate:?}", golden.name);
        let polished = closed_by_fallback(&golden);
        let certificates = [certificate, certify(stage, &polished)];
        assert!(disagreement(stage, &solution.twist, &polished.twist, &certificates) <= 1.0, "{}", golden.name);
    }
}

/// Full matrices and block Gauss-Seidel, which share no line with the solvers; `None` where it creeps.
#[test]
fn dense_gauss_seidel_finds_the_same_velocities_where_it_arrives() {
    let mut arrived = Vec::new();
    for golden in solvable().filter(|golden| golden.stage.links.len() <= 20) {
        let Some(twist) = dense::solve(&golden.stage, 1e-11) else { continue };
        let solution = closed_by_fallback(&golden);
        let certificate = certify(&golden.stage, &solution);
        let apart = disagreement(&golden.stage, &twist, &solution.twist, &[certificate, certificate]);
        println!("{}: {apart:.1e} of what the gaps admit", golden.name);
        assert!(apart <= 1.0, "{}: {apart}", golden.name);
        arrived.push(golden.name);
    }
    println!("arrived: {arrived:?}");
    assert!(arrived.len() >= 4);
}

#[test]
fn contradictory_stages_are_relaxed() {
    for golden in golden().into_iter().filter(|golden| CONTRADICTORY.contains(&golden.name.as_str())) {
        let stage = &golden.stage;
        let mut solution = StageSolution::cold(stage);
        let newton = Newton::new(stage.links.len()).solve_one(stage, &mut solution, TOLERANCE, 200);
        assert!(!newton.converged, "{}", golden.name);
        let (solves, closing) = Fallback::new(stage.links.len()).solve_hard(stage, &mut solution, TOLERANCE);
        assert_eq!(closing, SolveStatus::Relaxed, "{}", golden.name);
        let mut eased = stage.clone();
        eased.contacts.iter_mut().for_each(|contact| contact.offset = contact.offset.max(0.0));
        let certificate = certify(&eased, &solution);
        println!("{}: {solves} linear solves, {certificate:?}", golden.name);
        assert!(certificate.residual() < 100.0 * TOLERANCE, "{}: {certificate:?}", golden.name);
    }
}
