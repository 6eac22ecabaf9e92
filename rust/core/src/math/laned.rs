//! Conversion between the numbers of one robot and its lane of a register.

use nalgebra::{Vector2, Vector3};

use super::Real;

/// Data of several robots side by side.
pub trait Laned<T: Real> {
    /// The same of one robot.
    type One;

    fn lane(&self, lane: usize) -> Self::One;
    fn set_lane(&mut self, lane: usize, one: &Self::One);
}

/// Copies one robot's data from its lane; both have the same length.
pub fn read_lane<T: Real, X: Laned<T>>(from: &[X], lane: usize, to: &mut [X::One]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = from.lane(lane);
    }
}

/// Replaces `to` by one robot's data.
pub fn replace_by_lane<T: Real, X: Laned<T>>(to: &mut Vec<X::One>, from: &[X], lane: usize) {
    to.clear();
    to.extend(from.iter().map(|entry| entry.lane(lane)));
}

/// Copies one robot's data to its lane; both have the same length.
pub fn write_lane<T: Real, X: Laned<T>>(to: &mut [X], lane: usize, from: &[X::One]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.set_lane(lane, from);
    }
}

impl<T: Real> Laned<T> for T {
    type One = f64;

    #[inline]
    fn lane(&self, lane: usize) -> f64 {
        Real::lane(self, lane)
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &f64) {
        Real::set_lane(self, lane, *one);
    }
}

impl<T: Real, X: Laned<T>, const N: usize> Laned<T> for [X; N] {
    type One = [X::One; N];

    #[inline]
    fn lane(&self, lane: usize) -> Self::One {
        std::array::from_fn(|i| self[i].lane(lane))
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Self::One) {
        for (entry, one) in self.iter_mut().zip(one) {
            entry.set_lane(lane, one);
        }
    }
}

/// Implements [`Laned`] field by field for types generic over the number.
macro_rules! laned {
    ($($name:ident { $($field:ident),* };)*) => {
        $(impl<T: $crate::math::Real> $crate::math::Laned<T> for $name<T> {
            type One = $name<f64>;

            #[inline]
            fn lane(&self, lane: usize) -> Self::One {
                $name { $($field: $crate::math::Laned::<T>::lane(&self.$field, lane)),* }
            }

            #[inline]
            fn set_lane(&mut self, lane: usize, one: &Self::One) {
                $($crate::math::Laned::<T>::set_lane(&mut self.$field, lane, &one.$field);)*
            }
        })*
    };
}
pub(crate) use laned;

impl<T: Real> Laned<T> for Vector2<T> {
    type One = Vector2<f64>;

    #[inline]
    fn lane(&self, lane: usize) -> Vector2<f64> {
        Vector2::new(Real::lane(&self.x, lane), Real::lane(&self.y, lane))
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Vector2<f64>) {
        Real::set_lane(&mut self.x, lane, one.x);
        Real::set_lane(&mut self.y, lane, one.y);
    }
}

impl<T: Real> Laned<T> for Vector3<T> {
    type One = Vector3<f64>;

    #[inline]
    fn lane(&self, lane: usize) -> Vector3<f64> {
        Vector3::new(Real::lane(&self.x, lane), Real::lane(&self.y, lane), Real::lane(&self.z, lane))
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Vector3<f64>) {
        Real::set_lane(&mut self.x, lane, one.x);
        Real::set_lane(&mut self.y, lane, one.y);
        Real::set_lane(&mut self.z, lane, one.z);
    }
}
