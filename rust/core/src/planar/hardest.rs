use crate::math::Real;
use crate::planar::Stage;

/// The stage that took the most linear solves since the record was begun.
#[derive(Debug, Clone)]
pub struct Hardest {
    pub solves: u32,
    pub stage: Stage,
}

impl Hardest {
    pub fn new(links: usize) -> Self {
        Self { solves: 0, stage: Stage::with_capacity(links) }
    }

    /// Keeps the stage of `lane` if it took more `solves` than any before.
    pub fn offer<T: Real>(&mut self, stage: &Stage<T>, lane: usize, solves: u32) {
        if solves > self.solves {
            self.solves = solves;
            stage.copy_lane(lane, &mut self.stage);
        }
    }
}
