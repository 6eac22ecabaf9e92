//! The robot model of chapter 6: scripted runs, and its matrices for people.

use nalgebra::{DMatrix, DVector};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::error::{finite, require};
use snake_core::gait::{Gait, JointReference};
use snake_core::minimal::{
    ControlPlant, FeedbackConfig, FrictionLaw, Ground, MinimalState, Model, NoiseConfig, ProcessPlant, SmoothLaw,
};
use snake_core::minimal_simulation::{MinimalConfig, MinimalSimulation};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::stepper::{IntegratorConfig, Tally};

use crate::config::decode;
use crate::gait::GaitConfig;
use crate::gate::{Fault, detached};
use crate::numbers::set_array;
use crate::run::{SignalWatch, StartConfig, count_samples};

/// The ground as the user writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundConfig {
    friction: [f64; 2],
    viscous: [f64; 2],
    friction_law: String,
    smoothing: f64,
}

impl GroundConfig {
    /// Checks coefficients and law.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let ground = Ground { coulomb: self.friction, viscous: self.viscous };
        ground.validate()?;
        FrictionLaw::new(&self.friction_law, self.smoothing).map(drop)
    }

    fn ground(&self) -> Result<Ground, ConfigError> {
        let ground = Ground { coulomb: self.friction, viscous: self.viscous };
        ground.validate().map_err(|e| e.inside("scene"))?;
        Ok(ground)
    }

    fn law(&self) -> Result<FrictionLaw, ConfigError> {
        FrictionLaw::new(&self.friction_law, self.smoothing).map_err(|e| e.inside("scene"))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunConfig {
    robot: RobotConfig,
    scene: GroundConfig,
    gait: GaitConfig,
    controller: FeedbackConfig,
    integrator: IntegratorConfig,
    start: StartConfig,
    duration: f64,
    sample: f64,
    noise: NoiseConfig,
    seed: u64,
}

/// Simulates one robot; returns the fields of `Trajectory`.
///
/// # Errors
/// ConfigError, DivergenceError, or the exception of a signal handler.
#[pyfunction]
pub fn simulate_minimal<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    detached(py, || run(&decode(config_json)?))?.into_dict(py)
}

fn run(config: &RunConfig) -> Result<Samples, Fault> {
    let mut simulation = MinimalSimulation::new(&MinimalConfig {
        robot: config.robot.clone(),
        ground: config.scene.ground()?,
        friction_law: config.scene.law()?,
        controller: config.controller,
        integrator: config.integrator,
        noise: config.noise,
        seed: config.seed,
    })?;
    let joints = simulation.model().joint_count();
    let gait = config.gait.planar(joints).map_err(|e| e.inside("gait"))?;
    simulation.place(&start_state(config, simulation.model(), &gait)?);
    let rows = count_samples(config.duration, config.sample)?;
    let mut samples = Samples::default();
    let mut watch = SignalWatch::new();
    samples.push(0.0, &mut simulation, &Interval::default());
    for k in 1..=rows {
        let interval = advance(&mut simulation, config.sample, &gait, &mut watch)?;
        samples.push(k as f64 * config.sample, &mut simulation, &interval);
    }
    Ok(samples)
}

/// O_2 lies half a link behind the CG of the first link.
fn start_state(config: &RunConfig, model: &Model, gait: &Gait) -> Result<MinimalState, ConfigError> {
    let [x, y] = config.start.position;
    let heading = finite("start.heading", config.start.heading)?;
    let half = model.links[0].half_length;
    let mut state = MinimalState::zero(model.degrees());
    state.q[0] = finite("start.position[0]", x)? - half * heading.cos();
    state.q[1] = finite("start.position[1]", y)? - half * heading.sin();
    state.q[2] = heading;
    state.q[3..].copy_from_slice(&config.start.joint_angle(model.joint_count(), gait)?);
    Ok(state)
}

/// Moves on by one sample interval, in parts short enough for signals to be heard.
fn advance(
    simulation: &mut MinimalSimulation,
    duration: f64,
    gait: &Gait,
    watch: &mut SignalWatch,
) -> Result<Interval, Fault> {
    let mut interval = Interval::default();
    let parts = (duration / LONGEST_PART).ceil().max(1.0);
    for _ in 0..parts as u64 {
        let before = simulation.state().time;
        if !simulation.advance(duration / parts, gait) {
            return Err(Fault::Diverged(before));
        }
        interval.add(simulation.tally());
        watch.poll()?;
    }
    Ok(interval)
}

/// \[s\]
const LONGEST_PART: f64 = 0.1;

/// What happened during a sample interval.
#[derive(Default)]
struct Interval {
    residual: f64,
    iterations: f64,
    misses: f64,
    fallbacks: f64,
}

impl Interval {
    fn add(&mut self, tally: &Tally) {
        self.residual = self.residual.max(tally.residual);
        self.iterations += f64::from(tally.iterations);
        self.misses += f64::from(tally.misses);
        self.fallbacks += f64::from(tally.fallbacks);
    }
}

/// The columns of a `Trajectory`, row by row.
#[derive(Default)]
struct Samples {
    links: usize,
    time: Vec<f64>,
    position: Vec<f64>,
    angle: Vec<f64>,
    joint_angle: Vec<f64>,
    joint_torque: Vec<f64>,
    passive_velocity: Vec<f64>,
    residual: Vec<f64>,
    iterations: Vec<f64>,
    misses: Vec<f64>,
    fallbacks: Vec<f64>,
    energy: Vec<f64>,
}

impl Samples {
    fn push(&mut self, time: f64, simulation: &mut MinimalSimulation, interval: &Interval) {
        let poses = simulation.poses();
        self.links = poses.len();
        self.time.push(time);
        self.position.extend(poses.iter().flat_map(|pose| [pose.x, pose.y]));
        self.angle.extend(poses.iter().map(|pose| pose.z));
        self.joint_angle.extend_from_slice(simulation.state().phi());
        self.joint_torque.extend_from_slice(simulation.torque());
        self.passive_velocity.extend(simulation.state().passive_velocity().iter());
        self.residual.push(interval.residual);
        self.iterations.push(interval.iterations);
        self.misses.push(interval.misses);
        self.fallbacks.push(interval.fallbacks);
        self.energy.push(simulation.kinetic_energy());
    }

    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let (rows, links) = (self.time.len(), self.links);
        let dict = PyDict::new(py);
        set_array(&dict, "time", self.time, &[rows])?;
        set_array(&dict, "position", self.position, &[rows, links, 2])?;
        set_array(&dict, "angle", self.angle, &[rows, links])?;
        set_array(&dict, "joint_angle", self.joint_angle, &[rows, links - 1])?;
        set_array(&dict, "joint_torque", self.joint_torque, &[rows, links - 1])?;
        set_array(&dict, "contact_force", vec![0.0; 2 * rows * links], &[rows, links, 2])?;
        set_array(&dict, "passive_velocity", self.passive_velocity, &[rows, 3])?;
        set_array(&dict, "residual", self.residual, &[rows])?;
        set_array(&dict, "iterations", self.iterations, &[rows])?;
        set_array(&dict, "misses", self.misses, &[rows])?;
        set_array(&dict, "fallbacks", self.fallbacks, &[rows])?;
        set_array(&dict, "energy", self.energy, &[rows])?;
        dict.set_item("max_joint_gap", 0.0)?;
        dict.set_item("max_penetration", 0.0)?;
        Ok(dict)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateConfig {
    robot: RobotConfig,
    scene: GroundConfig,
    #[serde(alias = "q", alias = "phi")]
    coordinates: Vec<f64>,
    #[serde(alias = "qdot", alias = "nu")]
    velocities: Vec<f64>,
}

impl StateConfig {
    fn model(&self) -> Result<(Model, SmoothLaw), ConfigError> {
        let robot = Robot::new(&self.robot).map_err(|e| e.inside("robot"))?;
        let law = match self.scene.law()? {
            FrictionLaw::Smooth(law) => law,
            FrictionLaw::SetValued => {
                let expected = "\"arctan\" or \"ellipse\": a set-valued force is no function of the state";
                return Err(ConfigError::new("scene.friction_law", "\"set-valued\"", expected));
            }
        };
        Ok((Model::new(&robot, &self.scene.ground()?), law))
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
pub fn process_plant<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    let (plant, links) = detached(py, || {
        let config: StateConfig = decode(config_json)?;
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
pub fn control_plant<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    let (plant, links) = detached(py, || {
        let config: StateConfig = decode(config_json)?;
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

/// References of the yaw angles, or with `vertical` of the pitch angles, at given times: angle, rate and acceleration of
/// (T, joints) each.
///
/// # Errors
/// ConfigError names what is not admissible.
#[pyfunction]
pub fn gait_reference<'py>(
    py: Python<'py>,
    gait_json: &str,
    joints: usize,
    times: Vec<f64>,
    vertical: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let gait = detached(py, || {
        let config: GaitConfig = decode(gait_json)?;
        config.validate().map_err(|e| e.inside("gait"))?;
        Ok(if vertical { config.pitch(joints) } else { config.yaw(joints) })
    })?;
    let targets = times.iter().flat_map(|&time| (0..joints).map(move |joint| (joint, time)));
    let targets: Vec<_> = targets.map(|(joint, time)| gait.target(joint, time)).collect();
    let dict = PyDict::new(py);
    let shape = [times.len(), joints];
    set_array(&dict, "angle", targets.iter().map(|target| target.angle).collect(), &shape)?;
    set_array(&dict, "rate", targets.iter().map(|target| target.rate).collect(), &shape)?;
    set_array(&dict, "acceleration", targets.iter().map(|target| target.acceleration).collect(), &shape)?;
    Ok(dict)
}
