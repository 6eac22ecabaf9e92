//! The 3D chain in [one linear solve without symmetry](crate::solver::ChainLink).

use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::robot::Axes;
use crate::spatial::{SpatialVector, StageLink, hinge_directions};

pub(super) type ChainLink = crate::solver::ChainLink<6, 2>;

/// `link` behind `before`; for link 1 pass it twice.
pub(super) fn chain_link(axes: Axes, before: &StageLink, link: &StageLink) -> ChainLink {
    let arm = before.joint_arms()[1] + link.joint_arms()[0];
    let mut carry = Matrix6::identity();
    carry.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
    let hinge = hinge_directions(axes, &before.axes, &link.axes).map(|axis| stacked(&link.hinge(&axis)));
    ChainLink::new([axes.has(0), axes.has(1)], carry, hinge)
}

/// M of a link, frame I.
pub(super) fn mass_matrix(link: &StageLink) -> Matrix6<f64> {
    let axis = &link.axes[2];
    let mut matrix = Matrix6::identity() * link.mass;
    let turning = Matrix3::identity() * link.inertia + axis * axis.transpose() * (link.roll_inertia - link.inertia);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&turning);
    matrix
}

/// (v, omega) or (force, moment).
pub(super) fn stacked(vector: &SpatialVector) -> Vector6<f64> {
    let (v, w) = (&vector.linear, &vector.angular);
    Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

pub(super) fn spatial_vector(stacked: &Vector6<f64>) -> SpatialVector {
    SpatialVector { linear: stacked.fixed_rows::<3>(0).into(), angular: stacked.fixed_rows::<3>(3).into() }
}
