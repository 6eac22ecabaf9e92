//! References of a robot with broken joints.

use super::{Reference, WaveJets};

/// A reference that some joints do not follow: they keep theirs. Nothing else changes where there are none.
#[derive(Debug, Clone, PartialEq)]
pub struct Holding<R, T> {
    reference: R,
    /// Joints and the references that they keep.
    held: Vec<(usize, T)>,
}

impl<R, T> Holding<R, T> {
    pub fn new(reference: R, held: impl IntoIterator<Item = (usize, T)>) -> Self {
        Self { reference, held: held.into_iter().collect() }
    }
}

impl<R: Reference<T>, T: Copy + Sync> Reference<T> for Holding<R, T> {
    fn target(&self, joint: usize, time: f64) -> T {
        let held = self.held.iter().find(|(held, _)| *held == joint);
        held.map_or_else(|| self.reference.target(joint, time), |(_, target)| *target)
    }

    fn targets(&self, time: f64, targets: &mut [T]) {
        self.reference.targets(time, targets);
        for (joint, target) in &self.held {
            targets[*joint] = *target;
        }
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        if self.held.is_empty() { self.reference.travelling_wave(time) } else { None }
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.reference.next_jump(time)
    }
}
