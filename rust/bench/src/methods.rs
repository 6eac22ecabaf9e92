//! The ways to integrate that are compared: plain configurations with a name.

use snake_core::stepping::{ImplicitConfig, Precision};
use snake_thesis::{IntegratorConfig, ThesisConfig};

/// One point of a work-precision plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Points of one name make a curve.
    pub curve: String,
    pub integrator: IntegratorConfig,
}

/// Steps of the implicit schemes \[s\]; all divide 0.6 s and the time between samples.
const STEPS: [f64; 8] = [0.05, 0.025, 0.02, 0.0125, 0.01, 0.005, 0.0025, 0.001];
const QUICK_STEPS: [f64; 4] = [0.05, 0.02, 0.01, 0.0025];
const STEPS_IN_SPACE: [f64; 11] = [0.2, 0.1, 1.0 / 15.0, 0.05, 0.025, 0.02, 0.0125, 0.01, 0.005, 0.0025, 0.001];
const QUICK_STEPS_IN_SPACE: [f64; 2] = [0.05, 0.01];

/// Steps of the thesis's scheme \[s\]: its own (T Table 7.2) and smaller.
const THESIS_STEPS: [f64; 3] = [2.5e-4, 1.25e-4, 6.25e-5];

/// All choices that are compared; `pegs`: whether the scene has any.
pub fn choices(quick: bool, pegs: bool) -> Vec<Choice> {
    let mut choices = thesis(quick);
    let default = ImplicitConfig::default();
    let steps = if quick { &QUICK_STEPS[..] } else { &STEPS[..] };
    choices.extend(curve("implicit order 1", steps, ImplicitConfig { order: 1, ..default }));
    choices.extend(curve("implicit order 2", &with_default(steps), default));
    if !quick {
        choices.extend([1e-5, 1e-8, 1e-10].into_iter().flat_map(|tolerance| of_tolerance(tolerance, steps)));
    }
    if !quick && pegs {
        for precision in [Precision::Fast, Precision::Fine] {
            let name = format!("implicit order 2, {precision:?}");
            choices.extend(curve(&name, steps, ImplicitConfig { precision, ..default }));
        }
    }
    choices
}

/// All choices that are compared in 3D.
pub fn choices_in_space(quick: bool) -> Vec<Choice> {
    let steps = if quick { &QUICK_STEPS_IN_SPACE[..] } else { &STEPS_IN_SPACE[..] };
    let default = ImplicitConfig::default();
    let mut choices = curve("implicit order 2", &with_default(steps), default);
    if !quick {
        choices.extend([1e-4, 1e-3, 1e-2].into_iter().flat_map(|tolerance| of_tolerance(tolerance, steps)));
    }
    choices
}

/// The default but for the tolerance \[m/s\].
fn of_tolerance(tolerance: f64, steps: &[f64]) -> Vec<Choice> {
    let integrator = ImplicitConfig { tolerance: Some(tolerance), ..ImplicitConfig::default() };
    curve(&format!("implicit order 2, tolerance {tolerance:e}"), steps, integrator)
}

/// `steps` and the default one.
fn with_default(steps: &[f64]) -> Vec<f64> {
    let default = IntegratorConfig::default().step();
    let others = steps.iter().copied().filter(|&step| step != default);
    others.chain([default]).collect()
}

/// Whether a choice is the default one.
pub fn is_default(integrator: &IntegratorConfig) -> bool {
    let default = IntegratorConfig::default();
    integrator.with_step(integrator.step()) == default.with_step(default.step())
}

/// One configuration at several steps.
fn curve(name: &str, steps: &[f64], integrator: impl Into<IntegratorConfig>) -> Vec<Choice> {
    let integrator = integrator.into();
    let choice = |&step| Choice { curve: name.to_owned(), integrator: integrator.with_step(step) };
    steps.iter().map(choice).collect()
}

/// Algorithm 3.1 with the r's of (T Table 7.2), at its own epsilon and at a tight one.
fn thesis(quick: bool) -> Vec<Choice> {
    let steps = if quick { &THESIS_STEPS[..1] } else { &THESIS_STEPS[..] };
    let with =
        |epsilon| ThesisConfig { tolerance: Some(epsilon), max_iterations: 1_000_000, ..ThesisConfig::default() };
    let mut choices = curve("thesis, own tolerance", steps, with(2e-5));
    choices.extend(curve("thesis, tolerance 1e-8", steps, with(1e-8)));
    choices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Sampled;
    use crate::scenes::Scenario;
    use std::collections::HashSet;

    #[test]
    fn choices_are_admissible_and_differ() {
        let planar = [(false, false), (false, true), (true, true)].map(|(quick, pegs)| choices(quick, pegs));
        for all in planar.into_iter().chain([false, true].map(choices_in_space)) {
            all.iter().for_each(|choice| choice.integrator.validate().unwrap());
            let distinct: HashSet<_> = all.iter().map(|choice| format!("{:?}", choice.integrator)).collect();
            assert_eq!(distinct.len(), all.len());
            assert_eq!(all.iter().filter(|choice| is_default(&choice.integrator)).count(), 1);
        }
    }

    #[test]
    fn steps_divide_the_intervals_that_are_measured() {
        for choice in choices(false, true) {
            for interval in [crate::fleet::WINDOW, Scenario::SAMPLE] {
                let steps = f64::from(choice.integrator.steps_in(interval));
                let step = choice.integrator.step();
                assert!((interval - steps * step).abs() < 1e-9, "{step} s in {interval} s");
            }
        }
    }
}
