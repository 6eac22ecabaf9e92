//! Reference solution of the 3D model at the end of a run: two fine runs, and the distance between them.

use std::path::Path;

use serde::{Deserialize, Serialize};
use snake_core::ConfigError;
use snake_core::stepping::{ImplicitConfig, IntegratorConfig};

use crate::reference::Distance;
use crate::report::progress;

use super::scenes::SpatialScenario;

/// CGs of all links \[m\].
pub type Positions = Vec<[f64; 3]>;

/// Link whose distance is reported apart, 0-based: the middle of Aiko.
const MIDDLE: usize = 5;

/// Steps of the two runs \[s\].
const STEPS: [f64; 2] = [2.5e-4, 1.25e-4];
const TOLERANCE: f64 = 1e-9;

/// The converged end of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpatialReference {
    /// Link CGs at the end, from the finer run \[m\].
    pub links: Positions,
    /// Distance between the two runs: the accuracy of the reference \[m\].
    pub uncertainty: Distance,
    pub steps: [f64; 2],
    pub tolerance: f64,
}

/// Worst distance of a link, and that of link 6 \[m\].
pub fn distance(a: &Positions, b: &Positions) -> Distance {
    let apart = |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let distance: Vec<f64> = a.iter().zip(b).map(apart).collect();
    Distance { worst: distance.iter().copied().fold(0.0, f64::max), link6: distance[MIDDLE.min(a.len() - 1)] }
}

impl SpatialReference {
    /// The reference of a scenario, from `cache` if it holds one of the same scenario and steps.
    ///
    /// # Errors
    /// The scenario is not admissible.
    pub fn of(scenario: &SpatialScenario, cache: Option<&Path>) -> Result<Self, ConfigError> {
        let key = format!("{}\n{:?}", serde_json::to_string(scenario).expect("plain data"), fine(STEPS[1]));
        let file = cache.map(|folder| folder.join(format!("reference-{}.json", scenario.name)));
        if let Some(kept) = file.as_deref().and_then(|file| read(file, &key)) {
            return Ok(kept);
        }
        let reference = Self::compute(scenario)?;
        if let Some(file) = file {
            let text = serde_json::to_string(&(key, &reference)).expect("plain data");
            if let Err(error) = std::fs::write(&file, text) {
                progress(&format!("{}: not kept, {error}", file.display()));
            }
        }
        Ok(reference)
    }

    fn compute(scenario: &SpatialScenario) -> Result<Self, ConfigError> {
        let mut ends = Vec::new();
        for step in STEPS {
            progress(&format!("{}: reference at {step:e} s", scenario.name));
            let mut simulation = scenario.simulation(&fine(step))?;
            simulation.advance(scenario.duration, &scenario.gait());
            ends.push(super::scenes::positions(&simulation));
        }
        let links = ends.pop().expect("two runs");
        let uncertainty = distance(&links, &ends[0]);
        Ok(Self { links, uncertainty, steps: STEPS, tolerance: TOLERANCE })
    }
}

fn fine(step: f64) -> IntegratorConfig {
    ImplicitConfig { step: Some(step), tolerance: TOLERANCE, ..ImplicitConfig::default() }.into()
}

/// What is not there, not readable or of another scenario is computed anew.
fn read(file: &Path, key: &str) -> Option<SpatialReference> {
    let (kept, reference): (String, _) = serde_json::from_str(&std::fs::read_to_string(file).ok()?).ok()?;
    (kept == key).then_some(reference)
}
