//! The fallback closes what Newton's method closes, what it does not, and says so where nothing can.

use nalgebra::{Vector2, Vector3};
use snake_core::planar::{
    Fallback, Heading, Newton, Stage, StageContact, StageJoint, StageLink, StageSolution, Twist, certify,
};
use snake_core::solver::SolveStatus;
use snake_test_support::planar::Random;
use snake_test_support::planar_stage::{self as dense, Kind};

fn random(case: usize, random: &mut Random) -> Stage {
    let kind = Kind {
        links: [2, 5, 11][case % 3],
        contacts: [0, 3, 12][(case / 3) % 3],
        stiff: case.is_multiple_of(2),
        limited: case % 4 < 2,
        friction: !case.is_multiple_of(5),
        mass_ratio: 10.0,
        orthotropy: 30.0,
    };
    dense::random_stage(kind, random)
}

/// |u - u*|_M^2 / 2 is below the gap of either solution: their distance is below that of both gaps together.
#[test]
fn the_fallback_and_newton_agree_within_their_duality_gaps() {
    let mut numbers = Random::new(31);
    let (mut compared, mut most, mut worst) = (0, 0, 0.0_f64);
    for case in 0..400 {
        let stage = random(case, &mut numbers);
        let (mut ours, mut theirs) = (StageSolution::cold(&stage), StageSolution::cold(&stage));
        let (solves, closing) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut ours, 1e-9);
        let certificate = certify(&stage, &ours);
        assert_eq!(closing, SolveStatus::Solved, "case {case}: {certificate:?} of {:e} J", stage.energy());
        most = most.max(solves);
        if Newton::new(stage.links.len()).solve_one(&stage, &mut theirs, 1e-9, 500).converged {
            let d = dense::stacked(&ours.twist) - dense::stacked(&theirs.twist);
            let distance = 0.5 * d.dot(&(dense::mass_matrix(&stage) * &d));
            let gaps: f64 = [&ours, &theirs].iter().map(|solution| certify(&stage, solution).gap.sqrt()).sum();
            // Round-off of velocities of 1 m/s leaves 1e-15 J.
            assert!(distance.sqrt() <= gaps + 1e-7, "case {case}: {distance:e} against {gaps:e}");
            worst = worst.max(distance);
            compared += 1;
        }
    }
    println!("{compared} compared, farthest {worst:.1e} J; at most {most} linear solves");
    assert!(compared > 380 && most < 200);
}

/// What a solution holds before, numbers or not, is of no importance.
#[test]
fn the_fallback_starts_from_anything() {
    let mut numbers = Random::new(32);
    for case in 0..20 {
        let stage = random(case, &mut numbers);
        let (mut clean, mut dirty) = (StageSolution::cold(&stage), StageSolution::cold(&stage));
        dirty.twist.fill(Twist::repeat(f64::NAN));
        dirty.friction.fill(Vector2::repeat(f64::INFINITY));
        dirty.contact.fill(f64::NAN);
        let mut fallback = Fallback::new(stage.links.len());
        assert_eq!(fallback.solve_hard(&stage, &mut clean, 1e-8).1, SolveStatus::Solved);
        assert_eq!(fallback.solve_hard(&stage, &mut dirty, 1e-8).1, SolveStatus::Solved);
        let distance = (dense::stacked(&clean.twist) - dense::stacked(&dirty.twist)).norm();
        // Both are within some tolerances of the exact velocity, angular ones 1 / (half a length) times farther.
        assert!(distance < 1e-5, "case {case}: {distance:e}");
    }
}

/// A tolerance below round-off is out of reach: neither the relaxed stage nor any other attempt may leave more than before.
#[test]
fn a_fallback_that_fails_ends_no_worse_than_it_began() {
    let mut numbers = Random::new(33);
    for case in 0..100 {
        let stage = random(case, &mut numbers);
        let mut solution = StageSolution::cold(&stage);
        Newton::new(stage.links.len()).solve_one(&stage, &mut solution, 1e-9, 500);
        let before = certify(&stage, &solution).residual();
        let (_, status) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut solution, 1e-20);
        let after = certify(&stage, &solution).residual();
        assert!(status != SolveStatus::Unsolved || after <= before, "case {case}: {before:e} to {after:e}");
    }
}

/// Two links at rest, their friction strong, pressed by two contacts from opposite sides.
fn pinched(offset: f64) -> Stage {
    let link = StageLink {
        heading: Heading { cos: 1.0, sin: 0.0 },
        reference: Twist::zeros(),
        mass: 0.7,
        inertia: 1e-3,
        half_length: 0.06,
        cg_offset: 0.0,
        friction: Vector2::new(0.01, 0.01),
    };
    let contact = |side: f64| StageContact { link: 0, direction: Vector3::new(0.0, side, 0.01 * side), offset };
    Stage {
        coefficient: 0.01,
        skin: None,
        spins: Vec::new(),
        links: vec![link; 2],
        joints: vec![StageJoint { drive: 0.0, stiffness: 0.1, limit: 1.0, slack: 0.0 }],
        contacts: vec![contact(1.0), contact(-1.0)],
        motors: Vec::new(),
        stops: Vec::new(),
        obstacle_friction: Vec::new(),
        pairs: Vec::new(),
        pair_friction: Vec::new(),
    }
}

/// No velocity moves a link away from both sides. The penetration stays, the impulses stay small, and the
/// certificate of the stage as it was asked for tells of the opening that did not happen.
#[test]
fn contacts_that_contradict_each_other_are_relaxed_and_reported() {
    let stage = pinched(-0.2);
    let mut solution = StageSolution::cold(&stage);
    let (_, closing) = Fallback::new(2).solve_hard(&stage, &mut solution, 1e-8);
    assert_eq!(closing, SolveStatus::Relaxed);
    assert!(solution.twist.iter().all(|u| u.norm() < 1e-6), "{:?}", solution.twist);
    // The contacts may press against each other, but not more than friction could.
    assert!(solution.contact.iter().all(|&impulse| impulse < 0.01), "{:?}", solution.contact);
    let residual = certify(&stage, &solution).residual();
    assert!((residual - 0.2).abs() < 1e-6, "the missing opening of 0.2 m/s, not {residual}");
}

/// With the smallest play between them the same contacts are an ordinary stage.
#[test]
fn contacts_that_leave_no_room_close_exactly() {
    for offset in [0.0, 1e-12, 1e-3] {
        let mut stage = pinched(offset);
        stage.links.iter_mut().for_each(|link| link.reference = Twist::new(0.3, 1.0, 0.0));
        let mut solution = StageSolution::cold(&stage);
        let (_, closing) = Fallback::new(2).solve_hard(&stage, &mut solution, 1e-8);
        assert_eq!(closing, SolveStatus::Solved, "offset {offset:e}");
        let across = solution.twist[0].y + 0.01 * solution.twist[0].z;
        assert!((across.abs() - offset).abs() < 1e-8, "offset {offset:e}: moves at {across:e} m/s");
    }
}
