//! One robot of the minimal model (T ch. 6) that can be advanced: plant, controller, scheme and state together.

use nalgebra::{Vector2, Vector3};
use snake_core::capabilities::{Feature, Method, ModelName};
use snake_core::control::{ControllerConfig, Treatment};
use snake_core::error::ConfigError;
use snake_core::gait::{JointTarget, Reference};
use snake_core::noise::NoiseConfig;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::stepping::{ImplicitConfig, Record, StepStatistics};

use crate::IntegratorConfig;
use crate::minimal::{FrictionLaw, Ground, MinimalState, Model, Motion, Noise};

use super::controller::{Controller, ROUND_OFF};
use super::implicit::Implicit;
use super::printed::Thesis;
use super::smooth::Smooth;

/// What a user may choose about a run of the minimal model.
#[derive(Debug, Clone)]
pub struct MinimalConfig {
    pub robot: RobotConfig,
    pub ground: Ground,
    /// Of the plant; the controller's model is always smooth.
    pub friction_law: FrictionLaw,
    pub controller: ControllerConfig,
    pub integrator: IntegratorConfig,
    pub noise: NoiseConfig,
    pub seed: u64,
}

/// The scheme chosen at construction.
#[derive(Debug)]
enum Scheme {
    Implicit(Box<Implicit>),
    Thesis(Box<Thesis>),
    Smooth(Box<Smooth>),
}

/// A robot on plane ground under a joint controller.
#[derive(Debug)]
pub struct MinimalSimulation {
    model: Model,
    state: MinimalState,
    controller: Controller,
    integrator: IntegratorConfig,
    scheme: Scheme,
    motion: Motion,
    torque: Vec<f64>,
    /// Time of the last jump of the reference or the drives, or when a torque was last at its limit.
    last_jump: f64,
    statistics: StepStatistics,
    diverged: bool,
}

impl MinimalSimulation {
    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    pub fn new(config: &MinimalConfig) -> Result<Self, ConfigError> {
        let robot = Robot::new(&config.robot).map_err(|e| e.inside("robot"))?;
        let on = (ModelName::Minimal, config.integrator.method());
        let play = config.robot.backlash.largest();
        Feature::Backlash.require(on, play != 0.0, "robot.backlash", play)?;
        config.ground.validate().map_err(|e| e.inside("scene"))?;
        config.controller.validate().map_err(|e| e.inside("controller"))?;
        config.integrator.validate().map_err(|e| e.inside("integrator"))?;
        config.noise.validate().map_err(|e| e.inside("noise"))?;
        let model = Model::new(&robot, &config.ground);
        let links = model.link_count();
        let feedback = ControllerConfig { treatment: treatment_of(config), ..config.controller };
        let controller = Controller::new(feedback, Noise::new(config.noise, config.seed), &model);
        let integrator = with_default_step(config.integrator, feedback.treatment);
        let scheme = match (config.friction_law, integrator) {
            (FrictionLaw::SetValued, IntegratorConfig::Thesis(chosen)) => {
                Scheme::Thesis(Box::new(Thesis::new(chosen, &model)))
            }
            (FrictionLaw::SetValued, IntegratorConfig::Implicit(chosen)) => {
                Scheme::Implicit(Box::new(Implicit::new(chosen, &model)))
            }
            (FrictionLaw::Smooth(law), IntegratorConfig::Implicit(chosen)) => {
                Scheme::Smooth(Box::new(Smooth::new(&chosen, &model, law, &controller)))
            }
            (FrictionLaw::Smooth(_), IntegratorConfig::Thesis(_)) => {
                let expected = "\"implicit\" for a smooth friction law: time stepping is for set-valued laws";
                return Err(ConfigError::new("integrator.method", "\"thesis\"", expected));
            }
        };
        Ok(Self {
            state: MinimalState::zero(model.degrees()),
            controller,
            integrator,
            scheme,
            motion: Motion::new(links),
            torque: vec![0.0; links - 1],
            last_jump: 0.0,
            statistics: StepStatistics::default(),
            diverged: false,
            model,
        })
    }

    pub fn model(&self) -> &Model {
        &self.model
    }

    pub fn state(&self) -> &MinimalState {
        &self.state
    }

    /// tau of each joint in the last step; positive drives phi up (T 7.8) \[N m\].
    pub fn torque(&self) -> &[f64] {
        &self.torque
    }

    /// Velocities of the links' CGs and angular velocities, frame I.
    pub fn twists(&mut self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let Self { model, state, motion, .. } = self;
        motion.set(model, state.base(), state.phi(), state.phi_rate());
        motion.links.iter().map(|link| link.twist)
    }

    /// Records from now on friction and the work of the actuators.
    ///
    /// # Errors
    /// The friction law is smooth: the stiff solver's steps do not tell their impulses.
    pub fn start_record(&mut self) -> Result<(), ConfigError> {
        let record = Some(Box::new(Record::new(self.model.link_count())));
        match &mut self.scheme {
            Scheme::Implicit(scheme) => scheme.record = record,
            Scheme::Thesis(scheme) => scheme.record = record,
            Scheme::Smooth(_) => {
                let expected = "\"set-valued\" where forces or power are recorded";
                return Err(ConfigError::new("scene.friction_law", "a smooth law", expected));
            }
        }
        Ok(())
    }

    /// What has been recorded since it was last cleared.
    pub fn record_mut(&mut self) -> Option<&mut Record> {
        match &mut self.scheme {
            Scheme::Implicit(scheme) => scheme.record.as_deref_mut(),
            Scheme::Thesis(scheme) => scheme.record.as_deref_mut(),
            Scheme::Smooth(_) => None,
        }
    }

    /// What happened during the last `advance`.
    pub fn statistics(&self) -> &StepStatistics {
        &self.statistics
    }

    /// Sets the state and clears what earlier steps left.
    pub fn place(&mut self, state: &MinimalState) {
        self.state.copy_from(state);
        self.torque.fill(0.0);
        self.last_jump = state.time;
        self.diverged = false;
        self.controller.restart(state.time);
        match &mut self.scheme {
            Scheme::Implicit(scheme) => scheme.clear(),
            Scheme::Thesis(scheme) => scheme.clear(),
            Scheme::Smooth(scheme) => scheme.handle_discontinuity(),
        }
    }

    /// Integrates over `duration`; returns whether the state stayed plausible.
    ///
    /// Steps end where the reference jumps, the actuators are switched on or a control period begins.
    pub fn advance(&mut self, duration: f64, reference: &impl Reference<JointTarget>) -> bool {
        self.statistics = StepStatistics::default();
        let end = self.state.time + duration;
        while self.state.time < end - ROUND_OFF && !self.diverged {
            self.controller.tick(&self.model, &self.state, reference);
            let jump = self.next_break(reference);
            // A jump just behind the end belongs to this interval: the next one starts after it.
            let jumps = jump <= end + ROUND_OFF;
            self.run_to(if jumps { jump } else { end }, reference);
            if jumps {
                self.handle_discontinuity();
            }
        }
        !self.diverged
    }

    fn handle_discontinuity(&mut self) {
        self.last_jump = self.state.time;
        match &mut self.scheme {
            Scheme::Implicit(scheme) => scheme.handle_discontinuity(),
            Scheme::Smooth(scheme) => scheme.handle_discontinuity(),
            Scheme::Thesis(_) => {}
        }
    }

    /// The next time at which something jumps.
    fn next_break(&self, reference: &impl Reference<JointTarget>) -> f64 {
        let now = self.state.time + ROUND_OFF;
        let awake = self.controller.config().active_from;
        let awake = if awake > now { awake } else { f64::INFINITY };
        reference.next_jump(now).min(awake).min(self.controller.next_period())
    }

    fn run_to(&mut self, until: f64, reference: &impl Reference<JointTarget>) {
        while self.state.time < until - ROUND_OFF && !self.diverged {
            let end = self.step_end(until);
            let Self { model, state, controller, statistics, .. } = self;
            match &mut self.scheme {
                Scheme::Implicit(scheme) => {
                    scheme.step(model, state, controller, reference, end - state.time, statistics);
                    self.torque.iter_mut().zip(scheme.torque()).for_each(|(to, tau)| *to = tau);
                    if scheme.saturated {
                        self.last_jump = end;
                    }
                }
                Scheme::Thesis(scheme) => {
                    scheme.step(model, state, controller, reference, end - state.time, statistics);
                    self.torque.copy_from_slice(&scheme.torque);
                }
                Scheme::Smooth(scheme) => {
                    scheme.run_to(state, controller, reference, end, statistics);
                    scheme.write_torque(&mut self.torque);
                }
            }
            self.state.time = end;
            self.diverged = !self.state.is_plausible();
        }
    }

    /// The end of the next step towards `until`; the smooth plant's solver chooses its own steps.
    ///
    /// Feedback is stiff: after a jump, and while a torque is at its limit, steps grow from `RAMP` of the usual length.
    /// Torques that are held over steps are not.
    fn step_end(&self, until: f64) -> f64 {
        let left = until - self.state.time;
        let equal = left / f64::from(self.integrator.steps_in(left));
        let h = match self.scheme {
            Scheme::Smooth(_) => left,
            Scheme::Implicit(_) if self.controller.config().treatment == Treatment::Implicit => {
                let grown = GROWTH * (self.state.time - self.last_jump);
                equal.min(grown.max(LONGEST_START.min(RAMP * self.integrator.step())))
            }
            Scheme::Implicit(_) | Scheme::Thesis(_) => equal,
        };
        if h > left - ROUND_OFF { until } else { self.state.time + h }
    }

    /// Poses (x, y, theta) of the links' CGs.
    pub fn poses(&mut self) -> Vec<Vector3<f64>> {
        let Self { model, state, motion, .. } = self;
        motion.set(model, state.base(), state.phi(), state.phi_rate());
        let origin = Vector2::new(state.q[0], state.q[1]);
        let mut theta = 0.0;
        let links = motion.links.iter().enumerate();
        links
            .map(|(i, at)| {
                theta += state.q[2 + i];
                (origin + at.arm).push(theta)
            })
            .collect()
    }

    /// Kinetic and potential energy, the latter zero with every CG at the height of the origin \[J\].
    pub fn energy(&mut self) -> f64 {
        let links = self.poses().into_iter().zip(&self.model.links);
        let work = links.map(|(pose, link)| link.mass * self.model.pull.dot(&pose.xy())).sum::<f64>();
        self.state.kinetic_energy(&self.model, &mut self.motion) - work
    }
}

/// When torques are computed. Without steps of the scheme's own to hold them over, on a smooth plant, and without
/// measurements to add noise to, that is at the steps of the thesis; its scheme is explicit.
fn treatment_of(config: &MinimalConfig) -> Treatment {
    let smooth = matches!(config.friction_law, FrictionLaw::Smooth(_));
    match config.controller.treatment {
        Treatment::Implicit if config.integrator.method() == Method::Thesis => Treatment::Step,
        Treatment::Implicit if !config.noise.is_silent() => Treatment::Period(THESIS_STEP),
        Treatment::Step if smooth => Treatment::Period(with_default_step(config.integrator, Treatment::Step).step()),
        chosen => chosen,
    }
}

/// The configuration with this model's default step.
fn with_default_step(config: IntegratorConfig, treatment: Treatment) -> IntegratorConfig {
    let step = if treatment == Treatment::Step { THESIS_STEP } else { STEP };
    match config {
        // The error of the scheme grows with the square of the step.
        IntegratorConfig::Implicit(chosen) => {
            let step = step * chosen.precision.scale().sqrt();
            ImplicitConfig { step: chosen.step.or(Some(step)), ..chosen }.into()
        }
        IntegratorConfig::Thesis(_) => config,
    }
}

/// (T Table 7.2) \[s\].
const THESIS_STEP: f64 = 2.5e-4;

/// Default step: within 1e-4 rad and 0.2 mm over 20 s of lateral undulation \[s\].
const STEP: f64 = 0.02;

/// First step after a jump over the usual step, its bound \[s\], and growth of the steps from there.
const RAMP: f64 = 1.0 / 64.0;
const LONGEST_START: f64 = 1e-3;
const GROWTH: f64 = 0.5;
