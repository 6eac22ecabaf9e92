//! Stages in which a robot touches itself, against full matrices and before the certificate.

use nalgebra::{Vector2, Vector3};
use snake_core::solver::{CoupledStage, SolveStatus};
use snake_core::spatial::{
    CoulombNewton, Fallback, Newton, SpatialVector, Stage, StagePair, StageSolution, Wrench, certify,
};
use snake_core::stepping::StageStop;
use snake_test_support::planar::Random;
use snake_test_support::spatial_stage::{Dense, stacked};

use super::stage::{blank, chain, moving};

/// Adds `count` contacts between links that are not neighbours, which tend to close.
pub fn fold(stage: &mut Stage, count: usize, random: &mut Random) {
    let links = stage.links.len();
    for _ in 0..count {
        let first = random.below(links - 2);
        let second = first + 2 + random.below(links - first - 2);
        let normal = Vector3::from_fn(|_, _| random.between(-1.0, 1.0)).normalize();
        let wrench = |link: usize, along: f64, normal: Vector3<f64>| {
            let arm = stage.links[link].axes[2] * along;
            Wrench { linear: normal, angular: arm.cross(&normal) }
        };
        let direction =
            [wrench(first, random.between(-0.04, 0.04), normal), wrench(second, random.between(-0.04, 0.04), -normal)];
        stage.pairs.push(StagePair { links: [first, second], direction, offset: random.between(-0.05, 0.02) });
    }
}

fn solve(stage: &Stage, tolerance: f64) -> StageSolution {
    let mut solution = blank(stage);
    let outcome = Newton::new(stage.links.len()).solve_one(stage, &mut solution, tolerance, 500);
    assert!(outcome.converged, "{:?}", certify(stage, &solution));
    solution
}

/// The couplings of links that are not neighbours enter by corrections of the chain's elimination; the slow solver knows
/// nothing of chains.
#[test]
fn velocities_are_those_of_dense_gauss_seidel() {
    let mut random = Random::new(31);
    let mut closed = 0;
    for trial in 0..40 {
        let mut stage = moving(&mut random, 3 + trial % 4);
        fold(&mut stage, [1, 2, 3][trial % 3], &mut random);
        let slow = Dense::new(&stage).solve(&stage);
        let fast = solve(&stage, 1e-9);
        closed += fast.pair.iter().filter(|impulse| **impulse > 0.0).count();
        let apart = (stacked(&fast.twist) - slow).amax();
        // The compliance leaves a millionth of the speed, and angular velocities of some rad/s are among the numbers.
        assert!(apart < 1e-5, "trial {trial}: {apart}, {:?}", certify(&stage, &fast));
    }
    assert!(closed > 30, "{closed} closed contacts");
}

#[test]
fn every_stage_with_self_contact_is_solved_and_certified() {
    let mut random = Random::new(32);
    let mut closed = 0;
    for trial in 0..200 {
        let mut stage = moving(&mut random, 11);
        fold(&mut stage, 1 + trial % 6, &mut random);
        let solution = solve(&stage, 1e-8);
        let certificate = certify(&stage, &solution);
        assert!(certificate.residual() < 1e-5, "trial {trial}: {certificate:?}");
        closed += solution.pair.iter().filter(|impulse| **impulse > 0.0).count();
    }
    assert!(closed > 300, "{closed} closed contacts");
}

/// The method whose tangent knows Coulomb's law corrects an unsymmetric elimination.
#[test]
fn the_coupled_method_finds_the_same_velocities() {
    let mut random = Random::new(33);
    let mut worst: f64 = 0.0;
    for trial in 0..40 {
        let mut stage = if trial % 2 == 0 { chain(&mut random, 11, 0.6, 0.0) } else { moving(&mut random, 6) };
        fold(&mut stage, 1 + trial % 4, &mut random);
        let expected = solve(&stage, 1e-9);
        let mut coupled = blank(&stage);
        let mut newton = CoulombNewton::new(stage.links.len());
        assert!(newton.continuation(&stage, &mut coupled, 1e-9, u32::MAX).1, "trial {trial}");
        assert!(certify(&stage, &coupled).residual() < 1e-9, "trial {trial}: {:?}", certify(&stage, &coupled));
        worst = worst.max((stacked(&coupled.twist) - stacked(&expected.twist)).amax());
    }
    assert!(worst < 1e-5, "{worst:e} m/s apart");
}

/// A solution whose contact impulse is wrong by little fails, whichever law it then breaks.
#[test]
fn the_certificate_finds_a_wrong_impulse_between_links() {
    let mut random = Random::new(34);
    for _ in 0..20 {
        let mut stage = moving(&mut random, 6);
        fold(&mut stage, 2, &mut random);
        let solution = solve(&stage, 1e-9);
        assert!(certify(&stage, &solution).residual() < 1e-6);
        for k in 0..2 {
            let mut wrong = solution.clone();
            wrong.pair[k] += 1e-3;
            assert!(certify(&stage, &wrong).residual() > 1e-4);
        }
        let overlapping = solution.pair.iter().position(|impulse| *impulse > 0.0);
        if let Some(k) = overlapping {
            let mut stage = stage.clone();
            stage.pairs[k].offset -= 1e-3;
            assert!(certify(&stage, &solution).residual() > 5e-4, "links that sink into each other");
        }
    }
}

/// Impulses between links of one robot are internal: in the air, without drives, they change no momentum.
#[test]
fn impulses_between_links_conserve_linear_momentum() {
    let mut random = Random::new(35);
    for _ in 0..20 {
        let mut stage = moving(&mut random, 7);
        stage.contacts.clear();
        stage.links.iter_mut().for_each(|link| link.ground = [1e3; 2]);
        fold(&mut stage, 3, &mut random);
        let solution = solve(&stage, 1e-10);
        let after: SpatialVector = momentum(&stage, |i| stage.links[i].momentum_of(&solution.twist[i]));
        let before = momentum(&stage, |i| stage.links[i].momentum);
        assert!((after.linear - before.linear).norm() < 1e-9, "{before:?} {after:?}");
    }
}

fn momentum(stage: &Stage, of: impl Fn(usize) -> SpatialVector) -> SpatialVector {
    (0..stage.links.len()).fold(SpatialVector::zero(), |sum, i| sum.plus_scaled(&of(i), 1.0))
}

/// Links that cannot separate as fast as their overlap demands stay as they are.
#[test]
fn contradicting_self_contacts_are_relaxed() {
    let mut random = Random::new(36);
    let mut stage = chain(&mut random, 5, 0.1, 0.0);
    stage.friction.sliding = Vector2::repeat(0.2);
    for sign in [1.0, -1.0] {
        let linear = Vector3::x() * sign;
        let direction = [linear, -linear].map(|linear| Wrench { linear, angular: Vector3::zeros() });
        stage.pairs.push(StagePair { links: [1, 3], direction, offset: -0.1 });
    }
    let mut solution = blank(&stage);
    let (_, status) = Fallback::new(5).solve_hard(&stage, &mut solution, 1e-5, u32::MAX);
    assert_eq!(status, SolveStatus::Relaxed);
    assert!(solution.twist.iter().all(|x| x.linear.norm() < 1e-3));
}

/// A stop is a term of its axis in the chain's elimination, or a contact between the links, a correction of low rank.
#[test]
fn stops_of_joints_are_contacts_between_neighbours() {
    let mut random = Random::new(35);
    let (mut worst, mut met): (f64, usize) = (0.0, 0);
    for trial in 0..40 {
        let mut stage = moving(&mut random, 6);
        for axis in 0..10 {
            let mut offset = [random.between(-2e-3, 2e-2), StageStop::<f64>::FAR];
            offset.rotate_left(random.below(2));
            stage.stops.push(StageStop { lever: stage.links[axis / 2].half_length, offset });
        }
        let of_joints = solve(&stage, 1e-9);
        let (mut as_pairs, mut copied) = (Stage::with_capacity(6), StageSolution::new(6));
        as_pairs.links.clone_from(&stage.links);
        stage.copy_lane(0, &mut as_pairs);
        assert!(as_pairs.stops.is_empty() && as_pairs.pairs.len() == 10);
        let of_pairs = solve(&as_pairs, 1e-9);
        worst = worst.max((stacked(&of_joints.twist) - stacked(&of_pairs.twist)).amax());
        of_joints.copy_lane(&stage, 0, &mut copied);
        let residual = [certify(&stage, &of_joints), certify(&as_pairs, &copied)].map(|it| it.residual());
        assert!(residual[0] < 1e-6 && residual[1] < 1e-6, "trial {trial}: {residual:?}");
        let mut back = of_joints.clone();
        back.stop.fill([0.0; 2]);
        back.set_lane(&stage, 0, &copied);
        assert_eq!(back, of_joints);
        met += copied.pair.iter().filter(|impulse| **impulse > 0.0).count();
    }
    assert!(worst < 1e-6 && met > 60, "{worst}, {met} stops met");
}
