//! Time stepping of the thesis, as far as its models share it: equal steps of a fixed length.

use std::fmt::Debug;

use super::ThesisConfig;
use super::model::{Driven, Model, RobotState};

/// The scheme of the thesis for a model: Algorithm 3.1 in the plane, Algorithms 4.1 to 4.3 in 3D.
pub trait ThesisScheme: Debug + Clone {
    type Model: Model;

    fn new(config: ThesisConfig, system: &<Self::Model as Model>::System) -> Self;

    fn config(&self) -> &ThesisConfig;

    /// Clears all impulses.
    fn clear(&mut self);

    /// Impulses that the next step's iteration starts from, among `pegs` pegs, in a fixed order \[N s\].
    fn impulses(&mut self, pegs: usize) -> impl Iterator<Item = &mut f64>;

    /// One step of length `h`; the time is set by [`Self::advance`].
    fn step<D: Driven<Model = Self::Model>>(&mut self, system: &<Self::Model as Model>::System, robot: &mut D, h: f64);

    /// Integrates over `duration` in equal steps no longer than the configured one.
    fn advance<D: Driven<Model = Self::Model>>(
        &mut self,
        system: &<Self::Model as Model>::System,
        robot: &mut D,
        duration: f64,
    ) {
        robot.body_mut().begin();
        if duration <= 0.0 {
            return;
        }
        let steps = self.config().steps_in(duration);
        let h = duration / f64::from(steps);
        for k in 1..=steps {
            robot.body().interrupt.check();
            self.step(system, robot, h);
            let body = robot.body_mut();
            body.state.set_time(body.interval_start() + h * f64::from(k));
            body.is_plausible = body.state.is_plausible();
            body.quarantine();
            if body.statistics.diverged {
                self.clear();
                break;
            }
        }
    }
}
