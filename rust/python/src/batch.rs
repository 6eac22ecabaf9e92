//! `Batch`: environments stepped side by side, writing into arrays that Python passes.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use snake_core::ConfigError;
use snake_core::environment::EnvConfig;
use snake_core::error::require;

use crate::core::{Core, of_model};
use crate::ffi::{CoreError, detached};
use crate::from_python::from_python;
use crate::snapshot;
use crate::step_buffers::{StepBuffers, shape};
use crate::to_python::to_python;

/// n environments of one configuration.
///
/// Results go to step buffers, a tuple of C-contiguous arrays: observation float32 (n, o), reward float64 (n,),
/// terminated and truncated bool (n,), signals float64 (k, n), flags bool and counts int64, which repeat
/// the bool and int rows of signals. Rows outside a mask, bool (n,), stay untouched.
#[pyclass(module = "snake_env._native")]
pub struct Batch {
    config: EnvConfig,
    core: Core,
    /// Actions of the step at hand.
    actions: Vec<f64>,
}

#[pymethods]
impl Batch {
    #[new]
    fn new(py: Python<'_>, config: &Bound<'_, PyAny>, num_envs: usize, num_threads: usize) -> PyResult<Self> {
        let config: EnvConfig = from_python(config).map_err(CoreError::from)?;
        let core = detached(py, || Ok(Core::new(&config, num_envs, num_threads)?))?;
        Ok(Self { actions: vec![0.0; num_envs * core.action_size()], config, core })
    }

    /// Starts an episode in the rows of `mask`: with a seed its first, without one the next of the row.
    fn reset(
        &mut self,
        py: Python<'_>,
        mask: PyReadonlyArray1<'_, bool>,
        seeds: Option<Vec<Option<u64>>>,
        mut buffers: StepBuffers<'_>,
    ) -> PyResult<()> {
        let n = self.core.num_envs();
        let seeds = seeds.unwrap_or_else(|| vec![None; n]);
        shape("mask", &mask, &[n])?;
        require(seeds.len() == n, "seeds", format!("{} seeds", seeds.len()), "one per row").map_err(CoreError::from)?;
        buffers.check(&self.core)?;
        let (core, mask, out) = (&mut self.core, mask.as_slice()?, buffers.outputs()?);
        detached(py, || {
            of_model!(core, core => core.reset(mask, &seeds, out));
            Ok(())
        })?;
        buffers.copy_typed(&self.core)
    }

    /// One control period in the active rows under `actions`, float32 (n, a); returns how many of their
    /// episodes ended.
    fn step(
        &mut self,
        py: Python<'_>,
        actions: PyReadonlyArray2<'_, f32>,
        active: PyReadonlyArray1<'_, bool>,
        mut buffers: StepBuffers<'_>,
    ) -> PyResult<usize> {
        let n = self.core.num_envs();
        shape("action", &actions, &[n, self.core.action_size()])?;
        shape("active", &active, &[n])?;
        buffers.check(&self.core)?;
        let active = active.as_slice()?;
        self.take_actions(actions.as_slice()?, active)?;
        let (core, actions, out) = (&mut self.core, &self.actions, buffers.outputs()?);
        detached(py, || {
            of_model!(core, core => core.step(actions, active, out));
            Ok(())
        })?;
        buffers.copy_typed(&self.core)?;
        buffers.ended(active)
    }

    /// Writes the present observations of the rows in `mask`.
    fn observe(
        &mut self,
        py: Python<'_>,
        mask: PyReadonlyArray1<'_, bool>,
        mut observation: PyReadwriteArray2<'_, f32>,
    ) -> PyResult<()> {
        let (n, size) = (self.core.num_envs(), self.core.observation_size());
        shape("mask", &mask, &[n])?;
        shape("observation", &observation, &[n, size])?;
        let (core, mask, rows) = (&mut self.core, mask.as_slice()?, observation.as_slice_mut()?);
        detached(py, || {
            for (i, row) in rows.chunks_exact_mut(size).enumerate().filter(|(i, _)| mask[*i]) {
                of_model!(core, core => core.observe(i, row));
            }
            Ok(())
        })
    }

    /// The difficulty of the episodes that a row begins from now on.
    fn set_difficulty(&mut self, row: usize, difficulty: f64) -> PyResult<()> {
        self.require_row(row)?;
        let core = &mut self.core;
        Ok(of_model!(core, batch => batch.set_difficulty(row, difficulty)).map_err(CoreError::from)?)
    }

    /// Everything that changes in a row.
    fn get_state<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Bound<'py, PyBytes>> {
        self.require_row(row)?;
        let core = &self.core;
        let bytes = of_model!(core, core => {
            detached(py, || postcard::to_stdvec(&core.save(row)).map_err(|e| bad_state(&e)))?
        });
        Ok(PyBytes::new(py, &bytes))
    }

    /// Continues a row from a state of the same configuration.
    fn set_state(&mut self, py: Python<'_>, row: usize, state: &[u8]) -> PyResult<()> {
        self.require_row(row)?;
        let core = &mut self.core;
        of_model!(core, core => detached(py, || {
            let state = postcard::from_bytes(state).map_err(|e| bad_state(&e))?;
            Ok(core.restore(row, &state)?)
        }))
    }

    /// What a picture of a row shows.
    fn snapshot<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Bound<'py, PyDict>> {
        self.require_row(row)?;
        match &self.core {
            Core::Planar(core) => snapshot::planar(py, core.environment(row)),
            Core::Spatial(core) => snapshot::spatial(py, core.environment(row)),
        }
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, usize, usize)> {
        Ok((to_python(py, &self.config)?, self.core.num_envs(), self.core.num_threads()))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        (0..self.core.num_envs()).map(|row| self.get_state(py, row)).collect()
    }

    fn __setstate__(&mut self, py: Python<'_>, states: Vec<Vec<u8>>) -> PyResult<()> {
        states.iter().enumerate().try_for_each(|(row, state)| self.set_state(py, row, state))
    }
}

impl Batch {
    /// Copies the actions; those of the active rows must be finite.
    fn take_actions(&mut self, actions: &[f32], active: &[bool]) -> Result<(), CoreError> {
        // Both loops run in the registers' lanes; the search for the culprit does not, and is rare.
        if actions.iter().fold(false, |broken, action| broken | !action.is_finite()) {
            self.require_finite(actions, active)?;
        }
        self.actions.iter_mut().zip(actions).for_each(|(kept, given)| *kept = f64::from(*given));
        Ok(())
    }

    fn require_finite(&self, actions: &[f32], active: &[bool]) -> Result<(), ConfigError> {
        let size = self.core.action_size();
        let culprit = (0..actions.len()).find(|index| active[index / size] && !actions[*index].is_finite());
        culprit.map_or(Ok(()), |index| {
            let field = format!("action[{}, {}]", index / size, index % size);
            Err(ConfigError::new(field, actions[index], "a finite number"))
        })
    }

    fn require_row(&self, row: usize) -> Result<(), CoreError> {
        let n = self.core.num_envs();
        Ok(require(row < n, "row", row, &format!("an integer in [0, {n})"))?)
    }
}

fn bad_state(error: &postcard::Error) -> CoreError {
    ConfigError::new("state", error, "a state saved by an environment of the same configuration").into()
}
