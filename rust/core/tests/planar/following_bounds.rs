//! Bounds of friction at contacts follow the normal impulses, in forces and tangents alike: how fast the solver converges.

use snake_core::planar::{Newton, Stage, StageContact, StageSolution, Twist, certify};
use snake_core::rows::FrictionRow;
use snake_test_support::planar::Random;
use snake_test_support::planar_stage::{self as dense, Kind};

const LINKS: usize = 8;
const TRIALS: usize = 60;
const TOLERANCE: f64 = 1e-9;
const COEFFICIENT: f64 = 0.6;

fn kind(contacts: usize) -> Kind {
    Kind { links: LINKS, contacts, stiff: true, limited: false, friction: true, mass_ratio: 3.0, orthotropy: 2.0 }
}

/// Linear solves, if they solve the stage.
fn solves(stage: &Stage, solution: &mut StageSolution) -> Option<f64> {
    let outcome = Newton::new(LINKS).solve_one(stage, solution, TOLERANCE, 300);
    (outcome.converged && certify(stage, solution).residual() < 1e3 * TOLERANCE).then_some(outcome.iterations)
}

/// Mean number of linear solves of stages that differ little from one whose solution is the start, and how many contacts
/// slip in them. Contacts at random places may contradict each other; such stages are left out.
fn solves_near_a_solution(seed: u64, make: impl Fn(&mut Random) -> Stage) -> (f64, usize) {
    let mut random = Random::new(seed);
    let (mut total, mut count, mut slipping) = (0.0, 0, 0);
    while count < TRIALS {
        let mut stage = make(&mut random);
        let mut solution = StageSolution::new(LINKS);
        solution.contact.resize(stage.contacts.len(), 0.0);
        solution.pair.resize(stage.pairs.len(), 0.0);
        solution.obstacle_friction.resize(stage.obstacle_friction.len(), 0.0);
        solution.pair_friction.resize(stage.pair_friction.len(), 0.0);
        if solves(&stage, &mut solution).is_none() {
            continue;
        }
        for link in &mut stage.links {
            link.reference += Twist::from_fn(|_, _| 1e-5 * random.between(-1.0, 1.0));
        }
        set_bounds(&mut stage.obstacle_friction, &solution.contact);
        set_bounds(&mut stage.pair_friction, &solution.pair);
        (total, count) = (total + solves(&stage, &mut solution).expect("a start close to the solution"), count + 1);
        let friction = solution.obstacle_friction.iter().zip(&solution.contact);
        let friction = friction.chain(solution.pair_friction.iter().zip(&solution.pair));
        slipping += friction.filter(|(p, n)| **n > 0.0 && p.abs() > 0.999 * COEFFICIENT * **n).count();
    }
    (total / TRIALS as f64, slipping)
}

fn set_bounds<R>(rows: &mut [FrictionRow<R>], normal: &[f64]) {
    for row in rows {
        row.bound = row.coefficient * normal[row.normal];
    }
}

fn rough(contacts: usize, pairs: usize, random: &mut Random) -> Stage {
    let mut stage = dense::random_stage(kind(contacts), random);
    for (normal, contact) in stage.contacts.iter().enumerate() {
        let w = contact.direction;
        let direction = Twist::new(-w.y, w.x, random.between(-0.06, 0.06));
        let along = StageContact { direction, offset: 0.0, ..*contact };
        stage.obstacle_friction.push(FrictionRow { normal, along, coefficient: COEFFICIENT, bound: 0.0 });
    }
    dense::fold(&mut stage, pairs, random);
    dense::roughen(&mut stage, COEFFICIENT, random);
    // So that most contacts press.
    stage.contacts.iter_mut().for_each(|contact| contact.offset -= 0.05);
    stage.pairs.iter_mut().for_each(|pair| pair.offset -= 0.05);
    stage
}

#[test]
fn few_solves_end_the_search_close_to_a_solution() {
    let found = [
        ("obstacles", solves_near_a_solution(81, |random| rough(4, 0, random)), 3.2),
        ("links", solves_near_a_solution(82, |random| rough(0, 3, random)), 3.8),
        ("both", solves_near_a_solution(83, |random| rough(3, 2, random)), 5.0),
    ];
    for (name, (solves, slipping), most) in found {
        println!("{name}: {solves:.2} solves, {slipping} contacts slip");
        assert!(solves < most && slipping > 20, "{name}: {solves} solves");
    }
}
