//! Which robots share registers: those whose next parts are of one scheme, as alike as possible.

use super::plan::Part;

/// Robots that have chosen their next part, by its scheme.
#[derive(Default)]
pub struct Queues {
    second_order: Vec<usize>,
    euler: Vec<usize>,
    /// Lists of the last round, whose memory is used again.
    spare: Round,
    /// Solves above, number below, so that one comparison sorts; empty between rounds.
    keys: Vec<u64>,
}

/// The robots of one round, to be taken in registers in this order.
#[derive(Default)]
pub struct Round {
    pub second_order: Vec<usize>,
    pub euler: Vec<usize>,
}

impl Queues {
    pub fn with_capacity(robots: usize) -> Self {
        let list = || Vec::with_capacity(robots);
        let spare = Round { second_order: list(), euler: list() };
        Self { second_order: list(), euler: list(), spare, keys: Vec::with_capacity(robots) }
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
    /// others. Where no register can be filled, the longer queue is taken. `position` tells how far a robot has come \[s\]
    /// and the linear solves of its last stage.
    pub fn next_round(&mut self, lanes: usize, position: &dyn Fn(usize) -> (f64, u32)) -> Round {
        let Self { second_order, euler, spare, keys } = self;
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
                queue.sort_unstable_by(|&a, &b| position(b).0.total_cmp(&position(a).0).then(a.cmp(&b)));
            }
            // A register takes as long as its slowest lane.
            let key = |member: usize| u64::from(position(member).1) << 32 | member as u64;
            keys.extend(queue.drain(queue.len() - count..).map(key));
            keys.sort_unstable();
            chosen.extend(keys.drain(..).map(|key| key as u32 as usize));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn queued(second_order: usize, euler: usize) -> Queues {
        let mut queues = Queues::with_capacity(second_order + euler);
        for member in 0..second_order + euler {
            let is_euler = member >= second_order;
            queues.push(member, &Part { length: 0.0125, is_euler, may_fail: true });
        }
        queues
    }

    #[test]
    fn the_most_advanced_wait_until_a_register_is_full() {
        let mut queues = queued(10, 3);
        // Robots 3 and 7 are ahead, the others level.
        let position = |member| (if [3, 7].contains(&member) { 0.02 } else { 0.01 }, 10 - (member as u32).min(10));
        let round = queues.next_round(8, &position);
        assert_eq!(round.second_order, [9, 8, 6, 5, 4, 2, 1, 0], "in the order of their solves");
        assert!(round.euler.is_empty(), "three robots do not fill a register");
        queues.end_round(round);
        let round = queues.next_round(8, &position);
        assert_eq!((round.second_order.len(), round.euler.len()), (0, 3), "the longer queue where none is full");
        queues.end_round(round);
        assert_eq!(queues.next_round(8, &position).second_order.len(), 2);
        assert!(queues.is_empty());
    }

    #[test]
    fn robots_that_are_taken_one_by_one_never_wait() {
        let round = queued(3, 2).next_round(1, &|_| (0.0, 0));
        assert_eq!((round.second_order.len(), round.euler.len()), (3, 2));
    }
}
