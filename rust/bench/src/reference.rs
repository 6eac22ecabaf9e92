//! Reference solution at the end of a run: two fine runs, and the distance between them.

use std::path::Path;

use serde::{Deserialize, Serialize};
use snake_core::ConfigError;
use snake_core::gait::Wave;
use snake_core::stepping::{ImplicitConfig, IntegratorConfig};

use crate::report::progress;
use crate::scenes::Scenario;

/// CGs of all links \[m\].
pub type Positions = Vec<[f64; 2]>;

/// Link whose distance is reported apart, 0-based: the middle of Aiko.
const MIDDLE: usize = 5;

/// Worst distance of a link from the reference, and that of link 6 \[m\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Distance {
    pub worst: f64,
    pub link6: f64,
}

impl Distance {
    pub fn between(a: &Positions, b: &Positions) -> Self {
        let distance: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).collect();
        Self { worst: distance.iter().copied().fold(0.0, f64::max), link6: distance[MIDDLE.min(a.len() - 1)] }
    }
}

/// The converged end of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Link CGs at the end, from the finer run \[m\].
    pub links: Positions,
    /// Distance between the two runs: Richardson's estimate of the accuracy of the reference \[m\].
    pub uncertainty: Distance,
    pub steps: [f64; 2],
    pub tolerance: f64,
    pub event_substeps: u32,
}

/// Steps of the two runs \[s\].
const STEPS: [f64; 2] = [1e-4, 5e-5];
const TOLERANCE: f64 = 1e-11;
const EVENT_SUBSTEPS: u32 = 32;

impl Reference {
    /// The reference of a scenario, from `cache` if it holds one of the same scenario and steps.
    ///
    /// # Errors
    /// The scenario is not admissible.
    pub fn of(scenario: &Scenario, cache: Option<&Path>) -> Result<Self, ConfigError> {
        let key = format!("{}\n{:?}", serde_json::to_string(scenario).expect("plain data"), fine(STEPS[1]));
        let file = cache.map(|folder| folder.join(format!("reference-{}.json", scenario.name)));
        if let Some(kept) = file.as_deref().and_then(|file| Kept::read(file, &key)) {
            return Ok(kept);
        }
        let reference = Self::compute(scenario, STEPS)?;
        if let Some(file) = file {
            Kept { key, reference: reference.clone() }.write(&file);
        }
        Ok(reference)
    }

    fn compute(scenario: &Scenario, steps: [f64; 2]) -> Result<Self, ConfigError> {
        let mut ends = Vec::new();
        for step in steps {
            progress(&format!("{}: reference at {step:e} s", scenario.name));
            ends.push(end(scenario, &fine(step))?);
        }
        let links = ends.pop().expect("two runs");
        let uncertainty = Distance::between(&links, &ends[0]);
        Ok(Self { links, uncertainty, steps, tolerance: TOLERANCE, event_substeps: EVENT_SUBSTEPS })
    }
}

fn fine(step: f64) -> IntegratorConfig {
    ImplicitConfig {
        step: Some(step),
        tolerance: TOLERANCE,
        event_substeps: EVENT_SUBSTEPS,
        max_iterations: 2000,
        ..ImplicitConfig::default()
    }
    .into()
}

/// Link CGs at the end of a run.
fn end(scenario: &Scenario, integrator: &IntegratorConfig) -> Result<Positions, ConfigError> {
    let mut simulation = scenario.simulation(integrator)?;
    simulation.advance(scenario.duration, &Wave::default());
    Ok(simulation.state().pose.iter().map(|pose| [pose.x, pose.y]).collect())
}

/// A reference on disk, with the scenario and steps it belongs to.
#[derive(Serialize, Deserialize)]
struct Kept {
    key: String,
    reference: Reference,
}

impl Kept {
    /// What is not there, not readable or of another scenario is computed anew.
    fn read(file: &Path, key: &str) -> Option<Reference> {
        let kept: Self = serde_json::from_str(&std::fs::read_to_string(file).ok()?).ok()?;
        (kept.key == key).then_some(kept.reference)
    }

    fn write(&self, file: &Path) {
        let text = serde_json::to_string(self).expect("plain data");
        if let Err(error) = std::fs::write(file, text) {
            progress(&format!("{}: not kept, {error}", file.display()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes;

    #[test]
    fn distance_is_the_largest_of_any_link_and_that_of_the_sixth() {
        let a: Positions = (0..11).map(|i| [f64::from(i), 0.0]).collect();
        let mut b = a.clone();
        b[5][1] = 3e-3;
        b[10][0] += 4e-3;
        let distance = Distance::between(&a, &b);
        assert!((distance.worst - 4e-3).abs() < 1e-15 && (distance.link6 - 3e-3).abs() < 1e-15);
    }

    #[test]
    fn a_kept_reference_is_used_for_its_own_scenario_alone() {
        let folder = std::env::temp_dir().join(format!("snake-bench-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let kept = Kept {
            key: "this".into(),
            reference: Reference {
                links: vec![[1.0, 2.0]],
                uncertainty: Distance { worst: 0.0, link6: 0.0 },
                steps: STEPS,
                tolerance: TOLERANCE,
                event_substeps: EVENT_SUBSTEPS,
            },
        };
        let file = folder.join("reference.json");
        kept.write(&file);
        assert_eq!(Kept::read(&file, "this"), Some(kept.reference));
        assert_eq!(Kept::read(&file, "other"), None);
        std::fs::remove_dir_all(folder).unwrap();
    }

    /// The two runs agree to a fiftieth of a millimetre even at ten times the steps.
    #[test]
    fn the_reference_of_free_undulation_is_converged() {
        let reference = Reference::compute(&scenes::all()[0], STEPS.map(|step| 10.0 * step)).unwrap();
        assert!(reference.uncertainty.worst < 2e-5, "{:?}", reference.uncertainty);
    }
}
