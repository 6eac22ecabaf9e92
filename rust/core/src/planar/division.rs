//! Which robots of a fleet take a step whole, and which take it in parts.

use crate::stepping::IntegratorConfig;
use crate::stepping::start::halvings_to_start;

/// How the robots of a step, or of a part of one, go on.
#[derive(Debug, Clone, Default)]
pub struct Division {
    pub tried: Vec<usize>,
    /// Robots whose step is divided without trying.
    pub untried: Vec<usize>,
    /// Robots for which the step was tried and did not do.
    pub rejected: Vec<usize>,
}

impl Division {
    /// One for each length that a step of `robots` robots may be halved to.
    pub fn of_all_levels(config: &IntegratorConfig, robots: usize) -> Vec<Self> {
        let levels = halvings_to_start().max(config.event_halvings()) + 1;
        let list = || Vec::with_capacity(robots);
        (0..levels).map(|_| Self { tried: list(), untried: list(), rejected: list() }).collect()
    }

    /// Begins a step of `members`, of which those that `divides` names are not tried.
    pub fn sort(&mut self, members: &[usize], divides: impl Fn(usize) -> bool) {
        self.tried.clear();
        self.untried.clear();
        self.rejected.clear();
        for &member in members {
            if divides(member) { self.untried.push(member) } else { self.tried.push(member) }
        }
    }
}
