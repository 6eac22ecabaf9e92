//! `simulate_spatial`: one scripted robot of the spatial model, sampled.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::error::{finite, require, within};
use snake_core::gait::{CardanGait, CardanReference};
use snake_core::robot::RobotConfig;
use snake_core::scene::SceneConfig;
use snake_core::simulation::StepReport;
use snake_core::spatial::{Pose, joint_angle, orientation_of};
use snake_core::spatial_simulation::SpatialSimulation;
use snake_core::stepper::IntegratorConfig;

use crate::config::decode;
use crate::gait::GaitConfig;
use crate::gate::{Fault, detached};
use crate::numbers::set_array;
use crate::run::{SignalWatch, count_samples};

/// Simulates one robot of the spatial model; returns the fields of `Trajectory`.
///
/// # Errors
/// ConfigError, DivergenceError, or the exception of a signal handler.
#[pyfunction]
pub fn simulate_spatial<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    detached(py, || Run::new(decode(config_json)?)?.samples())?.into_dict(py)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunConfig {
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
#[serde(deny_unknown_fields)]
struct StartConfig {
    position: Vec<f64>,
    heading: f64,
    pitch: f64,
    roll: Option<f64>,
    posture: Posture,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Posture {
    Named(String),
    Angles(Vec<[f64; 2]>),
    Yaws(Vec<f64>),
}

impl StartConfig {
    /// Places the robot; it rests on the ground unless the position has a third coordinate.
    fn place(&self, simulation: &mut SpatialSimulation, gait: &CardanGait) -> Result<(), ConfigError> {
        let expected = "(x, y) or (x, y, z)";
        require((2..=3).contains(&self.position.len()), "start.position", format!("{:?}", self.position), expected)?;
        for (k, &coordinate) in self.position.iter().enumerate() {
            finite(&format!("start.position[{k}]"), coordinate)?;
        }
        finite("start.heading", self.heading)?;
        within("start.pitch", self.pitch, -FRAC_PI_2, FRAC_PI_2)?;
        let posture = self.joint_angle(simulation.robot().joint_count(), gait)?;
        let roll = finite("start.roll", self.roll.unwrap_or_else(|| self.natural_roll(&posture, gait)))?;
        let height = self.position.get(2).copied();
        let position = Vector3::new(self.position[0], self.position[1], height.unwrap_or(0.0));
        let orientation = orientation_of(self.heading, self.pitch, roll);
        simulation.place_chain(Pose { position, orientation }, &posture);
        if height.is_none() {
            simulation.rest_on_ground();
        }
        Ok(())
    }

    /// The joint angles (yaw, pitch) of the posture.
    fn joint_angle(&self, joints: usize, gait: &CardanGait) -> Result<Vec<Vector2<f64>>, ConfigError> {
        let expected =
            format!("\"gait\", \"straight\", {joints} yaw angles or {joints} pairs (yaw, pitch), all finite");
        let angles: Vec<Vector2<f64>> = match &self.posture {
            Posture::Named(name) if name == "gait" => (0..joints).map(|joint| at_start(gait, joint)).collect(),
            Posture::Named(name) if name == "straight" => vec![Vector2::zeros(); joints],
            Posture::Named(name) => return Err(ConfigError::new("start.posture", format!("{name:?}"), expected)),
            Posture::Angles(angles) => angles.iter().map(|&angle| angle.into()).collect(),
            Posture::Yaws(angles) => angles.iter().map(|&yaw| Vector2::new(yaw, 0.0)).collect(),
        };
        let admissible = angles.len() == joints && angles.iter().flatten().all(|angle| angle.abs() < FRAC_PI_2);
        let shown: Vec<_> = angles.iter().map(|angle| (angle.x, angle.y)).collect();
        require(admissible, "start.posture", format!("{shown:?}"), &expected)?;
        Ok(angles)
    }

    /// A gait that bends the robot both ways and starts with a bend up and down alone starts lying on its side (T 7.3.2).
    fn natural_roll(&self, posture: &[Vector2<f64>], gait: &CardanGait) -> f64 {
        let bent = |axis: usize| posture.iter().any(|angle| angle[axis].abs() > FLAT);
        let yaws = gait.yaw.amplitude() != 0.0;
        let named = matches!(&self.posture, Posture::Named(name) if name == "gait");
        if named && yaws && !bent(0) && bent(1) { -FRAC_PI_2 } else { 0.0 }
    }
}

/// Joint angles below which a joint counts as straight \[rad\].
const FLAT: f64 = 1e-9;

fn at_start(gait: &CardanGait, joint: usize) -> Vector2<f64> {
    let target = gait.target(joint, 0.0);
    Vector2::new(target.yaw.angle, target.pitch.angle)
}

/// A scripted run, ready to start.
struct Run {
    simulation: SpatialSimulation,
    gait: CardanGait,
    sample: f64,
    samples: usize,
    /// Integrator steps in a sample interval.
    steps: usize,
    watch: SignalWatch,
}

impl Run {
    fn new(config: RunConfig) -> Result<Self, ConfigError> {
        let RunConfig { robot, scene, controller, integrator, start, .. } = &config;
        let mut simulation = SpatialSimulation::new(robot, scene, controller, integrator)?;
        let gait = config.gait.spatial(simulation.robot().joint_count()).map_err(|e| e.inside("gait"))?;
        start.place(&mut simulation, &gait)?;
        let samples = count_samples(config.duration, config.sample)?;
        let steps = integrator.steps_in(config.sample) as usize;
        Ok(Self { simulation, gait, sample: config.sample, samples, steps, watch: SignalWatch::new() })
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

/// What happened during a sample interval.
struct Interval {
    /// Impulses of the pegs on each link \[N s\]; after `finish` mean forces \[N\].
    contact_force: Vec<Vector2<f64>>,
    residual: f64,
    iterations: f64,
    misses: f64,
    fallbacks: f64,
    joint_gap: f64,
    penetration: f64,
}

impl Interval {
    /// An interval of no length at the present state.
    fn new(simulation: &SpatialSimulation) -> Self {
        Self {
            contact_force: vec![Vector2::zeros(); simulation.robot().link_count()],
            residual: 0.0,
            iterations: 0.0,
            misses: 0.0,
            fallbacks: 0.0,
            joint_gap: simulation.joint_gap(),
            penetration: (-simulation.min_gap()).max(0.0),
        }
    }

    fn add(&mut self, report: &StepReport, simulation: &SpatialSimulation) {
        for (sum, impulse) in self.contact_force.iter_mut().zip(simulation.contact_impulse()) {
            *sum += impulse;
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
    quaternion: Vec<f64>,
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
    fn push(&mut self, time: f64, simulation: &SpatialSimulation, interval: &Interval) {
        let pose = &simulation.state().pose;
        self.time.push(time);
        for q in pose {
            let (axis, p) = (q.axis(), q.orientation);
            self.position.extend(q.position.iter());
            self.angle.push(axis.y.atan2(axis.x));
            self.quaternion.extend([p.w, p.i, p.j, p.k]);
        }
        self.joint_angle.extend(pose.windows(2).flat_map(|q| <[f64; 2]>::from(joint_angle(&q[0], &q[1]))));
        self.joint_torque.extend(simulation.joint_torque().iter().flatten());
        self.contact_force.extend(interval.contact_force.iter().flat_map(|force| [force.x, force.y, 0.0]));
        self.residual.push(interval.residual);
        self.iterations.push(interval.iterations);
        self.misses.push(interval.misses);
        self.fallbacks.push(interval.fallbacks);
        self.energy.push(simulation.energy());
        self.max_joint_gap = self.max_joint_gap.max(interval.joint_gap);
        self.max_penetration = self.max_penetration.max(interval.penetration);
    }

    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let rows = self.time.len();
        let links = self.angle.len() / rows;
        let dict = PyDict::new(py);
        set_array(&dict, "time", self.time, &[rows])?;
        set_array(&dict, "position", self.position, &[rows, links, 3])?;
        set_array(&dict, "angle", self.angle, &[rows, links])?;
        set_array(&dict, "quaternion", self.quaternion, &[rows, links, 4])?;
        set_array(&dict, "joint_angle", self.joint_angle, &[rows, links - 1, 2])?;
        set_array(&dict, "joint_torque", self.joint_torque, &[rows, links - 1, 2])?;
        set_array(&dict, "contact_force", self.contact_force, &[rows, links, 3])?;
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
