//! The scheme of chapter 3: laws that it shares with the schemes of the core, accuracy, Algorithm 3.1.

mod algorithm_3_1;
#[path = "../../../core/tests/planar/conservation_laws.rs"]
mod conservation_laws;
mod convergence;
#[path = "../../../core/tests/planar/friction_laws.rs"]
mod friction_laws;
mod io_control;
mod reference;
#[path = "../../../core/tests/planar/scheme_laws.rs"]
mod scheme_laws;

use snake_thesis::ThesisConfig;

/// The scheme with contacts solved to `epsilon` \[N s\].
fn thesis(step: f64, epsilon: f64) -> ThesisConfig {
    ThesisConfig { step, tolerance: Some(epsilon), max_iterations: 1_000_000, ..ThesisConfig::default() }
}

/// What the files of the core take for its schemes.
fn schemes(step: f64) -> [(&'static str, ThesisConfig); 1] {
    [("thesis", thesis(step, 1e-13))]
}

fn fit_for_the_gait(_step: f64, epsilon: f64) -> [(&'static str, ThesisConfig); 1] {
    [("thesis", thesis(2.5e-4, epsilon))]
}

fn for_a_long_run() -> (&'static str, ThesisConfig, f64) {
    ("thesis", thesis(2.5e-4, 1e-7), 250.0)
}
