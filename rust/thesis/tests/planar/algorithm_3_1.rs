//! Algorithm 3.1 against the solvers of the core, which share no line with it.

use snake_core::planar::{Newton, Stage, StageSolution, Twist, certify};
use snake_test_support::golden::{RELATIVE_GAP, closed_by_fallback, disagreement, solvable};
use snake_test_support::planar::Random;
use snake_test_support::planar_stage::{self as dense, Kind};
use snake_thesis::planar::{ModifiedNewton, Penalties};

const KIND: Kind =
    Kind { links: 7, contacts: 2, stiff: false, limited: false, friction: true, mass_ratio: 1.0, orthotropy: 1.0 };

/// A random stage of links with their CGs in the middle, the only ones that the thesis has.
fn random_stage(kind: Kind, random: &mut Random) -> Stage {
    let mut stage = dense::random_stage(kind, random);
    stage.links.iter_mut().for_each(|link| link.cg_offset = 0.0);
    stage
}

/// Algorithm 3.1 (it may stop at its cap: the certificate says how far it came) with r small enough for any stage:
/// 1 / r bounds the largest eigenvalue of W^T M^-1 W, which the joints only lower.
fn algorithm_3_1(stage: &Stage, epsilon: f64) -> StageSolution {
    let mut rate = vec![0.0; stage.links.len()];
    for (rate, link) in rate.iter_mut().zip(&stage.links) {
        *rate = 1.0 / link.mass;
    }
    for contact in &stage.contacts {
        let link = &stage.links[contact.link];
        rate[contact.link] += 1.0 / link.mass + contact.direction.z.powi(2) / link.inertia;
    }
    let r = 1.0 / rate.iter().fold(0.0, |a: f64, &b| a.max(b));
    let mut solution = StageSolution::cold(stage);
    let penalties = Penalties { friction: r, contact: r };
    ModifiedNewton::new(stage.links.len()).solve(stage, &mut solution, penalties, epsilon, 100_000);
    solution
}

#[test]
fn joints_hold_in_the_printed_directions() {
    let mut random = Random::new(12);
    for _ in 0..50 {
        let stage = random_stage(KIND, &mut random);
        let solution = algorithm_3_1(&stage, 1e-10);
        // A few ulps of speeds below 1 m/s, added up along seven links.
        let opening = dense::joint_directions(&stage).transpose() * dense::stacked(&solution.twist);
        assert!(opening.norm() < 1e-13);
    }
}

/// Newton with the sweep and Algorithm 3.1 with block elimination of the joints: velocities agree to the tolerances they
/// are given, a duality gap of 1e-17 J, which a residual of 1e-9 m/s on impulses of 1e-8 N s leaves, is 1e-8 m/s.
#[test]
fn newton_and_algorithm_3_1_find_the_same_velocities() {
    let mut random = Random::new(13);
    let (mut worst, mut finished) = (0.0_f64, 0);
    for links in [2, 3, 5, 8] {
        for case in 0..20 {
            let (contacts, limited, orthotropy) = (case % 4, case % 3 == 0, [1.0, 3.0][case % 2]);
            let kind = Kind { links, contacts, limited, mass_ratio: 3.0, orthotropy, ..KIND };
            let stage = random_stage(kind, &mut random);
            let mut ours = StageSolution::cold(&stage);
            Newton::new(links).solve_one(&stage, &mut ours, 1e-11, 2000);
            let printed = algorithm_3_1(&stage, 1e-13);
            if certify(&stage, &printed).residual() < 1e-11 {
                finished += 1;
                let apart = |(a, b): (&Twist, &Twist)| (a - b).component_mul(&Twist::new(1.0, 1.0, 0.1)).norm();
                worst = ours.twist.iter().zip(&printed.twist).map(apart).fold(worst, f64::max);
            }
        }
    }
    println!("Newton against Algorithm 3.1 {worst:.1e} m/s; finished {finished} of 80");
    assert!(worst < 1e-8 && finished > 60);
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
        let mut printed = StageSolution::cold(&frozen);
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
