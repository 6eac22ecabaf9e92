//! Friction radii follow the normal impulses, in forces and tangents alike: how fast and how exactly the solver converges on
//! every kind of friction.

use nalgebra::{Vector2, Vector3};
use snake_core::laws::Skin;
use snake_core::spatial::{Newton, Stage, StageObstacleFriction, StageSolution, certify};
use snake_test_support::planar::Random;

use super::hinge_laws::hinged;
use super::self_contact_stage::fold;
use super::stage::{blank, moving};

const LINKS: usize = 7;
const TRIALS: usize = 30;
const TOLERANCE: f64 = 1e-10;

fn solves(stage: &Stage, solution: &mut StageSolution) -> f64 {
    let outcome = Newton::new(LINKS).solve_one(stage, solution, TOLERANCE, 300);
    assert!(outcome.converged);
    outcome.iterations
}

/// Mean number of linear solves of stages that differ little from one whose solution is the start.
fn solves_near_a_solution(seed: u64, make: impl Fn(&mut Random) -> Stage) -> f64 {
    let mut random = Random::new(seed);
    let mut total = 0.0;
    for _ in 0..TRIALS {
        let mut stage = make(&mut random);
        let mut solution = blank(&stage);
        solves(&stage, &mut solution);
        for link in &mut stage.links {
            link.momentum.linear += link.mass * 1e-4 * Vector3::from_fn(|_, _| random.between(-1.0, 1.0));
        }
        total += solves(&stage, &mut solution);
    }
    total / TRIALS as f64
}

fn rough_ground(random: &mut Random) -> Stage {
    let mut stage = moving(random, LINKS);
    stage.friction.sliding *= 2.0;
    stage
}

fn rough_pegs(random: &mut Random) -> Stage {
    let mut stage = moving(random, LINKS);
    (stage.friction.sliding, stage.friction.rolling) = (Vector2::zeros(), 0.0);
    for contact in &stage.contacts {
        let normal = contact.direction.linear;
        let arm = normal.cross(&contact.direction.angular);
        stage.obstacle_friction.push(StageObstacleFriction::new(&normal, &arm, 0.6));
    }
    stage
}

fn with_skin(random: &mut Random) -> Stage {
    let mut stage = moving(random, LINKS);
    (stage.friction.sliding, stage.friction.skin) = Skin::of([0.1, 0.3], Some(0.2));
    stage
}

fn folded(random: &mut Random) -> Stage {
    let mut stage = moving(random, LINKS);
    fold(&mut stage, 3, random);
    stage
}

/// Bounds lie between what is printed and what it takes without the tangent of any one kind of friction.
#[test]
fn few_solves_end_the_search_close_to_a_solution() {
    let found = [
        ("rough ground", solves_near_a_solution(71, rough_ground), 4.5),
        ("hinges", solves_near_a_solution(72, |random| hinged(random, LINKS)), 4.7),
        ("skin", solves_near_a_solution(73, with_skin), 4.7),
        ("rough pegs", solves_near_a_solution(74, rough_pegs), 3.5),
        ("self-contact", solves_near_a_solution(75, folded), 5.5),
    ];
    for (name, solves, most) in found {
        println!("{name}: {solves:.1} solves");
        assert!(solves < most, "{name}: {solves} solves");
    }
}

/// The rule of the solver is one of step lengths; what it leaves is judged by the certificate. From a cold start, under friction
/// up to twenty times that of the thesis, at pegs and where robots touch themselves.
#[test]
fn what_is_reported_as_solved_obeys_the_laws() {
    const TOLERANCE: f64 = 1e-6;
    let mut random = Random::new(76);
    let (mut solved, mut coarse, mut worst) = (0, 0, 0.0_f64);
    for trial in 0..3000 {
        let mut stage = if trial % 3 == 0 { rough_pegs(&mut random) } else { rough_ground(&mut random) };
        let stronger = [1.0, 4.0, 10.0][trial % 7 % 3];
        (stage.friction.sliding, stage.friction.rolling) =
            (stage.friction.sliding * stronger, stage.friction.rolling * stronger);
        stage.obstacle_friction.iter_mut().for_each(|row| row.coefficient *= stronger);
        if trial % 5 == 0 {
            fold(&mut stage, 2, &mut random);
        }
        let mut solution = blank(&stage);
        if Newton::new(LINKS).solve_one(&stage, &mut solution, TOLERANCE, 100).converged {
            let residual = certify(&stage, &solution).residual() / TOLERANCE;
            (solved, coarse, worst) = (solved + 1, coarse + i32::from(residual > 10.0), worst.max(residual));
        }
    }
    println!("{solved} solved, {coarse} of them to more than ten tolerances, the worst to {worst:.0}");
    assert!(solved > 2900 && coarse < 3 && worst < 30.0);
}
