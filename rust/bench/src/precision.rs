//! Error over a run against simulated seconds per second of one thread.

use std::path::Path;

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::gait::Wave;
use snake_core::planar::{Fleet, Planar, PlanarSystem};
use snake_core::simulation::{Scheme, Simulation};
use snake_thesis::IntegratorConfig;

use crate::clock::{Spent, spent};
use crate::fleet::{ROBOTS, Undulator, WINDOW, staggered, time_window};
use crate::methods::{Choice, choices, is_default};
use crate::point::{Point, Work, speed};
use crate::reference::{Distance, Positions, Reference, Sampled};
use crate::report::{emit, progress};
use crate::scenes::{Scenario, positions};

/// Reference and time limits of a scene's measurements.
#[derive(Serialize)]
struct SceneRecord<'a> {
    scene: &'a str,
    title: &'a str,
    scenario: &'a Scenario,
    reference: &'a Reference,
}

/// How long one may take \[s of CPU time\].
struct Limits {
    /// The run whose error is measured; it is given up after this.
    run: f64,
    /// Repetitions are made while one takes less than this.
    repetition: f64,
    rounds: usize,
}

const LIMITS: Limits = Limits { run: 10.0, repetition: 0.4, rounds: 5 };
const QUICK_LIMITS: Limits = Limits { run: 2.0, repetition: 0.1, rounds: 3 };

/// Measures all methods on the scenes given and emits every point.
///
/// # Errors
/// A scene is not admissible.
pub fn measure(scenes: &[Scenario], quick: bool, cache: Option<&Path>) -> Result<(), ConfigError> {
    for scenario in scenes {
        let reference = Reference::of(scenario, cache)?;
        emit("scene", &SceneRecord { scene: scenario.name, title: scenario.title, scenario, reference: &reference });
        measure_scene(scenario, &reference, quick)?;
    }
    Ok(())
}

fn measure_scene(scenario: &Scenario, reference: &Reference, quick: bool) -> Result<(), ConfigError> {
    let limits = if quick { &QUICK_LIMITS } else { &LIMITS };
    let system = scenario.system()?;
    let robots = staggered(scenario, &system, ROBOTS)?;
    let mut cases = Vec::new();
    let choices = choices(quick, scenario.has_pegs());
    for (k, choice) in choices.iter().enumerate() {
        progress(&format!("{}: {}/{} {}", scenario.name, k + 1, choices.len(), choice.curve));
        cases.push(Case::new(scenario, &system, choice, limits)?);
    }
    progress(&format!("{}: repetitions", scenario.name));
    for _ in 0..limits.rounds {
        cases.iter_mut().for_each(|case| case.repeat(&system, &robots, limits));
    }
    cases.iter().for_each(|case| emit("point", &case.point(scenario, reference)));
    Ok(())
}

/// One method on one scene.
struct Case<'a> {
    choice: &'a Choice,
    scenario: &'a Scenario,
    run: Run,
    alone: Vec<Spent>,
    fleet: Option<Fleet>,
    together: Vec<Spent>,
}

impl<'a> Case<'a> {
    /// Makes the run whose error is measured.
    fn new(
        scenario: &'a Scenario,
        system: &PlanarSystem,
        choice: &'a Choice,
        limits: &Limits,
    ) -> Result<Self, ConfigError> {
        let run = Run::of(scenario, choice, limits.run)?;
        let fleet = choice.integrator.implicit().map(|config| Fleet::new(config, system, ROBOTS));
        Ok(Self { choice, scenario, alone: vec![run.spent], run, fleet, together: Vec::new() })
    }

    /// One more repetition of what does not take too long.
    fn repeat(&mut self, system: &PlanarSystem, robots: &[Undulator], limits: &Limits) {
        if self.run.spent.cpu < limits.repetition && self.run.ended {
            let run = Run::of(self.scenario, self.choice, limits.run).expect("it has run before");
            self.alone.push(run.spent);
        }
        let slow = self.together.first().is_some_and(|first| first.cpu > limits.repetition);
        if let Some(fleet) = self.fleet.as_mut().filter(|_| !slow) {
            self.together.push(time_window(system, fleet, robots).spent);
        }
    }

    fn point<'b>(&'b self, scenario: &'b Scenario, reference: &Reference) -> Point<'b> {
        let Run { samples, ended, simulated, work, .. } = &self.run;
        let of_fleet =
            |time: fn(&Spent) -> f64| self.fleet.as_ref().map(|_| speed(ROBOTS as f64 * WINDOW, &self.together, time));
        Point {
            scene: scenario.name,
            curve: &self.choice.curve,
            integrator: self.choice.integrator,
            default: is_default(&self.choice.integrator),
            error: ended.then(|| Distance::between(samples, &reference.samples)),
            speed_alone: speed(*simulated, &self.alone, |spent| spent.cpu),
            speed_fleet: of_fleet(|spent| spent.cpu),
            wall_alone: speed(*simulated, &self.alone, |spent| spent.wall),
            wall_fleet: of_fleet(|spent| spent.wall),
            repetitions: [self.alone.len(), self.together.len()],
            simulated: *simulated,
            work: *work,
        }
    }
}

/// One robot's run.
struct Run {
    samples: Vec<Positions>,
    /// Whether it came to the end.
    ended: bool,
    simulated: f64,
    spent: Spent,
    work: Work,
}

impl Run {
    fn of(scenario: &Scenario, choice: &Choice, limit: f64) -> Result<Self, ConfigError> {
        let duration = scenario.duration;
        Ok(match &choice.integrator {
            IntegratorConfig::Implicit(method) => Self::to_the_end(scenario.simulation(method)?, duration, limit),
            IntegratorConfig::Thesis(method) => Self::to_the_end(scenario.simulation(method)?, duration, limit),
        })
    }

    /// Runs for `duration`, or until `limit` seconds of CPU time are over.
    fn to_the_end<S: Scheme<Planar>>(mut simulation: Simulation<Planar, S>, duration: f64, limit: f64) -> Self {
        let (mut spent_in_all, mut work) = (Spent::default(), Work::default());
        let (mut samples, mut simulated) = (Vec::new(), 0.0);
        while simulated < duration - 1e-9 && spent_in_all.cpu < limit && !work.diverged {
            let (report, spent) = spent(|| simulation.advance(Scenario::SAMPLE, &Wave::default()));
            samples.push(positions(simulation.state()));
            simulated = samples.len() as f64 * Scenario::SAMPLE;
            spent_in_all += spent;
            work.add(&report);
        }
        let ended = simulated > duration - 1e-9 && !work.diverged;
        Self { samples, ended, simulated, spent: spent_in_all, work }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn a_run_is_as_long_as_it_says_and_one_out_of_time_has_no_error() {
        let scene = &scenes::all()[0];
        let choice = Choice { curve: "default".into(), integrator: IntegratorConfig::default() };
        let system = scene.system().unwrap();
        let whole = Case::new(scene, &system, &choice, &QUICK_LIMITS).unwrap();
        assert_eq!((whole.run.simulated, whole.run.work.steps), (5.0, 200));
        let hurried = Case::new(scene, &system, &choice, &Limits { run: 1e-9, ..QUICK_LIMITS }).unwrap();
        assert!(!hurried.run.ended && hurried.run.simulated == Scenario::SAMPLE);
        assert!(whole.run.ended && whole.run.work.misses == 0);
    }
}
