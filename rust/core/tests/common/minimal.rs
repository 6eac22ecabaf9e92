//! Random robots and states of the robot model.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use snake_core::minimal::{Ground, Model};
use snake_core::robot::{PerLink, Robot, RobotConfig};

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
