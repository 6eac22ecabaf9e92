//! Rows that one thread steps together.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::environment::{Environment, RobotModel};
use crate::stepping::Fleet;

use super::row::Row;

/// Neighbouring rows of a batch.
#[derive(Debug)]
pub struct Chunk<M: RobotModel> {
    first: usize,
    pub rows: Vec<Row<M>>,
    /// Rows that take part in the current step.
    active: Vec<bool>,
    /// Advances the robots side by side.
    fleet: Fleet<M::Model>,
}

impl<M: RobotModel> Chunk<M> {
    /// The rows from `first` on.
    pub fn new(first: usize, rows: Vec<Row<M>>, fleet: Fleet<M::Model>) -> Self {
        Self { first, active: vec![false; rows.len()], rows, fleet }
    }

    /// Indices of the rows in the batch.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.rows.len()
    }

    /// Starts an episode in the active rows.
    pub fn reset(
        &mut self,
        prototype: &Environment<M>,
        seeds: &[Option<u64>],
        active: &[bool],
        observation: &mut [f32],
    ) {
        self.active.copy_from_slice(active);
        self.for_active(prototype, observation, |index, row, observation| {
            let outcome = row.environment.reset(seeds[index], observation);
            row.keep(outcome);
        });
    }

    /// One control period in the active rows.
    pub fn step(&mut self, prototype: &Environment<M>, actions: &[f64], active: &[bool], observation: &mut [f32]) {
        let size = prototype.action_size();
        self.active.copy_from_slice(active);
        self.for_active(prototype, observation, |index, row, _| {
            row.environment.begin_step(&actions[index * size..(index + 1) * size]);
        });
        self.advance(prototype, observation);
        self.for_active(prototype, observation, |_, row, observation| {
            let outcome = row.environment.end_step(observation);
            row.keep(outcome);
        });
    }

    /// Advances the robots of the active rows together.
    fn advance(&mut self, prototype: &Environment<M>, observation: &mut [f32]) {
        let Self { rows, active, fleet, .. } = self;
        let (system, period) = (prototype.model().simulation().system(), prototype.rules().period);
        let taking_part = rows.iter_mut().zip(&*active).filter(|(_, active)| **active);
        let robots = taking_part.map(|(row, _)| row.environment.model_mut().driven());
        let result = catch_unwind(AssertUnwindSafe(|| fleet.advance(system, robots, period)));
        if result.is_err() {
            let observations = observation.chunks_exact_mut(prototype.observation_size());
            let rows = rows.iter_mut().zip(active).zip(observations).filter(|((_, active), _)| **active);
            rows.for_each(|((row, active), observation)| {
                *active = false;
                row.give_up(prototype, observation);
            });
        }
    }

    /// Runs `part` of a step in the active rows. A row in which it panics is abandoned.
    fn for_active(
        &mut self,
        prototype: &Environment<M>,
        observation: &mut [f32],
        part: impl Fn(usize, &mut Row<M>, &mut [f32]),
    ) {
        let observations = observation.chunks_exact_mut(prototype.observation_size());
        let rows = self.rows.iter_mut().zip(&mut self.active).zip(observations);
        for (index, ((row, active), observation)) in rows.enumerate().filter(|(_, ((_, active), _))| **active) {
            let result = catch_unwind(AssertUnwindSafe(|| {
                row.environment.model().simulation().body().interrupt.check();
                part(index, row, observation);
            }));
            if result.is_err() {
                *active = false;
                row.give_up(prototype, observation);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{EnvConfig, PlanarRobot};
    use crate::stepping::ImplicitConfig;

    /// Three rows after a reset with seeds 0, 1, 2, and their observations.
    fn three_rows(prototype: &Environment) -> (Chunk<PlanarRobot>, Vec<f32>) {
        let fleet = Fleet::new(ImplicitConfig::default(), prototype.system(), 3);
        let mut chunk = Chunk::new(0, vec![Row::new(prototype.clone()); 3], fleet);
        let mut observation = vec![0.5; 3 * prototype.observation_size()];
        chunk.reset(prototype, &[0, 1, 2].map(Some), &[true; 3], &mut observation);
        (chunk, observation)
    }

    #[test]
    fn a_row_that_panics_ends_flagged_and_leaves_its_neighbours_alone() {
        let prototype = Environment::new(&EnvConfig::default()).unwrap();
        let size = prototype.observation_size();
        let ((mut sick, mut a), (sound, b)) = (three_rows(&prototype), three_rows(&prototype));
        sick.for_active(&prototype, &mut a, |index, _, _| assert!(index != 1, "a defect in one row"));
        assert_eq!(sick.active, [true, false, true]);
        assert!(sick.rows[1].outcome.truncated && a[size..2 * size].iter().all(|value| *value == 0.0));
        for row in [0, 2] {
            assert_eq!(sick.rows[row].environment.save(), sound.rows[row].environment.save());
            assert_eq!(a[row * size..(row + 1) * size], b[row * size..(row + 1) * size]);
        }
    }

    #[test]
    fn a_row_that_panicked_goes_on_with_the_next_episode_of_its_seed() {
        let prototype = Environment::new(&EnvConfig::default()).unwrap();
        let ((mut sick, mut a), (mut sound, mut b)) = (three_rows(&prototype), three_rows(&prototype));
        sick.for_active(&prototype, &mut a, |index, _, _| assert!(index != 1, "a defect in one row"));
        sick.reset(&prototype, &[None; 3], &[true; 3], &mut a);
        sound.reset(&prototype, &[None; 3], &[true; 3], &mut b);
        assert_eq!(a, b);
    }
}
