//! Spatial vectors of a link: a linear and an angular part about the CG, both in frame I.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::math::Real;
pub(in crate::spatial) use crate::math::{add_scaled as along, dot as inner};
use crate::rows::{Saved, Screw};

/// Linear and angular part of a twist, wrench or momentum of a link, about its CG, frame I.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct SpatialVector<T = f64> {
    pub linear: Vector3<T>,
    pub angular: Vector3<T>,
}

/// Velocity of the CG \[m/s\] and angular velocity \[rad/s\].
pub type Twist<T = f64> = SpatialVector<T>;

/// Force and moment about the CG, or the direction of such a force: its power is its inner product with the twist.
pub type Wrench<T = f64> = SpatialVector<T>;

/// Linear momentum \[kg m/s\] and angular momentum about the CG \[kg m^2/s\].
pub type Momentum<T = f64> = SpatialVector<T>;

impl<T: Real> SpatialVector<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self { linear: zero_vector(), angular: zero_vector() }
    }

    /// Of a body that stays upright, from (x, y, angle) in the plane.
    #[inline(always)]
    pub fn upright(planar: &Vector3<T>) -> Self {
        let zero = T::zero();
        Self { linear: Vector3::new(planar.x, planar.y, zero), angular: Vector3::new(zero, zero, planar.z) }
    }

    /// (x, y, angle).
    #[inline(always)]
    pub fn in_plane(&self) -> Vector3<T> {
        Vector3::new(self.linear.x, self.linear.y, self.angular.z)
    }

    #[inline(always)]
    pub fn dot(&self, other: &Self) -> T {
        inner(&self.linear, &other.linear) + inner(&self.angular, &other.angular)
    }

    #[inline(always)]
    pub fn scaled(&self, factor: T) -> Self {
        Self { linear: scaled(&self.linear, factor), angular: scaled(&self.angular, factor) }
    }

    /// self + factor other.
    #[inline(always)]
    pub fn plus_scaled(&self, other: &Self, factor: T) -> Self {
        Self {
            linear: along(&self.linear, &other.linear, factor),
            angular: along(&self.angular, &other.angular, factor),
        }
    }

    /// Velocity of the body-fixed point at `arm` from the CG.
    #[inline(always)]
    pub fn velocity_at(&self, arm: &Vector3<T>) -> Vector3<T> {
        sum_with_cross(&self.linear, &self.angular, arm)
    }

    /// Copies `value` in the given lanes.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, value: &Self) {
        crate::math::select_into(&mut self.linear, lanes, &value.linear);
        crate::math::select_into(&mut self.angular, lanes, &value.angular);
    }
}

impl<T: Real> Screw<T> for SpatialVector<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self::zero()
    }

    #[inline(always)]
    fn power(&self, twist: &Self) -> T {
        self.dot(twist)
    }

    #[inline(always)]
    fn linear(&self) -> Vector3<T> {
        self.linear
    }
}

#[inline(always)]
pub(in crate::spatial) fn zero_vector<T: Real>() -> Vector3<T> {
    Vector3::new(T::zero(), T::zero(), T::zero())
}

// nalgebra's own operators are not certain to be inlined, and so compiled for the registers that a kernel is run with.

#[inline(always)]
pub(in crate::spatial) fn sum<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x + b.x, a.y + b.y, a.z + b.z)
}

#[inline(always)]
pub(in crate::spatial) fn difference<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x - b.x, a.y - b.y, a.z - b.z)
}

#[inline(always)]
pub(in crate::spatial) fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    let product = Vector3::new(a.y * b.z, a.z * b.x, a.x * b.y);
    Vector3::new(
        a.z.subtract_from(b.y, product.x),
        a.x.subtract_from(b.z, product.y),
        a.y.subtract_from(b.x, product.z),
    )
}

/// u + a x b.
#[inline(always)]
pub(in crate::spatial) fn sum_with_cross<T: Real>(u: &Vector3<T>, a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    let first = Vector3::new(a.y.mul_add(b.z, u.x), a.z.mul_add(b.x, u.y), a.x.mul_add(b.y, u.z));
    Vector3::new(a.z.subtract_from(b.y, first.x), a.x.subtract_from(b.z, first.y), a.y.subtract_from(b.x, first.z))
}

#[inline(always)]
pub(in crate::spatial) fn scaled<T: Real>(a: &Vector3<T>, factor: T) -> Vector3<T> {
    Vector3::new(a.x * factor, a.y * factor, a.z * factor)
}

/// The vector with these components along `axes`.
#[inline(always)]
pub(in crate::spatial) fn combined<T: Real>(axes: &[Vector3<T>; 3], components: &[T; 3]) -> Vector3<T> {
    let [x, y, z] = axes;
    along(&along(&scaled(x, components[0]), y, components[1]), z, components[2])
}
