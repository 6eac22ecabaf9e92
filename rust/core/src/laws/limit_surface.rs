//! Friction of the ground on a body that lies on a face: force and moment together, in an ellipsoid.
//!
//! While a body slides and turns, the forces under its points have different directions, so that neither their sum nor their
//! moment reaches what either would alone. The set of all that friction can resist is convex, and the slip is normal to it:
//! the limit surface of S. Goyal, A. Ruina and J. Papadopoulos, "Planar sliding with dry friction", Wear 143 (1991). We
//! take the ellipsoid through its largest force and its largest moment, as R. D. Howe and M. R. Cutkosky, "Practical
//! force-motion models for sliding manipulation", Int. J. Robotics Research 15 (1996).
//!
//! In coordinates in which the ellipsoid is the unit ball, as in [`Coulomb`](super::Coulomb): with S = diag(axes) the impulse
//! is S p, and `p = prox_ball(x)` with `x = centre - r S u`.

use nalgebra::Vector3;

use crate::math::{Real, dot};

use super::ConvexSet;

/// The ball around the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball<T = f64> {
    pub radius: T,
}

/// The ellipsoid with these semi-axes: force along and across the body, and moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitSurface<T = f64> {
    pub axes: Vector3<T>,
}

/// p, and the stiffness r S D S of the impulse against the twist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceEvaluation<T = f64> {
    pub value: Vector3<T>,
    /// Its part `diag(across)`, less `stiffness along along^T` where the body slips.
    pub across: Vector3<T>,
    pub stiffness: T,
    pub along: Vector3<T>,
}

impl<T: Real> LimitSurface<T> {
    /// S v.
    #[inline(always)]
    pub fn scaled(&self, v: &Vector3<T>) -> Vector3<T> {
        Vector3::new(self.axes.x * v.x, self.axes.y * v.y, self.axes.z * v.z)
    }

    /// p and stiffness at a twist.
    #[inline(always)]
    pub fn evaluate(&self, centre: &Vector3<T>, r: T, twist: &Vector3<T>) -> SurfaceEvaluation<T> {
        let (zero, one, s) = (T::zero(), T::splat(1.0), self.scaled(twist));
        let x = Vector3::new(centre.x - r * s.x, centre.y - r * s.y, centre.z - r * s.z);
        let squared = dot(&x, &x);
        let inverse = one / squared.max(one).sqrt();
        let value = Vector3::new(x.x * inverse, x.y * inverse, x.z * inverse);
        let (stiffness, slips) = (r * inverse, one.lt(squared));
        let slip = Vector3::new(
            T::select(slips, value.x, zero),
            T::select(slips, value.y, zero),
            T::select(slips, value.z, zero),
        );
        let across = self.scaled(&self.axes);
        let across = Vector3::new(stiffness * across.x, stiffness * across.y, stiffness * across.z);
        SurfaceEvaluation { value, across, stiffness, along: self.scaled(&slip) }
    }

    /// First and second derivative by alpha of the law's convex function at `twist + alpha rate`.
    #[inline(always)]
    pub fn along(&self, centre: &Vector3<T>, r: T, twist: &Vector3<T>, rate: &Vector3<T>, alpha: T) -> (T, T) {
        let (s, d, one) = (self.scaled(twist), self.scaled(rate), T::splat(1.0));
        let x = Vector3::new(
            centre.x - r * (s.x + alpha * d.x),
            centre.y - r * (s.y + alpha * d.y),
            centre.z - r * (s.z + alpha * d.z),
        );
        let squared = dot(&x, &x);
        let inverse = one / squared.max(one).sqrt();
        let along = dot(&x, &d) * inverse;
        let lost = T::select(one.lt(squared), along * along, T::zero());
        (-along, r * inverse * (dot(&d, &d) - lost))
    }

    /// The alpha at which the slope of that function nearly jumps; NaN where the rate is zero.
    #[inline(always)]
    pub fn kink(&self, centre: &Vector3<T>, r: T, twist: &Vector3<T>, rate: &Vector3<T>) -> T {
        let (s, d) = (self.scaled(twist), self.scaled(rate));
        let x = Vector3::new(centre.x - r * s.x, centre.y - r * s.y, centre.z - r * s.z);
        dot(&x, &d) / (r * dot(&d, &d))
    }
}

impl<T: Real> ConvexSet for Ball<T> {
    type Point = Vector3<T>;
    type Scalar = T;

    #[inline(always)]
    fn project(&self, x: Vector3<T>) -> Vector3<T> {
        let squared = dot(&x, &x);
        let inside = squared.le(self.radius * self.radius);
        let shrink = T::select(inside, T::splat(1.0), self.radius / squared.sqrt());
        Vector3::new(x.x * shrink, x.y * shrink, x.z * shrink)
    }

    #[inline(always)]
    fn support(&self, v: Vector3<T>) -> T {
        self.radius * dot(&v, &v).sqrt()
    }
}
