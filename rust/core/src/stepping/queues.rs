//! Which robots share registers: those whose next parts are of one scheme, as alike as possible.

use super::plan::{Division, Part, StepPlan};

/// Robots that have chosen their next part, by its scheme.
#[derive(Debug, Clone, Default)]
pub struct Queues {
    second_order: Vec<usize>,
    euler: Vec<usize>,
    /// Lists of the last round, whose memory is used again.
    spare: Round,
}

/// The robots of one round, to be taken in registers in this order.
#[derive(Debug, Clone, Default)]
pub struct Round {
    pub second_order: Vec<usize>,
    pub euler: Vec<usize>,
}

impl Queues {
    pub fn with_capacity(robots: usize) -> Self {
        let list = || Vec::with_capacity(robots);
        Self { second_order: list(), euler: list(), spare: Round { second_order: list(), euler: list() } }
    }

    pub fn clear(&mut self) {
        self.second_order.clear();
        self.euler.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.second_order.is_empty() && self.euler.is_empty()
    }

    pub fn push(&mut self, member: usize, part: &Part) {
        if part.is_euler { self.euler.push(member) } else { self.second_order.push(member) }
    }

    /// Takes as many robots from either queue as fill registers of `lanes`; those that are the most advanced wait for
    /// others. Where no register can be filled, the longer queue is taken.
    pub fn next_round<'a, V: Division + 'a>(&mut self, lanes: usize, plan: impl Fn(usize) -> &'a StepPlan<V>) -> Round {
        let Self { second_order, euler, spare } = self;
        let is_any_full = second_order.len().max(euler.len()) >= lanes;
        let is_second_order_longer = second_order.len() >= euler.len();
        let mut round = std::mem::take(spare);
        for (queue, chosen, is_longer) in [
            (second_order, &mut round.second_order, is_second_order_longer),
            (euler, &mut round.euler, !is_second_order_longer),
        ] {
            let count = match (is_any_full, is_longer) {
                (true, _) => queue.len() - queue.len() % lanes,
                (false, true) => queue.len(),
                (false, false) => 0,
            };
            if count < queue.len() {
                queue.sort_unstable_by(|&a, &b| plan(b).progress().total_cmp(&plan(a).progress()).then(a.cmp(&b)));
            }
            chosen.extend(queue.drain(queue.len() - count..));
            // A register takes as long as its slowest lane.
            chosen.sort_unstable_by_key(|&member| (plan(member).solves, member));
        }
        round
    }

    /// Ends a round: its robots have been queued again.
    pub fn end_round(&mut self, mut round: Round) {
        round.second_order.clear();
        round.euler.clear();
        self.spare = round;
    }
}
