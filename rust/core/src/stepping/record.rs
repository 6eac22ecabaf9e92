//! What a scripted run may record besides its motion: the impulses of all contacts, and the work of the actuators.

use nalgebra::Vector3;

use crate::contact::Source;

use super::stage::ContactImpulse;

/// Sums over an interval, which whoever reads them clears. A robot has none unless it is asked for.
#[derive(Debug, Clone)]
pub struct Record {
    pub sum: StageRecord,
    /// Impulse on each link of each other link: row = link that receives it \[N s\].
    pub pair: Vec<Vector3<f64>>,
    /// The stage at hand, and the first one of its step until the step is accepted.
    pub(crate) stage: StageRecord,
    first: StageRecord,
}

/// Impulses of the ground and work of the actuators over a stage, or over many.
#[derive(Debug, Clone, PartialEq)]
pub struct StageRecord {
    /// Friction, x and y of the world frame, and normal impulse at up to two contacts of each link \[N s\]; models whose
    /// normal forces are constant leave those out.
    pub ground: Vec<[Vector3<f64>; 2]>,
    /// Of each joint, axis by axis \[J\].
    pub actuator_work: Vec<[f64; 2]>,
    /// What the motors draw, alike \[J\].
    pub drawn: Vec<[f64; 2]>,
}

impl StageRecord {
    fn new(links: usize) -> Self {
        let none = vec![[0.0; 2]; links - 1];
        Self { ground: vec![[Vector3::zeros(); 2]; links], actuator_work: none.clone(), drawn: none }
    }

    /// Adds `other`, `weight` times.
    pub(crate) fn add(&mut self, other: &Self, weight: f64) {
        for (sum, other) in self.ground.iter_mut().flatten().zip(other.ground.iter().flatten()) {
            *sum += other * weight;
        }
        let pairs = self.actuator_work.iter_mut().zip(&other.actuator_work);
        for (sum, other) in pairs.chain(self.drawn.iter_mut().zip(&other.drawn)) {
            sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other * weight);
        }
    }

    fn clear(&mut self) {
        self.ground.fill([Vector3::zeros(); 2]);
        self.actuator_work.fill([0.0; 2]);
        self.drawn.fill([0.0; 2]);
    }
}

impl Record {
    /// Of a robot of `links` links.
    pub fn new(links: usize) -> Self {
        Self {
            sum: StageRecord::new(links),
            pair: vec![Vector3::zeros(); links * links],
            stage: StageRecord::new(links),
            first: StageRecord::new(links),
        }
    }

    /// Begins an interval.
    pub fn clear(&mut self) {
        self.sum.clear();
        self.pair.fill(Vector3::zeros());
    }

    /// The stage at hand becomes the first one of its step.
    pub(crate) fn keep_first_stage(&mut self) {
        std::mem::swap(&mut self.stage, &mut self.first);
    }

    /// Adds the first stage's share.
    pub(crate) fn add_first_stage(&mut self, weight: f64) {
        self.sum.add(&self.first, weight);
    }

    /// Adds the stage at hand.
    pub(crate) fn add_stage(&mut self) {
        self.sum.add(&self.stage, 1.0);
    }

    /// Adds the impulse of another link, `weight` times.
    pub(crate) fn add_contact(&mut self, contact: &ContactImpulse, weight: f64) {
        if let Source::Link(other) = contact.source {
            let links = self.stage.ground.len();
            if other < links {
                self.pair[contact.link * links + other] += contact.impulse * weight;
            }
        }
    }
}
