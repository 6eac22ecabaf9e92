//! A scripted run of any model: moved from sample to sample, watched on the way, open to Ctrl-C.

use std::time::{Duration, Instant};

use pyo3::prelude::*;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::error::{positive, require};
use snake_core::robot::RobotConfig;
use snake_core::scene::SceneConfig;
use snake_core::stepping::IntegratorConfig;
use snake_core::stepping::StepReport;

use crate::gait::GaitConfig;
use crate::gate::Fault;
use crate::samples::Samples;

/// A run among pegs as the user writes it; the start depends on the model.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig<Start> {
    pub robot: RobotConfig,
    pub scene: SceneConfig,
    pub gait: GaitConfig,
    pub controller: ControllerConfig,
    pub integrator: IntegratorConfig,
    pub start: Start,
    pub duration: f64,
    pub sample: f64,
}

/// A robot of some model together with its gait.
pub trait Scripted {
    /// Coordinates of a position, and components of a force.
    const COORDINATES: usize;

    fn link_count(&self) -> usize;

    /// Equal parts into which `duration` is divided: the robot is looked at, and signals are heard, after each.
    fn parts_of(&self, duration: f64) -> u32;

    fn advance(&mut self, duration: f64) -> StepReport;

    fn time(&self) -> f64;

    /// Adds the impulses of the pegs on each link during the last `advance` \[N s\].
    fn add_contact_impulse(&self, _sum: &mut [f64]) {}

    /// Widest gap of a joint now \[m\].
    fn joint_gap(&self) -> f64 {
        0.0
    }

    /// Smallest gap to a peg or the ground now \[m\].
    fn min_gap(&self) -> f64 {
        0.0
    }

    /// Puts position, angle, joint_angle, joint_torque, energy, and what else the model has.
    fn write(&mut self, samples: &mut Samples);
}

/// Samples of a robot that is moved for `duration`, one every `sample` \[s\].
///
/// # Errors
/// A duration is not admissible; the robot diverged; a signal handler raised.
pub fn sampled<R: Scripted>(robot: R, duration: f64, sample: f64) -> Result<Samples, Fault> {
    let count = count_samples(duration, sample)?;
    let mut run = Run { robot, sample, watch: SignalWatch::new() };
    let mut samples = Samples::default();
    run.write(0.0, &Interval::new(&run.robot), &mut samples);
    for k in 1..=count {
        let interval = run.advance()?;
        run.write(k as f64 * sample, &interval, &mut samples);
    }
    Ok(samples)
}

struct Run<R> {
    robot: R,
    sample: f64,
    watch: SignalWatch,
}

impl<R: Scripted> Run<R> {
    /// Moves on by one sample interval.
    fn advance(&mut self) -> Result<Interval, Fault> {
        let mut interval = Interval::new(&self.robot);
        let parts = self.robot.parts_of(self.sample);
        let part = self.sample / f64::from(parts);
        for _ in 0..parts {
            let before = self.robot.time();
            let report = self.robot.advance(part);
            if report.diverged {
                return Err(Fault::Diverged(before));
            }
            interval.add(&report, &self.robot);
            self.watch.poll()?;
        }
        interval.finish(self.sample);
        Ok(interval)
    }

    fn write(&mut self, time: f64, interval: &Interval, samples: &mut Samples) {
        samples.put("time", &[], [time]);
        self.robot.write(samples);
        let shape = [self.robot.link_count(), R::COORDINATES];
        samples.put("contact_force", &shape, interval.contact_force.iter().copied());
        samples.put("residual", &[], [interval.residual]);
        samples.put("iterations", &[], [interval.iterations]);
        samples.put("misses", &[], [interval.misses]);
        samples.put("fallbacks", &[], [interval.fallbacks]);
        samples.max_joint_gap = samples.max_joint_gap.max(interval.joint_gap);
        samples.max_penetration = samples.max_penetration.max(interval.penetration);
    }
}

/// What happened during a sample interval.
struct Interval {
    /// Impulses of the pegs on each link \[N s\]; after `finish` mean forces \[N\].
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
    fn new<R: Scripted>(robot: &R) -> Self {
        Self {
            contact_force: vec![0.0; R::COORDINATES * robot.link_count()],
            residual: 0.0,
            iterations: 0.0,
            misses: 0.0,
            fallbacks: 0.0,
            joint_gap: robot.joint_gap(),
            penetration: (-robot.min_gap()).max(0.0),
        }
    }

    fn add<R: Scripted>(&mut self, report: &StepReport, robot: &R) {
        robot.add_contact_impulse(&mut self.contact_force);
        self.residual = self.residual.max(report.residual); // never NaN: the core sees to that
        self.iterations += f64::from(report.iterations);
        self.misses += f64::from(report.misses);
        self.fallbacks += f64::from(report.fallbacks);
        self.joint_gap = self.joint_gap.max(robot.joint_gap());
        self.penetration = self.penetration.max(-robot.min_gap());
    }

    /// Impulses become mean forces (T 7.6).
    fn finish(&mut self, duration: f64) {
        self.contact_force.iter_mut().for_each(|impulse| *impulse /= duration);
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

/// Lets Python's signal handlers run about every 50 ms.
struct SignalWatch {
    last: Instant,
}

impl SignalWatch {
    fn new() -> Self {
        Self { last: Instant::now() }
    }

    fn poll(&mut self) -> PyResult<()> {
        if self.last.elapsed() < Duration::from_millis(50) {
            return Ok(());
        }
        self.last = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}
