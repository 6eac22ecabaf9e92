//! `simulate`: one scripted robot of any model, sampled; Ctrl-C ends it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::capabilities::{Feature, Method, ModelName, require_supported};
use snake_core::control::ControllerConfig;
use snake_core::error::{positive, require};
use snake_core::gait::{CardanGait, Gait, JointTarget};
use snake_core::noise::NoiseConfig;
use snake_core::planar::Planar;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::SceneConfig;
use snake_core::simulation::SchemeConfig;
use snake_core::spatial::Spatial;
use snake_core::stepping::{Record, StepStatistics, require_steps};
use snake_thesis::IntegratorConfig;
use snake_thesis::minimal::{self, Ground};

use crate::ffi::{CoreError, interruptible, signal_raised};
use crate::from_python::from_python;
use crate::gait::GaitConfig;
use crate::joint_trajectory::TrajectoryConfig;
use crate::memory::require_memory;
use crate::minimal::MinimalRobot;
use crate::records::{Layout, Recorded, Sums, write_means};
use crate::samples::Samples;
use crate::scripted::{ScriptedModel, ScriptedRobot};
use crate::start::{StartConfig, largest_reference};

/// A run as the user writes it; what is left out of scene and controller depends on the model.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunConfig {
    pub model: ModelName,
    pub robot: RobotConfig,
    pub scene: Option<SceneConfig>,
    pub gait: GaitConfig,
    /// Instead of the gait.
    pub joint_trajectory: Option<TrajectoryConfig>,
    pub controller: Option<ControllerConfig>,
    pub integrator: IntegratorConfig,
    pub start: StartConfig,
    pub duration: f64,
    pub sample: f64,
    pub noise: Option<NoiseConfig>,
    pub seed: u64,
    /// Groups of columns that are recorded besides the motion.
    pub record: Vec<Recorded>,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            model: ModelName::Planar,
            robot: RobotConfig::default(),
            scene: None,
            gait: GaitConfig::default(),
            joint_trajectory: None,
            controller: None,
            integrator: IntegratorConfig::default(),
            start: StartConfig::default(),
            duration: 5.0,
            sample: 0.1,
            noise: None,
            seed: 0,
            record: Vec::new(),
        }
    }
}

impl RunConfig {
    /// Model and method.
    pub fn on(&self) -> (ModelName, Method) {
        (self.model, self.integrator.method())
    }

    /// # Errors
    /// Names the part of the run that is not admissible, or that the model does not have.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let noise = format!("{:?}", self.noise);
        Feature::MeasurementNoise.require(self.on(), self.noise.is_some(), "noise", noise)?;
        self.validate_record()?;
        require_steps(self.duration, self.integrator.step(), MOST_STEPS, "duration")?;
        require_supported(self.model, self.integrator.method(), &self.robot, &self.scene(), &self.controller())
    }

    /// Rejects a group of columns that the model cannot fill.
    fn validate_record(&self) -> Result<(), ConfigError> {
        for (k, group) in self.record.iter().enumerate() {
            let field = format!("record[{k}]");
            match group {
                Recorded::Obstacles => Feature::Pegs.require(self.on(), true, &field, "\"obstacles\"")?,
                Recorded::SelfContacts => Feature::SelfContact.require(self.on(), true, &field, "\"self_contacts\"")?,
                Recorded::Velocity | Recorded::Ground | Recorded::Power | Recorded::Motors => {}
            }
        }
        Ok(())
    }

    /// The groups of columns that the trajectory has besides those of every run.
    pub fn recorded(&self) -> Vec<Recorded> {
        let motors = self.robot.motor.as_ref().map(|_| Recorded::Motors);
        self.record.iter().copied().chain(motors).collect()
    }

    /// Whether the schemes have to sum something up for what is recorded.
    pub fn is_summed(&self) -> bool {
        self.recorded().into_iter().any(Recorded::is_summed)
    }

    pub fn scene(&self) -> SceneConfig {
        self.scene.clone().unwrap_or_else(|| default_scene(self.model))
    }

    /// Locked joints and the references that they keep, given the joint angles of the start.
    pub fn held_joints<'a>(&'a self, joint_angle: &'a [f64]) -> impl Iterator<Item = (usize, JointTarget)> + 'a {
        let at = |joint: usize| JointTarget { angle: joint_angle[joint], ..JointTarget::default() };
        self.robot.locked.iter().map(move |&joint| (joint, at(joint)))
    }

    /// The reference of a robot in the plane.
    pub fn planar_reference(&self, joints: usize) -> Result<Gait, ConfigError> {
        let reference = match &self.joint_trajectory {
            Some(trajectory) => trajectory.planar(joints),
            None => self.gait.planar(joints, self.controller().active_from),
        };
        reference.map_err(|e| e.inside("gait"))
    }

    /// The reference of a robot in 3D. The printed scheme has joints that bend by a right angle at most (T 4.5).
    pub fn spatial_reference(&self, robot: &Robot) -> Result<CardanGait, ConfigError> {
        let largest = match self.integrator.method() {
            Method::Thesis => FRAC_PI_2,
            Method::Implicit => largest_reference(robot.joint_limit()),
        };
        let reference = match &self.joint_trajectory {
            Some(trajectory) => trajectory.spatial(robot, largest),
            None => self.gait.spatial(robot.joint_count(), self.controller().active_from, largest),
        };
        reference.map_err(|e| e.inside("gait"))
    }

    pub fn controller(&self) -> ControllerConfig {
        self.controller.unwrap_or_else(|| default_controller(self.model))
    }
}

/// The ground of (T Table 7.2) for the minimal model.
pub fn default_scene(model: ModelName) -> SceneConfig {
    let Ground { coulomb, viscous, .. } = Ground::default();
    match model {
        ModelName::Minimal => SceneConfig { friction: coulomb, viscous, ..SceneConfig::default() },
        ModelName::Planar | ModelName::Spatial => SceneConfig::default(),
    }
}

/// PD with the gains of (T Table 7.2).
pub fn default_controller(model: ModelName) -> ControllerConfig {
    match model {
        ModelName::Minimal => minimal::pd(),
        ModelName::Planar | ModelName::Spatial => ControllerConfig::default(),
    }
}

/// Simulates one robot that follows a gait; returns the fields of `Trajectory`.
///
/// # Errors
/// ConfigError, DivergenceError, or the exception of a signal handler.
#[pyfunction]
pub fn simulate<'py>(py: Python<'py>, config: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let config: RunConfig = from_python(config).map_err(CoreError::from)?;
    let run = || {
        config.validate()?;
        match (config.model, &config.integrator) {
            (ModelName::Planar, IntegratorConfig::Implicit(method)) => scripted::<Planar, _>(&config, method),
            (ModelName::Planar, IntegratorConfig::Thesis(method)) => scripted::<Planar, _>(&config, method),
            (ModelName::Spatial, IntegratorConfig::Implicit(method)) => scripted::<Spatial, _>(&config, method),
            (ModelName::Spatial, IntegratorConfig::Thesis(method)) => scripted::<Spatial, _>(&config, method),
            (ModelName::Minimal, _) => sampled(MinimalRobot::new(&config)?, &config),
        }
    };
    interruptible(py, run)?.into_dict(py)
}

/// A robot of some model together with its gait.
pub trait Scripted {
    /// Coordinates of a position, and components of a force.
    const COORDINATES: usize;

    fn link_count(&self) -> usize;

    /// Equal parts into which `duration` is divided: the robot is looked at, and signals are heard, after each.
    fn parts_of(&self, duration: f64) -> u32;

    fn advance(&mut self, duration: f64) -> StepStatistics;

    fn time(&self) -> f64;

    /// Adds the impulses of the pegs on each link during the last `advance` \[N s\].
    fn add_contact_impulse(&self, _sum: &mut [f64]) {}

    /// Impulse of each obstacle, by its number, during the last `advance` \[N s\].
    fn obstacle_impulse(&self) -> &[Vector3<f64>] {
        &[]
    }

    /// Adds the impulses of the robot's other links on each link during the last `advance`; false where the robot does
    /// not touch itself \[N s\].
    fn add_self_contact_impulse(&self, _sum: &mut [f64]) -> bool {
        false
    }

    /// Widest gap of a joint now \[m\].
    fn joint_gap(&self) -> f64 {
        0.0
    }

    /// Smallest gap to a peg, the ground or, where the robot touches itself, of two links now \[m\].
    fn min_gap(&self) -> f64 {
        0.0
    }

    /// Puts position, angle, joint_angle, joint_torque, energy, and what else the model has.
    fn write(&mut self, samples: &mut Samples);

    /// Puts velocity, angular_velocity and joint_rate.
    fn write_velocity(&mut self, samples: &mut Samples);

    /// How the model lays out what is recorded.
    fn layout(&self) -> Layout;

    /// What the scheme has summed up, if it does.
    fn record_mut(&mut self) -> Option<&mut Record>;
}

/// Samples of a robot of a model, advanced by a method.
fn scripted<M: ScriptedModel, C: SchemeConfig<M>>(config: &RunConfig, method: &C) -> Result<Samples, CoreError> {
    sampled(ScriptedRobot::<M, C::Scheme>::new(config, method)?, config)
}

/// Samples of a robot that is moved as a run says.
///
/// # Errors
/// A duration is not admissible; the robot diverged; a signal handler raised.
fn sampled<R: Scripted>(robot: R, config: &RunConfig) -> Result<Samples, CoreError> {
    let RunConfig { duration, sample, .. } = *config;
    let count = count_samples(duration, sample)?;
    let mut run = Run { robot, sample, record: config.recorded() };
    let mut samples = Samples::default();
    run.write(0.0, 0.0, &Interval::new(&run.robot), &mut samples);
    let bytes = MOST_COPIES * samples.bytes() * count as f64;
    require_memory("duration", duration, &format!("{count} samples every {sample} s"), bytes)?;
    for k in 1..=count {
        let interval = run.advance()?;
        run.write(k as f64 * sample, sample, &interval, &mut samples);
    }
    Ok(samples)
}

struct Run<R> {
    robot: R,
    sample: f64,
    record: Vec<Recorded>,
}

impl<R: Scripted> Run<R> {
    /// Moves on by one sample interval.
    fn advance(&mut self) -> Result<Interval, CoreError> {
        let mut interval = Interval::new(&self.robot);
        let parts = self.robot.parts_of(self.sample);
        let part = self.sample / f64::from(parts);
        for _ in 0..parts {
            let before = self.robot.time();
            let report = self.robot.advance(part);
            if report.diverged {
                return Err(CoreError::Diverged(before));
            }
            interval.add(&report, &self.robot);
            if signal_raised() {
                return Err(CoreError::Interrupted);
            }
        }
        interval.finish(self.sample);
        Ok(interval)
    }

    fn write(&mut self, time: f64, length: f64, interval: &Interval, samples: &mut Samples) {
        samples.put("time", &[], [time]);
        self.robot.write(samples);
        let shape = [self.robot.link_count(), R::COORDINATES];
        samples.put("contact_force", &shape, interval.contact_force.iter().copied());
        if interval.has_self_contact {
            samples.put("self_contact_force", &shape, interval.self_contact_force.iter().copied());
        }
        samples.put("residual", &[], [interval.residual]);
        samples.put("iterations", &[], [interval.iterations]);
        samples.put("unconverged", &[], [interval.unconverged]);
        samples.put("fallbacks", &[], [interval.fallbacks]);
        if self.record.contains(&Recorded::Velocity) {
            self.robot.write_velocity(samples);
        }
        let layout = self.robot.layout();
        if let Some(record) = self.robot.record_mut() {
            let Interval { obstacle_impulse, friction_work, .. } = interval;
            let sums = Sums { obstacle_impulse, friction_work: *friction_work };
            write_means(record, &self.record, &layout, &sums, length, samples);
        }
        samples.max_joint_gap = samples.max_joint_gap.max(interval.joint_gap);
        samples.max_penetration = samples.max_penetration.max(interval.penetration);
    }
}

/// What happened during a sample interval.
struct Interval {
    /// Impulses of the pegs on each link \[N s\]; after `finish` mean forces \[N\].
    contact_force: Vec<f64>,
    /// Impulse of each obstacle, by its number \[N s\].
    obstacle_impulse: Vec<Vector3<f64>>,
    /// As `contact_force`, of the robot's other links.
    self_contact_force: Vec<f64>,
    has_self_contact: bool,
    /// \[J\]
    friction_work: f64,
    residual: f64,
    iterations: f64,
    unconverged: f64,
    fallbacks: f64,
    joint_gap: f64,
    penetration: f64,
}

impl Interval {
    /// An interval of no length at the present state.
    fn new<R: Scripted>(robot: &R) -> Self {
        let no_force = vec![0.0; R::COORDINATES * robot.link_count()];
        Self {
            contact_force: no_force.clone(),
            obstacle_impulse: vec![Vector3::zeros(); robot.obstacle_impulse().len()],
            has_self_contact: robot.add_self_contact_impulse(&mut no_force.clone()),
            self_contact_force: no_force,
            friction_work: 0.0,
            residual: 0.0,
            iterations: 0.0,
            unconverged: 0.0,
            fallbacks: 0.0,
            joint_gap: robot.joint_gap(),
            penetration: (-robot.min_gap()).max(0.0),
        }
    }

    fn add<R: Scripted>(&mut self, report: &StepStatistics, robot: &R) {
        robot.add_contact_impulse(&mut self.contact_force);
        self.obstacle_impulse.iter_mut().zip(robot.obstacle_impulse()).for_each(|(sum, impulse)| *sum += impulse);
        robot.add_self_contact_impulse(&mut self.self_contact_force);
        self.residual = self.residual.max(report.residual); // never NaN: the core sees to that
        self.friction_work += report.friction_work;
        self.iterations += f64::from(report.iterations);
        self.unconverged += f64::from(report.unconverged);
        self.fallbacks += f64::from(report.fallbacks);
        self.joint_gap = self.joint_gap.max(robot.joint_gap());
        self.penetration = self.penetration.max(-robot.min_gap());
    }

    /// Impulses become mean forces (T 7.6).
    fn finish(&mut self, duration: f64) {
        self.contact_force.iter_mut().chain(&mut self.self_contact_force).for_each(|impulse| *impulse /= duration);
    }
}

/// Number of sample intervals in a run.
fn count_samples(duration: f64, sample: f64) -> Result<usize, ConfigError> {
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

/// A table that outgrows its memory is copied into twice as much.
const MOST_COPIES: f64 = 3.0;

/// Most steps of a run.
const MOST_STEPS: u32 = 1_000_000_000;
