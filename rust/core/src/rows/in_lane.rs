//! Which rows of a register a lane has.

use crate::math::{Laned, Real};

use super::{ContactRow, FrictionRow, PairRow, Screw};

/// A row of some lanes: in the others its directions are zero.
pub trait InLane {
    /// Whether the lane has this row.
    fn is_in(&self, lane: usize) -> bool;
}

impl<S: Screw<T, One: Screw<f64>>, T: Real> InLane for ContactRow<S, T> {
    fn is_in(&self, lane: usize) -> bool {
        self.direction.lane(lane) != Screw::zero()
    }
}

impl<S: Screw<T, One: Screw<f64>>, T: Real> InLane for PairRow<S, T> {
    fn is_in(&self, lane: usize) -> bool {
        self.direction[0].lane(lane) != Screw::zero()
    }
}

impl<R: InLane, T> InLane for FrictionRow<R, T> {
    fn is_in(&self, lane: usize) -> bool {
        self.along.is_in(lane)
    }
}

/// Replaces `to` by the friction that a lane has, of the `normal` rows that it has.
pub fn read_friction<T: Real, R: Laned<T> + InLane>(
    from: &[FrictionRow<R, T>],
    normal: &[R],
    lane: usize,
    to: &mut Vec<FrictionRow<R::One>>,
) {
    to.clear();
    to.extend(from.iter().filter(|row| row.is_in(lane)).map(|row| FrictionRow {
        normal: normal[..row.normal].iter().filter(|normal| normal.is_in(lane)).count(),
        ..row.lane(lane)
    }));
}

/// Replaces `to` by what belongs to the rows that a lane has.
pub fn read_rows<T: Real, X: Laned<T>>(from: &[X], rows: &[impl InLane], lane: usize, to: &mut Vec<X::One>) {
    to.clear();
    to.extend(from.iter().zip(rows).filter(|(_, row)| row.is_in(lane)).map(|(one, _)| one.lane(lane)));
}

/// Copies what belongs to the rows that a lane has to it; their number.
pub fn write_rows<T: Real, X: Laned<T>>(to: &mut [X], rows: &[impl InLane], lane: usize, from: &[X::One]) -> usize {
    let own = to.iter_mut().zip(rows).filter(|(_, row)| row.is_in(lane));
    own.zip(from).map(|((to, _), from)| to.set_lane(lane, from)).count()
}
