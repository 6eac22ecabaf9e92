//! The arrays that Python passes for the results of a step.

use numpy::{PyArray, PyReadwriteArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use snake_core::ConfigError;
use snake_core::batch::Outputs;
use snake_core::environment::signal::SignalKind;

use crate::core::Core;
use crate::ffi::CoreError;

/// A tuple of C-contiguous arrays for n rows; `flags` and `counts` repeat the bool and int rows of `signals` with their
/// own types.
#[derive(FromPyObject)]
pub struct StepBuffers<'py> {
    /// (n, observation_size)
    #[pyo3(item(0))]
    observation: PyReadwriteArray2<'py, f32>,
    /// (n)
    #[pyo3(item(1))]
    reward: PyReadwriteArray1<'py, f64>,
    /// (n)
    #[pyo3(item(2))]
    terminated: PyReadwriteArray1<'py, bool>,
    /// (n)
    #[pyo3(item(3))]
    truncated: PyReadwriteArray1<'py, bool>,
    /// (signals, n)
    #[pyo3(item(4))]
    signals: PyReadwriteArray2<'py, f64>,
    /// (bool signals, n)
    #[pyo3(item(5))]
    flags: PyReadwriteArray2<'py, bool>,
    /// (int signals, n)
    #[pyo3(item(6))]
    counts: PyReadwriteArray2<'py, i64>,
}

impl StepBuffers<'_> {
    /// # Errors
    /// Names the array of the wrong shape.
    pub fn check(&self, batch: &Core) -> Result<(), CoreError> {
        let n = batch.num_envs();
        shape("observation", &self.observation, &[n, batch.observation_size()])?;
        shape("reward", &self.reward, &[n])?;
        shape("terminated", &self.terminated, &[n])?;
        shape("truncated", &self.truncated, &[n])?;
        shape("signals", &self.signals, &[batch.signal_count(), n])?;
        shape("flags", &self.flags, &[batch.rows_of(SignalKind::Bool).len(), n])?;
        shape("counts", &self.counts, &[batch.rows_of(SignalKind::Int).len(), n])
    }

    /// Where the core writes.
    pub fn outputs(&mut self) -> PyResult<Outputs<'_>> {
        Ok(Outputs {
            observation: self.observation.as_slice_mut()?,
            reward: self.reward.as_slice_mut()?,
            terminated: self.terminated.as_slice_mut()?,
            truncated: self.truncated.as_slice_mut()?,
            signals: self.signals.as_slice_mut()?,
        })
    }

    /// Fills `flags` and `counts`.
    pub fn copy_typed(&mut self, batch: &Core) -> PyResult<()> {
        let signals = self.signals.as_slice()?;
        let n = self.reward.len();
        let (flags, counts) = (self.flags.as_slice_mut()?, self.counts.as_slice_mut()?);
        for (typed, row) in flags.chunks_exact_mut(n).zip(batch.rows_of(SignalKind::Bool)) {
            typed.iter_mut().zip(&signals[row * n..]).for_each(|(typed, value)| *typed = *value != 0.0);
        }
        for (typed, row) in counts.chunks_exact_mut(n).zip(batch.rows_of(SignalKind::Int)) {
            typed.iter_mut().zip(&signals[row * n..]).for_each(|(typed, value)| *typed = *value as i64);
        }
        Ok(())
    }

    /// How many episodes of the rows in `active` have ended.
    pub fn ended(&self, active: &[bool]) -> PyResult<usize> {
        let flags = self.terminated.as_slice()?.iter().zip(self.truncated.as_slice()?).zip(active);
        Ok(flags.map(|((terminated, truncated), active)| usize::from(*active & (*terminated | *truncated))).sum())
    }
}

/// # Errors
/// Names the array that does not have the expected shape or is not C-contiguous.
pub fn shape<T, D>(name: &str, array: &Bound<'_, PyArray<T, D>>, expected: &[usize]) -> Result<(), CoreError> {
    if array.shape() == expected && array.is_c_contiguous() {
        return Ok(());
    }
    let layout = if array.is_c_contiguous() { "" } else { ", not C-contiguous" };
    let actual = format!("shape {:?}{layout}", array.shape());
    Err(ConfigError::new(name, actual, format!("shape {expected:?}, C-contiguous")).into())
}
