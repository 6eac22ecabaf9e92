//! The matrices of the minimal model (T ch. 6), for people.

use nalgebra::{DMatrix, DVector};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::error::require;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_thesis::minimal::{ControlPlant, FrictionLaw, Ground, Model, ProcessPlant, SmoothLaw};

use crate::ffi::{CoreError, detached};
use crate::from_python::from_python;
use crate::numbers::set_array;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateConfig {
    robot: RobotConfig,
    scene: SceneConfig,
    #[serde(alias = "q", alias = "phi")]
    coordinates: Vec<f64>,
    #[serde(alias = "qdot", alias = "nu")]
    velocities: Vec<f64>,
}

impl StateConfig {
    fn model(&self) -> Result<(Model, SmoothLaw), ConfigError> {
        let robot = Robot::new(&self.robot).map_err(|e| e.inside("robot"))?;
        Scene::new(&self.scene).map_err(|e| e.inside("scene"))?;
        let law = match FrictionLaw::of(&self.scene) {
            FrictionLaw::Smooth(law) => law,
            FrictionLaw::SetValued => {
                let expected = "\"arctan\" or \"ellipse\": a set-valued force is no function of the state";
                return Err(ConfigError::new("scene.friction_law", "\"set-valued\"", expected));
            }
        };
        Ok((Model::new(&robot, &Ground::of(&self.scene)), law))
    }
}

fn of_length(field: &str, values: &[f64], length: usize) -> Result<(), ConfigError> {
    let admissible = values.len() == length && values.iter().all(|x| x.is_finite());
    require(admissible, field, format!("{values:?}"), &format!("{length} finite numbers"))
}

/// Matrices of (T 6.14) at q, q'.
///
/// # Errors
/// ConfigError names what is not admissible.
#[pyfunction]
pub fn process_plant<'py>(py: Python<'py>, config: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let config: StateConfig = from_python(config).map_err(CoreError::from)?;
    let (plant, links) = detached(py, || {
        let (model, law) = config.model()?;
        of_length("q", &config.coordinates, model.degrees())?;
        of_length("qdot", &config.velocities, model.degrees())?;
        Ok((ProcessPlant::new(&model, law, &config.coordinates, &config.velocities), model.link_count()))
    })?;
    let dict = PyDict::new(py);
    set_matrix(&dict, "M", &plant.mass)?;
    set_matrix(&dict, "C", &plant.coriolis)?;
    set_jacobian(&dict, "J_G", &plant.jacobian_centre, links)?;
    set_jacobian(&dict, "J_F", &plant.jacobian_front, links)?;
    set_jacobian(&dict, "J_R", &plant.jacobian_rear, links)?;
    set_points(&dict, "F_F", &plant.friction_front, links)?;
    set_points(&dict, "F_R", &plant.friction_rear, links)?;
    set_vector(&dict, "friction", &plant.friction())?;
    Ok(dict)
}

/// Matrices of (T 6.37) at phi, nu.
///
/// # Errors
/// ConfigError names what is not admissible.
#[pyfunction]
pub fn control_plant<'py>(py: Python<'py>, config: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let config: StateConfig = from_python(config).map_err(CoreError::from)?;
    let (plant, links) = detached(py, || {
        let (model, law) = config.model()?;
        of_length("phi", &config.coordinates, model.joint_count())?;
        of_length("nu", &config.velocities, model.degrees())?;
        Ok((ControlPlant::new(&model, law, &config.coordinates, &config.velocities), model.link_count()))
    })?;
    let dict = PyDict::new(py);
    set_matrix(&dict, "M", &plant.mass)?;
    set_matrix(&dict, "C", &plant.coriolis)?;
    set_jacobian(&dict, "J_F", &plant.jacobian_front, links)?;
    set_jacobian(&dict, "J_R", &plant.jacobian_rear, links)?;
    set_points(&dict, "F_F", &plant.friction_front, links)?;
    set_points(&dict, "F_R", &plant.friction_rear, links)?;
    for (name, block) in ["M11", "M12", "M21", "M22"].into_iter().zip(plant.mass_blocks()) {
        set_matrix(&dict, name, &block)?;
    }
    set_vector(&dict, "h", &plant.h)?;
    set_vector(&dict, "g", &plant.g)?;
    set_matrix(&dict, "M_V", &plant.viscous)?;
    let joints = plant.joint_dynamics();
    set_matrix(&dict, "M22_bar", &joints.mass)?;
    set_vector(&dict, "h2_bar", &joints.h)?;
    set_vector(&dict, "g2_bar", &joints.g)?;
    Ok(dict)
}

fn set_matrix(dict: &Bound<'_, PyDict>, name: &str, matrix: &DMatrix<f64>) -> PyResult<()> {
    // Column-major storage of the transpose is row-major storage of the matrix.
    set_array(dict, name, matrix.transpose().as_slice().to_vec(), &[matrix.nrows(), matrix.ncols()])
}

/// As (links, 2, n).
fn set_jacobian(dict: &Bound<'_, PyDict>, name: &str, matrix: &DMatrix<f64>, links: usize) -> PyResult<()> {
    set_array(dict, name, matrix.transpose().as_slice().to_vec(), &[links, 2, matrix.ncols()])
}

/// As (links, 2).
fn set_points(dict: &Bound<'_, PyDict>, name: &str, vector: &DVector<f64>, links: usize) -> PyResult<()> {
    set_array(dict, name, vector.as_slice().to_vec(), &[links, 2])
}

fn set_vector(dict: &Bound<'_, PyDict>, name: &str, vector: &DVector<f64>) -> PyResult<()> {
    set_array(dict, name, vector.as_slice().to_vec(), &[vector.len()])
}
