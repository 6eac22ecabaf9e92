//! Contacts of a robot with itself and their friction, whose rows couple two links of the chain. A stage without them costs
//! nothing.

use nalgebra::Vector3;

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::math::{Real, add_scaled, keep};
use crate::planar::{Stage, StageSolution};
use crate::solver::{EliminatedChain, LawForm, add};

use super::contact_friction::ContactFriction;
use super::link_term::LinkTerm;
use super::low_rank::{Coupling, LowRank, coupling_of, respond};
use super::sweep::Quadratic;
use super::terms::RowTerm;
use super::unilateral::{RowLaw, UnilateralTerm};

/// The contacts of the current stage.
pub(super) struct SelfContacts<T> {
    terms: Vec<PairTerm<T>>,
    friction: ContactFriction<Coupling<T>, T>,
    /// Force of all contacts on each link, w P, in the link's frame.
    pub force: Vec<Vector3<T>>,
    /// Difference of that force to its linearisation at the start of the step.
    pub remainder: Vec<Vector3<T>>,
    low_rank: LowRank<T>,
    /// Workspace of an elimination with another linear term, one number per link.
    constant: Vec<T>,
}

/// One contact between two links.
type PairTerm<T> = RowTerm<Coupling<T>, UnilateralTerm<T>>;

impl<T: Real, L: RowLaw<T>> RowTerm<Coupling<T>, L> {
    /// Force and stiffness at the present twists by `evaluate`, a function of the law and the velocity; adds the force on both
    /// links, with its difference to its linearisation, and to the slope. In the linearisation it falls by `coupled` with the
    /// step of another row.
    #[inline(always)]
    fn evaluate(
        &mut self,
        links: &[LinkTerm<T>],
        (force, remainder): (&mut [Vector3<T>], &mut [Vector3<T>]),
        slope: &mut T,
        coupled: T,
        evaluate: impl FnOnce(&mut L, T) -> T,
    ) {
        let Self { row: coupling, law } = self;
        let step = coupling.along(|link| links[link].step);
        let expected = law.impulse() - coupled - coupling.stiffness * step;
        coupling.stiffness = evaluate(law, coupling.along(|link| links[link].twist));
        *slope -= law.impulse() * step;
        for (link, w) in coupling.links.into_iter().zip(&coupling.direction) {
            force[link] = add_scaled(&force[link], w, law.impulse());
            remainder[link] = add_scaled(&remainder[link], w, law.impulse() - expected);
        }
    }

    /// First and second derivative of the law's function along the step.
    #[inline(always)]
    fn along(&self, links: &[LinkTerm<T>], alpha: T) -> (T, T) {
        let (velocity, rate) = (self.row.along(|link| links[link].start), self.row.along(|link| links[link].step));
        self.law.along(velocity, rate, alpha)
    }
}

impl<T: Real> SelfContacts<T> {
    pub fn new(links: usize) -> Self {
        let none = vec![Vector3::new(T::zero(), T::zero(), T::zero()); links];
        Self {
            terms: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            friction: ContactFriction::new(LINK_CONTACTS_PER_LINK * links),
            force: none.clone(),
            remainder: none,
            low_rank: LowRank::new(links),
            constant: vec![T::zero(); links],
        }
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Laws around the impulses of a warm start; `penalty` is the stiffness of a closed or sticking contact over the mass of
    /// its first link.
    #[inline(always)]
    pub fn warm_up(&mut self, stage: &Stage<T>, solution: &StageSolution<T>, penalty: f64) {
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        self.force.resize(stage.links.len(), zero);
        self.remainder.resize(stage.links.len(), zero);
        self.constant.resize(stage.links.len(), T::zero());
        self.terms.clear();
        for (pair, &impulse) in stage.pairs.iter().zip(&solution.pair) {
            let penalty = T::splat(penalty) * stage.links[pair.links[0]].mass;
            let law = UnilateralTerm::new(pair.offset, impulse, penalty);
            self.terms.push(PairTerm { row: coupling_of(pair, stage), law });
        }
        self.friction.clear();
        for (row, &impulse) in stage.pair_friction.iter().zip(&solution.pair_friction) {
            let mass = stage.links[row.along.links[0]].mass;
            self.friction.add(row, coupling_of(&row.along, stage), mass, impulse, penalty);
        }
    }

    /// Forces and stiffnesses at the present twists, with bounds of friction that follow in some lanes; returns the slope of the laws'
    /// function along the step \[J\].
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, links: &[LinkTerm<T>], follows: T::Mask) -> T {
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        self.force.fill(zero);
        self.remainder.fill(zero);
        let mut slope = T::zero();
        let Self { terms, friction, force, remainder, .. } = self;
        let mut friction = friction.terms.iter_mut().peekable();
        for (k, term) in terms.iter_mut().enumerate() {
            let expected_change = term.row.stiffness * term.row.along(|link| links[link].step);
            term.evaluate(
                links,
                (force, remainder),
                &mut slope,
                T::zero(),
                #[inline(always)]
                |law, velocity| law.evaluate(form, velocity),
            );
            if let Some(rough) = friction.next_if(|rough| rough.law.normal == k) {
                let (coupled, load) = (rough.law.ratio * expected_change, term.law.impulse);
                rough.evaluate(
                    links,
                    (force, remainder),
                    &mut slope,
                    coupled,
                    #[inline(always)]
                    |law, velocity| law.evaluate(form, velocity, load, follows),
                );
            }
        }
        slope
    }

    /// Turns the steps of the links without the contacts' stiffness into those with it, see [`LowRank::correct`].
    #[inline(always)]
    pub fn correct(&mut self, links: &mut [LinkTerm<T>], head: &Quadratic<T>, movables: &[Quadratic<T>]) -> T {
        let mut chain = Links { links, head, movables, constant: &mut self.constant };
        let mut friction = self.friction.terms.iter().peekable();
        self.low_rank.clear();
        let mut lost = T::zero();
        for (k, term) in self.terms.iter().enumerate() {
            let mut column = term.row.direction;
            if let Some(rough) = friction.next_if(|rough| rough.law.normal == k) {
                let [w, v] = &rough.row.direction;
                column = [add_scaled(&column[0], w, rough.law.ratio), add_scaled(&column[1], v, rough.law.ratio)];
                lost += self.low_rank.apply(rough.row, &rough.row.direction, &mut chain);
            }
            lost += self.low_rank.apply(term.row, &column, &mut chain);
        }
        lost
    }

    /// First and second derivative of all laws' functions along the step.
    #[inline(always)]
    pub fn along(&self, links: &[LinkTerm<T>], alpha: T) -> (T, T) {
        let mut sum = (T::zero(), T::zero());
        for term in &self.terms {
            add(&mut sum, term.along(links, alpha));
        }
        for term in &self.friction.terms {
            add(&mut sum, term.along(links, alpha));
        }
        sum
    }

    /// The largest squared violation; of bounds of friction where these are not `held`.
    #[inline(always)]
    pub fn squared_error(&self, held: bool) -> T {
        let mut worst = T::zero();
        for term in &self.terms {
            worst = worst.max(term.law.squared_error());
        }
        worst.max(self.friction.squared_error(&self.terms, held))
    }

    /// Square of the largest way of a bound of friction to that of its normal impulse, as a velocity \[m/s\].
    #[inline(always)]
    pub fn squared_bound_error(&self) -> T {
        self.friction.squared_bound_error(&self.terms)
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.terms.iter_mut().for_each(|term| term.law.stiffen(factor));
        self.friction.stiffen(factor);
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.terms.iter_mut().for_each(|term| term.law.recentre(lanes));
        self.friction.recentre(lanes);
    }

    /// As [`ContactFriction::move_bounds`] does.
    #[inline(always)]
    pub fn move_bounds(&mut self, lanes: T::Mask) {
        self.friction.move_bounds(&self.terms, lanes);
    }

    /// Impulses of the contacts, and of their friction, in the given lanes.
    #[inline(always)]
    pub fn write(&self, solution: &mut StageSolution<T>, lanes: T::Mask) {
        for (impulse, term) in solution.pair.iter_mut().zip(&self.terms) {
            keep(impulse, lanes, term.law.impulse);
        }
        for (impulse, term) in solution.pair_friction.iter_mut().zip(&self.friction.terms) {
            keep(impulse, lanes, term.law.impulse());
        }
    }
}

struct Links<'a, T> {
    links: &'a mut [LinkTerm<T>],
    head: &'a Quadratic<T>,
    movables: &'a [Quadratic<T>],
    constant: &'a mut [T],
}

impl<T: Real> EliminatedChain<T, Vector3<T>, Vector3<T>> for Links<'_, T> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.links.len()
    }

    #[inline(always)]
    fn step(&self, link: usize) -> Vector3<T> {
        self.links[link].step
    }

    #[inline(always)]
    fn set_step(&mut self, link: usize, step: Vector3<T>) {
        self.links[link].step = step;
    }

    #[inline(always)]
    fn respond(&mut self, links: [usize; 2], column: &[Vector3<T>; 2], response: &mut Vec<Vector3<T>>) {
        respond((links, column), |link| &self.links[link].segment, self.head, self.movables, self.constant, response);
    }
}
