//! The rows of contact that are found for a stage, of all lanes: their places in the stage, and what its solution says of
//! them.

use nalgebra::Vector3;

use crate::contact::{ContactId, KnownContact, Source};
use crate::math::{Laned, Mask, Real};
use crate::rows::{ContactRow, PairRow, Row, Screw};

use super::closing::{ClosingRow, Closings};
use super::lanes::Lanes;
use super::stage::ContactImpulse;

/// A row of one robot.
#[derive(Debug, Clone, Copy)]
pub struct FoundRow<R> {
    pub lane: usize,
    pub id: ContactId,
    /// Where the robot keeps what it knows of the contact, if not by its identity.
    pub handle: usize,
    pub known: KnownContact,
    pub row: R,
    /// Its index in the stage, once all rows are laid out; until then, among those of lane and link.
    pub slot: usize,
}

/// All rows of one kind.
pub struct FoundRows<R, T> {
    found: Vec<FoundRow<R>>,
    /// By the rows' indices in the stage, positive in the lanes in which they carried force before.
    touched: Vec<T>,
    /// For each link, rows in the lane that has the most of them; once laid out, its first slot.
    most: Vec<usize>,
    /// For each link, rows of the last lane.
    count: Vec<usize>,
    /// The contacts between links of all lanes, sorted.
    ids: Vec<ContactId>,
}

/// The motion of a solved stage, which opens and closes rows.
pub struct SolvedMotion<'a, S, T> {
    pub coefficient: T,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: T,
    /// Twists with which the stage was predicted, and those of its solution.
    pub expected: &'a [S],
    pub twist: &'a [S],
}

impl<R, T: Real> FoundRows<R, T> {
    pub fn with_capacity(links: usize, rows: usize) -> Self {
        Self {
            found: Vec::with_capacity(rows),
            touched: Vec::with_capacity(rows),
            most: vec![0; links],
            count: vec![0; links],
            ids: Vec::with_capacity(rows),
        }
    }

    /// The rows of all lanes, lane by lane.
    pub fn all(&self) -> &[FoundRow<R>] {
        &self.found
    }

    pub fn clear(&mut self) {
        self.found.clear();
        self.most.fill(0);
    }

    /// Adds the closing times of a stage's rows, given their impulses.
    #[inline(always)]
    pub fn add_closings<S: Screw<T>, L: Row<S, T>>(
        &self,
        (rows, impulses): (&[L], &[T]),
        motion: &SolvedMotion<S, T>,
        closings: &mut Closings<T>,
    ) {
        let SolvedMotion { coefficient, elapsed, expected, twist } = motion;
        debug_assert_eq!(rows.len(), self.touched.len());
        for (row, (impulse, touched)) in rows.iter().zip(impulses.iter().zip(&self.touched)) {
            let row = ClosingRow {
                offset: row.offset(),
                expected_rate: row.rate(expected),
                rate: row.rate(twist),
                presses: T::zero().lt(*impulse),
                touched: T::zero().lt(*touched),
            };
            closings.add(row.times(*coefficient, *elapsed, T::Mask::of(|_| true)));
        }
    }

    /// Passes the forces of the rows in a solved stage of coefficient `c` to `remember`, in all lanes, and collects the
    /// impulses on links in the lanes that are kept.
    pub fn read<D: Screw<f64>>(
        &self,
        c: T,
        (solution, kept): (&[T], Lanes),
        impulses: &mut Vec<ContactImpulse>,
        mut remember: impl FnMut(&FoundRow<R>, f64),
    ) where
        R: Row<D, f64>,
    {
        for found in &self.found {
            let impulse = solution[found.slot].lane(found.lane);
            remember(found, impulse * (1.0 / c.lane(found.lane)));
            if kept[found.lane] {
                found.collect(&found.row, impulse, impulses);
            }
        }
    }
}

impl<R> FoundRow<R> {
    /// Collects the impulses on links of an impulse along a row of this contact, unless it is zero.
    pub fn collect<D: Screw<f64>>(&self, row: &impl Row<D, f64>, impulse: f64, impulses: &mut Vec<ContactImpulse>) {
        if impulse != 0.0 {
            let parts = row.parts().enumerate();
            impulses.extend(parts.map(|(part, (_, w))| self.impulse(part, w.linear() * impulse)));
        }
    }

    /// An impulse of this contact on the first of its links or on the second, frame I \[N s\].
    pub fn impulse(&self, part: usize, impulse: Vector3<f64>) -> ContactImpulse {
        let ContactId { link: first, with, .. } = self.id;
        let (link, source) = match with {
            Source::Link(second) if part > 0 => (second, Source::Link(first)),
            _ => (first, with),
        };
        ContactImpulse { lane: self.lane, link, impulse, source }
    }
}

impl<V, T: Real> FoundRows<ContactRow<V>, T> {
    /// Adds a contact of a lane; contacts come lane by lane.
    pub fn add(&mut self, lane: usize, id: ContactId, handle: usize, known: KnownContact, row: ContactRow<V>) {
        debug_assert!(self.found.last().is_none_or(|last| last.lane <= lane), "rows of lane {lane} come in two parts");
        if self.found.last().is_none_or(|last| last.lane != lane) {
            self.count.fill(0);
        }
        let slot = self.count[row.link];
        self.count[row.link] += 1;
        self.most[row.link] = self.most[row.link].max(slot + 1);
        self.found.push(FoundRow { lane, id, handle, known, row, slot });
    }

    /// Writes all rows to a stage of coefficient `c`, sorted by link and in each lane in the order found, so that a
    /// robot's contacts come in the same order whatever its neighbours; `impulses` are those of the last forces.
    pub fn lay_out<S: Screw<T> + Laned<T, One = V>>(
        &mut self,
        c: T,
        rows: &mut Vec<ContactRow<S, T>>,
        impulses: &mut Vec<T>,
    ) {
        rows.clear();
        for (link, most) in self.most.iter_mut().enumerate() {
            let first = rows.len();
            if *most > 0 {
                rows.resize(first + *most, ContactRow::empty(link));
            }
            *most = first;
        }
        for of_rows in [&mut *impulses, &mut self.touched] {
            of_rows.clear();
            of_rows.resize(rows.len(), T::zero());
        }
        for FoundRow { lane, known, row, slot, .. } in &mut self.found {
            *slot += self.most[row.link];
            rows[*slot].set_lane(*lane, row);
            impulses[*slot].set_lane(*lane, known.force * c.lane(*lane));
            self.touched[*slot].set_lane(*lane, known.touches.into());
        }
    }
}

impl<V, T: Real> FoundRows<PairRow<V>, T> {
    /// Adds a contact between links of a lane.
    pub fn add(&mut self, lane: usize, id: ContactId, known: KnownContact, row: PairRow<V>) {
        self.found.push(FoundRow { lane, id, handle: 0, known, row, slot: 0 });
    }

    /// Writes all rows to a stage of coefficient `c`, sorted: a robot's contacts come in the same order whatever its
    /// neighbours; `impulses` are those of the last forces.
    pub fn lay_out<S: Screw<T> + Laned<T, One = V>>(
        &mut self,
        c: T,
        rows: &mut Vec<PairRow<S, T>>,
        impulses: &mut Vec<T>,
    ) {
        let Self { found, touched, ids, .. } = self;
        rows.clear();
        impulses.clear();
        touched.clear();
        if found.is_empty() {
            return;
        }
        ids.clear();
        // Sorted by the nodes of the stage: their numbers in the scene are others from lane to lane.
        let place = |found: &FoundRow<PairRow<V>>| ContactId::of_pair(found.row.links, found.id.feature);
        ids.extend(found.iter().map(place));
        ids.sort_unstable();
        ids.dedup();
        rows.resize(ids.len(), PairRow::empty([0; 2]));
        impulses.resize(ids.len(), T::zero());
        touched.resize(ids.len(), T::zero());
        for found in found {
            found.slot = ids.binary_search(&place(found)).expect("a listed contact");
            let FoundRow { lane, known, row, slot, .. } = found;
            rows[*slot].links = row.links;
            rows[*slot].set_lane(*lane, row);
            impulses[*slot].set_lane(*lane, known.force * c.lane(*lane));
            touched[*slot].set_lane(*lane, known.touches.into());
        }
    }
}
