//! Contacts of a robot with itself, whose rows couple two links of the chain. A stage without them costs nothing.

use nalgebra::Vector3;

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::math::{Real, add_scaled};
use crate::planar::Stage;
use crate::solver::{EliminatedChain, LawForm};

use super::link_term::LinkTerm;
use super::low_rank::{Coupling, LowRank, coupling_of, respond};
use super::sweep::Quadratic;
use super::unilateral::UnilateralTerm;

/// The contacts of the current stage.
#[derive(Debug, Clone)]
pub(super) struct SelfContacts<T> {
    terms: Vec<PairTerm<T>>,
    /// Force of all contacts on each link, w P, in the link's frame.
    pub force: Vec<Vector3<T>>,
    /// Difference of that force to its linearisation at the start of the step.
    pub remainder: Vec<Vector3<T>>,
    low_rank: LowRank<T>,
    /// Workspace of an elimination with another linear term, one number per link.
    constant: Vec<T>,
}

/// One contact between two links.
#[derive(Debug, Clone, Copy)]
struct PairTerm<T> {
    coupling: Coupling<T>,
    law: UnilateralTerm<T>,
}

impl<T: Real> SelfContacts<T> {
    pub fn new(links: usize) -> Self {
        let none = vec![Vector3::new(T::zero(), T::zero(), T::zero()); links];
        Self {
            terms: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
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

    /// Laws around the impulses of a warm start; `penalty` is the stiffness of a closed contact over the mass of its
    /// first link.
    #[inline(always)]
    pub fn warm_up(&mut self, stage: &Stage<T>, impulses: &[T], penalty: f64) {
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        self.force.resize(stage.links.len(), zero);
        self.remainder.resize(stage.links.len(), zero);
        self.constant.resize(stage.links.len(), T::zero());
        self.terms.clear();
        for (pair, &impulse) in stage.pairs.iter().zip(impulses) {
            let penalty = T::splat(penalty) * stage.links[pair.links[0]].mass;
            let law = UnilateralTerm::new(pair.offset, impulse, penalty);
            self.terms.push(PairTerm { coupling: coupling_of(pair, stage), law });
        }
    }

    /// Forces and stiffnesses at the present twists; returns the slope of the laws' function along the step \[J\].
    #[inline(always)]
    pub fn evaluate(&mut self, form: LawForm, links: &[LinkTerm<T>]) -> T {
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        self.force.fill(zero);
        self.remainder.fill(zero);
        let mut slope = T::zero();
        for PairTerm { coupling, law } in &mut self.terms {
            let step = coupling.along(|link| links[link].step);
            let expected = law.impulse - coupling.stiffness * step;
            coupling.stiffness = law.evaluate(form, coupling.along(|link| links[link].twist));
            slope -= law.impulse * step;
            for (link, w) in coupling.links.into_iter().zip(&coupling.direction) {
                self.force[link] = add_scaled(&self.force[link], w, law.impulse);
                self.remainder[link] = add_scaled(&self.remainder[link], w, law.impulse - expected);
            }
        }
        slope
    }

    /// Turns the steps of the links without the contacts' stiffness into those with it, see [`LowRank::correct`].
    #[inline(always)]
    pub fn correct(&mut self, links: &mut [LinkTerm<T>], head: &Quadratic<T>, movables: &[Quadratic<T>]) -> T {
        let couplings = self.terms.iter().map(|term| term.coupling);
        let mut chain = Links { links, head, movables, constant: &mut self.constant };
        self.low_rank.correct(couplings, &mut chain)
    }

    /// First and second derivative of all laws' functions along the step.
    #[inline(always)]
    pub fn along(&self, links: &[LinkTerm<T>], alpha: T) -> (T, T) {
        let (mut slope, mut curvature) = (T::zero(), T::zero());
        for PairTerm { coupling, law } in &self.terms {
            let (velocity, rate) = (coupling.along(|link| links[link].start), coupling.along(|link| links[link].step));
            let (first, second) = law.along(velocity, rate, alpha);
            slope += first;
            curvature += second;
        }
        (slope, curvature)
    }

    /// The largest squared violation.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let mut worst = T::zero();
        for term in &self.terms {
            worst = worst.max(term.law.squared_error());
        }
        worst
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.terms.iter_mut().for_each(|term| term.law.stiffen(factor));
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.terms.iter_mut().for_each(|term| term.law.recentre(lanes));
    }

    #[inline(always)]
    pub fn impulses(&self) -> impl Iterator<Item = T> + '_ {
        self.terms.iter().map(
            #[inline(always)]
            |term| term.law.impulse,
        )
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
    fn respond(&mut self, coupling: &Coupling<T>, response: &mut Vec<Vector3<T>>) {
        respond(coupling, |link| &self.links[link].segment, self.head, self.movables, self.constant, response);
    }
}
