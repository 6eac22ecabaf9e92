//! Contacts with pegs of robots side by side: which lane's peg is in which contact of the stage.

use crate::math::{MAX_LANES, Real};
use crate::robot::Link;
use crate::spatial::{Laned, SpatialBody, Stage, StagePeg, StageSolution, Wrench};
use crate::stepping::{ContactImpulse, Source};

use super::peg_contacts::{LinkPrediction, Pair};
use super::workspace::Workspace;

/// The obstacles, and the places at them, that lanes have in one contact of the stage.
type Slot = [Option<(usize, usize)>; MAX_LANES];

/// Peg contacts of the current stage, and the pairs of the one before.
#[derive(Debug, Clone, Default)]
pub struct ContactMap {
    slots: Vec<Slot>,
    /// Pairs of the last stage, lane by lane.
    pairs: [Vec<Pair>; MAX_LANES],
}

impl ContactMap {
    pub fn new(links: usize) -> Self {
        Self { slots: Vec::with_capacity(4 * links), pairs: std::array::from_fn(|_| Vec::with_capacity(4 * links)) }
    }

    /// Takes over what the last step of a lane's robot left.
    pub fn recall(&mut self, lane: usize, pairs: &[Pair]) {
        self.pairs[lane].clear();
        self.pairs[lane].extend_from_slice(pairs);
    }

    pub fn pairs(&self, lane: usize) -> &[Pair] {
        &self.pairs[lane]
    }

    /// Contacts of the stage that are a lane's own.
    pub fn of_lane(&self, lane: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        self.slots.iter().enumerate().filter(move |(_, slot)| slot[lane].is_some()).map(|(index, _)| index)
    }

    pub fn clear<T: Real>(&mut self, work: &mut Workspace<T>) {
        self.slots.clear();
        work.stage.pegs.clear();
        work.solution.peg.clear();
    }

    /// Adds the contacts of link `index` in the lanes given; `elapsed` as in [`LinkPrediction`].
    pub fn add<'a, T: Real>(
        &mut self,
        work: &mut Workspace<T>,
        index: usize,
        link: &Link,
        robots: impl Iterator<Item = (usize, &'a SpatialBody)>,
        elapsed: T,
    ) {
        let first = self.slots.len();
        for (lane, body) in robots {
            let mut next = first;
            let prediction = LinkPrediction::of(work, lane, index, link, elapsed.lane(lane));
            prediction.visit(index, &body.pegs, |(peg, place), contact| {
                if next == self.slots.len() {
                    self.slots.push([None; MAX_LANES]);
                    work.stage.pegs.push(StagePeg::nowhere(index));
                    work.solution.peg.push(T::zero());
                }
                self.slots[next][lane] = Some((peg, place));
                work.stage.pegs[next].set_lane(lane, &contact);
                let same = |pair: &&Pair| (pair.link, pair.peg, pair.place) == (index, peg, place);
                let force = self.pairs[lane].iter().find(same).map_or(0.0, |pair| pair.force);
                work.solution.peg[next].set_lane(lane, work.stage.coefficient.lane(lane) * force);
                next += 1;
            });
        }
    }

    /// The forces of a lane's solved stage become those that the next one starts from.
    pub fn remember<T: Real>(&mut self, stage: &Stage<T>, solution: &StageSolution<T>, lane: usize) {
        let Self { slots, pairs } = self;
        pairs[lane].clear();
        for (slot, (contact, impulse)) in slots.iter().zip(stage.pegs.iter().zip(&solution.peg)) {
            if let Some((peg, place)) = slot[lane] {
                let force = impulse.lane(lane) / stage.coefficient.lane(lane);
                pairs[lane].push(Pair { link: contact.link, peg, place, force });
            }
        }
    }

    /// Impulses of pegs in a lane's solved stage.
    pub fn contact_impulses<'a, T: Real>(
        &'a self,
        stage: &'a Stage<T>,
        solution: &'a StageSolution<T>,
        lane: usize,
    ) -> impl Iterator<Item = ContactImpulse> + 'a {
        self.of_lane(lane).map(move |index| {
            let StagePeg { link, direction: Wrench { linear, .. }, .. } = &stage.pegs[index];
            let impulse = linear.lane(lane) * solution.peg[index].lane(lane);
            let (obstacle, _) = self.slots[index][lane].expect("a contact of the lane");
            ContactImpulse { lane, link: *link, impulse, source: Source::Obstacle(obstacle) }
        })
    }
}
