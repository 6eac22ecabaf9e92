//! Noise on the measurements used for feedback (T 7.9)-(T 7.14).

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use snake_core::noise::NoiseConfig;

use super::feedback::Measurement;

/// A seeded stream of noise.
#[derive(Debug, Clone)]
pub struct Noise {
    config: NoiseConfig,
    stream: ChaCha8Rng,
}

impl Noise {
    pub fn new(config: NoiseConfig, seed: u64) -> Self {
        Self { config, stream: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// A fresh draw of the errors of all measurements.
    pub fn draw(&mut self, error: &mut Measurement) {
        if self.config.is_silent() {
            return;
        }
        let config = self.config;
        // N_p, drawn so that the stream is that of all measurements.
        let _ = [self.uniform(config.position), self.uniform(config.position)];
        error.theta = self.uniform(config.heading);
        error.phi.iter_mut().for_each(|x| *x = self.uniform(config.joint_angle));
        error.velocity.iter_mut().for_each(|x| *x = self.uniform(config.velocity));
        error.theta_rate = self.uniform(config.yaw_rate);
        error.phi_rate.iter_mut().for_each(|x| *x = self.uniform(config.joint_rate));
    }

    /// N (2 rand - 1), uniform on [-N, N).
    fn uniform(&mut self, amplitude: f64) -> f64 {
        let unit = (self.stream.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        amplitude * (2.0 * unit - 1.0)
    }
}

impl Measurement {
    /// Adds the errors of a draw.
    pub fn add(&mut self, error: &Measurement) {
        self.theta += error.theta;
        self.velocity += error.velocity;
        self.theta_rate += error.theta_rate;
        self.phi.iter_mut().zip(&error.phi).for_each(|(x, e)| *x += e);
        self.phi_rate.iter_mut().zip(&error.phi_rate).for_each(|(x, e)| *x += e);
    }
}
