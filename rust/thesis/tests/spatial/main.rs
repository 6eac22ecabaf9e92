//! The scheme of chapter 4: directions of forces, laws, and trajectories of an independent implementation.

mod allocation;
mod ground_geometry;
mod joints;
mod laws;
mod peg_geometry;
mod reference;
mod step;

use snake_thesis::ThesisConfig;

/// The scheme with contacts solved to `epsilon` \[N s\].
fn thesis(step: f64, epsilon: f64) -> ThesisConfig {
    ThesisConfig { step, tolerance: Some(epsilon), max_iterations: 1_000_000, ..ThesisConfig::default() }
}
