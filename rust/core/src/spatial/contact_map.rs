//! Contacts with pegs of robots side by side: which lane's peg is in which contact of the stage.

use nalgebra::{Vector2, Vector3};

use crate::math::{MAX_LANES, Real};
use crate::robot::Link;
use crate::spatial::{Laned, SpatialBody, Stage, StagePair, StagePeg, StagePegFriction, StageSolution, Wrench};
use crate::stepping::{ContactImpulse, Source};

use super::peg_contacts::{LinkPrediction, Pair};
use super::workspace::Workspace;

/// The obstacles, and the places at them, that lanes have in one contact of the stage, and whether they touched before.
type Slot = [Option<(usize, usize, bool)>; MAX_LANES];

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
        work.stage.peg_friction.clear();
        work.solution.peg.clear();
        work.solution.peg_friction.clear();
    }

    /// Adds the contacts of link `index` in the lanes given; `elapsed` as in [`LinkPrediction`]. Once one of them has friction,
    /// all have a row of it.
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
            if LinkPrediction::is_clear(work, lane, index, link, &body.pegs) {
                continue;
            }
            let mut next = first;
            let prediction = LinkPrediction::of(work, lane, index, link, elapsed.lane(lane));
            prediction.visit(index, &body.pegs, |(peg, place), contact, surface| {
                if next == self.slots.len() {
                    self.slots.push([None; MAX_LANES]);
                    work.stage.pegs.push(StagePeg::nowhere(index));
                    work.solution.peg.push(T::zero());
                }
                let coefficient = body.pegs.friction(peg);
                if coefficient > 0.0 || !work.stage.peg_friction.is_empty() {
                    lay_out_friction(work);
                }
                work.stage.pegs[next].set_lane(lane, &contact);
                let same = |pair: &&Pair| (pair.link, pair.peg, pair.place) == (index, peg, place);
                let known = self.pairs[lane].iter().find(same);
                self.slots[next][lane] = Some((peg, place, known.is_some_and(|pair| pair.touches)));
                let c = work.stage.coefficient.lane(lane);
                work.solution.peg[next].set_lane(lane, c * known.map_or(0.0, |pair| pair.force));
                if coefficient > 0.0 {
                    let friction = StagePegFriction::new(&contact.direction.linear, &surface, coefficient);
                    let force = known.map_or(Vector3::zeros(), |pair| pair.friction);
                    let impulse = Vector2::from(friction.tangents.map(|tangent| c * tangent.linear.dot(&force)));
                    work.solution.peg_friction[next].set_lane(lane, &impulse);
                    work.stage.peg_friction[next].set_lane(lane, &friction);
                }
                next += 1;
            });
        }
    }

    /// The forces of a lane's solved stage become those that the next one starts from.
    pub fn remember<T: Real>(&mut self, stage: &Stage<T>, solution: &StageSolution<T>, lane: usize) {
        let Self { slots, pairs } = self;
        pairs[lane].clear();
        for (index, (slot, (contact, impulse))) in slots.iter().zip(stage.pegs.iter().zip(&solution.peg)).enumerate() {
            if let Some((peg, place, touches)) = slot[lane] {
                let c = stage.coefficient.lane(lane);
                let friction = friction_of(stage, solution, index, lane) / c;
                pairs[lane].push(Pair {
                    link: contact.link,
                    peg,
                    place,
                    force: impulse.lane(lane) / c,
                    friction,
                    touches,
                });
            }
        }
    }

    /// The contacts of a lane's solved stage, as of a link with itself, their impulses, and whether they touched before.
    pub fn solved_rows<'a, T: Real>(
        &'a self,
        stage: &'a Stage<T>,
        solution: &'a StageSolution<T>,
        lane: usize,
    ) -> impl Iterator<Item = (StagePair, f64, bool)> + 'a {
        self.of_lane(lane).map(move |index| {
            let StagePeg { link, direction, offset, .. } = &stage.pegs[index];
            let direction = [direction.lane(lane), Wrench::zero()];
            let (_, _, touched) = self.slots[index][lane].expect("a contact of the lane");
            let row = StagePair { links: [*link; 2], direction, offset: offset.lane(lane) };
            (row, solution.peg[index].lane(lane), touched)
        })
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
            let pressed = linear.lane(lane) * solution.peg[index].lane(lane);
            let impulse = pressed + friction_of(stage, solution, index, lane);
            let (obstacle, ..) = self.slots[index][lane].expect("a contact of the lane");
            ContactImpulse { lane, link: *link, impulse, source: Source::Obstacle(obstacle) }
        })
    }
}

/// Gives every contact a row of friction, without any in lanes that do not set it.
fn lay_out_friction<T: Real>(work: &mut Workspace<T>) {
    let (stage, solution) = (&mut work.stage, &mut work.solution);
    stage.peg_friction.resize(stage.pegs.len(), StagePegFriction::nowhere());
    solution.peg_friction.resize(stage.pegs.len(), Vector2::new(T::zero(), T::zero()));
}

/// Friction of a lane's contact as an impulse on the link, frame I \[N s\].
fn friction_of<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, index: usize, lane: usize) -> Vector3<f64> {
    let Some(friction) = stage.peg_friction.get(index) else { return Vector3::zeros() };
    let [along, across] = friction.tangents.map(|tangent| tangent.linear.lane(lane));
    let impulse = solution.peg_friction[index].lane(lane);
    along * impulse.x + across * impulse.y
}
