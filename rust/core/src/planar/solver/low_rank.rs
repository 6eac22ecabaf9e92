//! What the correction for couplings of low rank needs of the planar chain.

use nalgebra::{Vector2, Vector3};

use crate::math::{Real, add_scaled, dot};
use crate::planar::{Stage, StagePair};
use crate::solver::LinkStep;

use super::link_term::in_frame;
use super::sweep::{Quadratic, Segment};

/// A row that couples two links; directions are in the frames of the links.
pub(super) type Coupling<T> = crate::solver::Coupling<T, Vector3<T>>;

/// Steps of the links' velocities in their frames, corrected for couplings.
pub(super) type LowRank<T> = crate::solver::LowRank<T, Vector3<T>, Vector3<T>>;

impl<T: Real> LinkStep<T, Self> for Vector3<T> {
    #[inline(always)]
    fn along(&self, direction: &Vector3<T>) -> T {
        dot(direction, self)
    }

    #[inline(always)]
    fn plus_scaled(&self, other: &Self, factor: T) -> Self {
        add_scaled(self, other, factor)
    }
}

/// The row of a contact, without stiffness.
#[inline(always)]
pub(super) fn coupling_of<T: Real>(pair: &StagePair<T>, stage: &Stage<T>) -> Coupling<T> {
    let [first, second] = pair.links.map(|link| &stage.links[link].heading);
    let direction = [in_frame(first, &pair.direction[0]), in_frame(second, &pair.direction[1])];
    Coupling { links: pair.links, direction, stiffness: T::zero() }
}

/// Appends H^-1 c to `response`, of a column c on two links; `head` is the value function of the whole chain at its free end, `movables` are those of the
/// obstacles behind it at their centres, `constant` is a workspace of one number for each link and obstacle.
#[inline(always)]
pub(super) fn respond<'a, T: Real>(
    (links, column): ([usize; 2], &[Vector3<T>; 2]),
    segment: impl Fn(usize) -> &'a Segment<T>,
    head: &Quadratic<T>,
    movables: &[Quadratic<T>],
    constant: &mut [T],
    response: &mut Vec<Vector3<T>>,
) {
    let zero = T::zero();
    let none = Vector3::new(zero, zero, zero);
    let own = |link: usize| {
        let mut own = none;
        for (_, w) in links.iter().zip(column).filter(|(of, _)| **of == link) {
            own = add_scaled(&own, w, T::splat(-1.0));
        }
        own
    };
    let mut behind = none;
    let chain = constant.len() - movables.len();
    for (link, constant) in constant[..chain].iter_mut().enumerate().rev() {
        (behind, *constant) = segment(link).eliminate_linear(&behind, &own(link));
    }
    let (mut end, mut omega) = (head.minimiser_under(Vector2::new(behind.x, behind.y)), zero);
    for (link, &constant) in constant[..chain].iter().enumerate() {
        response.push(segment(link).substitute_with(constant, &mut end, &mut omega));
    }
    for (node, value) in (chain..).zip(movables) {
        let (force, constant) = segment(node).eliminate_linear(&none, &own(node));
        let mut end = value.minimiser_under(Vector2::new(force.x, force.y));
        response.push(segment(node).substitute_with(constant, &mut end, &mut T::zero()));
    }
}
