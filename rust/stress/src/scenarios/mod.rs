//! The scenarios, each a family of cases with the bounds they must keep.

pub mod coils;
pub mod drive;
pub mod environments;
pub mod ground;
pub mod neighbours;
pub mod pegs;
pub mod robots;
pub mod spatial;
pub mod walls;

use snake_core::environment::{ActionMode, ModelKind, PlanarRobot, RobotModel, SpatialRobot};
use snake_core::gait::Reference;
use snake_core::simulation::{PlanarSimulation, SpatialSimulation};
use snake_core::spatial::Spatial;
use snake_core::stepping::Model;

use crate::case::Case;
use crate::draw::Draw;
use crate::figures::Figures;
use crate::observable::Observable;
use crate::requirements::Bounds;
use crate::spatial_case::SpatialCase;
use crate::stages;

use environments::Kind;
use neighbours::{TestFleet, poisoned};
use spatial::{fall, gaits, rest};

/// Something to run and measure.
pub struct Job {
    pub name: String,
    pub run: Box<dyn Fn() -> Figures + Send + Sync>,
}

impl Job {
    fn new(name: impl Into<String>, run: impl Fn() -> Figures + Send + Sync + 'static) -> Self {
        Self { name: name.into(), run: Box::new(run) }
    }

    fn of_case(case: Case) -> Self {
        Self::new(case.name.clone(), move || case.run())
    }
}

/// A family of jobs.
pub struct Scenario {
    pub name: &'static str,
    pub bounds: Bounds,
    pub jobs: Vec<Job>,
}

/// How long the suite may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// A few seconds, within the tests.
    Short,
    /// Ten minutes of one core.
    Quick,
    /// Some four hours of one core.
    Long,
}

impl Effort {
    fn of(self, short: u64, quick: u64, long: u64) -> u64 {
        match self {
            Effort::Short => short,
            Effort::Quick => quick,
            Effort::Long => long,
        }
    }

    fn seconds(self, short: f64, quick: f64, long: f64) -> f64 {
        match self {
            Effort::Short => short,
            Effort::Quick => quick,
            Effort::Long => long,
        }
    }
}

/// All scenarios; `seed` is that of environments and their actions.
pub fn all(effort: Effort, seed: u64) -> Vec<Scenario> {
    let mut all = in_the_plane(effort, seed);
    all.extend(in_space(effort, seed));
    all
}

pub fn in_the_plane(effort: Effort, seed: u64) -> Vec<Scenario> {
    let time = effort.seconds(2.0, 5.0, 60.0);
    let standing = effort.of(500, 50_000, 1_000_000);
    let default = Bounds::default();
    let inside = Bounds { penetration: f64::INFINITY, energy: f64::INFINITY, ..default };
    vec![
        run("steps to 50 ms", default, drive::steps(time)),
        run("k_P 0 to 1e6", default, drive::gains(time)),
        run("mass ratios to 1e4", default, robots::mass_ratios(time)),
        run("friction 0 to 10, axis ratio to 1e3", default, ground::friction(time)),
        // The first part after a robot was placed is of second order, and lets stiff motors jump to their rates: in steps of
        // 50 ms, 1 ms that creates 0.08 mJ at every precision, 0.127 of what two links turn over in the short run.
        run("2 to 300 links", Bounds { energy: 0.13, ..default }, robots::links(effort.seconds(0.1, 2.0, 10.0))),
        run("wedge of converging pegs", default, pegs::wedge(time)),
        run("thin peg in the crack", default, pegs::crack(time)),
        // Clamped from both sides, a robot is thrown out in its first steps of 50 ms. They spend their budget and are flagged.
        run("start in deep penetration", Bounds { unconverged: 20, ..inside }, pegs::deep(time)),
        run("1 to 100 m/s into a peg", default, pegs::fast(1.0)),
        run("coils and folds", default, coils::coils(time)),
        run("corners of walls", default, walls::corners(0.0, time)),
        run("corners of rough walls", default, walls::corners(0.3, time)),
        run("limp robot thrown among pegs", Bounds { energy: 1e-9, ..default }, pegs::limp(2.0)),
        run("torque-limit chatter", default, drive::torque_limit(time)),
        Scenario {
            name: "standing still under load",
            bounds: Bounds { drift: 1e-9, ..default },
            jobs: stand(ground::rest(), standing),
        },
        Scenario {
            name: "standing at the limit of friction",
            bounds: Bounds { drift: CREEP * standing as f64, ..default },
            jobs: stand(ground::brink(), standing),
        },
        Scenario {
            name: "NaN in one robot of 19",
            bounds: default,
            jobs: poison(neighbours::in_the_plane, effort.of(8, 100, 1000)),
        },
        Scenario {
            name: "random scenes",
            bounds: Bounds { unconverged: u64::MAX, ..inside },
            jobs: scenes(effort.of(50, 1000, 20_000), effort.seconds(0.1, 1.0, 1.0)),
        },
        Scenario {
            name: "random stage problems",
            bounds: Bounds { unconverged: u64::MAX, ..default },
            jobs: problems(effort.of(2_000, 100_000, 10_000_000)),
        },
        Scenario {
            name: "random environment steps, steps of 10 and 50 ms",
            bounds: default,
            jobs: random_steps::<PlanarRobot>(environments::step_lengths(), seed, effort.of(2_000, 100_000, 1_000_000)),
        },
        Scenario {
            name: "random environment steps, rough room",
            bounds: default,
            jobs: random_steps::<PlanarRobot>(
                environments::rough_rooms(ModelKind::Planar),
                seed,
                effort.of(500, 30_000, 1_000_000),
            ),
        },
    ]
    .into_iter()
    .chain(RANDOM_STEPS.map(|(mode, name, _)| Scenario {
        name,
        bounds: default,
        jobs: random_steps::<PlanarRobot>(environments::everywhere(mode), seed, effort.of(1_000, 50_000, 10_000_000)),
    }))
    .collect()
}

pub fn in_space(effort: Effort, seed: u64) -> Vec<Scenario> {
    let time = effort.seconds(0.3, 2.0, 20.0);
    let standing = effort.of(200, 20_000, 1_000_000);
    let default = Bounds { residual: Spatial::ACCURACY.tolerance, ..Bounds::default() };
    // Three of four gaits start inside pegs.
    let inside = Bounds { penetration: f64::INFINITY, energy: f64::INFINITY, ..default };
    let name = "3D: NaN in one robot of 19";
    vec![
        run_spatial("3D: drops in steps to 50 ms", default, fall::drops(time)),
        run_spatial("3D: upright, on its side, upside down", default, fall::postures(time)),
        run_spatial("3D: limp chain in flight", Bounds { energy: 1e-3, ..default }, fall::flight(time)),
        run_spatial("3D: limp chain at edges", default, fall::edges(0.25 * time)),
        run_spatial("3D: pegs in the cracks", default, fall::crack(time)),
        run_spatial("3D: friction 0", inside, gaits::friction([0.0; 2], time)),
        run_spatial("3D: friction 0.2", inside, gaits::friction([0.2; 2], time)),
        run_spatial("3D: friction 0.01, 1", inside, gaits::friction([0.01, 1.0], time)),
        run_spatial("3D: friction 1", Bounds { unconverged: 5, ..inside }, gaits::friction([1.0; 2], time)),
        run_spatial("3D: friction 2", Bounds { unconverged: 100, ..inside }, gaits::friction([2.0; 2], time)),
        run_spatial("3D: k_P 0 to 1e5", default, gaits::gains(time)),
        run_spatial("3D: mass ratios to 1e3", default, gaits::mass_ratios(time)),
        run_spatial("3D: 2 to 50 links", default, gaits::links(0.5 * time)),
        run_spatial("3D: coils and folds", default, coils::spatial_coils(time)),
        Scenario {
            name: "3D: lying on 22 contacts",
            bounds: Bounds { drift: 1e-9, ..default },
            jobs: stand_spatial(rest::flat(), standing),
        },
        Scenario {
            name: "3D: lying, pushed below the limit of friction",
            bounds: Bounds { drift: CREEP * standing as f64, ..default },
            jobs: stand_spatial(rest::pushed(), standing / 10),
        },
        Scenario {
            name: "3D: straightened itself",
            bounds: Bounds { drift: CREEP * standing as f64, ..default },
            jobs: stand_spatial(rest::straightened(), standing / 10),
        },
        Scenario { name, bounds: default, jobs: poison(spatial::neighbours::in_space, effort.of(8, 40, 400)) },
        Scenario {
            name: "3D: random environment steps, steps of 10 and 25 ms",
            bounds: default,
            jobs: random_steps::<SpatialRobot>(
                environments::step_lengths_in_space(),
                seed,
                effort.of(1_000, 20_000, 100_000),
            ),
        },
        Scenario {
            name: "3D: random environment steps, rough room",
            bounds: default,
            jobs: random_steps::<SpatialRobot>(
                environments::rough_rooms(ModelKind::Spatial),
                seed,
                effort.of(200, 4_000, 100_000),
            ),
        },
    ]
    .into_iter()
    .chain(RANDOM_STEPS.map(|(mode, _, name)| Scenario {
        name,
        bounds: default,
        jobs: random_steps::<SpatialRobot>(
            environments::everywhere_in_space(mode),
            seed,
            effort.of(200, 4_000, 200_000),
        ),
    }))
    .collect()
}

/// Scenarios of random environment steps, in the plane and in 3D.
const RANDOM_STEPS: [(ActionMode, &str, &str); 5] = [
    (ActionMode::Gait, "random environment steps, gait", "3D: random environment steps, gait"),
    (ActionMode::Joints, "random environment steps, joints", "3D: random environment steps, joints"),
    (ActionMode::Residual, "random environment steps, residual", "3D: random environment steps, residual"),
    (ActionMode::Velocities, "random environment steps, velocities", "3D: random environment steps, velocities"),
    (ActionMode::Torques, "random environment steps, torques", "3D: random environment steps, torques"),
];

fn run(name: &'static str, bounds: Bounds, cases: Vec<Case>) -> Scenario {
    Scenario { name, bounds, jobs: cases.into_iter().map(Job::of_case).collect() }
}

fn run_spatial(name: &'static str, bounds: Bounds, cases: Vec<SpatialCase>) -> Scenario {
    let job = |case: SpatialCase| Job::new(case.name.clone(), move || case.run());
    Scenario { name, bounds, jobs: cases.into_iter().map(job).collect() }
}

fn stand(cases: Vec<Case>, steps: u64) -> Vec<Job> {
    let job = |case: Case| {
        Job::new(case.name.clone(), move || {
            let advance = |simulation: &mut PlanarSimulation, time| simulation.advance(time, &case.motion);
            ground::stand(case.simulation(), case.integrator.step(), steps, advance)
        })
    };
    cases.into_iter().map(job).collect()
}

fn stand_spatial(cases: Vec<SpatialCase>, steps: u64) -> Vec<Job> {
    let job = |case: SpatialCase| {
        Job::new(case.name.clone(), move || {
            let advance = |simulation: &mut SpatialSimulation, time| simulation.advance(time, &case.motion);
            ground::stand(case.simulation(), case.integrator.step(), steps, advance)
        })
    };
    cases.into_iter().map(job).collect()
}

fn poison<M: Model, R: Reference<M::Target> + 'static>(fleet: fn(f64) -> TestFleet<M, R>, periods: u64) -> Vec<Job> {
    let kinds = [1e-2, 5e-2].into_iter().flat_map(|step| [f64::NAN, f64::INFINITY, 1e300].map(|poison| (step, poison)));
    let job = |(step, poison): (f64, f64)| {
        Job::new(format!("{poison:e}, h {step} s"), move || poisoned([fleet(step), fleet(step)], poison, periods))
    };
    kinds.map(job).collect()
}

/// Random scenes of `duration` \[s\].
fn scenes(count: u64, duration: f64) -> Vec<Job> {
    let job = |index| {
        let name = format!("scene {index}");
        Job::new(name.clone(), move || Draw::random(SEED, index).case(name.clone(), duration).run())
    };
    (0..count).map(job).collect()
}

/// Jobs that share `steps` environment steps.
fn random_steps<M: RobotModel<Model: Observable>>(kinds: Vec<Kind>, seed: u64, steps: u64) -> Vec<Job> {
    let each = steps / kinds.len() as u64;
    let job = |(index, Kind { name, config }): (usize, Kind)| {
        Job::new(name, move || environments::random_steps::<M>(&config, each, seed * MOST_KINDS + index as u64))
    };
    kinds.into_iter().enumerate().map(job).collect()
}

fn problems(count: u64) -> Vec<Job> {
    let job = |k: u64| {
        let part = k * count / BATCHES..(k + 1) * count / BATCHES;
        Job::new(format!("problems {part:?}"), move || stages::solve_many(SEED, part.clone()))
    };
    (0..BATCHES).map(job).collect()
}

/// Of everything drawn at random but environments.
const SEED: u64 = 2007;

/// Sets the seeds of different runs apart.
const MOST_KINDS: u64 = 1000;

const BATCHES: u64 = 20;

/// Creep of a robot whose links stopped at the very limit of friction \[m\] per step: a micrometre in a million steps.
const CREEP: f64 = 1e-12;
