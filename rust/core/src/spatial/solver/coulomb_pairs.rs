//! Contacts of a robot with itself in [`CoulombNewton`](super::CoulombNewton): laws with impulses as unknowns of their
//! own, whose rows couple two links of the chain.

use nalgebra::{LU, U6, Vector6};

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::solver::{CoulombForm, Coupling, EliminatedChain, LinkStep, LowRank, UnilateralLaw};
use crate::spatial::{Stage, StageSolution};

use super::coulomb_newton::{Link, solve_head};
use super::coulomb_sweep::stacked;

/// The contacts of the stage at hand.
#[derive(Debug, Clone)]
pub(super) struct CoulombPairs {
    laws: Vec<PairLaw>,
    low_rank: LowRank<f64, Vector6<f64>, ChainStep>,
    /// Workspace of an elimination for another load, two numbers per link.
    constant: Vec<[f64; 2]>,
}

/// Law of one contact between two links.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairLaw {
    pub links: [usize; 2],
    pub direction: [Vector6<f64>; 2],
    pub law: UnilateralLaw,
}

/// Change of a link's twist and of the rates of the joint before it.
#[derive(Debug, Clone, Copy)]
struct ChainStep {
    twist: Vector6<f64>,
    rates: [f64; 2],
}

impl LinkStep<f64, Vector6<f64>> for ChainStep {
    fn along(&self, direction: &Vector6<f64>) -> f64 {
        direction.dot(&self.twist)
    }

    fn plus_scaled(&self, other: &Self, factor: f64) -> Self {
        let rates = [0, 1].map(|axis| self.rates[axis] + other.rates[axis] * factor);
        Self { twist: self.twist + other.twist * factor, rates }
    }
}

impl PairLaw {
    fn velocity(&self, twist: impl Fn(usize) -> Vector6<f64>) -> f64 {
        self.links.iter().zip(&self.direction).map(|(link, w)| w.dot(&twist(*link))).sum()
    }
}

impl CoulombPairs {
    pub fn new(links: usize) -> Self {
        Self {
            laws: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            low_rank: LowRank::new(links),
            constant: vec![[0.0; 2]; links],
        }
    }

    pub fn load(&mut self, stage: &Stage, solution: &StageSolution) {
        self.laws.clear();
        self.laws.extend(stage.pairs.iter().zip(&solution.pair).map(|(pair, &impulse)| PairLaw {
            links: pair.links,
            direction: [stacked(&pair.direction[0]), stacked(&pair.direction[1])],
            law: UnilateralLaw::new(pair.offset, impulse),
        }));
    }

    pub fn laws(&self) -> &[PairLaw] {
        &self.laws
    }

    /// Evaluates all laws at the given twists.
    pub fn measure(&mut self, twist: impl Fn(usize) -> Vector6<f64>, form: &CoulombForm) {
        for pair in &mut self.laws {
            let velocity = pair.velocity(&twist);
            pair.law.measure(velocity, form);
        }
    }

    /// Contribution of the linearised laws to the load on a link.
    pub fn load_on(&self, link: usize, form: &CoulombForm) -> Vector6<f64> {
        let mut load = Vector6::zeros();
        for pair in &self.laws {
            for (_, w) in pair.links.iter().zip(&pair.direction).filter(|(of, _)| **of == link) {
                load += w * pair.law.tangent(form).0;
            }
        }
        load
    }

    /// Turns the step of the links without the contacts' stiffness into that with it, see [`LowRank::correct`].
    pub fn correct(&mut self, links: &mut [Link], head: &LU<f64, U6, U6>, form: &CoulombForm) {
        let Self { laws, low_rank, constant } = self;
        let couplings = laws.iter().map(|pair| Coupling {
            links: pair.links,
            direction: pair.direction,
            stiffness: -pair.law.tangent(form).1,
        });
        low_rank.correct(couplings, &mut Chain { links, head, constant });
    }

    /// Computes the change of the impulses with the links' steps.
    pub fn find_step(&mut self, step: impl Fn(usize) -> Vector6<f64>, form: &CoulombForm) {
        for pair in &mut self.laws {
            let velocity = pair.velocity(&step);
            pair.law.find_step(velocity, form);
        }
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.laws.iter_mut().for_each(|pair| pair.law.move_along(fraction));
    }

    pub fn recentre(&mut self) {
        self.laws.iter_mut().for_each(|pair| pair.law.centre = pair.law.impulse);
    }

    /// How far the impulses are from the centres at most \[N s\].
    pub fn centre_error(&self) -> f64 {
        self.laws.iter().map(|pair| (pair.law.impulse - pair.law.centre).abs()).fold(0.0, f64::max)
    }

    pub fn write(&self, impulses: &mut [f64]) {
        for (impulse, pair) in impulses.iter_mut().zip(&self.laws) {
            *impulse = pair.law.impulse.max(0.0);
        }
    }
}

struct Chain<'a> {
    links: &'a mut [Link],
    head: &'a LU<f64, U6, U6>,
    constant: &'a mut [[f64; 2]],
}

impl EliminatedChain<f64, Vector6<f64>, ChainStep> for Chain<'_> {
    fn len(&self) -> usize {
        self.links.len()
    }

    fn step(&self, link: usize) -> ChainStep {
        let Link { step, step_rates, .. } = &self.links[link];
        ChainStep { twist: *step, rates: *step_rates }
    }

    fn set_step(&mut self, link: usize, ChainStep { twist, rates }: ChainStep) {
        (self.links[link].step, self.links[link].step_rates) = (twist, rates);
    }

    fn respond(&mut self, links: [usize; 2], column: &[Vector6<f64>; 2], response: &mut Vec<ChainStep>) {
        let mut load = Vector6::zeros();
        for (link, own) in self.links.iter().enumerate().rev() {
            for (_, w) in links.iter().zip(column).filter(|(of, _)| **of == link) {
                load += w;
            }
            if link > 0 {
                (load, self.constant[link]) = own.chain.eliminate_load(load);
            }
        }
        let (mut twist, mut rates) = (solve_head(self.head, &load), [0.0; 2]);
        for (link, own) in self.links.iter().enumerate() {
            if link > 0 {
                (rates, twist) = own.chain.substitute_with(&self.constant[link], &twist);
            }
            response.push(ChainStep { twist, rates });
        }
    }
}
