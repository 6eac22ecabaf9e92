//! Linear solves of the chain with rows that couple links which are not neighbours.
//!
//! The elimination of the chain knows couplings of neighbours only. With k rows of directions W and stiffnesses R the
//! matrix is `H = H_0 + W R W^T`, of which the sweep inverts H_0. By Woodbury's formula the step `-H^-1 g` is
//!
//! `x = x_0 - Z y`, `Z = H_0^-1 W`, `(R^-1 + W^T Z) y = W^T x_0`
//!
//! with x_0 the step without the couplings: k more substitutions of the chain, and a dense system of k equations. Rows
//! of no stiffness are admissible: with S = sqrt R the system is solved as `(I + S W^T Z S) (S^-1 y) = S W^T x_0`, which
//! is symmetric and positive definite.

use nalgebra::{Vector2, Vector3};

use crate::math::{Real, add_scaled, dot};

use super::sweep::{Quadratic, Segment};

/// A row that couples two links; directions are in the frames of the links.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling<T> {
    pub links: [usize; 2],
    pub direction: [Vector3<T>; 2],
    pub stiffness: T,
}

/// Links whose elimination has been made, and their steps without the couplings.
pub(super) trait EliminatedChain<T> {
    fn len(&self) -> usize;
    fn segment(&self, link: usize) -> &Segment<T>;
    fn step(&mut self, link: usize) -> &mut Vector3<T>;
}

/// Workspace of the correction.
#[derive(Debug, Clone)]
pub(super) struct LowRank<T> {
    /// Z, one row of links per coupling.
    response: Vec<Vector3<T>>,
    /// Lower triangle of `I + S W^T Z S` by rows, then of its factors L D L^T.
    matrix: Vec<T>,
    /// `S W^T x_0`, then `S^-1 y`.
    unknown: Vec<T>,
    /// Constants of an elimination with another linear term, one per link.
    constant: Vec<T>,
}

impl<T: Real> Coupling<T> {
    /// w_0 . x_0 + w_1 . x_1 of the two links' entries of `x`.
    #[inline(always)]
    pub fn along(&self, mut x: impl FnMut(usize) -> Vector3<T>) -> T {
        let [i, j] = self.links;
        dot(&self.direction[0], &x(i)) + dot(&self.direction[1], &x(j))
    }
}

impl<T: Real> LowRank<T> {
    pub fn new(links: usize) -> Self {
        Self {
            response: Vec::with_capacity(links * links),
            matrix: Vec::with_capacity(links * (links + 1) / 2),
            unknown: Vec::with_capacity(links),
            constant: vec![T::zero(); links],
        }
    }

    /// Turns steps without couplings into those with them; `head` is the value function of the whole chain at its free
    /// end. Returns by how much g^T H^-1 g is less than g^T H_0^-1 g \[J\].
    #[inline(always)]
    pub fn correct(
        &mut self,
        couplings: impl Iterator<Item = Coupling<T>> + Clone,
        chain: &mut impl EliminatedChain<T>,
        head: &Quadratic<T>,
    ) -> T {
        self.response.clear();
        self.unknown.clear();
        for coupling in couplings.clone() {
            self.respond(&coupling, chain, head);
            let rate = coupling.along(|link| *chain.step(link));
            self.unknown.push(coupling.stiffness.sqrt() * rate);
        }
        self.fill_matrix(couplings.clone(), chain.len());
        let lost = self.solve();
        for (k, coupling) in couplings.enumerate() {
            let y = coupling.stiffness.sqrt() * self.unknown[k];
            let row = k * chain.len();
            for link in 0..chain.len() {
                let step = chain.step(link);
                *step = add_scaled(step, &self.response[row + link], -y);
            }
        }
        lost
    }

    /// Appends H_0^-1 w to the responses.
    #[inline(always)]
    fn respond(&mut self, coupling: &Coupling<T>, chain: &impl EliminatedChain<T>, head: &Quadratic<T>) {
        let zero = T::zero();
        let mut behind = Vector3::new(zero, zero, zero);
        for link in (0..chain.len()).rev() {
            let mut own = Vector3::new(zero, zero, zero);
            for (_, w) in coupling.links.iter().zip(&coupling.direction).filter(|(of, _)| **of == link) {
                own = add_scaled(&own, w, T::splat(-1.0));
            }
            (behind, self.constant[link]) = chain.segment(link).eliminate_linear(&behind, &own);
        }
        let (mut end, mut omega) = (head.minimiser_under(Vector2::new(behind.x, behind.y)), zero);
        for (link, &constant) in self.constant.iter().enumerate() {
            self.response.push(chain.segment(link).substitute_with(constant, &mut end, &mut omega));
        }
    }

    #[inline(always)]
    fn fill_matrix(&mut self, couplings: impl Iterator<Item = Coupling<T>> + Clone, links: usize) {
        self.matrix.clear();
        for (a, row) in couplings.clone().enumerate() {
            for (b, column) in couplings.clone().take(a + 1).enumerate() {
                let entry = row.along(|link| self.response[b * links + link]);
                let diagonal = if a == b { T::splat(1.0) } else { T::zero() };
                self.matrix.push(diagonal + row.stiffness.sqrt() * entry * column.stiffness.sqrt());
            }
        }
    }

    /// Solves the dense system in place by L D L^T; returns `b^T A^-1 b`.
    #[inline(always)]
    fn solve(&mut self) -> T {
        let Self { matrix, unknown, .. } = self;
        let count = unknown.len();
        let row = |a: usize| a * (a + 1) / 2;
        for a in 0..count {
            for b in 0..=a {
                let mut sum = matrix[row(a) + b];
                for c in 0..b {
                    sum -= matrix[row(a) + c] * matrix[row(b) + c] * matrix[row(c) + c];
                }
                matrix[row(a) + b] = if a == b { sum } else { sum / matrix[row(b) + b] };
            }
        }
        let mut squared = T::zero();
        for a in 0..count {
            for b in 0..a {
                unknown[a] = unknown[a] - matrix[row(a) + b] * unknown[b];
            }
            squared += unknown[a] * unknown[a] / matrix[row(a) + a];
        }
        for a in (0..count).rev() {
            unknown[a] = unknown[a] / matrix[row(a) + a];
            for b in a + 1..count {
                unknown[a] = unknown[a] - matrix[row(b) + a] * unknown[b];
            }
        }
        squared
    }
}
