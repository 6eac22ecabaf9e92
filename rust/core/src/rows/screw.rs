//! Twists of links and wrenches on them: what rows of the plane and of 3D differ in.

use std::fmt::Debug;

use nalgebra::Vector3;

use crate::math::{Laned, Real};

/// The twist of a link or a wrench on it, about its CG: velocity and rate of turn, force and moment.
pub trait Screw<T: Real>: Laned<T> + Copy + Debug + PartialEq + 'static {
    fn zero() -> Self;

    /// Power of a wrench at a twist.
    fn power(&self, twist: &Self) -> T;

    /// Velocity or force, frame I; without a z part in the plane.
    fn linear(&self) -> Vector3<T>;
}

/// In the plane: x, y and the angle.
impl<T: Real> Screw<T> for Vector3<T> {
    #[inline(always)]
    fn zero() -> Self {
        Vector3::new(T::zero(), T::zero(), T::zero())
    }

    #[inline(always)]
    fn power(&self, twist: &Self) -> T {
        self.x * twist.x + self.y * twist.y + self.z * twist.z
    }

    #[inline(always)]
    fn linear(&self) -> Vector3<T> {
        Vector3::new(self.x, self.y, T::zero())
    }
}
