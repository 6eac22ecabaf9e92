//! Error over a run against simulated seconds per second of one thread.

use std::path::Path;

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::simulation::SchemeConfig;
use snake_core::stepping::Fleet;
use snake_thesis::{IntegratorConfig, ThesisConfig};

use crate::clock::{Spent, spent};
use crate::fleet::{ROBOTS, WINDOW, staggered, time_window};
use crate::methods::{Choice, is_default};
use crate::point::{Point, Work, speed};
use crate::reference::{Distance, Positions, Reference, RobotOf, Sampled, SystemOf};
use crate::report::{emit, progress};

/// What a scene's measurements are compared with.
#[derive(Serialize)]
struct SceneRecord<'a, S> {
    scene: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    model: Option<&'a str>,
    title: &'a str,
    scenario: &'a S,
    reference: &'a Reference,
}

/// How often something is repeated, and how long it may take \[s of CPU time\].
pub struct Limits {
    /// The run whose error is measured; it is given up after this.
    pub run: f64,
    /// Repetitions are made while one takes less than this.
    pub repetition: f64,
    /// Runs of one robot, the first one included.
    pub runs: usize,
    /// Rounds over all methods, with a window of a fleet in each.
    pub rounds: usize,
}

/// Measures all methods on the scenes given and emits every point.
///
/// # Errors
/// A scene is not admissible.
pub fn measure<S: Sampled>(scenes: &[S], quick: bool, cache: Option<&Path>) -> Result<(), ConfigError>
where
    ThesisConfig: SchemeConfig<S::Model>,
{
    for scenario in scenes {
        let reference = Reference::of(scenario, cache)?;
        let (scene, title) = (scenario.name(), scenario.title());
        emit("scene", &SceneRecord { scene, model: S::MODEL, title, scenario, reference: &reference });
        measure_scene(scenario, &reference, quick)?;
    }
    Ok(())
}

fn measure_scene<S: Sampled>(scenario: &S, reference: &Reference, quick: bool) -> Result<(), ConfigError>
where
    ThesisConfig: SchemeConfig<S::Model>,
{
    let limits = &S::LIMITS[usize::from(quick)];
    let system = scenario.system()?;
    let robots = staggered(scenario, &system, ROBOTS);
    let mut cases = Vec::new();
    let choices = scenario.choices(quick);
    for (k, choice) in choices.iter().enumerate() {
        progress(&format!("{}: {}/{} {}", scenario.name(), k + 1, choices.len(), choice.curve));
        cases.push(Case::new(scenario, &system, choice, limits)?);
    }
    progress(&format!("{}: repetitions", scenario.name()));
    for _ in 0..limits.rounds {
        cases.iter_mut().for_each(|case| case.repeat(&system, &robots, limits));
    }
    cases.iter().for_each(|case| emit("point", &case.point(reference)));
    Ok(())
}

/// One method on one scene.
struct Case<'a, S: Sampled> {
    choice: &'a Choice,
    scenario: &'a S,
    run: Run,
    alone: Vec<Spent>,
    fleet: Option<Fleet<S::Model>>,
    together: Vec<Spent>,
}

impl<'a, S: Sampled> Case<'a, S>
where
    ThesisConfig: SchemeConfig<S::Model>,
{
    /// Makes the run whose error is measured.
    fn new(scenario: &'a S, system: &SystemOf<S>, choice: &'a Choice, limits: &Limits) -> Result<Self, ConfigError> {
        let run = Run::of(scenario, choice, limits.run)?;
        let fleet = choice.integrator.implicit().map(|config| Fleet::new(config, system, ROBOTS));
        Ok(Self { choice, scenario, alone: vec![run.spent], run, fleet, together: Vec::new() })
    }

    /// One more repetition of what does not take too long.
    fn repeat(&mut self, system: &SystemOf<S>, robots: &[RobotOf<S>], limits: &Limits) {
        if self.run.spent.cpu < limits.repetition && self.run.ended && self.alone.len() < limits.runs {
            let run = Run::of(self.scenario, self.choice, limits.run).expect("it has run before");
            self.alone.push(run.spent);
        }
        let slow = self.together.first().is_some_and(|first| first.cpu > limits.repetition);
        if let Some(fleet) = self.fleet.as_mut().filter(|_| !slow) {
            self.together.push(time_window(system, fleet, robots).spent);
        }
    }

    fn point(&self, reference: &Reference) -> Point<'_> {
        let Run { samples, ended, simulated, work, .. } = &self.run;
        let of_fleet =
            |time: fn(&Spent) -> f64| self.fleet.as_ref().map(|_| speed(ROBOTS as f64 * WINDOW, &self.together, time));
        Point {
            scene: self.scenario.name(),
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
    fn of<S: Sampled>(scenario: &S, choice: &Choice, limit: f64) -> Result<Self, ConfigError>
    where
        ThesisConfig: SchemeConfig<S::Model>,
    {
        match &choice.integrator {
            IntegratorConfig::Implicit(method) => Self::to_the_end(scenario, method, limit),
            IntegratorConfig::Thesis(method) => Self::to_the_end(scenario, method, limit),
        }
    }

    /// Runs to the end, or until `limit` seconds of CPU time are over.
    fn to_the_end<S: Sampled, C: SchemeConfig<S::Model>>(
        scenario: &S,
        method: &C,
        limit: f64,
    ) -> Result<Self, ConfigError> {
        let (mut simulation, gait) = (scenario.simulation(method)?, scenario.gait());
        let (mut spent_in_all, mut work) = (Spent::default(), Work::default());
        let (mut samples, mut simulated) = (Vec::new(), 0.0);
        while simulated < scenario.duration() - 1e-9 && spent_in_all.cpu < limit && !work.diverged {
            let (report, spent) = spent(|| simulation.advance(S::SAMPLE, &gait));
            samples.push(S::positions(simulation.state()));
            simulated = samples.len() as f64 * S::SAMPLE;
            spent_in_all += spent;
            work.add(&report);
        }
        let ended = simulated > scenario.duration() - 1e-9 && !work.diverged;
        Ok(Self { samples, ended, simulated, spent: spent_in_all, work })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{self, Scenario};

    #[test]
    fn a_run_is_as_long_as_it_says_and_one_out_of_time_has_no_error() {
        let scene = &scenes::all()[0];
        let choice = Choice { curve: "default".into(), integrator: IntegratorConfig::default() };
        let system = scene.system().unwrap();
        let [_, quick] = Scenario::LIMITS;
        let whole = Case::new(scene, &system, &choice, &quick).unwrap();
        assert_eq!((whole.run.simulated, whole.run.work.steps), (5.0, 200));
        let hurried = Case::new(scene, &system, &choice, &Limits { run: 1e-9, ..quick }).unwrap();
        assert!(!hurried.run.ended && hurried.run.simulated == Scenario::SAMPLE);
        assert!(whole.run.ended && whole.run.work.misses == 0);
    }
}
