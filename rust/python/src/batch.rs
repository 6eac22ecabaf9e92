//! `Batch`: environments stepped side by side, writing into arrays that Python passes.

use nalgebra::Vector3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadwriteArray2, PyReadwriteArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use pythonize::pythonize;
use snake_core::ConfigError;
use snake_core::batch::Batch as Rows;
use snake_core::environment::quantity::quantities_of;
use snake_core::environment::{EnvConfig, Environment, ModelKind, RobotModel};
use snake_core::error::require;

use crate::config::environment_config;
use crate::core::{Core, of_model};
use crate::ffi::{CoreError, detached, interruptible, signal_raised};
use crate::from_python::from_python;
use crate::memory;
use crate::numbers::set_array;
use crate::parameters::ParameterArrays;
use crate::scenes::Scenes;
use crate::step_buffers::{StepBuffers, shape};
use crate::world::WorldConfig;

/// n environments of one configuration.
///
/// Results go to step buffers, a tuple of C-contiguous arrays: observation float32 (n, o), reward float64 (n,),
/// terminated and truncated bool (n,), signals float64 (k, n), flags bool and counts int64, which repeat
/// the bool and int rows of signals. Rows outside a mask, bool (n,), stay untouched.
#[pyclass(module = "snake_env._native")]
pub struct Batch {
    config: EnvConfig,
    core: Core,
    scenes: Scenes,
    /// A signal handler has ended a call, and has left robots at the start of other episodes.
    #[pyo3(get)]
    is_interrupted: bool,
    /// Actions of the step at hand.
    actions: Vec<f64>,
}

#[pymethods]
impl Batch {
    #[new]
    fn new(py: Python<'_>, config: &Bound<'_, PyAny>, num_envs: usize, num_threads: usize) -> PyResult<Self> {
        let config = environment_config(config).map_err(CoreError::from)?;
        let core = detached(py, || {
            let links = config.robot.links;
            let obstacles = config.scene.as_ref().map_or(0, |scene| scene.obstacles.len());
            let bytes = memory::of_batch(config.model, links, obstacles, num_envs, num_threads);
            memory::require_memory("num_envs", num_envs, &format!("{num_envs} robots of {links} links"), bytes)?;
            Ok(Core::new(&config, num_envs, num_threads)?)
        })?;
        of_model!(&core, core => core.interrupt().ask_with(signal_raised));
        let actions = vec![0.0; num_envs * core.action_size()];
        Ok(Self { actions, scenes: Scenes::default(), is_interrupted: false, config, core })
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
        self.is_interrupted = true;
        interruptible(py, || {
            of_model!(core, core => core.reset(mask, &seeds, out));
            Ok(())
        })?;
        self.is_interrupted = false;
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
        self.is_interrupted = true;
        interruptible(py, || {
            of_model!(core, core => core.step(actions, active, out));
            Ok(())
        })?;
        self.is_interrupted = false;
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

    /// The difficulty of the episodes that each row begins from now on.
    fn difficulty(&self) -> Vec<f64> {
        let core = &self.core;
        of_model!(core, core => (0..core.num_envs()).map(|row| core.difficulty(row)).collect())
    }

    /// Sets it in some rows, or in none.
    fn set_difficulty(&mut self, rows: Vec<usize>, difficulty: Vec<f64>) -> PyResult<()> {
        self.require_rows(&rows, difficulty.len(), "difficulty")?;
        let core = &mut self.core;
        Ok(of_model!(core, batch => batch.set_difficulty(&rows, &difficulty)).map_err(CoreError::from)?)
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

    /// Continues rows from states of the same configuration, or none of them.
    fn set_states(&mut self, py: Python<'_>, rows: Vec<usize>, states: Vec<Vec<u8>>) -> PyResult<()> {
        self.require_rows(&rows, states.len(), "states")?;
        let core = &mut self.core;
        of_model!(core, core => detached(py, || {
            let states = states.iter().map(|state| postcard::from_bytes(state).map_err(|e| bad_state(&e)));
            Ok(core.restore(&rows, &states.collect::<Result<Vec<_>, CoreError>>()?)?)
        }))
    }

    /// Changes the momentum of the links of rows by impulses at their CGs, float64 (k, links, 3), frame I \[N s\].
    fn push(&mut self, rows: Vec<usize>, impulses: PyReadonlyArray3<'_, f64>) -> PyResult<()> {
        rows.iter().try_for_each(|row| self.require_row(*row))?;
        let core = &mut self.core;
        let links = of_model!(&*core, core => core.environment(0).robot().link_count());
        shape("impulse", &impulses, &[rows.len(), links, 3])?;
        let impulses = impulses.as_slice()?;
        of_model!(core, core => {
            for (row, impulses) in rows.iter().zip(impulses.chunks_exact(3 * links)) {
                core.strike(*row, impulses.chunks_exact(3).map(|impulse| Vector3::new(impulse[0], impulse[1], impulse[2])));
            }
        });
        Ok(())
    }

    /// Changes how each robot differs from the configured one, until its next episode, or changes none.
    fn set_parameters(&mut self, arrays: ParameterArrays<'_>) -> PyResult<()> {
        let n = self.core.num_envs();
        arrays.check_shapes(n)?;
        let core = &mut self.core;
        of_model!(core, core => {
            let present = |core: &Rows<_>, row: usize| core.environment(row).drawn().parameters;
            let wanted = |core: &Rows<_>, row: usize| arrays.of_row(row, present(core, row));
            // Ranges are checked where there is something new.
            if (0..n).any(|row| wanted(core, row).is_ok_and(|wanted| wanted != present(core, row))) {
                arrays.check_values(&self.config)?;
                for row in 0..n {
                    core.set_parameters(row, wanted(core, row)?);
                }
            }
        });
        Ok(())
    }

    /// Prescribes where the next episodes of rows take place, or none of them; see [`WorldConfig`].
    fn set_next_worlds(&mut self, py: Python<'_>, rows: Vec<usize>, worlds: Vec<Bound<'_, PyDict>>) -> PyResult<()> {
        self.require_rows(&rows, worlds.len(), "worlds")?;
        let core = &mut self.core;
        let robot = of_model!(&*core, core => core.environment(0).robot().clone());
        self.scenes.forget(py);
        let mut prescribed = Vec::with_capacity(worlds.len());
        for world in worlds {
            let rest = world.copy()?;
            let obstacles = match rest.get_item("scene")? {
                Some(scene) => Some(self.scenes.obstacles(&scene, &self.config)?),
                None => None,
            };
            if obstacles.is_some() {
                rest.del_item("scene")?;
            }
            let world: WorldConfig = from_python(&rest).map_err(CoreError::from)?;
            prescribed.push(world.resolve(obstacles, &self.config, &robot).map_err(CoreError::from)?);
        }
        Ok(of_model!(core, core => core.set_next_worlds(&rows, prescribed)).map_err(CoreError::from)?)
    }

    /// Seed and number of the next episode of a row.
    fn next_episode(&self, row: usize) -> PyResult<(u64, u64)> {
        self.require_row(row)?;
        let core = &self.core;
        Ok(of_model!(core, core => core.environment(row).next_episode()))
    }

    /// The quantities of the state by name, float64 (n, ...); see "state" of `layout`.
    fn state<'py>(&self, py: Python<'py>, rows: Vec<usize>) -> PyResult<Bound<'py, PyDict>> {
        rows.iter().try_for_each(|row| self.require_row(*row))?;
        let core = &self.core;
        of_model!(core, core => read_state(py, core, &rows))
    }

    /// Writes quantities of the state of all rows into arrays, float64 (n, ...).
    fn read(&self, names: Vec<String>, mut arrays: Vec<PyReadwriteArrayDyn<'_, f64>>) -> PyResult<()> {
        let core = &self.core;
        of_model!(core, core => read_into(core, &names, &mut arrays))
    }

    /// The scene of a row, as a mapping with the fields of a `Scene`.
    fn scene<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Bound<'py, PyAny>> {
        self.require_row(row)?;
        let core = &self.core;
        let obstacles = of_model!(core, core => core.environment(row).obstacles());
        Ok(pythonize(py, &self.config.scene(obstacles))?)
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, usize, usize)> {
        Ok((pythonize(py, &self.config)?, self.core.num_envs(), self.core.num_threads()))
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        (0..self.core.num_envs()).map(|row| self.get_state(py, row)).collect()
    }

    fn __setstate__(&mut self, py: Python<'_>, states: Vec<Vec<u8>>) -> PyResult<()> {
        self.set_states(py, (0..self.core.num_envs()).collect(), states)
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

    /// Each row exists and has one value.
    fn require_rows(&self, rows: &[usize], values: usize, name: &str) -> Result<(), CoreError> {
        rows.iter().try_for_each(|row| self.require_row(*row))?;
        Ok(require(values == rows.len(), name, format!("{values} values"), "one per row")?)
    }

    fn require_row(&self, row: usize) -> Result<(), CoreError> {
        let n = self.core.num_envs();
        Ok(require(row < n, "row", row, &format!("an integer in [0, {n})"))?)
    }
}

fn read_state<'py, M: RobotModel>(py: Python<'py>, batch: &Rows<M>, rows: &[usize]) -> PyResult<Bound<'py, PyDict>> {
    let robot = batch.environment(0).robot();
    let dict = PyDict::new(py);
    for quantity in quantities_of::<M>() {
        let shape = (quantity.shape)(robot);
        let size = shape.iter().product();
        let mut values = vec![0.0; rows.len() * size];
        batch.read(quantity, rows, size, &mut values);
        set_array(&dict, quantity.name, values, &[&[rows.len()], shape.as_slice()].concat())?;
    }
    let environments = || rows.iter().map(|row| batch.environment(*row));
    let pegs = environments().map(|one| one.pegs().iter().map(|peg| [peg.radius, peg.x, peg.y]).collect());
    set_ragged::<3>(&dict, "obstacles", &pegs.collect::<Vec<_>>())?;
    let moved = environments().map(|one| one.movables().map(|one| one.pose.xy().into()).collect());
    set_ragged::<2>(&dict, "obstacle_position", &moved.collect::<Vec<_>>())?;
    let turned = environments().map(|one| one.movables().map(|one| [one.pose.z]).collect());
    set_ragged::<1>(&dict, "obstacle_angle", &turned.collect::<Vec<_>>())?;
    let raised = environments().map(|one| one.movables().map(|one| [one.height]).collect());
    set_ragged::<1>(&dict, "obstacle_height", &raised.collect::<Vec<_>>())?;
    let forces: Vec<_> = environments().map(Environment::obstacle_force).collect();
    match M::KIND {
        ModelKind::Spatial => set_ragged(&dict, "obstacle_force", &forces)?,
        _ => {
            let in_plane = |[x, y, _]: &[f64; 3]| [*x, *y];
            let forces: Vec<Vec<_>> = forces.iter().map(|force| force.iter().map(in_plane).collect()).collect();
            set_ragged(&dict, "obstacle_force", &forces)?;
        }
    }
    let paths = environments().map(|one| one.goal().path().iter().map(|point| [point.x, point.y]).collect());
    set_ragged::<2>(&dict, "path", &paths.collect::<Vec<_>>())?;
    Ok(dict)
}

fn read_into<M: RobotModel>(
    batch: &Rows<M>,
    names: &[String],
    arrays: &mut [PyReadwriteArrayDyn<'_, f64>],
) -> PyResult<()> {
    let rows: Vec<usize> = (0..batch.num_envs()).collect();
    for (name, array) in names.iter().zip(arrays) {
        let found = quantities_of::<M>().find(|quantity| quantity.name == name);
        let quantity = found.ok_or_else(|| ConfigError::new("name", name, "a quantity of the state"));
        let quantity = quantity.map_err(CoreError::from)?;
        let shape_of_row = (quantity.shape)(batch.environment(0).robot());
        shape(name, &*array, &[&[rows.len()], shape_of_row.as_slice()].concat())?;
        batch.read(quantity, &rows, shape_of_row.iter().product(), array.as_slice_mut()?);
    }
    Ok(())
}

/// Tables of different lengths as one array, filled up with rows that are not numbers.
fn set_ragged<const N: usize>(dict: &Bound<'_, PyDict>, name: &str, tables: &[Vec<[f64; N]>]) -> PyResult<()> {
    let longest = tables.iter().map(Vec::len).max().unwrap_or(0);
    let rows = tables.iter().flat_map(|table| {
        let missing = longest - table.len();
        table.iter().copied().chain(std::iter::repeat_n([f64::NAN; N], missing))
    });
    let shape = [tables.len(), longest, N];
    set_array(dict, name, rows.flatten().collect(), if N == 1 { &shape[..2] } else { &shape })
}

fn bad_state(error: &postcard::Error) -> CoreError {
    ConfigError::new("state", error, "a state saved by an environment of the same configuration").into()
}
