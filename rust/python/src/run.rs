//! `simulate`: one scripted robot, sampled.

use std::time::{Duration, Instant};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::error::{finite, positive, require};
use snake_core::gait::{Gait, JointReference};
use snake_core::robot::RobotConfig;
use snake_core::scene::SceneConfig;
use snake_core::simulation::{PlanarSimulation, StepReport};
use snake_core::stepper::IntegratorConfig;

use crate::config::decode;
use crate::gait::GaitConfig;
use crate::gate::{Fault, detached};
use crate::numbers::set_array;

/// Simulates one robot; returns the fields of `Trajectory`.
///
/// # Errors
/// ConfigError, DivergenceError, or the exception of a signal handler.
#[pyfunction]
pub fn simulate<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    detached(py, || Run::new(decode(config_json)?)?.samples())?.into_dict(py)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunConfig {
    #[serde(rename = "model")]
    _model: Model,
    robot: RobotConfig,
    scene: SceneConfig,
    gait: GaitConfig,
    controller: ControllerConfig,
    integrator: IntegratorConfig,
    start: StartConfig,
    duration: f64,
    sample: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Model {
    Planar,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartConfig {
    pub position: [f64; 2],
    pub heading: f64,
    posture: Posture,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Posture {
    Named(String),
    Angles(Vec<f64>),
}

impl StartConfig {
    /// The joint angles of the posture.
    pub fn joint_angle(&self, joints: usize, gait: &Gait) -> Result<Vec<f64>, ConfigError> {
        let expected = format!("\"gait\", \"straight\" or {joints} finite joint angles");
        match &self.posture {
            Posture::Named(name) if name == "gait" => Ok((0..joints).map(|j| gait.target(j, 0.0).angle).collect()),
            Posture::Named(name) if name == "straight" => Ok(vec![0.0; joints]),
            Posture::Named(name) => Err(ConfigError::new("start.posture", format!("{name:?}"), expected)),
            Posture::Angles(angles) => {
                let admissible = angles.len() == joints && angles.iter().all(|angle| angle.is_finite());
                require(admissible, "start.posture", format!("{angles:?}"), &expected).map(|()| angles.clone())
            }
        }
    }
}

/// A scripted run, ready to start.
struct Run {
    simulation: PlanarSimulation,
    gait: Gait,
    sample: f64,
    samples: usize,
    /// Integrator steps in a sample interval.
    steps: usize,
    watch: SignalWatch,
}

impl Run {
    fn new(config: RunConfig) -> Result<Self, ConfigError> {
        let RunConfig { robot, scene, controller, integrator, start, .. } = &config;
        let mut simulation = PlanarSimulation::new(robot, scene, controller, integrator)?;
        let joints = simulation.robot().joint_count();
        let gait = config.gait.planar(joints).map_err(|e| e.inside("gait"))?;
        let [x, y] = start.position;
        finite("start.position[0]", x)?;
        finite("start.position[1]", y)?;
        finite("start.heading", start.heading)?;
        simulation.place_chain(x, y, start.heading, &start.joint_angle(joints, &gait)?);
        let samples = count_samples(config.duration, config.sample)?;
        let steps = integrator.steps_in(config.sample);
        Ok(Self { simulation, gait, sample: config.sample, samples, steps: steps as usize, watch: SignalWatch::new() })
    }

    fn samples(mut self) -> Result<Samples, Fault> {
        let mut samples = Samples::default();
        samples.push(0.0, &self.simulation, &Interval::new(&self.simulation));
        for k in 1..=self.samples {
            let interval = self.advance()?;
            samples.push(k as f64 * self.sample, &self.simulation, &interval);
        }
        Ok(samples)
    }

    /// Moves on by one sample interval, step by step.
    fn advance(&mut self) -> Result<Interval, Fault> {
        let mut interval = Interval::new(&self.simulation);
        let step = self.sample / self.steps as f64;
        for _ in 0..self.steps {
            let report = self.simulation.advance(step, &self.gait);
            if report.diverged {
                return Err(Fault::Diverged(self.simulation.state().time));
            }
            interval.add(&report, &self.simulation);
            self.watch.poll()?;
        }
        interval.finish(self.sample);
        Ok(interval)
    }
}

/// Number of sample intervals in a run.
pub fn count_samples(duration: f64, sample: f64) -> Result<usize, ConfigError> {
    positive("duration", duration)?;
    positive("sample", sample)?;
    let samples = (duration / sample * (1.0 + ROUND_OFF)).floor();
    require(samples <= MAX_SAMPLES, "duration", duration, "at most 1e7 sample intervals")?;
    require(samples >= 1.0, "sample", sample, "no longer than the duration")?;
    Ok(samples as usize)
}

/// A ratio of times this close to a whole number, relatively, counts as whole.
const ROUND_OFF: f64 = 1e-9;

const MAX_SAMPLES: f64 = 1e7;

/// Lets Python's signal handlers run about every 50 ms.
pub struct SignalWatch {
    last: Instant,
}

impl SignalWatch {
    pub fn new() -> Self {
        Self { last: Instant::now() }
    }

    pub fn poll(&mut self) -> PyResult<()> {
        if self.last.elapsed() < Duration::from_millis(50) {
            return Ok(());
        }
        self.last = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}

/// What happened during a sample interval.
struct Interval {
    /// Impulses of the pegs on each link, x and y in turn \[N s\]; after `finish` mean forces \[N\].
    contact_force: Vec<f64>,
    residual: f64,
    iterations: f64,
    misses: f64,
    fallbacks: f64,
    joint_gap: f64,
    penetration: f64,
}

impl Interval {
    /// An interval of no length at the present state.
    fn new(simulation: &PlanarSimulation) -> Self {
        Self {
            contact_force: vec![0.0; 2 * simulation.robot().link_count()],
            residual: 0.0,
            iterations: 0.0,
            misses: 0.0,
            fallbacks: 0.0,
            joint_gap: simulation.joint_gap(),
            penetration: (-simulation.min_gap()).max(0.0),
        }
    }

    fn add(&mut self, report: &StepReport, simulation: &PlanarSimulation) {
        for (sum, impulse) in self.contact_force.chunks_exact_mut(2).zip(simulation.contact_impulse()) {
            sum[0] += impulse.x;
            sum[1] += impulse.y;
        }
        self.residual = self.residual.max(report.residual); // never NaN: the core sees to that
        self.iterations += f64::from(report.iterations);
        self.misses += f64::from(report.misses);
        self.fallbacks += f64::from(report.fallbacks);
        self.joint_gap = self.joint_gap.max(simulation.joint_gap());
        self.penetration = self.penetration.max(-simulation.min_gap());
    }

    /// Impulses become mean forces (T 7.6).
    fn finish(&mut self, duration: f64) {
        self.contact_force.iter_mut().for_each(|impulse| *impulse /= duration);
    }
}

/// The columns of a `Trajectory`, row by row.
#[derive(Default)]
struct Samples {
    time: Vec<f64>,
    position: Vec<f64>,
    angle: Vec<f64>,
    joint_angle: Vec<f64>,
    joint_torque: Vec<f64>,
    contact_force: Vec<f64>,
    residual: Vec<f64>,
    iterations: Vec<f64>,
    misses: Vec<f64>,
    fallbacks: Vec<f64>,
    energy: Vec<f64>,
    max_joint_gap: f64,
    max_penetration: f64,
}

impl Samples {
    fn push(&mut self, time: f64, simulation: &PlanarSimulation, interval: &Interval) {
        let state = simulation.state();
        self.time.push(time);
        self.position.extend(state.pose.iter().flat_map(|pose| [pose.x, pose.y]));
        self.angle.extend(state.pose.iter().map(|pose| pose.z));
        self.joint_angle.extend((0..state.pose.len() - 1).map(|joint| state.joint_angle(joint)));
        self.joint_torque.extend_from_slice(simulation.joint_torque());
        self.contact_force.extend_from_slice(&interval.contact_force);
        self.residual.push(interval.residual);
        self.iterations.push(interval.iterations);
        self.misses.push(interval.misses);
        self.fallbacks.push(interval.fallbacks);
        self.energy.push(simulation.kinetic_energy());
        self.max_joint_gap = self.max_joint_gap.max(interval.joint_gap);
        self.max_penetration = self.max_penetration.max(interval.penetration);
    }

    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let rows = self.time.len();
        let links = self.angle.len() / rows;
        let dict = PyDict::new(py);
        set_array(&dict, "time", self.time, &[rows])?;
        set_array(&dict, "position", self.position, &[rows, links, 2])?;
        set_array(&dict, "angle", self.angle, &[rows, links])?;
        set_array(&dict, "joint_angle", self.joint_angle, &[rows, links - 1])?;
        set_array(&dict, "joint_torque", self.joint_torque, &[rows, links - 1])?;
        set_array(&dict, "contact_force", self.contact_force, &[rows, links, 2])?;
        set_array(&dict, "residual", self.residual, &[rows])?;
        set_array(&dict, "iterations", self.iterations, &[rows])?;
        set_array(&dict, "misses", self.misses, &[rows])?;
        set_array(&dict, "fallbacks", self.fallbacks, &[rows])?;
        set_array(&dict, "energy", self.energy, &[rows])?;
        dict.set_item("max_joint_gap", self.max_joint_gap)?;
        dict.set_item("max_penetration", self.max_penetration)?;
        Ok(dict)
    }
}
