//! Friction radii at the end of a step are foreseen: how fast the solver converges on every kind of friction.

use nalgebra::{Vector2, Vector3};
use snake_core::laws::Skin;
use snake_core::spatial::{Newton, Stage, StageObstacleFriction, StageSolution};
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
        let mut solution =
            StageSolution { obstacle_friction: vec![Vector2::zeros(); stage.obstacle_friction.len()], ..blank(&stage) };
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

/// Bounds lie between what is printed and what it takes where steps foresee no radii.
#[test]
fn few_solves_end_the_search_close_to_a_solution() {
    let found = [
        ("rough ground", solves_near_a_solution(71, rough_ground), 11.0),
        ("hinges", solves_near_a_solution(72, |random| hinged(random, LINKS)), 9.0),
        ("skin", solves_near_a_solution(73, with_skin), 8.4),
        ("rough pegs", solves_near_a_solution(74, rough_pegs), 6.5),
        ("self-contact", solves_near_a_solution(75, folded), 12.5),
    ];
    for (name, solves, most) in found {
        println!("{name}: {solves:.1} solves");
        assert!(solves < most, "{name}: {solves} solves");
    }
}
