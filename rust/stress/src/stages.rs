//! Random stage problems with every datum drawn from as many decades as the interface admits.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use snake_core::environment::rng::Rng;
use snake_core::planar::{Fallback, Heading, Newton, Stage, StageContact, StageJoint, StageLink, StageSolution};

use crate::figures::Figures;
use snake_core::solver::SolveStatus;

/// A number drawn uniformly in its logarithm.
pub fn magnitude(random: &mut Rng, low: f64, high: f64) -> f64 {
    random.uniform(low.ln(), high.ln()).exp()
}

/// Stage problem `index` of the family `seed`.
pub fn random_stage(seed: u64, index: u64) -> Stage {
    let random = &mut Rng::new(seed, index);
    let links = [2, 3, 5, 8, 11, 16, 30][random.index(7)];
    let mut stage = Stage::with_capacity(links);
    stage.coefficient = magnitude(random, 1e-4, 5e-2);
    add_links(&mut stage, links, random);
    add_joints(&mut stage, random);
    add_contacts(&mut stage, random);
    stage
}

fn add_links(stage: &mut Stage, links: usize, random: &mut Rng) {
    let c = stage.coefficient;
    let mass_ratio = [1.0, 10.0, 1e2, 1e4][random.index(4)];
    let axis_ratio = [1.0, 3.0, 1e3][random.index(3)];
    let mu = if random.chance(0.1) { 0.0 } else { magnitude(random, 1e-3, 10.0) };
    let speed = if random.chance(0.1) { 0.0 } else { magnitude(random, 1e-6, 100.0) };
    let (length, bend) = (magnitude(random, 0.02, 0.5), random.uniform(0.0, 2.0));
    let (straight, along) = (random.chance(0.15), random.chance(0.5));
    let inertia_factor = magnitude(random, 0.02, 0.5);
    let mut angle = random.around_zero(3.0);
    for i in 0..links {
        let mass = magnitude(random, 1.0, mass_ratio) * 0.1;
        let bound = mu * mass * 9.81 * c;
        let other = bound / axis_ratio;
        let mut friction = if along { Vector2::new(bound, other) } else { Vector2::new(other, bound) };
        if axis_ratio > 1.0 && random.chance(0.05) {
            friction[random.index(2)] = 0.0;
        }
        if !straight && i > 0 {
            angle += random.around_zero(bend);
        }
        let rate = speed / length;
        stage.links.push(StageLink {
            heading: Heading::of(angle),
            reference: Vector3::new(random.around_zero(speed), random.around_zero(speed), random.around_zero(rate)),
            mass,
            inertia: inertia_factor * mass * length * length,
            half_length: 0.5 * length,
            cg_offset: 0.0,
            friction,
        });
    }
}

fn add_joints(stage: &mut Stage, random: &mut Rng) {
    let c = stage.coefficient;
    let kp = if random.chance(0.15) { 0.0 } else { magnitude(random, 1.0, 1e6) };
    let kd = if random.chance(0.15) { 0.0 } else { magnitude(random, 1e-3, 1e3) };
    let error = magnitude(random, 1e-8, 1.0);
    let limit = if random.chance(0.5) { f64::INFINITY } else { magnitude(random, 1e-3, 100.0) };
    let rate = if random.chance(0.5) { 0.0 } else { magnitude(random, 1e-3, 10.0) };
    for _ in 1..stage.links.len() {
        let torque = kp * random.around_zero(error) + kd * random.around_zero(rate);
        stage.joints.push(StageJoint { drive: c * torque, stiffness: c * (c * kp + kd), limit: c * limit, slack: 0.0 });
    }
}

/// Contacts of the kinds that pegs make: many at once, opposed pairs, touching, apart and penetrating.
fn add_contacts(stage: &mut Stage, random: &mut Rng) {
    let links = stage.links.len();
    let count = [0, 1, 2, 4, 8, 18][random.index(6)];
    let scale = magnitude(random, 1e-6, 10.0);
    let penetrating = random.chance(0.3);
    let mut last: Option<(usize, Vector2<f64>, f64)> = None;
    for _ in 0..count {
        let fresh = (random.index(links), Heading::of(random.around_zero(PI)).axial(), random.around_zero(1.0));
        // Now and then a copy of the last contact, nearly or exactly, from the same side or the opposite one.
        let (link, normal, place) = match last {
            Some((link, normal, place)) if random.chance(0.3) => {
                let turn = [0.0, 1e-9, 1e-4][random.index(3)];
                let side = if random.chance(0.5) { 1.0 } else { -1.0 };
                (link, Heading::of(turn).to_world(normal) * side, place + turn)
            }
            _ => fresh,
        };
        last = Some((link, normal, place));
        let own = &stage.links[link];
        let arm = place * own.half_length * normal.dot(&own.heading.lateral());
        let offset = if penetrating {
            random.uniform(-0.2, 0.2)
        } else if random.chance(0.5) {
            0.0
        } else {
            random.uniform(0.0, scale)
        };
        stage.contacts.push(StageContact { link, direction: Vector3::new(normal.x, normal.y, arm), offset });
    }
    stage.contacts.sort_by_key(|contact| contact.link);
    if !penetrating {
        return;
    }
    feasible_offsets(stage, random);
}

/// Shifts the offsets so that some motion satisfies them all: geometry always leaves one, random numbers do not.
fn feasible_offsets(stage: &mut Stage, random: &mut Rng) {
    let rigid = Vector3::new(random.around_zero(0.2), random.around_zero(0.2), 0.0);
    for contact in &mut stage.contacts {
        let needed = -(contact.direction.x * rigid.x + contact.direction.y * rigid.y);
        contact.offset = needed + if random.chance(0.5) { 0.0 } else { random.uniform(0.0, 0.1) };
    }
}

/// A cold start: at the reference velocity without impulses.
pub fn cold(stage: &Stage) -> StageSolution {
    let mut solution = StageSolution::cold(stage);
    for (twist, link) in solution.twist.iter_mut().zip(&stage.links) {
        *twist = link.reference;
    }
    solution
}

/// Solves the given stages as a simulation would, from a cold start: Newton's method, and the fallback where that
/// does not close. An iteration is a linear solve, and a step is a stage.
pub fn solve_many(seed: u64, indices: std::ops::Range<u64>) -> Figures {
    let mut figures = Figures::default();
    let mut solvers: BTreeMap<usize, (Newton, Fallback)> = BTreeMap::new();
    for index in indices {
        let stage = random_stage(seed, index);
        let links = stage.links.len();
        let (newton, fallback) = solvers.entry(links).or_insert_with(|| (Newton::new(links), Fallback::new(links)));
        let mut solution = cold(&stage);
        let outcome = newton.solve_one(&stage, &mut solution, TOLERANCE, MAX_ITERATIONS);
        figures.steps += 1;
        figures.iterations += outcome.iterations as u64;
        if !outcome.converged {
            let (solves, closing) = fallback.solve_hard(&stage, &mut solution, TOLERANCE);
            figures.fallbacks += 1;
            figures.iterations += u64::from(solves);
            figures.relaxed += u64::from(closing == SolveStatus::Relaxed);
            figures.unconverged += u64::from(closing == SolveStatus::Unsolved);
        }
    }
    figures
}

const TOLERANCE: f64 = 1e-8;
const MAX_ITERATIONS: u32 = 200;
