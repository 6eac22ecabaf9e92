//! Arithmetic of the judges; no solver uses this code.

use super::Real;

/// The larger of two violations, NaN if either is: no broken solution passes.
#[inline(always)]
pub(crate) fn worse<T: Real>(a: T, b: T) -> T {
    T::select(b.le(a), a, T::select(a.lt(b), b, a + b))
}

/// p / a, or 0 along a zero axis.
#[inline(always)]
pub(crate) fn ratio<T: Real>(p: T, a: T) -> T {
    T::select(T::zero().lt(a), p / a, T::zero())
}

#[inline(always)]
pub(crate) fn norm<T: Real>(x: T, y: T) -> T {
    (x * x + y * y).sqrt()
}
