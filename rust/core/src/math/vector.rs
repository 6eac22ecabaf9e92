//! Vectors of lanes.

use nalgebra::Vector3;

use super::Real;

#[inline(always)]
pub fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// u + factor du.
#[inline(always)]
pub fn add_scaled<T: Real>(u: &Vector3<T>, du: &Vector3<T>, factor: T) -> Vector3<T> {
    Vector3::new(u.x + du.x * factor, u.y + du.y * factor, u.z + du.z * factor)
}

/// Takes `value` over in the given lanes.
#[inline(always)]
pub fn select_into<T: Real>(target: &mut Vector3<T>, lanes: T::Mask, value: &Vector3<T>) {
    target.x = T::select(lanes, value.x, target.x);
    target.y = T::select(lanes, value.y, target.y);
    target.z = T::select(lanes, value.z, target.z);
}
