//! Coulomb friction between links of one robot.

use nalgebra::{DVector, Vector2};
use snake_core::contact::{PlacedLink, link_pair_contact};
use snake_core::control::ControllerConfig;
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Fallback, PlanarSystem, Pose, Scripted, StageSolution, Twist, certify};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::Scene;
use snake_core::simulation::PlanarSimulation;
use snake_core::solver::SolveStatus;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::allocation::REQUESTS;
use snake_test_support::lanes::alone_as_among_others;
use snake_test_support::planar::{Hold, LIMP, Random, build, ground, implicit, momentum, moving_chain};
use snake_test_support::planar_stage::{self as dense, Kind, after_rough_impact, stacked};

use crate::self_contact_laws::closed_by;

fn rough(links: usize, link_friction: f64) -> RobotConfig {
    RobotConfig { links, link_friction, ..RobotConfig::default() }
}

/// A limp chain whose first and last link touch within a nanometre, without friction on the ground.
fn closed_ring(robot: &RobotConfig, shape: &[f64], order: u32) -> PlanarSimulation {
    let mut simulation = build(robot, &ground([0.0, 0.0]), &LIMP, &implicit(1e-6, order));
    closed_by(&mut simulation, shape);
    simulation
}

/// Directions of a unit impulse into the first of two links at their nearest points, and of one along the surfaces: forces
/// at the point where they touch.
fn directions(robot: &Robot, pose: &[Pose], [i, j]: [usize; 2]) -> [DVector<f64>; 2] {
    let placed = [i, j].map(|k| PlacedLink::new(&robot.links[k], pose[k]));
    let contacts = (0..4).map(|end| link_pair_contact([&placed[0], &placed[1]], end));
    let nearest = contacts.min_by(|a, b| a.gap.total_cmp(&b.gap)).unwrap();
    let (normal, axis) = (nearest.normal, placed[0].axis);
    let point = pose[i].xy() + axis * nearest.along[0] - normal * robot.links[i].radius;
    [normal, Vector2::new(-normal.y, normal.x)].map(|force| {
        let mut all = DVector::zeros(3 * pose.len());
        for (link, force) in [(i, force), (j, -force)] {
            let moment = (point - pose[link].xy()).perp(&force);
            all.fixed_rows_mut::<3>(3 * link).copy_from(&Twist::new(force.x, force.y, moment));
        }
        all
    })
}

/// The halves of a chain meet with any velocities. Below mu P_N the surfaces stick, above it they slide on with mu P_N
/// against the slip: velocities after the impact are those of full matrices with the one or the other law.
#[test]
fn halves_of_a_chain_that_meet_stick_or_slide_as_coulombs_law_has_it() {
    let (mut random, mut seen) = (Random::new(43), [0; 2]);
    for links in [5, 6, 8, 11] {
        for (case, mu) in [0.05, 0.3, 0.8].into_iter().cycle().take(9).enumerate() {
            let shape: Vec<f64> = (1..links).map(|_| random.between(0.85, 1.15)).collect();
            let mut simulation = closed_ring(&rough(links, mu), &shape, 1 + case as u32 % 2);
            let pose: Vec<Pose> = simulation.state().pose.clone();
            let [w, d] = directions(simulation.robot(), &pose, [0, links - 1]);
            let head = Twist::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), random.between(-1.0, 1.0));
            let omega: Vec<f64> = (1..links).map(|_| random.between(-1.0, 1.0)).collect();
            let mut state = moving_chain(simulation.robot(), &pose, head, &omega);
            if w.dot(&stacked(&state.twist)) > 0.0 {
                state.twist.iter_mut().for_each(|u| *u = -*u);
            }
            let (sticks, exact) = after_rough_impact(simulation.robot(), &state, [&w, &d], mu);
            seen[usize::from(sticks)] += 1;
            simulation.place(&state);
            let (linear, _) = momentum(simulation.robot(), &state);
            let before = simulation.kinetic_energy();
            let statistics = simulation.advance(4e-6, &Hold(0.0));
            assert_eq!(statistics.unconverged, 0);
            // omega^2 h over four steps, and an impulse resolved to 1e-10.
            let defect = (stacked(&simulation.state().twist) - stacked(&exact)).amax();
            assert!(defect < 1e-4, "{links} links, case {case}, mu {mu}, sticks {sticks}: {defect:e}");
            assert!(simulation.kinetic_energy() < before);
            let (after, _) = momentum(simulation.robot(), simulation.state());
            // A stage that ends with a residual may leave as much of each link's momentum unbalanced.
            let mass: f64 = simulation.robot().links.iter().map(|link| link.mass).sum();
            assert!(statistics.residual < 1e-9);
            let most = 1e-12 + mass * statistics.residual;
            assert!((after - linear).norm() < most, "{linear} {after}, at most {most:e}");
        }
    }
    assert!(seen[0] > 8 && seen[1] > 8, "{seen:?} slide and stick");
}

/// Friction between links is internal: in free flight both momenta stay, and the energy only falls, by more than without.
#[test]
fn a_ring_that_closes_and_rubs_keeps_its_momentum_and_loses_energy() {
    let run = |mu: f64| {
        let step = 2e-3;
        let mut simulation = build(&rough(7, mu), &ground([0.0, 0.0]), &LIMP, &implicit(step, 2));
        simulation.place_chain(0.0, 0.0, 0.3, &[0.8; 6]);
        let pose: Vec<Pose> = simulation.state().pose.clone();
        let omega = [-2.5, -1.0, 0.5, 0.0, 0.5, 1.0];
        let state = moving_chain(simulation.robot(), &pose, Twist::new(0.1, -0.05, -1.5), &omega);
        simulation.place(&state);
        let (linear, angular) = momentum(simulation.robot(), &state);
        let (before, mut energy) = (simulation.kinetic_energy(), simulation.kinetic_energy());
        for _ in 0..150 {
            let statistics = simulation.advance(step, &Hold(0.0));
            assert_eq!(statistics.unconverged, 0);
            let now = simulation.kinetic_energy();
            assert!(now < energy + 1e-6 * before, "{now} after {energy}");
            energy = energy.min(now);
        }
        let (after, turning) = momentum(simulation.robot(), simulation.state());
        assert!((linear - after).norm() < 1e-9, "{linear} {after}");
        // Forces act at the predicted configuration, which the end of a step leaves by an order of the step.
        assert!((angular - turning).abs() < 1e-3 * angular.abs().max(1e-2), "{angular} {turning}");
        energy / before
    };
    let (smooth, rubbed) = (run(0.0), run(0.5));
    assert!(rubbed < smooth - 1e-4, "{rubbed} of the energy is left, without friction {smooth}");
}

/// Random stages: what the fallback returns is certified, a tangential impulse beyond mu P_N or against the law is not.
#[test]
fn the_certificate_judges_friction_between_links() {
    let (mut random, mut rubbing) = (Random::new(48), 0);
    for case in 0..60 {
        let mut stage = dense::random_stage(Kind::of_case(6 + case % 4, case), &mut random);
        dense::fold(&mut stage, [1, 2, 3][case % 3], &mut random);
        dense::roughen(&mut stage, 0.3, &mut random);
        let mut solution = StageSolution::cold(&stage);
        let (_, status) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut solution, 1e-9);
        if status != SolveStatus::Solved {
            continue;
        }
        assert!(certify(&stage, &solution).residual() < 1e-7, "case {case}: {:?}", certify(&stage, &solution));
        for (k, pressed) in solution.pair.iter().enumerate().filter(|(_, pressed)| **pressed > 1e-4) {
            assert!(solution.pair_friction[k].abs() < 0.3 * pressed + 1e-9, "case {case}");
            let mut other = solution.clone();
            other.pair_friction[k] += 0.1 * pressed;
            assert!(certify(&stage, &other).residual() > 1e-6, "case {case}");
            rubbing += 1;
        }
    }
    assert!(rubbing > 20, "{rubbing} rubbing contacts");
}

/// Robots that coil up by different amounts, so that links rub on each other.
#[test]
fn a_robot_rubs_on_itself_the_same_alone_and_among_others() {
    let robot = Robot::new(&rough(11, 0.4)).unwrap();
    let controller = ControllerConfig { torque_limit: Some(5.0), ..ControllerConfig::default() };
    let system = PlanarSystem::new(robot, &Scene::new(&ground([0.2, 0.2])).unwrap(), controller).unwrap();
    let coiling = |k: usize| {
        let start = [0.0, 0.0, 0.3 * k as f64];
        Scripted::new(&system.robot, ObstacleGrid::new(&[]), start, &[0.0; 10], Hold(0.8 + 0.06 * k as f64))
    };
    let config = ImplicitConfig { step: Some(0.0125), ..ImplicitConfig::default() };
    let alone = alone_as_among_others(&system, config, &[9, 13], &[0.05; 25], 9, coiling);
    assert!(alone.iter().any(|(body, _)| body.statistics.unconverged == 0));
}

#[test]
fn links_that_rub_on_each_other_do_not_allocate() {
    let limited = ControllerConfig { torque_limit: Some(5.0), ..ControllerConfig::default() };
    let mut simulation = build(&rough(11, 0.4), &ground([0.2, 0.2]), &limited, &implicit(1e-2, 2));
    simulation.place_chain(0.0, 0.0, 0.0, &[0.0; 10]);
    simulation.advance(3.0, &Hold(1.1));
    assert!(simulation.self_contact_impulse().iter().any(|impulse| impulse.norm() > 0.0));
    let before = REQUESTS.get();
    for _ in 0..50 {
        simulation.advance(1e-2, &Hold(1.1));
    }
    assert_eq!(REQUESTS.get() - before, 0);
}
