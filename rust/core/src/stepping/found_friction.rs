//! Friction of the contacts that are found for a stage, of all lanes: its rows in the stage, and what its solution says of
//! it.

use nalgebra::Vector3;

use crate::math::{Laned, Real};
use crate::rows::{FrictionRow, Row, Screw};

use super::found_rows::FoundRows;
use super::lanes::Lanes;
use super::stage::ContactImpulse;

/// Friction of those rows of one kind that have it.
pub struct FoundFriction<R> {
    found: Vec<Frictional<R>>,
}

/// Friction of one row of one robot.
#[derive(Debug, Clone, Copy)]
struct Frictional<R> {
    /// Index of the row among those found.
    of: usize,
    /// Index among the rows of friction of the stage, once laid out.
    slot: usize,
    along: R,
    coefficient: f64,
}

impl<R> FoundFriction<R> {
    pub fn with_capacity(rows: usize) -> Self {
        Self { found: Vec::with_capacity(rows) }
    }

    pub fn clear(&mut self) {
        self.found.clear();
    }

    /// Adds friction of the row found as number `of`; see [`FrictionRow`].
    pub fn add(&mut self, of: usize, along: R, coefficient: f64) {
        self.found.push(Frictional { of, slot: 0, along, coefficient });
    }

    /// Gives all friction its rows in a stage of coefficient `c`, in the order of the rows of contact, which are laid out as
    /// `normal`; `impulses` are those of the last forces.
    pub fn lay_out<S, L, T: Real>(
        &mut self,
        c: T,
        contacts: &FoundRows<R, T>,
        normal: &[L],
        rows: &mut Vec<FrictionRow<L, T>>,
        impulses: &mut Vec<T>,
    ) where
        S: Screw<T>,
        S::One: Screw<f64>,
        L: Row<S, T> + Laned<T, One = R>,
        R: Row<S::One, f64> + Copy,
    {
        rows.clear();
        impulses.clear();
        let (contacts, zero) = (contacts.all(), T::zero());
        self.found.sort_unstable_by_key(|friction| (contacts[friction.of].slot, contacts[friction.of].lane));
        for friction in &mut self.found {
            let of = &contacts[friction.of];
            if rows.last().is_none_or(|last| last.normal != of.slot) {
                let along = normal[of.slot].vacated();
                rows.push(FrictionRow { normal: of.slot, along, coefficient: zero, bound: zero });
                impulses.push(zero);
            }
            friction.slot = rows.len() - 1;
            let Frictional { slot, along, coefficient, .. } = *friction;
            rows[slot].set_lane(of.lane, &FrictionRow { normal: of.slot, along, coefficient, bound: 0.0 });
            let direction = along.first_direction().linear();
            impulses[slot].set_lane(of.lane, direction.dot(&of.known.friction) * c.lane(of.lane));
        }
    }

    /// Passes the forces on the first links in a solved stage of coefficient `c` to `remember`, with the numbers of their
    /// rows, and collects the impulses on links in the lanes that are kept.
    pub fn read<D: Screw<f64>, T: Real>(
        &self,
        c: T,
        contacts: &FoundRows<R, T>,
        (solution, kept): (&[T], Lanes),
        impulses: &mut Vec<ContactImpulse>,
        mut remember: impl FnMut(usize, Vector3<f64>),
    ) where
        R: Row<D, f64>,
    {
        for Frictional { of, slot, along, .. } in &self.found {
            let found = &contacts.all()[*of];
            let impulse = solution[*slot].lane(found.lane);
            remember(*of, along.first_direction().linear() * impulse / c.lane(found.lane));
            if kept[found.lane] {
                found.collect(along, impulse, impulses);
            }
        }
    }
}
