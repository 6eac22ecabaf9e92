//! The arrays that Python passes for how each robot differs from the configured one.

use nalgebra::Vector2;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use snake_core::ConfigError;
use snake_core::environment::{EnvConfig, Randomization};
use snake_core::stepping::PlantParameters;

use crate::ffi::CoreError;
use crate::step_buffers::shape;

/// A tuple of C-contiguous arrays for n rows, each with the meaning and the range of its field in [`Randomization`].
#[derive(FromPyObject)]
pub struct ParameterArrays<'py> {
    /// (n, 2): along and across a link.
    #[pyo3(item(0))]
    friction: PyReadonlyArray2<'py, f64>,
    /// (n)
    #[pyo3(item(1))]
    mass: PyReadonlyArray1<'py, f64>,
    /// (n)
    #[pyo3(item(2))]
    torque_limit: PyReadonlyArray1<'py, f64>,
    /// (n)
    #[pyo3(item(3))]
    backlash: PyReadonlyArray1<'py, f64>,
    /// (n)
    #[pyo3(item(4))]
    stribeck: PyReadonlyArray1<'py, f64>,
}

/// An array by name, its columns, and the range of the field that it is drawn from.
type Column<'a> = (&'static str, &'a [f64], usize, fn(&mut Randomization) -> &mut [f64; 2]);

impl ParameterArrays<'_> {
    /// # Errors
    /// Names the array of the wrong shape.
    pub fn check_shapes(&self, n: usize) -> Result<(), CoreError> {
        shape("friction", &self.friction, &[n, 2])?;
        shape("mass", &self.mass, &[n])?;
        shape("torque_limit", &self.torque_limit, &[n])?;
        shape("backlash", &self.backlash, &[n])?;
        shape("stribeck", &self.stribeck, &[n])
    }

    /// # Errors
    /// Names the element that is not admissible, and its range.
    pub fn check_values(&self, config: &EnvConfig) -> PyResult<()> {
        let columns: [Column; 5] = [
            ("friction", self.friction.as_slice()?, 2, |drawn| &mut drawn.friction),
            ("mass", self.mass.as_slice()?, 1, |drawn| &mut drawn.mass),
            ("torque_limit", self.torque_limit.as_slice()?, 1, |drawn| &mut drawn.torque_limit),
            ("backlash", self.backlash.as_slice()?, 1, |drawn| &mut drawn.backlash),
            ("stribeck", self.stribeck.as_slice()?, 1, |drawn| &mut drawn.stribeck),
        ];
        for (name, values, columns, range) in columns {
            check_column(config, name, values, columns, range).map_err(CoreError::from)?;
        }
        Ok(())
    }

    /// Those of a row; what no array sets is as in `present`.
    pub fn of_row(&self, row: usize, present: PlantParameters) -> PyResult<PlantParameters> {
        let friction = self.friction.as_slice()?;
        let mut parameters = present;
        parameters.friction = Vector2::new(friction[2 * row], friction[2 * row + 1]);
        parameters.mass = self.mass.as_slice()?[row];
        parameters.torque_limit = self.torque_limit.as_slice()?[row];
        parameters.backlash = self.backlash.as_slice()?[row];
        parameters.stribeck = self.stribeck.as_slice()?[row];
        Ok(parameters)
    }
}

/// All values may be drawn: those of a range are checked by its ends.
fn check_column(
    config: &EnvConfig,
    name: &str,
    values: &[f64],
    columns: usize,
    range: fn(&mut Randomization) -> &mut [f64; 2],
) -> Result<(), ConfigError> {
    let element = |index: usize| match columns {
        1 => format!("{name}[{index}]"),
        _ => format!("{name}[{}, {}]", index / columns, index % columns),
    };
    if let Some(index) = values.iter().position(|value| !value.is_finite()) {
        return Err(ConfigError::new(element(index), values[index], "a finite number"));
    }
    let by_size = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    let ends = [(0..values.len()).min_by(by_size), (0..values.len()).max_by(by_size)];
    for index in ends.into_iter().flatten() {
        let mut drawn = config.clone();
        *range(&mut drawn.randomization) = [values[index]; 2];
        drawn.validate().map_err(|error| {
            let expected = error.expected.replace("[low, high] with ", "").replace("low <= high", "value");
            ConfigError::new(element(index), values[index], expected)
        })?;
    }
    Ok(())
}
