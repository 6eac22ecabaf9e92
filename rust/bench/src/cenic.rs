//! Our implicit Euler steps under the error control of CENIC (arXiv 2511.08771) and at our precisions, with the same
//! random joint actions.
//!
//! A step of length h is also taken as two of h / 2. The estimate of its error, of second order, is the largest difference
//! of a generalized position between the two ends: of x, y and angle of link 1 and of joint angles, one metre counted as one
//! radian, as Drake's `CenicIntegrator` counts them. Beyond the accuracy the step is taken again with another length;
//! otherwise the end of the two halves is kept. Lengths follow Drake's `IntegratorBase`.
//!
//! CENIC's own steps are first order too, but linearise contacts at the start of a step, where ours predict its end, and
//! have compliant contacts and regularised friction, where ours are rigid.

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, Environment, PlanarRobot, RobotModel, Task};
use snake_core::planar::PlanarState;
use snake_core::stepping::{ImplicitConfig, Precision, StepStatistics};

use crate::report::{emit, progress};

/// What the robots of one batch did, robot by robot.
#[derive(Debug, Default, Serialize)]
struct Run {
    scene: &'static str,
    /// "reference", a precision, or "CENIC" with its accuracy.
    stepping: String,
    /// CGs of the links after one control period and at the end (robots, 2, links, 2) \[m\].
    position: Vec<[Vec<[f64; 2]>; 2]>,
    /// Positive work of the actuators (robots,) \[J\].
    work: Vec<f64>,
    /// Linear solves per robot and control period.
    solves: f64,
    /// Lengths of the accepted steps of error control \[s\], and how many others were rejected.
    lengths: Vec<f64>,
    rejected: u32,
}

/// Measures all scenes; `quick`: few robots, for a short time.
///
/// # Errors
/// A configuration is not admissible.
pub fn measure(quick: bool) -> Result<(), ConfigError> {
    let (robots, periods) = if quick { (8, 4) } else { (96, 20) };
    for (scene, task) in [("field", Task::FIELD), ("course", Task::COURSE)] {
        for stepping in steppings() {
            progress(&format!("{scene}: {}", stepping.name()));
            emit("cenic", &run(scene, task, &stepping, robots, periods)?);
        }
    }
    Ok(())
}

/// How time is stepped.
#[derive(Debug, Clone, Copy)]
enum Stepping {
    Reference,
    Ours(Precision),
    Cenic { accuracy: f64 },
}

fn steppings() -> Vec<Stepping> {
    let ours = [Precision::Fast, Precision::Default, Precision::Fine].map(Stepping::Ours);
    let cenic = [1e-2, 1e-3, 1e-4].map(|accuracy| Stepping::Cenic { accuracy });
    [Stepping::Reference].into_iter().chain(ours).chain(cenic).collect()
}

impl Stepping {
    fn name(&self) -> String {
        match self {
            Self::Reference => "reference".into(),
            Self::Ours(precision) => format!("{precision:?}").to_lowercase(),
            Self::Cenic { accuracy } => format!("CENIC {accuracy:e}"),
        }
    }

    fn config(&self) -> ImplicitConfig {
        match *self {
            Self::Reference => ImplicitConfig {
                step: Some(6.25e-4),
                tolerance: Some(1e-7),
                step_tolerance: Some(1e-6),
                impact_step: Some(1e-4),
                ..ImplicitConfig::default()
            },
            Self::Ours(precision) => ImplicitConfig { precision, ..ImplicitConfig::default() },
            Self::Cenic { .. } => ImplicitConfig { order: 1, step: Some(LONGEST), ..ImplicitConfig::default() },
        }
    }
}

/// Robots k of seeds `SEED + k` over some control periods.
fn run(scene: &'static str, task: Task, stepping: &Stepping, robots: u64, periods: u32) -> Result<Run, ConfigError> {
    let integrator = stepping.config();
    let config =
        EnvConfig { task, action_mode: ActionMode::Joints, difficulty: 0.5, integrator, ..EnvConfig::default() };
    let mut env = Environment::<PlanarRobot>::new(&config)?;
    let mut observation = vec![0.0; env.observation_size()];
    let mut run = Run { scene, stepping: stepping.name(), ..Run::default() };
    for seed in (SEED..).take(robots as usize) {
        env.reset(Some(seed), &mut observation);
        let mut actions = Rng::new(seed, u64::MAX);
        let mut control = ErrorControl::new(stepping);
        let (mut work, mut first) = (0.0, None);
        for _ in 0..periods {
            let action: Vec<f64> = (0..env.action_size()).map(|_| actions.around_zero(1.0)).collect();
            env.begin_step(&action);
            let spent = match &mut control {
                Some(control) => control.advance(env.model_mut(), config.control_period),
                None => {
                    env.model_mut().advance(config.control_period);
                    env.model().report()
                }
            };
            env.end_step(&mut observation);
            work += spent.positive_actuator_work;
            run.solves += f64::from(spent.iterations) / (robots as f64 * f64::from(periods));
            first.get_or_insert_with(|| positions(env.state()));
        }
        run.position.push([first.unwrap_or_default(), positions(env.state())]);
        run.work.push(work);
        if let Some(control) = control {
            run.lengths.extend(control.lengths);
            run.rejected += control.rejected;
        }
    }
    Ok(run)
}

fn positions(state: &PlanarState) -> Vec<[f64; 2]> {
    state.pose.iter().map(|pose| [pose.x, pose.y]).collect()
}

/// Chooses the lengths of the steps of one robot.
#[derive(Debug)]
struct ErrorControl {
    accuracy: f64,
    /// Length to be tried next \[s\].
    next: f64,
    lengths: Vec<f64>,
    rejected: u32,
}

impl ErrorControl {
    fn new(stepping: &Stepping) -> Option<Self> {
        match *stepping {
            Stepping::Cenic { accuracy } => {
                Some(Self { accuracy, next: FIRST * LONGEST, lengths: Vec::new(), rejected: 0 })
            }
            _ => None,
        }
    }

    /// Advances a robot; returns all solves, and the work of accepted steps.
    fn advance(&mut self, robot: &mut PlanarRobot, duration: f64) -> StepStatistics {
        let mut total = StepStatistics::default();
        let mut left = duration;
        while left > 0.0 {
            let mut h = self.next;
            loop {
                let is_cut = left < MUCH_SHORTER * h;
                if left < BARELY_LONGER * h {
                    h = left;
                }
                let before = robot.simulation.snapshot();
                let (error, work) = doubled_step(robot, h, &mut total.iterations);
                let next = self.adjusted(error, h);
                if next >= h {
                    total.positive_actuator_work += work;
                    if !is_cut {
                        self.next = next;
                    }
                    break;
                }
                self.rejected += 1;
                robot.simulation.restore(&before);
                h = next;
            }
            self.lengths.push(h);
            left -= h;
        }
        total
    }

    /// Length after a step of length `h` and estimated error; shorter than `h` if that step is rejected \[s\].
    fn adjusted(&self, error: f64, h: f64) -> f64 {
        let wanted = SAFETY * h * (self.accuracy / error).sqrt();
        let next = if error <= self.accuracy && wanted < SMALLEST_GROWTH * h { h } else { wanted };
        next.clamp(LARGEST_SHRINKAGE * h, LARGEST_GROWTH * h).min(LONGEST)
    }
}

/// Takes a step whole and in two halves, and leaves the robot at the end of the halves: the estimated error and the positive
/// work.
fn doubled_step(robot: &mut PlanarRobot, h: f64, solves: &mut u32) -> (f64, f64) {
    let before = robot.simulation.snapshot();
    let mut step = |robot: &mut PlanarRobot, h: f64| {
        robot.advance(h);
        *solves += robot.report().iterations;
        robot.report().positive_actuator_work
    };
    step(robot, h);
    let whole = coordinates(robot);
    robot.simulation.restore(&before);
    let work = step(robot, 0.5 * h) + step(robot, 0.5 * h);
    let halves = coordinates(robot);
    let error = whole.iter().zip(&halves).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (error, work)
}

/// Generalized positions: pose of link 1 and joint angles \[m, rad\].
fn coordinates(robot: &PlanarRobot) -> Vec<f64> {
    let state = robot.simulation.state();
    let joints = (0..robot.robot().joint_count()).map(|joint| state.joint_angle(joint));
    state.pose[0].iter().copied().chain(joints).collect()
}

/// Of the first robot; the others follow.
const SEED: u64 = 11;

/// Drake's defaults: longest step \[s\], and the first one over it.
const LONGEST: f64 = 0.1;
const FIRST: f64 = 0.1;

/// Bounds of what is left over a step, below which it is cut and its successor not lengthened, or stretched to the end.
const MUCH_SHORTER: f64 = 0.95;
const BARELY_LONGER: f64 = 1.001;

/// Share of the length with an error of the accuracy that is tried next, and bounds of it over the length before; less
/// growth than the smallest is none.
const SAFETY: f64 = 0.9;
const LARGEST_SHRINKAGE: f64 = 0.1;
const SMALLEST_GROWTH: f64 = 1.2;
const LARGEST_GROWTH: f64 = 5.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_follow_the_root_of_accuracy_over_error() {
        let control = ErrorControl::new(&Stepping::Cenic { accuracy: 1e-3 }).unwrap();
        let grown = |error: f64| control.adjusted(error, 0.01) / 0.01;
        for (error, growth) in [(0.0, 5.0), (2.5e-4, 1.8), (8e-4, 1.0), (1e-3, 1.0), (4e-3, 0.45), (1.0, 0.1)] {
            assert!((grown(error) - growth).abs() < 1e-12, "{error}: {}", grown(error));
        }
        assert_eq!(control.adjusted(0.0, 0.05), LONGEST);
    }

    #[test]
    fn a_tighter_accuracy_shortens_steps_and_errors() {
        let run = |stepping| run("course", Task::COURSE, &stepping, 8, 4).unwrap();
        let reference = run(Stepping::Reference);
        let [loose, tight] = [1e-2, 1e-4].map(|accuracy| run(Stepping::Cenic { accuracy }));
        let error = |run: &Run| {
            let ends = run.position.iter().zip(&reference.position).flat_map(|(a, b)| a[1].iter().zip(&b[1]));
            ends.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum::<f64>()
        };
        assert!(error(&tight) < 0.2 * error(&loose), "{} {}", error(&tight), error(&loose));
        for run in [&loose, &tight] {
            let time: f64 = run.lengths.iter().sum();
            assert!((time - 8.0 * 4.0 * 0.05).abs() < 1e-9, "{time} s");
        }
        // An error of second order: a hundredth of it in about a tenth of the length.
        let growth = tight.lengths.len() as f64 / loose.lengths.len() as f64;
        assert!((5.0..40.0).contains(&growth), "{growth}");
    }
}
