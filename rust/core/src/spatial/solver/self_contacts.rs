//! Contacts of a robot with itself, whose rows couple two links of the chain. A stage without them pays for none.

use crate::math::Real;
use crate::solver::{Coupling, EliminatedChain, LinkStep, LowRank};
use crate::spatial::spatial_vector::{Momentum, Twist, Wrench};
use crate::spatial::{Stage, StagePair};

use super::link_term::LinkTerm;
use super::ray_laws::RayLaws;
use super::sweep::Affine;
use super::terms::ContactTerm;

/// The contacts of the stage at hand.
pub(super) struct SelfContacts<T: Real> {
    terms: Vec<PairTerm<T>>,
    /// Force of all contacts on each link, w P.
    force: Vec<Wrench<T>>,
    low_rank: LowRank<T, Wrench<T>, ChainStep<T>>,
    /// Workspace of an elimination with another linear term, two numbers per link.
    constant: Vec<[T; 2]>,
}

/// One contact between two links.
#[derive(Debug, Clone, Copy)]
struct PairTerm<T: Real> {
    coupling: Coupling<T, Wrench<T>>,
    contact: ContactTerm<T>,
}

/// Step of a link and of the joint before it.
#[derive(Debug, Clone, Copy)]
struct ChainStep<T> {
    twist: Twist<T>,
    rates: [T; 2],
}

impl<T: Real> LinkStep<T, Wrench<T>> for ChainStep<T> {
    #[inline(always)]
    fn along(&self, direction: &Wrench<T>) -> T {
        direction.dot(&self.twist)
    }

    #[inline(always)]
    fn plus_scaled(&self, other: &Self, factor: T) -> Self {
        let [yaw, pitch] = self.rates;
        Self {
            twist: self.twist.plus_scaled(&other.twist, factor),
            rates: [yaw + other.rates[0] * factor, pitch + other.rates[1] * factor],
        }
    }
}

impl<T: Real> PairTerm<T> {
    #[inline(always)]
    fn new(pair: &StagePair<T>, penalty: T, impulse: T) -> Self {
        let coupling = Coupling { links: pair.links, direction: pair.direction, stiffness: T::zero() };
        Self { coupling, contact: ContactTerm::new(pair.offset, penalty, impulse) }
    }

    /// w . x of both links' twists.
    #[inline(always)]
    fn velocity(&self, twist: impl Fn(usize) -> Twist<T> + Copy) -> T {
        let Coupling { links: [i, j], direction: [first, second], .. } = &self.coupling;
        first.dot(&twist(*i)) + second.dot(&twist(*j))
    }
}

impl<T: Real> SelfContacts<T> {
    pub fn new(links: usize) -> Self {
        Self {
            terms: Vec::with_capacity(2 * links),
            force: vec![Wrench::zero(); links],
            low_rank: LowRank::new(links),
            constant: vec![[T::zero(); 2]; links],
        }
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Laws of stiffness `penalty`, closed where a warm start has an impulse.
    #[inline(always)]
    pub fn warm_up(&mut self, stage: &Stage<T>, impulses: &[T], penalty: T) {
        self.terms.clear();
        for (pair, impulse) in stage.pairs.iter().zip(impulses) {
            self.terms.push(PairTerm::new(pair, penalty, *impulse));
        }
    }

    /// Forces and stiffnesses at the given twists; returns the largest squared violation.
    #[inline(always)]
    pub fn evaluate(&mut self, twist: impl Fn(usize) -> Twist<T> + Copy, recentred: T::Mask) -> T {
        self.force.fill(Wrench::zero());
        let mut squared_error = T::zero();
        for term in &mut self.terms {
            let velocity = term.velocity(twist);
            let PairTerm { coupling, contact } = term;
            coupling.stiffness = contact.evaluate(velocity);
            contact.recentre_here(velocity, coupling.stiffness, recentred);
            for (link, w) in coupling.links.into_iter().zip(&coupling.direction) {
                self.force[link] = self.force[link].plus_scaled(w, contact.value);
            }
            squared_error = squared_error.max(contact.squared_error());
        }
        squared_error
    }

    /// Gradient of all laws' functions by a link's twist.
    #[inline(always)]
    pub fn add_gradient(&self, link: usize, gradient: &mut Momentum<T>) {
        *gradient = gradient.plus_scaled(&self.force[link], T::splat(-1.0));
    }

    /// Turns the steps of the links without the contacts' stiffness into those with it, see [`LowRank::correct`].
    #[inline(always)]
    pub fn correct(&mut self, links: &mut [LinkTerm<T>], head: &Affine<T>, movables: &[Affine<T>]) -> T {
        let couplings = self.terms.iter().map(|term| term.coupling);
        let mut chain = Chain { links, head, movables, constant: &mut self.constant };
        self.low_rank.correct(couplings, &mut chain)
    }

    /// Adds all laws along the step.
    #[inline(always)]
    pub fn add_along(&self, links: &[LinkTerm<T>], ray: &mut RayLaws<T>) {
        for term in &self.terms {
            let (velocity, rate) = (term.velocity(|link| links[link].twist), term.velocity(|link| links[link].step));
            term.contact.add_along(velocity, rate, ray);
        }
    }

    #[inline(always)]
    pub fn release(&mut self) {
        self.terms.iter_mut().for_each(|term| term.contact.release());
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        for term in &mut self.terms {
            term.contact.recentre(lanes);
        }
    }

    #[inline(always)]
    pub fn write(&self, impulses: &mut [T]) {
        for (impulse, term) in impulses.iter_mut().zip(&self.terms) {
            *impulse = term.contact.value;
        }
    }
}

struct Chain<'a, T: Real> {
    links: &'a mut [LinkTerm<T>],
    head: &'a Affine<T>,
    /// Functions of what can be pushed, behind the chain.
    movables: &'a [Affine<T>],
    constant: &'a mut [[T; 2]],
}

impl<T: Real> EliminatedChain<T, Wrench<T>, ChainStep<T>> for Chain<'_, T> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.links.len()
    }

    #[inline(always)]
    fn step(&self, link: usize) -> ChainStep<T> {
        let LinkTerm { step, step_rates, .. } = &self.links[link];
        ChainStep { twist: *step, rates: *step_rates }
    }

    #[inline(always)]
    fn set_step(&mut self, link: usize, ChainStep { twist, rates }: ChainStep<T>) {
        (self.links[link].step, self.links[link].step_rates) = (twist, rates);
    }

    #[inline(always)]
    fn respond(&mut self, links: [usize; 2], column: &[Wrench<T>; 2], response: &mut Vec<ChainStep<T>>) {
        let add_own = |link: usize, gradient: &mut Momentum<T>| {
            for (_, w) in links.iter().zip(column).filter(|(of, _)| **of == link) {
                *gradient = gradient.plus_scaled(w, T::splat(-1.0));
            }
        };
        let (chain, mut gradient) = (self.links.len() - self.movables.len(), Momentum::zero());
        for (link, term) in self.links[..chain].iter().enumerate().rev() {
            add_own(link, &mut gradient);
            if link > 0 {
                (gradient, self.constant[link]) = term.segment.eliminate_linear(&gradient);
            }
        }
        let (mut twist, mut rates) = (self.head.solution_under(&gradient), [T::zero(); 2]);
        for (link, term) in self.links[..chain].iter().enumerate() {
            if link > 0 {
                (rates, twist) = term.segment.substitute_with(&self.constant[link], &twist);
            }
            response.push(ChainStep { twist, rates });
        }
        for (node, value) in (chain..).zip(self.movables) {
            let mut own = Momentum::zero();
            add_own(node, &mut own);
            response.push(ChainStep { twist: value.solution_under(&own), rates: [T::zero(); 2] });
        }
    }
}
