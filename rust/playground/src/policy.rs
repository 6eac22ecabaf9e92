//! A trained network: the policies that the Python package ships, evaluated as `snake_env.policies.Network` does.

use nalgebra::{DMatrix, DVector};
use safetensors::{Dtype, SafeTensors};
use serde::Deserialize;
use serde_json::{Value, json};

/// Layers with tanh between them, symmetrised and with running means of the observation where the file has them.
#[derive(Debug, Clone)]
pub struct Policy {
    layers: Vec<(DMatrix<f64>, DVector<f64>)>,
    /// Signs of observation and action under reflection.
    mirror: Option<(DVector<f64>, DVector<f64>)>,
    config: Config,
    /// Time constant for time constant the running means of the remembered elements; empty before the first observation
    /// of an episode.
    traces: Vec<f32>,
}

/// The part of the training's configuration that the network needs.
#[derive(Debug, Clone, Deserialize)]
struct Config {
    #[serde(default)]
    env_id: String,
    #[serde(default)]
    env: Value,
    #[serde(default)]
    policy: Memory,
}

#[derive(Debug, Clone, Default, Deserialize)]
struct Memory {
    /// Time constants \[s\].
    #[serde(default, alias = "traces")]
    memory: Vec<f64>,
}

impl Policy {
    /// # Errors
    /// What is missing in the file.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| error.to_string())?;
        let file = SafeTensors::deserialize(bytes).map_err(|error| error.to_string())?;
        let config = header.metadata().as_ref().and_then(|found| found.get("config"));
        let config = config.ok_or("expected a configuration in the metadata of the file")?;
        let config: Config = serde_json::from_str(config).map_err(|error| error.to_string())?;
        let vector = |name: &str| Ok::<_, String>(DVector::from_vec(numbers(&file, name)?.1));
        let count = file.names().iter().filter(|name| name.starts_with("actor.") && name.ends_with(".weight")).count();
        let mut layers = Vec::new();
        for layer in 0..count {
            let (shape, weight) = numbers(&file, &format!("actor.{layer}.weight"))?;
            let [rows, columns] = shape[..] else { return Err(format!("actor.{layer}.weight: expected a matrix")) };
            layers.push((DMatrix::from_row_slice(rows, columns, &weight), vector(&format!("actor.{layer}.bias"))?));
        }
        if layers.is_empty() {
            return Err("expected arrays actor.<k>.weight".into());
        }
        let has_mirror = file.names().contains(&"mirror.action");
        let mirror = has_mirror.then(|| Ok::<_, String>((vector("mirror.observation")?, vector("mirror.action")?)));
        if file.names().contains(&"mirror.order") {
            return Err("mirror.order: expected observations whose elements keep their places in the mirror".into());
        }
        Ok(Self { layers, mirror: mirror.transpose()?, config, traces: Vec::new() })
    }

    /// Id and keywords of the environment of its training.
    pub fn environment(&self) -> Value {
        json!({"env_id": self.config.env_id, "env": self.config.env})
    }

    /// Elements of an observation with so many remembered ones that the network takes.
    pub fn inputs(&self, remembered: usize) -> usize {
        self.layers[0].0.ncols() - self.config.policy.memory.len() * remembered
    }

    pub fn outputs(&self) -> usize {
        self.layers[self.layers.len() - 1].1.len()
    }

    /// The next observation begins an episode.
    pub fn forget(&mut self) {
        self.traces.clear();
    }

    /// The mean action; `remembered` are the places of the elements with running means, `period` the time between two
    /// observations \[s\].
    pub fn act(&mut self, observation: &[f32], remembered: &[usize], period: f64) -> Vec<f64> {
        self.remember(observation, remembered, period);
        let seen = observation.iter().chain(&self.traces).map(|value| f64::from(*value));
        let seen = DVector::from_iterator(observation.len() + self.traces.len(), seen);
        let mut action = self.output(&seen);
        if let Some((of_observation, of_action)) = &self.mirror {
            let mirrored = self.output(&of_observation.component_mul(&seen));
            action = 0.5 * (action + of_action.component_mul(&mirrored));
        }
        // As float32, like the actions that Python hands to an environment.
        action.iter().map(|value| f64::from(*value as f32)).collect()
    }

    fn remember(&mut self, observation: &[f32], remembered: &[usize], period: f64) {
        let times = &self.config.policy.memory;
        let is_new = self.traces.is_empty();
        self.traces.resize(times.len() * remembered.len(), 0.0);
        for (traces, time) in self.traces.chunks_exact_mut(remembered.len().max(1)).zip(times) {
            let keep = (-period / time).exp() as f32;
            for (trace, place) in traces.iter_mut().zip(remembered) {
                let now = observation[*place];
                let before = if is_new { now } else { *trace };
                *trace = now + keep * (before - now);
            }
        }
    }

    fn output(&self, seen: &DVector<f64>) -> DVector<f64> {
        let (weight, bias) = &self.layers[self.layers.len() - 1];
        let hidden = &self.layers[..self.layers.len() - 1];
        let last = hidden.iter().fold(seen.clone(), |x, (weight, bias)| (weight * x + bias).map(f64::tanh));
        weight * last + bias
    }
}

/// Shape and values of an array of the file.
fn numbers(file: &SafeTensors, name: &str) -> Result<(Vec<usize>, Vec<f64>), String> {
    let array = file.tensor(name).map_err(|error| format!("{name}: {error}"))?;
    if array.dtype() != Dtype::F32 {
        return Err(format!("{name}: expected float32, found {:?}", array.dtype()));
    }
    let value = |bytes: &[u8]| f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    Ok((array.shape().to_vec(), array.data().chunks_exact(4).map(value).collect()))
}
