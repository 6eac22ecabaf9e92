//! A slow and late link between the policy and the joint references (T 7.5.4).

use serde::{Deserialize, Serialize};

/// Holds actions back: the references take one over every so many control periods, that of some periods ago.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// Control periods from one update of the references to the next.
    every: u32,
    /// Control periods from an action to its effect.
    delay: u32,
    /// Actions so far, and the last of them, a ring.
    count: u32,
    size: usize,
    ring: Vec<f64>,
}

impl Latency {
    /// For actions of `size` elements held back by at most `longest` control periods.
    pub fn new(size: usize, every: u32, longest: u32) -> Self {
        Self { every: every.max(1), delay: 0, count: 0, size, ring: vec![0.0; size * (longest as usize + 1)] }
    }

    /// Begins an episode; a delay longer than the longest counts as that.
    pub fn begin(&mut self, delay: u32) {
        (self.delay, self.count) = (delay.min(self.length() - 1), 0);
    }

    /// Takes the action of a control period; returns the one that reaches the references now, if any does.
    pub fn pass(&mut self, action: &[f64]) -> Option<&[f64]> {
        let (count, length) = (self.count, self.length());
        self.count += 1;
        let place = |count: u32| (count % length) as usize * self.size;
        let (to, from) = (place(count), place(count.wrapping_sub(self.delay)));
        self.ring[to..to + self.size].copy_from_slice(action);
        let is_due = count >= self.delay && count.is_multiple_of(self.every);
        is_due.then(|| &self.ring[from..from + self.size])
    }

    /// Takes over a saved state if it has the shape of this one.
    pub fn restore(&mut self, state: &Self) -> bool {
        let fits = (state.size, state.ring.len(), state.every) == (self.size, self.ring.len(), self.every);
        if fits {
            self.clone_from(state);
        }
        fits
    }

    fn length(&self) -> u32 {
        (self.ring.len() / self.size) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What reaches the references in control periods 0, 1, ..., if action k is k.
    fn arrivals(every: u32, delay: u32) -> Vec<Option<f64>> {
        let mut latency = Latency::new(1, every, 4);
        latency.begin(delay);
        (0..8).map(|k| latency.pass(&[f64::from(k)]).map(|action| action[0])).collect()
    }

    #[test]
    fn without_delay_every_action_arrives_at_once() {
        assert_eq!(arrivals(1, 0), (0..8).map(|k| Some(f64::from(k))).collect::<Vec<_>>());
    }

    #[test]
    fn actions_arrive_late_and_only_at_the_instants_of_an_update() {
        let late = [None, None, None, Some(0.0), Some(1.0), Some(2.0), Some(3.0), Some(4.0)];
        assert_eq!(arrivals(1, 3), late);
        let late_and_rare = [None, None, Some(1.0), None, Some(3.0), None, Some(5.0), None];
        assert_eq!(arrivals(2, 1), late_and_rare);
    }
}
