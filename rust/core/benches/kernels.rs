//! Time of the kernels: `cargo bench -p snake-core`, or `-- newton` for some of them.
//!
//! Solves are of stages drawn at random, as in the tests: *smooth* is one elimination of the chain and
//! what surrounds it, *friction* and *contacts* need several. Steps are of the default method.

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, criterion_group, criterion_main};
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Fleet, Newton, PlanarSystem, Scripted, Stage, StageSolution, certify};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_5, Scene, SceneConfig};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{Random, START_FREE, aiko, ground, posture, table_7_5};
use snake_test_support::planar_stage::{Kind, random_stage};

const LINKS: usize = 11;

const SMOOTH: Kind =
    Kind { links: LINKS, contacts: 0, stiff: true, limited: false, friction: false, mass_ratio: 1.0, orthotropy: 1.0 };

/// Stages from easy to hard, by name.
fn stages() -> [(&'static str, Stage); 3] {
    let mut random = Random::new(7);
    let kinds = [
        ("smooth", SMOOTH),
        ("friction", Kind { friction: true, ..SMOOTH }),
        ("contacts", Kind { friction: true, contacts: 6, ..SMOOTH }),
    ];
    kinds.map(|(name, kind)| (name, random_stage(kind, &mut random)))
}

/// Newton's method from a cold start to 1e-8 m/s, and the judge of what it found.
fn solve_and_certify(criterion: &mut Criterion) {
    let mut newton = Newton::new(LINKS);
    let mut solve = criterion.benchmark_group("newton");
    for (name, stage) in stages() {
        solve.bench_function(name, |bencher| {
            let start = || StageSolution::cold(&stage);
            let solve = |solution: &mut StageSolution| newton.solve_one(&stage, solution, 1e-8, 2000);
            bencher.iter_batched_ref(start, solve, BatchSize::SmallInput);
        });
    }
    solve.finish();
    let mut judge = criterion.benchmark_group("certify");
    for (name, stage) in stages() {
        let mut solution = StageSolution::cold(&stage);
        newton.solve_one(&stage, &mut solution, 1e-8, 2000);
        judge.bench_function(name, |bencher| bencher.iter(|| certify(black_box(&stage), black_box(&solution))));
    }
    judge.finish();
}

/// One robot, step by step through one and the same second.
fn step_of_one_robot(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    let default = ImplicitConfig::default();
    bench_robot(&mut group, "free", &ground([0.2, 0.2]), START_FREE, &default);
    bench_robot(&mut group, "course", &table_7_5(), START_7_5, &default);
    group.finish();
}

fn bench_robot(
    group: &mut BenchmarkGroup<WallTime>,
    name: &str,
    scene: &SceneConfig,
    start: [f64; 3],
    integrator: &ImplicitConfig,
) {
    let mut simulation = aiko(scene, start, integrator);
    let step = integrator.step();
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            if simulation.state().time > 1.0 {
                simulation.place_chain(start[0], start[1], start[2], &posture(&Wave::default(), LINKS - 1));
            }
            simulation.advance(step, &Wave::default())
        });
    });
}

type Undulator = Scripted<Wave>;

/// Robots of a fleet that takes the widest registers of the machine alone.
const LARGE_FLEET: usize = 100;

/// Eight robots 0.1 s apart, one control period of 50 ms, in the widest registers of the machine.
fn period_of_eight_robots(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("eight robots");
    for (name, scene, start) in [("free", ground([0.2, 0.2]), START_FREE), ("course", table_7_5(), START_7_5)] {
        let robot = Robot::new(&RobotConfig::default()).expect("a valid robot");
        let ground = Scene::new(&scene).expect("a valid scene");
        let system = PlanarSystem::new(robot, &ground, ControllerConfig::default()).expect("a valid controller");
        let mut fleet = Fleet::new(ImplicitConfig::default(), &system, LARGE_FLEET);
        let robots = staggered(&system, &scene, start, &mut fleet);
        group.bench_function(name, |bencher| {
            let period =
                |robots: &mut Vec<Undulator>| fleet.advance(&system, robots.iter_mut().map(Scripted::driven), 0.05);
            bencher.iter_batched_ref(|| robots.clone(), period, BatchSize::SmallInput);
        });
    }
    group.finish();
}

fn staggered(system: &PlanarSystem, scene: &SceneConfig, start: [f64; 3], fleet: &mut Fleet) -> Vec<Undulator> {
    let (pegs, angles) = (ObstacleGrid::of(&scene.obstacles), posture(&Wave::default(), LINKS - 1));
    let mut robots = vec![Scripted::new(&system.robot, pegs, start, &angles, Wave::default()); 8];
    for k in 0..8 {
        fleet.advance(system, robots[k..].iter_mut().map(Scripted::driven), 0.1);
    }
    robots
}

criterion_group!(kernels, solve_and_certify, step_of_one_robot, period_of_eight_robots);
criterion_main!(kernels);
