//! Stages in which a robot touches itself, against full matrices and before the certificate.

use snake_core::planar::{InteriorPoint, Newton, Stage, StageLink, StageSolution, Twist, certify};
use snake_core::stepping::StageStop;
use snake_test_support::planar::Random;
use snake_test_support::planar_stage::{self as dense, Kind};

const FREE: Kind =
    Kind { links: 6, contacts: 0, stiff: true, limited: false, friction: false, mass_ratio: 1.0, orthotropy: 1.0 };

fn solve(stage: &Stage, tolerance: f64) -> (StageSolution, f64) {
    let mut solution = StageSolution::cold(stage);
    let outcome = Newton::new(stage.links.len()).solve_one(stage, &mut solution, tolerance, 2000);
    (solution, outcome.iterations)
}

fn distance(a: &[Twist], b: &[Twist]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).component_mul(&Twist::new(1.0, 1.0, 0.1)).norm()).fold(0.0, f64::max)
}

/// The couplings of links that are not neighbours enter by low-rank corrections of the chain's elimination; the dense
/// solver knows nothing of chains.
#[test]
fn the_velocities_are_those_of_the_dense_solver() {
    let mut random = Random::new(21);
    let (mut worst, mut closed, mut finished): (f64, usize, usize) = (0.0, 0, 0);
    for links in [3, 5, 8, 11] {
        for case in 0..30 {
            let mut stage = dense::random_stage(Kind::of_case(links, case), &mut random);
            dense::fold(&mut stage, [1, 2, 5][case % 3], &mut random);
            let (solution, _) = solve(&stage, 1e-11);
            let certificate = certify(&stage, &solution);
            assert!(certificate.residual() < 1e-8, "{links} links, case {case}: {certificate:?}");
            closed += solution.pair.iter().filter(|impulse| **impulse > 0.0).count();
            if let Some(exact) = dense::solve(&stage, 1e-12) {
                finished += 1;
                let error = distance(&solution.twist, &exact);
                worst = worst.max(error);
                assert!(error < 1e-7, "{links} links, case {case}: {error:e} m/s");
            }
        }
    }
    println!("worst velocity {worst:.1e} m/s in {finished} stages, {closed} closed contacts");
    assert!(closed > 60 && finished > 80, "{closed} closed contacts, {finished} stages of 120");
}

/// The interior point method shares the correction of low rank with Newton's method, but not its laws.
#[test]
fn the_interior_point_method_finds_the_same_velocities() {
    let mut random = Random::new(24);
    let mut worst: f64 = 0.0;
    for case in 0..40 {
        let kind = Kind { friction: true, links: 3 + case % 9, stiff: case % 2 == 0, ..FREE };
        let mut stage = dense::random_stage(kind, &mut random);
        dense::fold(&mut stage, 1 + case % 5, &mut random);
        let (solution, _) = solve(&stage, 1e-11);
        let mut from_inside = solution.clone();
        from_inside.twist.fill(Twist::zeros());
        InteriorPoint::new(stage.links.len()).solve(&stage, &mut from_inside, 1e-10);
        worst = worst.max(distance(&solution.twist, &from_inside.twist));
    }
    println!("worst velocity {worst:.1e} m/s");
    assert!(worst < 1e-6, "{worst:e} m/s");
}

/// It leaves out links that are far apart until they would fly through each other.
#[test]
fn the_interior_point_method_takes_in_contacts_that_close_from_far() {
    let mut random = Random::new(25);
    let mut closed = [0, 0];
    for case in 0..40 {
        let kind = Kind { friction: true, links: 3 + case % 9, ..FREE };
        let mut stage = dense::random_stage(kind, &mut random);
        dense::fold(&mut stage, 5, &mut random);
        stage.links.iter_mut().for_each(|link| link.reference *= 1000.0);
        stage.pairs.iter_mut().for_each(|pair| pair.offset += random.between(0.2, 2.0));
        let (solution, _) = solve(&stage, 1e-11);
        let mut from_inside = solution.clone();
        from_inside.twist.fill(Twist::zeros());
        InteriorPoint::new(stage.links.len()).solve(&stage, &mut from_inside, 1e-10);
        assert!(distance(&solution.twist, &from_inside.twist) < 1e-5, "case {case}");
        for (pair, _) in stage.pairs.iter().zip(&solution.pair).filter(|(_, impulse)| **impulse > 0.0) {
            closed[usize::from(pair.offset > 1.0)] += 1;
        }
    }
    println!("contacts that close from nearby and from far: {closed:?}");
    assert!(closed.iter().all(|count| *count > 5));
}

/// A solution whose contact impulse is wrong by little fails, whichever law it then breaks.
#[test]
fn the_certificate_finds_a_wrong_impulse_between_links() {
    let mut random = Random::new(22);
    let kind = Kind { friction: true, ..FREE };
    for _ in 0..20 {
        let mut stage = dense::random_stage(kind, &mut random);
        dense::fold(&mut stage, 2, &mut random);
        let (solution, _) = solve(&stage, 1e-11);
        for k in 0..2 {
            let mut wrong = solution.clone();
            wrong.pair[k] += 1e-4;
            assert!(certify(&stage, &wrong).residual() > 1e-6);
        }
    }
}

/// Solutions in balance that break the law of a contact: one that ignores it while links approach each other, and one that
/// pushes although they part.
#[test]
fn the_certificate_finds_a_contact_whose_law_is_broken() {
    let mut random = Random::new(25);
    let kind = Kind { friction: true, ..FREE };
    let (mut ignored, mut pushed) = (0, 0);
    for _ in 0..60 {
        let mut stage = dense::random_stage(kind, &mut random);
        dense::fold(&mut stage, 1, &mut random);
        let pair = stage.pairs[0];
        for impulse in [0.0, 0.01] {
            let mut alone = stage.clone();
            alone.pairs.clear();
            for (link, w) in pair.links.into_iter().zip(&pair.direction) {
                let StageLink { mass, inertia, reference, .. } = &mut alone.links[link];
                *reference += w.component_div(&Twist::new(*mass, *mass, *inertia)) * impulse;
            }
            let (mut solution, _) = solve(&alone, 1e-11);
            solution.pair = vec![impulse];
            let opening =
                pair.offset + (0..2).map(|k| pair.direction[k].dot(&solution.twist[pair.links[k]])).sum::<f64>();
            let is_broken = opening < -1e-3 || (impulse > 0.0 && opening > 1e-3);
            let residual = certify(&stage, &solution).residual();
            assert!(!is_broken || residual > 5e-4, "{impulse} N s, opening {opening} m/s: {residual:e}");
            ignored += usize::from(is_broken && impulse == 0.0);
            pushed += usize::from(is_broken && impulse > 0.0);
        }
    }
    assert!(ignored > 5 && pushed > 5, "{ignored} ignored, {pushed} pushed");
}

/// Impulses between links of one robot are internal: without friction and actuation they change no momentum.
#[test]
fn impulses_between_links_conserve_linear_momentum() {
    let mut random = Random::new(23);
    let kind = Kind { links: 7, stiff: false, mass_ratio: 3.0, ..FREE };
    for _ in 0..20 {
        let mut stage = dense::random_stage(kind, &mut random);
        dense::fold(&mut stage, 3, &mut random);
        let (solution, _) = solve(&stage, 1e-11);
        let momentum = |of: &dyn Fn(usize) -> Twist| {
            stage.links.iter().enumerate().map(|(i, link)| of(i).xy() * link.mass).sum::<nalgebra::Vector2<f64>>()
        };
        let change = momentum(&|i| solution.twist[i]) - momentum(&|i| stage.links[i].reference);
        assert!(change.norm() < 1e-10, "{change}");
    }
}

/// A stop is a term of its joint in the chain's elimination, or a contact between the links, a correction of low rank.
#[test]
fn stops_of_joints_are_contacts_between_neighbours() {
    let mut random = Random::new(22);
    let (mut worst, mut met): (f64, usize) = (0.0, 0);
    for case in 0..60 {
        let kind = Kind { stiff: case % 2 == 0, friction: case % 3 != 0, contacts: case % 3, ..FREE };
        let mut stage = dense::random_stage(kind, &mut random);
        for joint in 0..stage.joints.len() {
            let mut offset = [random.between(-2e-3, 2e-2), StageStop::<f64>::FAR];
            offset.rotate_left(random.below(2));
            stage.stops.push(StageStop { lever: stage.links[joint].half_length, offset });
        }
        let (of_joints, _) = solve(&stage, 1e-9);
        let (mut as_pairs, mut copied) = (Stage::with_capacity(6), StageSolution::new(6));
        stage.copy_lane(0, &mut as_pairs);
        assert!(as_pairs.stops.is_empty() && as_pairs.pairs.len() == 5);
        let (of_pairs, _) = solve(&as_pairs, 1e-9);
        worst = worst.max(distance(&of_joints.twist, &of_pairs.twist));
        // Impulses are those of the copy, too.
        of_joints.copy_lane(&stage, 0, &mut copied);
        let residual = [certify(&stage, &of_joints), certify(&as_pairs, &copied)].map(|it| it.residual());
        assert!(residual[0] < 1e-7 && residual[1] < 1e-7, "case {case}: {residual:?}");
        let mut back = of_joints.clone();
        back.stop.fill([0.0; 2]);
        back.set_lane(&stage, 0, &copied);
        assert_eq!(back, of_joints);
        met += copied.pair.iter().filter(|impulse| **impulse > 0.0).count();
    }
    assert!(worst < 1e-7 && met > 60, "{worst}, {met} stops met");
}
