//! Reference solution over a whole run: two fine runs, and the distance between them.

use std::path::Path;

use serde::{Deserialize, Serialize};
use snake_core::ConfigError;
use snake_core::gait;
use snake_core::simulation::{SchemeConfig, SimulatedModel, Simulation};
use snake_core::stepping::{ImplicitConfig, Model, Scripted, StateOf};

use crate::methods::Choice;
use crate::precision::Limits;
use crate::report::progress;

/// CGs of all links at one instant \[m\].
pub type Positions = Vec<Vec<f64>>;

/// Distance of the worst link from the reference \[m\]: at the worst instant of the run, and at its end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Distance {
    pub worst: f64,
    pub end: f64,
}

impl Distance {
    /// Between two runs that were sampled at the same instants.
    pub fn between(a: &[Positions], b: &[Positions]) -> Self {
        assert_eq!(a.len(), b.len());
        let at = |(a, b): (&Positions, &Positions)| a.iter().zip(b).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
        let distance: Vec<f64> = a.iter().zip(b).map(at).collect();
        Self {
            worst: distance.iter().copied().fold(0.0, f64::max),
            end: distance.last().copied().expect("at least one instant"),
        }
    }
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// What a reference is computed for: a robot at rest, ready for its gait.
pub trait Sampled: Serialize {
    type Model: SimulatedModel;
    type Gait: gait::Reference<<Self::Model as Model>::Target> + Clone;

    /// What records call the model, if they name it.
    const MODEL: Option<&'static str>;
    /// Steps of the two runs \[s\].
    const STEPS: [f64; 2];
    /// Time between two samples \[s\]; every step that is measured divides it.
    const SAMPLE: f64;
    /// At length, and quickly.
    const LIMITS: [Limits; 2];

    fn name(&self) -> &'static str;
    fn title(&self) -> &'static str;
    /// Simulated time over which errors are measured \[s\].
    fn duration(&self) -> f64;
    fn gait(&self) -> Self::Gait;

    /// All ways to integrate that are compared.
    fn choices(&self, quick: bool) -> Vec<Choice>;

    /// The configuration of a reference run at a step.
    fn fine(step: f64) -> ImplicitConfig;

    /// # Errors
    /// The robot, the scene or the controller is not admissible.
    fn system(&self) -> Result<SystemOf<Self>, ConfigError>;

    /// The robot at its start.
    fn at_start(&self, system: &SystemOf<Self>) -> RobotOf<Self>;

    /// # Errors
    /// The scenario or the method is not admissible.
    fn simulation<C: SchemeConfig<Self::Model>>(
        &self,
        integrator: &C,
    ) -> Result<Simulation<Self::Model, C::Scheme>, ConfigError>;

    /// Link CGs \[m\].
    fn positions(state: &StateOf<Self::Model>) -> Positions;

    /// Link CGs at all samples of a run.
    ///
    /// # Errors
    /// The scenario or the method is not admissible.
    fn samples(&self, integrator: &ImplicitConfig) -> Result<Vec<Positions>, ConfigError> {
        let (mut simulation, gait) = (self.simulation(integrator)?, self.gait());
        let sample = |_| {
            simulation.advance(Self::SAMPLE, &gait);
            Self::positions(simulation.state())
        };
        Ok((0..(self.duration() / Self::SAMPLE).round() as usize).map(sample).collect())
    }
}

pub type SystemOf<S> = <<S as Sampled>::Model as Model>::System;

/// A robot that follows the gait of a scenario.
pub type RobotOf<S> = Scripted<<S as Sampled>::Gait, <S as Sampled>::Model>;

/// The converged run of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Link CGs at the end of each sampling interval, from the finer run \[m\].
    pub samples: Vec<Positions>,
    /// \[s\]
    pub sample: f64,
    /// Distance between the two runs: Richardson's estimate of the accuracy of the reference \[m\].
    pub uncertainty: Distance,
    pub steps: [f64; 2],
}

impl Reference {
    /// The reference of a scenario, from `cache` if it holds one of the same scenario and configuration.
    ///
    /// # Errors
    /// The scenario is not admissible.
    pub fn of<S: Sampled>(scenario: &S, cache: Option<&Path>) -> Result<Self, ConfigError> {
        let text = serde_json::to_string(scenario).expect("plain data");
        let key = format!("{text}\n{:?}\n{}", S::fine(S::STEPS[1]), S::SAMPLE);
        let file = cache.map(|folder| folder.join(format!("reference-{}.json", scenario.name())));
        if let Some(kept) = file.as_deref().and_then(|file| read(file, &key)) {
            return Ok(kept);
        }
        let reference = Self::compute(scenario, S::STEPS)?;
        if let Some(file) = file {
            write(&file, &key, &reference);
        }
        Ok(reference)
    }

    fn compute<S: Sampled>(scenario: &S, steps: [f64; 2]) -> Result<Self, ConfigError> {
        let mut runs = Vec::new();
        for step in steps {
            progress(&format!("{}: reference at {step:e} s", scenario.name()));
            runs.push(scenario.samples(&S::fine(step))?);
        }
        let samples = runs.pop().expect("two runs");
        let uncertainty = Distance::between(&samples, &runs[0]);
        Ok(Self { samples, sample: S::SAMPLE, uncertainty, steps })
    }
}

/// The reference on disk. What is not there, not readable or of another scenario is computed anew.
fn read(file: &Path, key: &str) -> Option<Reference> {
    let (kept, reference): (String, Reference) = serde_json::from_str(&std::fs::read_to_string(file).ok()?).ok()?;
    (kept == key).then_some(reference)
}

fn write(file: &Path, key: &str, reference: &Reference) {
    let text = serde_json::to_string(&(key, reference)).expect("plain data");
    if let Err(error) = std::fs::write(file, text) {
        progress(&format!("{}: not kept, {error}", file.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{self, Scenario};

    #[test]
    fn distance_is_that_of_the_worst_link_over_the_run_and_at_its_end() {
        let still: Positions = (0..11).map(|i| vec![f64::from(i), 0.0]).collect();
        let (mut early, mut late) = (still.clone(), still.clone());
        early[10][0] += 4e-3;
        late[5][1] = 3e-3;
        let distance = Distance::between(&[still.clone(), still.clone()], &[early, late]);
        assert!((distance.worst - 4e-3).abs() < 1e-15 && (distance.end - 3e-3).abs() < 1e-15);
    }

    #[test]
    fn a_kept_reference_is_used_only_for_its_own_scenario() {
        let folder = std::env::temp_dir().join(format!("snake-bench-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let reference = Reference {
            samples: vec![vec![vec![1.0, 2.0]]],
            sample: Scenario::SAMPLE,
            uncertainty: Distance { worst: 0.0, end: 0.0 },
            steps: Scenario::STEPS,
        };
        let file = folder.join("reference.json");
        write(&file, "this", &reference);
        assert_eq!(read(&file, "this"), Some(reference));
        assert_eq!(read(&file, "other"), None);
        std::fs::remove_dir_all(folder).unwrap();
    }

    /// The two runs agree to a fiftieth of a millimetre at every sample even at ten times the steps.
    #[test]
    fn the_reference_of_free_undulation_is_converged() {
        let reference = Reference::compute(&scenes::all()[0], Scenario::STEPS.map(|step| 10.0 * step)).unwrap();
        assert!(reference.uncertainty.worst < 2e-5, "{:?}", reference.uncertainty);
        assert_eq!(reference.samples.len(), 50);
    }
}
