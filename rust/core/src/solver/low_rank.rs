//! Linear solves of a chain with rows that couple links which are not neighbours.
//!
//! The elimination of a chain knows couplings of neighbours only. A row of direction w and stiffness r changes its
//! matrix H to `H + r w w^T`, and by the formula of Sherman and Morrison every solution x of the old system to
//!
//! `x - y z`, `z = H^-1 w`, `y = r w^T x / (1 + r w^T z)`.
//!
//! The same with `H + r c w^T` and `z = H^-1 c` for a column c of its own, as friction has that grows with a normal impulse.
//! A row costs one more substitution of the chain and the corrections by the rows before it, so that k rows on n links
//! cost O(k n + k^2 n). Rows of no stiffness are admissible: they change nothing.

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::math::{Mask, Real};

/// A row that couples two links.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coupling<T, D> {
    pub links: [usize; 2],
    /// w of both links.
    pub direction: [D; 2],
    pub stiffness: T,
}

/// Step of one link, on which forces act along directions `D`.
pub(crate) trait LinkStep<T, D>: Copy {
    /// w . x
    fn along(&self, direction: &D) -> T;
    /// self + factor other
    fn plus_scaled(&self, other: &Self, factor: T) -> Self;
}

/// Links whose elimination has been made, and their steps without the couplings.
///
/// Implementations must be `#[inline(always)]`, so that they are compiled for the instruction set of the solve.
pub(crate) trait EliminatedChain<T, D, S> {
    fn len(&self) -> usize;
    fn step(&self, link: usize) -> S;
    fn set_step(&mut self, link: usize, step: S);
    /// Appends H^-1 c of all links to `response`, of a column on these two links.
    fn respond(&mut self, links: [usize; 2], column: &[D; 2], response: &mut Vec<S>);
}

/// Workspace of the correction.
pub(crate) struct LowRank<T, D, S> {
    /// z of each row that has been applied, link by link.
    response: Vec<S>,
    /// Those rows, with r / (1 + r w^T z).
    applied: Vec<(Coupling<T, D>, T)>,
}

/// Rows whose responses are reserved at most, so that memory grows with the number of links, not with its square; a long
/// robot that touches itself at more places allocates once.
const ROWS: usize = 64;

impl<T: Real, D> Coupling<T, D> {
    /// w_0 . x_0 + w_1 . x_1 of the two links' entries of `x`.
    #[inline(always)]
    pub fn along<S: LinkStep<T, D>>(&self, mut x: impl FnMut(usize) -> S) -> T {
        let [i, j] = self.links;
        x(i).along(&self.direction[0]) + x(j).along(&self.direction[1])
    }
}

impl<D, S> LowRank<f64, D, S> {
    /// Sign of the factor by which the rows of the last correction changed the determinant of the matrix.
    pub fn orientation(&self) -> f64 {
        self.applied.iter().map(|(coupling, factor)| (coupling.stiffness * factor).signum()).product()
    }
}

impl<T: Real, D: Copy, S: LinkStep<T, D>> LowRank<T, D, S> {
    pub fn new(links: usize) -> Self {
        let rows = LINK_CONTACTS_PER_LINK * links;
        Self { response: Vec::with_capacity(rows.min(ROWS) * links), applied: Vec::with_capacity(rows) }
    }

    /// Turns steps without couplings into those with them. Returns by how much g^T H^-1 g decreases, an
    /// estimate where H has no symmetry \[J\].
    #[inline(always)]
    pub fn correct(
        &mut self,
        couplings: impl Iterator<Item = Coupling<T, D>>,
        chain: &mut impl EliminatedChain<T, D, S>,
    ) -> T {
        self.clear();
        let mut lost = T::zero();
        for coupling in couplings {
            lost += self.apply(coupling, &coupling.direction, chain);
        }
        lost
    }

    /// Begins a correction that [`Self::apply`] makes coupling by coupling.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.response.clear();
        self.applied.clear();
    }

    /// Turns steps without this coupling into those with it, `r c w^T` with its column c.
    #[inline(always)]
    pub fn apply(&mut self, coupling: Coupling<T, D>, column: &[D; 2], chain: &mut impl EliminatedChain<T, D, S>) -> T {
        if !T::zero().lt(coupling.stiffness.abs()).any() {
            return T::zero();
        }
        let (own, links) = (self.response.len(), chain.len());
        chain.respond(coupling.links, column, &mut self.response);
        for (k, (earlier, factor)) in self.applied.iter().enumerate() {
            let y = *factor * earlier.along(|link| self.response[own + link]);
            for link in 0..links {
                let corrected = self.response[own + link].plus_scaled(&self.response[k * links + link], -y);
                self.response[own + link] = corrected;
            }
        }
        let response = &self.response[own..];
        let along = coupling.along(|link| response[link]);
        let factor = coupling.stiffness / (T::splat(1.0) + coupling.stiffness * along);
        let rate = coupling.along(|link| chain.step(link));
        let y = factor * rate;
        for (link, z) in response.iter().enumerate() {
            chain.set_step(link, chain.step(link).plus_scaled(z, -y));
        }
        self.applied.push((coupling, factor));
        y * rate
    }
}
