//! Vectors of lanes.

use nalgebra::{SVector, Vector3};

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

/// Copies a number in the given lanes.
#[inline(always)]
pub fn keep<T: Real>(target: &mut T, lanes: T::Mask, value: T) {
    *target = T::select(lanes, value, *target);
}

/// Copies a vector in the given lanes.
#[inline(always)]
pub fn select_into<T: Real, const N: usize>(target: &mut SVector<T, N>, lanes: T::Mask, value: &SVector<T, N>) {
    for k in 0..N {
        keep(&mut target[k], lanes, value[k]);
    }
}
