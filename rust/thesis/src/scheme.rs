//! Time stepping of the thesis, as far as its models share it: equal steps of a fixed length.

use snake_core::stepping::{Body, Model, steps_in};

/// Integrates over `duration` in equal steps no longer than `longest`, each of which `step` takes; the time is set here.
/// Returns whether the state stayed plausible.
pub fn advance_in_equal_steps<M: Model>(
    body: &mut Body<M>,
    duration: f64,
    longest: f64,
    mut step: impl FnMut(&mut Body<M>, f64),
) -> bool {
    body.begin();
    if duration <= 0.0 {
        return true;
    }
    let steps = steps_in(duration, longest);
    let h = duration / f64::from(steps);
    for k in 1..=steps {
        body.interrupt.check();
        step(body, h);
        body.state.time = body.interval_start() + h * f64::from(k);
        body.is_plausible = body.state.is_plausible();
        body.quarantine();
        if body.statistics.diverged {
            return false;
        }
    }
    true
}
