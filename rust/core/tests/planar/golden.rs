//! Hard stage problems, saved from simulations, that every solver must close.
//!
//! `snake-stress --dump FOLDER` writes such files. Those in which contacts contradict each other (the robot is
//! squeezed from both sides and asked to open both) have no solution; the fallback must say so.

use std::path::Path;

use snake_core::planar::{
    Answer, Certificate, Fallback, InteriorPoint, ModifiedNewton, Newton, Penalties, Problem, Stage, StageSolution,
    Twist, certify,
};
use snake_core::solver::SolveStatus;
use snake_test_support::planar_stage as dense;

const CONTRADICTORY: [&str; 3] = ["deep", "impact", "wedge"];

/// \[m/s\]
const TOLERANCE: f64 = 1e-10;

/// Duality gap of a solution over the energies of its stage.
const RELATIVE_GAP: f64 = 1e-10;

struct Golden {
    name: String,
    stage: Stage,
}

/// The files, and two stages too large for one: 200 links, and 200 links with 100 contacts.
fn golden() -> Vec<Golden> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let mut all: Vec<Golden> = paths
        .iter()
        .map(|path| {
            let problem: Problem = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            Golden { name, stage: problem.stage().unwrap() }
        })
        .collect();
    for contacts in [0, 100] {
        let kind = dense::Kind {
            links: 200,
            contacts,
            stiff: true,
            limited: true,
            friction: true,
            mass_ratio: 1.0,
            orthotropy: 3.0,
        };
        let stage = dense::random_stage(kind, &mut snake_test_support::planar::Random::new(200 + contacts as u64));
        all.push(Golden { name: format!("200 links, {contacts} contacts"), stage });
    }
    all
}

fn solvable() -> impl Iterator<Item = Golden> {
    golden().into_iter().filter(|golden| !CONTRADICTORY.contains(&golden.name.as_str()))
}

fn cold(stage: &Stage) -> StageSolution {
    let mut solution = StageSolution::new(stage.links.len());
    solution.contact.resize(stage.contacts.len(), 0.0);
    solution
}

fn closed_by_fallback(golden: &Golden) -> StageSolution {
    let mut solution = cold(&golden.stage);
    let (_, closing) = Fallback::new(golden.stage.links.len()).solve_hard(&golden.stage, &mut solution, TOLERANCE);
    assert_eq!(closing, SolveStatus::Solved, "{}: {:?}", golden.name, certify(&golden.stage, &solution));
    solution
}

/// Distance of two velocities over what their gaps, or the round-off of the energies, admit: at most 1.
fn disagreement(stage: &Stage, a: &[Twist], b: &[Twist], gaps: &[Certificate]) -> f64 {
    let d = dense::stacked(a) - dense::stacked(b);
    let mass = stage.links.iter().flat_map(|link| [link.mass, link.mass, link.inertia]);
    let distance: f64 = d.iter().zip(mass).map(|(d, m)| 0.5 * m * d * d).sum();
    let admitted: f64 = gaps.iter().map(|certificate| certificate.gap.max(RELATIVE_GAP * stage.energy()).sqrt()).sum();
    distance.sqrt() / admitted
}

#[test]
fn a_problem_file_is_read_exactly_as_it_was_written() {
    for Golden { name, stage } in golden() {
        let solution = cold(&stage);
        let written = serde_json::to_string(&Problem::new(&name, &stage)).unwrap();
        let read = serde_json::from_str::<Problem>(&written).unwrap().stage().unwrap();
        assert_eq!((&read.links, &read.joints, &read.contacts), (&stage.links, &stage.joints, &stage.contacts));
        assert_eq!(read.coefficient.to_bits(), stage.coefficient.to_bits());
        let answer: Answer = serde_json::from_str(&serde_json::to_string(&Answer::from(&solution)).unwrap()).unwrap();
        assert_eq!(StageSolution::from(answer), solution);
    }
}

#[test]
fn a_problem_file_that_is_no_stage_names_the_row() {
    let good = Problem::new("good", &golden()[0].stage);
    let broken = |change: &dyn Fn(&mut Problem)| {
        let mut problem = good.clone();
        change(&mut problem);
        problem.stage().unwrap_err().field
    };
    assert_eq!(broken(&|p| p.links[2].mass = 0.0), "links[2].mass");
    assert_eq!(broken(&|p| p.links[1].heading = [1.0, 1.0]), "links[1].heading");
    assert_eq!(broken(&|p| p.joints[3].limit = Some(-1.0)), "joints[3].limit");
    assert_eq!(broken(&|p| p.contacts[0].link = 11), "contacts[0].link");
    assert_eq!(broken(&|p| p.coefficient = f64::NAN), "coefficient");
    assert_eq!(broken(&|p| p.joints.truncate(3)), "joints");
}

/// What a simulation does: Newton's method, and the fallback where it does not arrive.
#[test]
fn every_golden_stage_is_closed_by_newton_or_the_fallback() {
    for Golden { name, stage } in solvable() {
        let mut solution = cold(&stage);
        let newton = Newton::new(stage.links.len()).solve(&stage, &mut solution, TOLERANCE, 200, true);
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
        let mut solution = cold(stage);
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

/// The stage with its drives frozen at their solution has the same solution, and Algorithm 3.1 can be asked for it. It
/// creeps in jams: what it closes must agree.
#[test]
fn algorithm_3_1_finds_the_same_velocities_where_it_arrives() {
    let mut arrived = Vec::new();
    for golden in solvable().filter(|golden| golden.stage.links.len() <= 20) {
        let solution = closed_by_fallback(&golden);
        let mut frozen = golden.stage.clone();
        for (joint, drive) in frozen.joints.iter_mut().zip(&solution.actuator) {
            (joint.drive, joint.stiffness) = (*drive, 0.0);
        }
        let mut rate = 0.0_f64;
        for contact in &frozen.contacts {
            let link = &frozen.links[contact.link];
            rate = rate.max(2.0 / link.mass + contact.direction.z.powi(2) / link.inertia);
        }
        let lightest = frozen.links.iter().map(|link| link.mass).fold(f64::INFINITY, f64::min);
        let penalties = Penalties { friction: 0.5 * lightest, contact: if rate > 0.0 { 1.0 / rate } else { 1.0 } };
        let mut printed = cold(&frozen);
        ModifiedNewton::new(frozen.links.len()).solve(&frozen, &mut printed, penalties, 1e-13, 300_000);
        let certificates = [certify(&frozen, &printed), certify(&frozen, &solution)];
        let gap = certificates[0].gap / golden.stage.energy();
        println!("{}: gap {gap:.0e}", golden.name);
        if gap < RELATIVE_GAP {
            let apart = disagreement(&frozen, &printed.twist, &solution.twist, &certificates);
            assert!(apart <= 1.0, "{}: {apart}", golden.name);
            arrived.push(golden.name);
        }
    }
    println!("arrived: {arrived:?}");
    assert!(arrived.len() >= 4);
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
        let mut solution = cold(stage);
        let newton = Newton::new(stage.links.len()).solve(stage, &mut solution, TOLERANCE, 200, true);
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
