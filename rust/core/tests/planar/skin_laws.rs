//! Friction that differs forward and backward: deceleration, direction, energy, and stages against dense solvers.

use nalgebra::Vector2;
use snake_core::gait::Wave;
use snake_core::laws::Skin;
use snake_core::planar::{Fallback, InteriorPoint, Newton, Stage, StageContact, StageSolution, Twist, certify};
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::rows::FrictionRow;
use snake_core::scene::SceneConfig;
use snake_core::solver::SolveStatus;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::friction_scenes::{G, sliding};
use snake_test_support::planar::{Hold, Random, START_FREE, aiko, ground, implicit, links};
use snake_test_support::planar_stage::{self as dense, Kind};

fn scales(friction: [f64; 2], backward: f64) -> SceneConfig {
    SceneConfig { friction_backward: Some(backward), ..ground(friction) }
}

fn schemes(step: f64) -> [ImplicitConfig; 2] {
    [implicit(step, 1), implicit(step, 2)]
}

/// Link 1 lies at -x of the others: a robot that moves to -x slides forward. While it slides, each step takes mu g h.
#[test]
fn a_robot_slides_forward_and_backward_against_its_own_coefficient() {
    let (h, scene) = (1e-3, scales([0.1, 0.6], 0.3));
    let factor = PerLink::Each(vec![4.0, 1.0, 0.5]);
    let own_skins = RobotConfig { friction_factor: factor, ..links(3) };
    let mean = 5.5 / 3.0;
    for (robot, velocity, mu) in [
        (links(3), [-0.5, 0.0], 0.1),
        (links(3), [0.5, 0.0], 0.3),
        (links(3), [0.0, 0.5], 0.6),
        (own_skins.clone(), [-0.5, 0.0], mean * 0.1),
        (own_skins, [0.5, 0.0], mean * 0.3),
    ] {
        for integrator in schemes(h) {
            let mut simulation = sliding(&robot, &scene, velocity, &integrator);
            for step in 1..80 {
                simulation.advance(h, &Hold(0.0));
                let expected = 0.5 - mu * G * h * f64::from(step);
                let speed = simulation.state().twist[1].xy().norm();
                assert!((speed - expected).abs() < 1e-9, "{velocity:?} after {step}: {speed} for {expected}");
            }
            simulation.advance(1.0, &Hold(0.0));
            assert!(simulation.state().twist[1].norm() < 1e-9, "it stops");
        }
    }
}

/// v' = -g D^2 v / |D v| with the coefficient of the direction along, as on the ellipse of that side: v_y^(mu_x^2) /
/// v_x^(mu_y^2) is constant; the tolerance is that of `slides_along_the_normal_of_the_ellipse`.
#[test]
fn a_slip_turns_as_the_half_ellipse_of_its_side_says() {
    for (direction, along) in [(-1.0, 0.2), (1.0, 0.35)] {
        let mut simulation = sliding(&links(2), &scales([0.2, 0.3], 0.35), [direction * 0.3, 0.3], &implicit(1e-3, 2));
        let integral = |u: &Twist| along * along * u.y.ln() - 0.09 * u.x.abs().ln();
        let start = integral(&simulation.state().twist[0]);
        let mut judged = 0;
        while simulation.state().twist[0].norm() > 0.042 {
            simulation.advance(1e-3, &Hold(0.0));
            let drift = integral(&simulation.state().twist[0]) - start;
            assert!(drift.abs() < 0.05 * 2.0 * 0.09, "{direction}: {drift:e}");
            judged += 1;
        }
        assert!(judged > 60, "{judged}");
    }
}

#[test]
fn equal_halves_are_the_ellipse_bit_by_bit() {
    let run = |scene: &SceneConfig| {
        let mut simulation = aiko(scene, START_FREE, &implicit(1e-2, 2));
        simulation.advance(0.5, &Wave::default());
        simulation.state().pose.clone()
    };
    let reference = run(&ground([0.2, 0.5]));
    assert_eq!(reference, run(&scales([0.2, 0.5], 0.2)));
    // With this gait and friction links slide forward only.
    let apart = (run(&scales([0.3, 0.5], 0.2))[0] - reference[0]).norm();
    assert!(apart > 1e-3, "{apart}");
}

/// The energy that the joints put in is that of the motion and what friction took, to the order of the scheme.
#[test]
fn friction_takes_what_is_missing_from_the_energy() {
    let mut defects = Vec::new();
    for h in [2e-3, 5e-4] {
        // More friction along the links than across them: they slide forward and backward.
        let mut simulation = aiko(&scales([0.4, 0.1], 0.2), START_FREE, &implicit(h, 2));
        let (mut friction, mut drive) = (0.0, 0.0);
        for _ in 0..100 {
            let report = simulation.advance(5e-3, &Wave::default());
            assert!(report.friction_work <= 1e-12 && report.unconverged == 0);
            friction += report.friction_work;
            drive += report.actuator_work;
        }
        defects.push((simulation.kinetic_energy() - drive - friction).abs() / drive);
    }
    println!("energy defects {defects:?}");
    assert!(defects[0] < 2e-2 && defects[1] < 5e-3, "{defects:?}");
}

fn random_stage(case: usize, random: &mut Random) -> Stage {
    let kind = Kind {
        links: [2, 5, 11][case % 3],
        contacts: [0, 3, 12][(case / 3) % 3],
        stiff: case.is_multiple_of(2),
        limited: case % 4 < 2,
        friction: true,
        mass_ratio: 10.0,
        orthotropy: 10.0,
    };
    let mut stage = dense::random_stage(kind, random);
    let [forward, backward] = [[0.3, 1.0], [1.0, 0.2], [0.0, 1.0]][case % 3];
    stage.skin = Skin::of([forward, 1.0], Some(backward)).1;
    stage
}

/// Angular velocities count as those of the ends of links.
fn apart(stage: &Stage, a: &[Twist], b: &[Twist]) -> f64 {
    let links = stage.links.iter().zip(a.iter().zip(b));
    links
        .map(|(link, (a, b))| (a - b).component_mul(&Twist::new(1.0, 1.0, link.half_length)).norm())
        .fold(0.0, f64::max)
}

/// Newton's method, the fallback and the interior point method find the velocities of a dense solver that projects on the
/// nearest point of the set.
#[test]
fn all_solvers_find_the_velocities_of_dense_gauss_seidel() {
    let (mut random, mut compared, mut both_sides) = (Random::new(41), 0, [0, 0]);
    for case in 0..200 {
        let stage = random_stage(case, &mut random);
        let n = stage.links.len();
        let (mut newton, mut fallback) = (StageSolution::cold(&stage), StageSolution::cold(&stage));
        let outcome = Newton::new(n).solve_one(&stage, &mut newton, 1e-10, 300);
        let residual = certify(&stage, &newton).residual();
        assert!(outcome.converged && residual < 1e-7, "case {case}: {:?}", certify(&stage, &newton));
        let (_, status) = Fallback::new(n).solve_hard(&stage, &mut fallback, 1e-9);
        assert_eq!(status, SolveStatus::Solved, "case {case}: {:?}", certify(&stage, &fallback));
        let distance = apart(&stage, &newton.twist, &fallback.twist);
        assert!(distance < 1e-6, "case {case}: {distance:e}");
        newton.friction.iter().for_each(|p| both_sides[usize::from(p.x < 0.0)] += 1);
        if let Some(slow) = (n < 11).then(|| dense::solve(&stage, 1e-12)).flatten() {
            let distance = apart(&stage, &newton.twist, &slow);
            assert!(distance < 1e-6, "case {case}: {distance:e}");
            compared += 1;
        }
    }
    assert!(compared > 80 && both_sides.iter().all(|count| *count > 200), "{compared} {both_sides:?}");
}

/// The interior point method alone, on the ellipses of the sides on which the forces lie.
#[test]
fn a_fallback_without_a_start_closes_hard_stages() {
    let mut random = Random::new(43);
    for case in 0..60 {
        let stage = random_stage(case, &mut random);
        let mut solution = StageSolution::cold(&stage);
        solution.twist.fill(Twist::repeat(f64::NAN));
        let (_, status) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut solution, 1e-9);
        assert_eq!(status, SolveStatus::Solved, "case {case}: {:?}", certify(&stage, &solution));
    }
    // The method itself knows ellipses.
    let mut stage = random_stage(1, &mut random);
    stage.skin = None;
    assert!(InteriorPoint::new(5).solve(&stage, &mut StageSolution::cold(&stage), 1e-9).solves > 0);
}

/// Friction at obstacles: the coupled Newton iteration takes over.
#[test]
fn stages_with_friction_at_obstacles_are_solved() {
    let (mut random, mut solved) = (Random::new(47), [0; 2]);
    for case in 0..180 {
        let mut stage = random_stage(case, &mut random);
        stage.obstacle_friction = (0..stage.contacts.len())
            .map(|normal| {
                let row = &stage.contacts[normal];
                let direction = Twist::new(-row.direction.y, row.direction.x, 0.0);
                let along = StageContact { link: row.link, direction, offset: 0.0 };
                FrictionRow { normal, along, coefficient: 0.4, bound: 0.0 }
            })
            .collect();
        if stage.contacts.is_empty() {
            continue;
        }
        let mut solution = StageSolution::cold(&stage);
        let (_, status) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut solution, 1e-9);
        let certificate = certify(&stage, &solution);
        // A stage with friction at obstacles may have no solution.
        let is_solved = status == SolveStatus::Solved;
        assert!(!is_solved || certificate.residual() < 1e-6, "case {case}: {certificate:?}");
        solved[usize::from(case % 3 == 2)] += u32::from(is_solved);
    }
    // 80 with two proper halves, 40 with one that is a segment across.
    assert!(solved[0] == 80 && solved[1] >= 38, "{solved:?}");
}

#[test]
fn the_certificate_tells_of_a_force_of_the_other_side() {
    let mut random = Random::new(53);
    for case in 0..60 {
        let stage = random_stage(case, &mut random);
        let mut solution = StageSolution::cold(&stage);
        Newton::new(stage.links.len()).solve_one(&stage, &mut solution, 1e-10, 300);
        let sound = certify(&stage, &solution);
        let mut symmetric = stage.clone();
        symmetric.skin = None;
        let slips = |i: usize| stage.links[i].heading.to_link(solution.twist[i].xy()).norm() > 1e-3;
        let [positive, negative] = stage.skin.expect("a skin").shares();
        // On the shorter half the ellipse of the longer one asks for another force.
        let shorter = |p: &Vector2<f64>| if positive < negative { p.x > 1e-4 } else { p.x < -1e-4 };
        let differs = (0..stage.links.len()).any(|i| slips(i) && shorter(&solution.friction[i]));
        let wrong = certify(&symmetric, &solution);
        assert!(sound.law < 1e-7, "case {case}");
        assert!(!differs || wrong.law > 1e-5, "case {case}: {wrong:?}");
    }
}
