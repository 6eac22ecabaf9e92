//! The stage of the minimal model: solver against judge, and the judge against mutilated solutions.

use nalgebra::{DVector, Vector2, Vector3};
use snake_thesis::minimal::{
    Base, ControlPlant, Motion, Newton, SmoothLaw, Stage, StageJoint, StageLink, StageSolution, certify,
};

use crate::robots::{Uniform, uneven_model};

/// A random stage of `links` links; `momentum_feedforward` is f, `limit` the drives' bound \[N m s\].
fn random_stage(links: usize, seed: u64, momentum_feedforward: f64, limit: f64) -> (Stage, StageSolution) {
    let mut uniform = Uniform::new(seed);
    let model = uneven_model(links, &mut uniform);
    let joints = links - 1;
    let mut motion = Motion::new(links);
    let rate = Vector3::new(uniform.next(-1.0, 1.0), uniform.next(-1.0, 1.0), uniform.next(-3.0, 3.0));
    let phi = uniform.vector(joints, 1.5);
    let phi_rate = uniform.vector(joints, 3.0);
    motion.set(&model, Base { theta: uniform.next(-3.0, 3.0), rate }, &phi, &phi_rate);
    let c = 3e-3;
    // Slow links stick, fast ones slide.
    let scale = 10.0_f64.powf(uniform.next(-4.0, 0.0));
    let pairs = model.links.iter().zip(&motion.links);
    let stage_links = pairs.map(|(link, at)| StageLink::new(link, at, at.twist * scale, c));
    let mut stage = Stage { coefficient: c, links: stage_links.collect(), joints: Vec::new(), momentum_feedforward };
    for _ in 0..joints {
        let stiffness = if momentum_feedforward > 0.0 { 0.0 } else { uniform.next(0.0, 0.02) };
        stage.joints.push(StageJoint { drive: uniform.next(-0.02, 0.02), stiffness, limit });
    }
    let mut solution = StageSolution::new(links);
    for (u, at) in solution.twist.iter_mut().zip(&motion.links) {
        *u = at.twist;
    }
    (stage, solution)
}

fn solved(links: usize, seed: u64, momentum_feedforward: f64, limit: f64) -> (Stage, StageSolution, u32) {
    let (stage, mut solution) = random_stage(links, seed, momentum_feedforward, limit);
    let outcome = Newton::new(links).solve(&stage, &mut solution, 1e-9, 500);
    assert!(outcome.converged, "{links} links, seed {seed}, f = {momentum_feedforward}");
    (stage, solution, outcome.iterations as u32)
}

const DRIVES: [(f64, f64); 4] = [(0.0, f64::INFINITY), (0.0, 0.01), (0.1, f64::INFINITY), (30.0, f64::INFINITY)];

#[test]
fn the_judge_accepts_what_the_solver_finds_on_random_stages() {
    let (mut iterations, mut count) = (0, 0);
    for links in [2, 3, 11, 30] {
        for seed in 0..60 {
            for (momentum_feedforward, limit) in DRIVES {
                let (stage, solution, n) = solved(links, seed, momentum_feedforward, limit);
                let certificate = certify(&stage, &solution);
                assert!(
                    certificate.residual() < 1e-7,
                    "{links} links, seed {seed}, f = {momentum_feedforward}: {certificate:?}"
                );
                iterations += n;
                count += 1;
            }
        }
    }
    println!("{:.1} linear solves a stage from cold", f64::from(iterations) / f64::from(count));
}

#[test]
fn the_judge_rejects_every_mutilation() {
    for (momentum_feedforward, limit) in DRIVES {
        let (stage, solution, _) = solved(11, 4, momentum_feedforward, limit);
        type Mutilation = fn(&mut StageSolution);
        let mutilations: [Mutilation; 6] = [
            |s| s.twist[3].x += 1e-3,
            |s| s.twist[0].z += 1e-3,
            |s| s.friction[5][0].x += 1e-5,
            |s| s.friction[7][1] *= 1.01,
            |s| s.actuator[2] += 1e-5,
            |s| s.actuator[9] = f64::NAN,
        ];
        for (k, mutilate) in mutilations.into_iter().enumerate() {
            let mut worse = solution.clone();
            mutilate(&mut worse);
            let residual = certify(&stage, &worse).residual();
            let rejected = residual.is_nan() || residual >= 1e-6;
            assert!(rejected, "mutilation {k}, f = {momentum_feedforward}: {residual:e}");
        }
    }
}

#[test]
fn the_velocities_do_not_depend_on_where_the_solver_starts() {
    for (momentum_feedforward, limit) in DRIVES {
        let (stage, one, _) = solved(11, 9, momentum_feedforward, limit);
        let (_, mut other) = random_stage(11, 9, momentum_feedforward, limit);
        other.friction.iter_mut().flatten().for_each(|p| *p = Vector2::new(5e-3, -5e-3));
        assert!(Newton::new(11).solve(&stage, &mut other, 1e-9, 500).converged);
        for (a, b) in one.twist.iter().zip(&other.twist) {
            assert!((a - b).norm() < 1e-7, "{:e}", (a - b).norm());
        }
    }
}

#[test]
fn the_drives_of_input_output_linearisation_are_linear_with_the_inertia_of_the_joints() {
    let links = 7;
    let mut uniform = Uniform::new(5);
    let model = uneven_model(links, &mut uniform);
    let (phi, phi_rate) = (uniform.vector(links - 1, 1.5), uniform.vector(links - 1, 3.0));
    let rate = Vector3::new(0.4, -0.3, 1.1);
    let mut motion = Motion::new(links);
    motion.set(&model, Base { theta: 0.0, rate }, &phi, &phi_rate);
    let (mut stage, mut solution) = random_stage(links, 5, 2.5, f64::INFINITY);
    for (i, (link, at)) in stage.links.iter_mut().zip(&motion.links).enumerate() {
        (link.axial, link.arm) = (at.axial, at.arm);
        (link.mass, link.inertia) = (model.links[i].mass, model.links[i].inertia);
        link.half_length = model.links[i].half_length;
        solution.twist[i] = at.twist;
    }
    let nu: Vec<f64> = rate.iter().copied().chain(phi_rate.iter().copied()).collect();
    let mass = ControlPlant::new(&model, SmoothLaw::PRINTED, &phi, &nu).joint_dynamics().mass;
    let constant = DVector::from_iterator(links - 1, stage.joints.iter().map(|joint| joint.drive));
    let expected = constant - mass * DVector::from_row_slice(&phi_rate) * stage.momentum_feedforward;
    stage.wanted_drives(&solution.twist, &mut solution.actuator);
    let found = DVector::from_row_slice(&solution.actuator);
    assert!((&found - &expected).norm() < 1e-12 * expected.norm());
}
