//! Error over a run of the 3D model against simulated seconds per second of one thread.

use std::path::Path;

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::spatial::{SpatialFleet, SpatialSystem};
use snake_core::stepping::ImplicitConfig;

use crate::clock::{Spent, spent};
use crate::fleet::{ROBOTS, WINDOW};
use crate::methods::Choice;
use crate::point::{Point, Work, speed};
use crate::reference::{Distance, Positions, Reference, Sampled};
use crate::report::{emit, progress};

use super::robots::{Robot, staggered, time_window};
use super::scenes::{SpatialScenario, all, positions};

/// What a scene's measurements are compared with.
#[derive(Serialize)]
struct SceneRecord<'a> {
    scene: &'a str,
    model: &'a str,
    title: &'a str,
    scenario: &'a SpatialScenario,
    reference: &'a Reference,
}

/// Measures the spatial model on all its scenes and emits every point.
///
/// # Errors
/// A scene is not admissible.
pub fn measure(quick: bool, cache: Option<&Path>) -> Result<(), ConfigError> {
    for scenario in all() {
        let reference = Reference::of(&scenario, cache)?;
        let SpatialScenario { name, title, .. } = scenario;
        emit(
            "scene",
            &SceneRecord { scene: name, model: "spatial", title, scenario: &scenario, reference: &reference },
        );
        let system = scenario.system()?;
        let robots = staggered(&scenario, &system)?;
        for choice in choices(quick) {
            progress(&format!("{name}: {} at {} s", choice.curve, choice.integrator.step()));
            emit("point", &measure_choice(&scenario, &reference, &system, &robots, &choice, rounds(quick))?);
        }
    }
    Ok(())
}

fn rounds(quick: bool) -> usize {
    if quick { 1 } else { 5 }
}

/// Steps and tolerances of the work-precision curves; steps divide 0.6 s and the time between samples.
fn choices(quick: bool) -> Vec<Choice> {
    let steps: &[f64] = if quick {
        &[0.05, 0.01]
    } else {
        &[0.2, 0.1, 1.0 / 15.0, 0.05, 0.025, 0.02, 0.0125, 0.01, 0.005, 0.0025, 0.001]
    };
    let tolerances: &[f64] = if quick { &[1e-6] } else { &[1e-6, 1e-5, 1e-4, 1e-3] };
    let mut choices = Vec::new();
    for &tolerance in tolerances {
        for &step in steps {
            let curve = match tolerance {
                1e-6 => "implicit order 2".to_owned(),
                _ => format!("implicit order 2, tolerance {tolerance:e}"),
            };
            let integrator =
                ImplicitConfig { step: Some(step), tolerance: Some(tolerance), ..ImplicitConfig::default() }.into();
            choices.push(Choice { curve, integrator });
        }
    }
    choices
}

/// Whether a choice is the default one of the spatial model.
fn is_default(integrator: &ImplicitConfig) -> bool {
    *integrator == ImplicitConfig { step: Some(DEFAULT_STEP), ..ImplicitConfig::default() }
}

/// The spatial model's own default step \[s\].
const DEFAULT_STEP: f64 = 0.025;

fn measure_choice<'a>(
    scenario: &'a SpatialScenario,
    reference: &Reference,
    system: &SpatialSystem,
    robots: &[Robot],
    choice: &'a Choice,
    rounds: usize,
) -> Result<Point<'a>, ConfigError> {
    let config = choice.integrator.implicit().expect("all curves of the spatial model are of the implicit method");
    let mut fleet = SpatialFleet::new(config, system, ROBOTS);
    let (mut alone, mut together) = (Vec::new(), Vec::new());
    let mut run = Run::of(scenario, &config)?;
    alone.push(run.spent);
    for round in 0..rounds {
        if round > 0 {
            run = Run::of(scenario, &config)?;
            alone.push(run.spent);
        }
        together.push(time_window(system, &mut fleet, robots));
    }
    let Run { work, ref samples, .. } = run;
    let simulated = scenario.duration;
    Ok(Point {
        scene: scenario.name,
        curve: &choice.curve,
        integrator: choice.integrator,
        default: is_default(&config),
        error: (!work.diverged).then(|| Distance::between(samples, &reference.samples)),
        speed_alone: speed(simulated, &alone, |spent| spent.cpu),
        speed_fleet: Some(speed(ROBOTS as f64 * WINDOW, &together, |spent| spent.cpu)),
        wall_alone: speed(simulated, &alone, |spent| spent.wall),
        wall_fleet: Some(speed(ROBOTS as f64 * WINDOW, &together, |spent| spent.wall)),
        repetitions: [alone.len(), together.len()],
        simulated,
        work,
    })
}

/// One robot's run.
struct Run {
    samples: Vec<Positions>,
    spent: Spent,
    work: Work,
}

impl Run {
    fn of(scenario: &SpatialScenario, integrator: &ImplicitConfig) -> Result<Self, ConfigError> {
        let (mut simulation, gait) = (scenario.simulation(integrator)?, scenario.gait());
        let mut run = Self { samples: Vec::new(), spent: Spent::default(), work: Work::default() };
        for _ in 0..(scenario.duration / SpatialScenario::SAMPLE).round() as usize {
            let (report, spent) = spent(|| simulation.advance(SpatialScenario::SAMPLE, &gait));
            run.spent += spent;
            run.work.add(&report);
            run.samples.push(positions(&simulation));
        }
        Ok(run)
    }
}
