use crate::math::Real;
use crate::rows::{Row, Screw};

use super::{half_line, worse};

/// Signorini's law at the rows of a stage whose links have these twists: the worst violation as a velocity \[m/s\], by the
/// mass of the first link that a row acts on, and the duality gap \[J\].
#[inline(always)]
pub(crate) fn rows<S: Screw<T>, T: Real>(
    rows: &[impl Row<S, T>],
    impulses: &[T],
    twist: &[S],
    mass: impl Fn(usize) -> T,
) -> (T, T) {
    let (mut worst, mut gap) = (T::zero(), T::zero());
    for (row, &impulse) in rows.iter().zip(impulses) {
        let mass = mass(row.first_link());
        let opening = row.opening(twist);
        worst = worse(worst, half_line(impulse, opening, mass) / mass);
        gap += worse(T::zero(), impulse * opening);
    }
    (worst, gap)
}
