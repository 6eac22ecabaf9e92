//! Stages of the spatial model: the solver against a slow one on matrices, the choice among indeterminate impulses, and
//! the judge against both.

use nalgebra::{DVector, Vector2, Vector3};
use snake_core::robot::Robot;
use snake_core::solver::{CoupledStage, SolveStatus};
use snake_core::spatial::{
    ChainShape, Configuration, CoulombNewton, Fallback, Frame, Momentum, Newton, Stage, StageContact, StageDrive,
    StageFriction, StageLink, StageSolution, Wrench, certify,
};
use snake_test_support::planar::Random;
use snake_test_support::spatial_stage::{Dense, stacked};

const C: f64 = 3e-3;
const GRAVITY: f64 = 9.81;

/// A chain in a random configuration near the ground, without momentum, pegs or drives.
pub fn chain(random: &mut Random, links: usize, bend: f64, tilt: f64) -> Stage {
    let robot = Robot::new(&snake_test_support::planar::links(links)).expect("admissible");
    let mut configuration = Configuration::straight(links);
    let q = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| random.between(-tilt, tilt)));
    let flat = snake_core::spatial::orientation_of(random.between(-3.0, 3.0), 0.0, 0.0);
    let q = (q * flat).into_inner();
    configuration.orientation = [q.w, q.i, q.j, q.k];
    for angle in &mut configuration.angle {
        *angle = [random.between(-bend, bend), random.between(-tilt, tilt)];
    }
    let mut frames = vec![Frame::origin(); links];
    configuration.place_links(&ChainShape::new(&robot), &mut frames);
    let mut stage = Stage::with_capacity(links);
    stage.coefficient = C;
    stage.friction = StageFriction { sliding: Vector2::new(0.2, 0.3), rolling: 0.02, skin: None };
    stage.links.extend(robot.links.iter().zip(&frames).map(|(link, frame)| {
        let shadow = frame.axes[2].xy().normalize();
        StageLink {
            axes: frame.axes,
            momentum: Momentum { linear: Vector3::z() * (-link.mass * GRAVITY * C), angular: Vector3::zeros() },
            mass: link.mass,
            inertia: link.inertia,
            roll_inertia: link.roll_inertia,
            half_length: 0.5 * link.length,
            cg_offset: 0.0,
            sphere: link.contact_half_length,
            radius: link.radius,
            tangent: shadow,
            share: [1.0; 2],
            ground: [0.0; 2],
        }
    }));
    stage.joints =
        vec![[StageDrive { drive: 0.0, stiffness: C * 2.0, limit: f64::INFINITY, slack: 0.0 }; 2]; links - 1];
    stage
}

/// The same in motion, with gaps, pegs and drives.
pub fn moving(random: &mut Random, links: usize) -> Stage {
    let mut stage = chain(random, links, 0.5, 0.1);
    for link in &mut stage.links {
        link.momentum.linear += Vector3::from_fn(|_, _| random.between(-0.1, 0.1)) * link.mass;
        link.momentum.angular += Vector3::from_fn(|_, _| random.between(-1e-3, 1e-3));
        link.ground = [random.between(-0.02, 0.05), random.between(-0.02, 0.05)];
    }
    for drive in stage.joints.iter_mut().flatten() {
        *drive = StageDrive { drive: random.between(-3e-3, 3e-3), stiffness: C * (C * 800.0 + 2.0), ..*drive };
    }
    for link in 0..links {
        if random.between(0.0, 1.0) < 0.3 {
            let angle = random.between(-3.0, 3.0_f64);
            let normal = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let arm = stage.links[link].axes[2] * random.between(-0.04, 0.04);
            let direction = Wrench { linear: normal, angular: arm.cross(&normal) };
            stage.contacts.push(StageContact { link, direction, offset: random.between(-0.02, 0.05) });
        }
    }
    stage
}

/// In every other trial, moves the CGs of all links off the middle.
pub fn off_centre(stage: &mut Stage, trial: usize) {
    let mut random = Random::new(trial as u64);
    for link in stage.links.iter_mut().filter(|_| trial % 2 == 1) {
        link.cg_offset = random.between(-0.9, 0.9) * link.half_length;
    }
}

pub fn blank(stage: &Stage) -> StageSolution {
    let mut solution = StageSolution::new(stage.links.len());
    solution.contact.resize(stage.contacts.len(), 0.0);
    solution.pair.resize(stage.pairs.len(), 0.0);
    solution.stop.resize(stage.stops.len(), [0.0; 2]);
    solution.obstacle_friction.resize(stage.obstacle_friction.len(), Vector2::zeros());
    solution
}

fn solve(stage: &Stage, start: &StageSolution, tolerance: f64) -> StageSolution {
    let mut solution = start.clone();
    let outcome = Newton::new(stage.links.len()).solve_one(stage, &mut solution, tolerance, 300);
    assert!(outcome.converged, "{:?}", certify(stage, &solution));
    solution
}

#[test]
fn newton_and_dense_gauss_seidel_find_the_same_velocities() {
    let mut random = Random::new(5);
    for trial in 0..40 {
        let mut stage = moving(&mut random, 2 + trial % 4);
        off_centre(&mut stage, trial);
        let slow = Dense::new(&stage).solve(&stage);
        let fast = solve(&stage, &blank(&stage), 1e-9);
        let apart = (stacked(&fast.twist) - slow).amax();
        assert!(apart < 2e-6, "trial {trial}: {apart}, {:?}", certify(&stage, &fast));
    }
}

#[test]
fn every_random_stage_is_solved_and_certified() {
    let mut random = Random::new(11);
    let mut solves = 0;
    for trial in 0..300 {
        let mut stage = moving(&mut random, 11);
        off_centre(&mut stage, trial);
        let mut solution = blank(&stage);
        let outcome = Newton::new(11).solve_one(&stage, &mut solution, 1e-8, 300);
        let certificate = certify(&stage, &solution);
        assert!(outcome.converged && certificate.residual() < 1e-5, "trial {trial}: {certificate:?}");
        solves += outcome.iterations as u32;
    }
    println!("{:.1} solves a stage", f64::from(solves) / 300.0);
}

/// Lying flat, 22 normal impulses act on 12 freedoms. Whatever the solver starts from, and whichever way it goes, it
/// finds the same, and among all that carry the robot alike the shortest.
#[test]
fn indeterminate_impulses_are_the_shortest_whatever_the_start() {
    let mut random = Random::new(3);
    for _ in 0..10 {
        let stage = chain(&mut random, 11, 0.6, 0.0);
        let from_nothing = solve(&stage, &blank(&stage), 1e-9);
        let mut elsewhere = blank(&stage);
        for i in 0..11 {
            elsewhere.normal[i] = [random.between(0.0, 0.1), random.between(0.0, 0.1)];
            elsewhere.twist[i].angular = Vector3::from_fn(|_, _| random.between(-1.0, 1.0));
        }
        let from_elsewhere = solve(&stage, &elsewhere, 1e-9);
        let mut strictly = elsewhere.clone();
        assert!(Newton::strict(11).solve_one(&stage, &mut strictly, 1e-9, 2000).converged);
        let load = stage.links[0].mass * GRAVITY * C;
        for other in [&from_elsewhere, &strictly] {
            let pairs = from_nothing.normal.iter().flatten().zip(other.normal.iter().flatten());
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-4 * load, "{apart} N s apart, of {load}");
        }
        let impulses = all_impulses(&from_nothing);
        let svd = Dense::new(&stage).contact.svd(true, true);
        let rank = svd.singular_values.iter().filter(|&&value| value > 1e-9).count();
        let range = svd.u.expect("asked for").columns(0, rank).into_owned();
        let redundant = (&impulses - &range * (range.transpose() * &impulses)).norm();
        assert!(redundant < 1e-4 * impulses.norm(), "{redundant} of {} moves nothing", impulses.norm());
    }
}

fn all_impulses(solution: &StageSolution) -> DVector<f64> {
    let rows = (0..solution.normal.len()).flat_map(|i| {
        let end = |k: usize| [solution.normal[i][k], solution.friction[i][k].x, solution.friction[i][k].y];
        [end(0).to_vec(), end(1).to_vec(), vec![solution.rolling[i].x, solution.rolling[i].y]].concat()
    });
    DVector::from_vec(rows.collect())
}

/// Where friction is weak the problem has one solution. The method whose tangent knows Coulomb's law finds it from
/// anywhere, with the shortest of its impulses, on its direct way and on that from soft contacts.
#[test]
fn the_coupled_method_finds_the_solution_of_weak_friction() {
    let mut random = Random::new(13);
    let (mut residual, mut twice, mut from_lanes) = (0.0_f64, 0.0_f64, 0.0_f64);
    for trial in 0..40 {
        let stage = if trial % 2 == 0 { chain(&mut random, 11, 0.6, 0.0) } else { moving(&mut random, 6) };
        let n = stage.links.len();
        let expected = solve(&stage, &blank(&stage), 1e-9);
        let mut newton = CoulombNewton::new(n);
        let mut from_soft = blank(&stage);
        assert!(newton.continuation(&stage, &mut from_soft, 1e-9, u32::MAX).1, "trial {trial}");
        let mut from_near = from_soft.clone();
        from_near.twist.iter_mut().for_each(|x| x.linear += Vector3::repeat(0.02));
        assert!(newton.solve(&stage, &mut from_near, 1e-9).1, "trial {trial}");
        let load = stage.links[0].mass * GRAVITY * C;
        let apart = |a: &StageSolution, b: &StageSolution| farthest_apart(a, b, stage.links[0].half_length);
        twice = twice.max(apart(&from_soft, &from_near));
        for solution in [&from_soft, &from_near] {
            residual = residual.max(certify(&stage, solution).residual());
            from_lanes = from_lanes.max(apart(solution, &expected));
            if trial % 2 == 0 {
                let apart = (all_impulses(solution) - all_impulses(&expected)).amax();
                assert!(apart < 1e-3 * load, "trial {trial}: impulses {apart} N s apart, of {load}");
            }
        }
    }
    println!("residual {residual:.0e} m/s, {twice:.0e} m/s apart, {from_lanes:.0e} m/s from the lanes' method");
    assert!(residual < 1e-9 && twice < 1e-10 && from_lanes < 1e-7);
}

/// Velocities of CGs, and of the links' ends about them \[m/s\].
fn farthest_apart(a: &StageSolution, b: &StageSolution, arm: f64) -> f64 {
    let pairs = a.twist.iter().zip(&b.twist);
    pairs.map(|(x, y)| (x.linear - y.linear).norm() + arm * (x.angular - y.angular).norm()).fold(0.0, f64::max)
}

/// A chain that lies flat and bends, on ground as rough as rubber, where the lanes' method solves most stages, and rougher,
/// where friction follows normal impulses, and these friction, so strongly that it leaves many. The fallback closes them.
#[test]
fn strong_friction_under_many_contacts_is_solved_by_the_fallback() {
    let mut random = Random::new(17);
    for (mu, hard, most_open) in [(1.0, 0..=5, 0), (3.0, 5..=30, 1), (6.0, 15..=60, 3)] {
        let (mut left, mut open, mut solves) = (0, 0, 0);
        for _ in 0..100 {
            let mut stage = chain(&mut random, 11, 0.6, 0.0);
            stage.friction.sliding = Vector2::repeat(mu);
            for drive in stage.joints.iter_mut().flatten() {
                *drive = StageDrive { drive: random.between(-1e-2, 1e-2), stiffness: C * (C * 800.0 + 2.0), ..*drive };
            }
            let mut solution = blank(&stage);
            if Newton::new(11).solve_one(&stage, &mut solution, 1e-6, 200).converged {
                continue;
            }
            left += 1;
            let (more, closing) = Fallback::new(11).solve_hard(&stage, &mut solution, 1e-5, u32::MAX);
            solves += more;
            let certified = certify(&stage, &solution).residual() <= 1e-5;
            assert_eq!(certified, closing == SolveStatus::Solved);
            open += u32::from(!certified);
        }
        println!("mu {mu}: {left} of 100 stages left, {open} of them open, {} solves each", solves / left.max(1));
        assert!(hard.contains(&left), "mu {mu}: {left} stages are hard");
        assert!(open <= most_open, "mu {mu}: {open} stages open");
    }
}

/// A tolerance out of reach: every method is tried, or, once the budget is spent, none but a calm end.
#[test]
fn a_spent_budget_ends_the_fallback() {
    let mut random = Random::new(17);
    let mut stage = chain(&mut random, 11, 0.6, 0.0);
    stage.links.iter_mut().for_each(|link| link.momentum.linear.x += link.mass);
    let [first, all] =
        [1, u32::MAX].map(|most| Fallback::new(11).solve_hard(&stage, &mut blank(&stage), 1e-20, most).0);
    assert!(first > 0 && 2 * first < all, "{first} and {all} linear solves");
}

/// A contact that cannot open as fast as another asks closes neither; the fallback leaves penetrations where they are.
#[test]
fn contradicting_pegs_are_relaxed() {
    let mut random = Random::new(2);
    let mut stage = chain(&mut random, 3, 0.1, 0.0);
    for sign in [1.0, -1.0] {
        let direction = Wrench { linear: Vector3::x() * sign, angular: Vector3::zeros() };
        stage.contacts.push(StageContact { link: 1, direction, offset: -0.1 });
    }
    let mut solution = blank(&stage);
    let (_, closing) = Fallback::new(3).solve_hard(&stage, &mut solution, 1e-5, u32::MAX);
    assert_eq!(closing, SolveStatus::Relaxed);
    assert!(solution.twist.iter().all(|x| x.linear.norm() < 1e-3));
}

#[test]
fn the_judge_reports_every_broken_law() {
    let mut random = Random::new(7);
    let stage = moving(&mut random, 5);
    let good = solve(&stage, &blank(&stage), 1e-9);
    assert!(certify(&stage, &good).residual() < 1e-6);
    let breakages: [fn(&mut StageSolution); 7] = [
        |s| s.twist[1].linear.x += 1e-2,
        |s| s.twist[2].angular.y += 1e-1,
        |s| s.normal[0][1] += 1e-2,
        |s| s.friction[3][0].x += 1e-2,
        |s| s.rolling[2].y += 1e-2,
        |s| s.actuator[1][0] += 1e-2,
        |s| s.normal.iter_mut().flatten().for_each(|p| *p = f64::NAN),
    ];
    for (k, breaks) in breakages.iter().enumerate() {
        let mut bad = good.clone();
        breaks(&mut bad);
        let residual = certify(&stage, &bad).residual();
        assert!(residual.is_nan() || residual > 1e-3, "breakage {k}: {residual}");
    }
}
