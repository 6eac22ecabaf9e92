//! Vectors of lanes.

use nalgebra::Vector3;

use super::Real;

#[inline(always)]
pub fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x.mul_add(b.x, a.y.mul_add(b.y, a.z * b.z))
}

/// u + factor du.
#[inline(always)]
pub fn add_scaled<T: Real>(u: &Vector3<T>, du: &Vector3<T>, factor: T) -> Vector3<T> {
    Vector3::new(du.x.mul_add(factor, u.x), du.y.mul_add(factor, u.y), du.z.mul_add(factor, u.z))
}

/// Copies `value` in the given lanes.
#[inline(always)]
pub fn select_into<T: Real>(target: &mut Vector3<T>, lanes: T::Mask, value: &Vector3<T>) {
    target.x = T::select(lanes, value.x, target.x);
    target.y = T::select(lanes, value.y, target.y);
    target.z = T::select(lanes, value.z, target.z);
}
