//! Random robots and states, runs.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use snake_core::control::ControllerConfig;
use snake_core::gait::{JointTarget, Reference, SoftStart, Wave};
use snake_core::noise::NoiseConfig;
use snake_core::robot::{PerLink, Robot, RobotConfig};
use snake_thesis::IntegratorConfig;
use snake_thesis::minimal::{self, FrictionLaw, Ground, MinimalConfig, MinimalSimulation, MinimalState, Model};

/// Uniform numbers from a seed.
pub struct Uniform(ChaCha8Rng);

impl Uniform {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn next(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() as f64 / u64::MAX as f64)
    }

    pub fn vector(&mut self, length: usize, limit: f64) -> Vec<f64> {
        (0..length).map(|_| self.next(-limit, limit)).collect()
    }
}

/// Input-output linearisation with critically damped gains for a control period \[s\]: K_D = 0.5 / T, K_P = K_D^2 / 4.
/// Both poles of (T 6.63) then lie at 0.25 / T, slow enough to be held over a period.
pub fn io_for_period(period: f64) -> ControllerConfig {
    let kd = 0.5 / period;
    ControllerConfig { kp: 0.25 * kd * kd, kd, ..ControllerConfig::io() }
}

/// A robot whose links all differ.
pub fn uneven_model(links: usize, uniform: &mut Uniform) -> Model {
    let mut each = |low, high| PerLink::Each((0..links).map(|_| uniform.next(low, high)).collect());
    let config = RobotConfig {
        links,
        length: each(0.08, 0.2),
        contact_half_length: each(0.02, 0.06),
        mass: each(0.3, 1.2),
        inertia: each(5e-4, 4e-3),
        ..RobotConfig::default()
    };
    Model::new(&Robot::new(&config).expect("admissible"), &Ground::default())
}

/// Aiko on the ground of Table 7.2.
pub fn aiko() -> Model {
    Model::new(&Robot::new(&RobotConfig::default()).expect("admissible"), &Ground::default())
}

/// Aiko under PD on the set-valued ground of Table 7.2, by the default scheme.
pub fn default_config() -> MinimalConfig {
    MinimalConfig {
        robot: RobotConfig::default(),
        ground: Ground::default(),
        friction_law: FrictionLaw::SetValued,
        controller: minimal::pd(),
        integrator: IntegratorConfig::default(),
        noise: NoiseConfig::default(),
        seed: 0,
    }
}

/// Lateral undulation (7.3) with soft start.
pub fn soft_start() -> SoftStart {
    SoftStart::new(Wave::default(), 10)
}

/// The straight robot at rest, O_2 at the origin.
pub fn straight(config: &MinimalConfig) -> MinimalSimulation {
    let mut simulation = MinimalSimulation::new(config).expect("admissible");
    let degrees = simulation.model().degrees();
    simulation.place(&MinimalState::zero(degrees));
    simulation
}

/// phi - phi_d of joint 5 \[rad\].
pub fn error_of_joint_5(simulation: &MinimalSimulation, reference: &impl Reference<JointTarget>) -> f64 {
    simulation.state().phi()[4] - reference.target(4, simulation.state().time).angle
}
