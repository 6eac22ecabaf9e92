//! The planar chain in [one linear solve without symmetry](crate::solver::ChainLink).

use nalgebra::{Matrix3, Vector3};

use crate::planar::StageLink;

pub(super) type Balance = crate::solver::Balance<3>;
pub(super) type ChainLink = crate::solver::ChainLink<3, 1>;

/// `link` behind `before`; for link 1 pass it twice.
pub(super) fn chain_link(before: &StageLink, link: &StageLink) -> ChainLink {
    let swing = link.heading.lateral() * link.arms()[0];
    let arm = before.heading.lateral() * before.arms()[1] + swing;
    let carry = Matrix3::new(1.0, 0.0, arm.x, 0.0, 1.0, arm.y, 0.0, 0.0, 1.0);
    ChainLink::new([true], carry, [swing.push(1.0)])
}

/// The matrix of masses of a link.
pub(super) fn mass_matrix(link: &StageLink) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(link.mass, link.mass, link.inertia))
}
