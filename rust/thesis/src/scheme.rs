//! Time stepping of the thesis, as far as its models share it: equal steps of a fixed length.

use snake_core::stepping::{Driven, steps_in};

/// Integrates over `duration` in equal steps no longer than `longest`, each of which `step` takes; the time is set here.
/// Returns whether the state stayed plausible.
pub fn advance_in_equal_steps<D: Driven>(
    robot: &mut D,
    duration: f64,
    longest: f64,
    mut step: impl FnMut(&mut D, f64),
) -> bool {
    robot.body_mut().begin();
    if duration <= 0.0 {
        return true;
    }
    let steps = steps_in(duration, longest);
    let h = duration / f64::from(steps);
    for k in 1..=steps {
        robot.body().interrupt.check();
        step(robot, h);
        let body = robot.body_mut();
        body.state.time = body.interval_start() + h * f64::from(k);
        body.is_plausible = body.state.is_plausible();
        body.quarantine();
        if body.statistics.diverged {
            return false;
        }
    }
    true
}
