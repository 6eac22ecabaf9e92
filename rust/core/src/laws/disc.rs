use nalgebra::Vector2;

use crate::math::Real;

use super::ConvexSet;

/// Isotropic Coulomb friction, C_T1 = {|lambda| <= radius} (T 3.61).
///
/// All of friction in the plane, isotropic or not, is projected here: an ellipse is a disc in the coordinates of
/// [`Coulomb`](super::Coulomb).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc<R = f64> {
    pub radius: R,
}

/// Radius of a disc: a number, or [`Unit`], for which the projection takes fewer operations.
pub trait Radius<T: Real>: Copy {
    /// 1 / max(length, radius), given the square of the length, and whether the length is within the radius: on the
    /// boundary included, since friction at its bound holds what does not slip, but not in a disc of radius zero.
    fn inverse_length(self, squared: T) -> (T, T::Mask);

    /// Factor from a point to its projection, given the above: radius / max(length, radius), or 1 within.
    fn shrink(self, inverse: T, within: T::Mask) -> T;
}

/// The radius 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit;

impl<T: Real> Radius<T> for T {
    #[inline(always)]
    fn inverse_length(self, squared: T) -> (T, T::Mask) {
        let bound = self * self;
        let inverse = T::splat(1.0) / squared.max(bound).max(T::splat(TINY)).sqrt();
        (inverse, squared.le(bound) & T::zero().lt(self))
    }

    #[inline(always)]
    fn shrink(self, inverse: T, within: T::Mask) -> T {
        T::select(within, T::splat(1.0), self * inverse)
    }
}

impl<T: Real> Radius<T> for Unit {
    #[inline(always)]
    fn inverse_length(self, squared: T) -> (T, T::Mask) {
        let one = T::splat(1.0);
        (one / squared.max(one).sqrt(), squared.le(one))
    }

    #[inline(always)]
    fn shrink(self, inverse: T, _within: T::Mask) -> T {
        inverse
    }
}

/// A symmetric 2 x 2 matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Symmetric2<T = f64> {
    pub xx: T,
    pub xy: T,
    pub yy: T,
}

/// The projection on a disc and its derivative at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscEvaluation<T = f64> {
    /// prox_C(x), or x itself on the inner branch.
    pub value: Vector2<T>,
    /// Element of the generalised Jacobian: I inside, `radius (I - e e^T) / |x|` with e = x / |x| outside.
    pub jacobian: Symmetric2<T>,
    /// Change of the value by that of the radius, up to a radius of |x|: e outside, zero inside.
    pub by_radius: Vector2<T>,
}

impl<R> Disc<R> {
    /// The projection and its derivative at `x`.
    #[inline(always)]
    pub fn evaluate<T: Real>(&self, x: &Vector2<T>) -> DiscEvaluation<T>
    where
        R: Radius<T>,
    {
        let (inverse, within) = self.radius.inverse_length(squared_length(x));
        on_branch(x, inverse, self.radius.shrink(inverse, within), within)
    }

    /// With p = prox_C(x) and its Jacobian D: the pair (p . d, r d^T D d). For phi(alpha) = Phi(x - alpha r d) / r with
    /// grad Phi = p these are -phi' and phi''.
    #[inline(always)]
    pub fn along<T: Real>(&self, x: &Vector2<T>, d: &Vector2<T>, r: T) -> (T, T)
    where
        R: Radius<T>,
    {
        let (inverse, within) = self.radius.inverse_length(squared_length(x));
        let shrink = self.radius.shrink(inverse, within);
        let along = x.x * d.x + x.y * d.y;
        // Inside, p follows x; outside, only its component across p does, shrunk.
        let across = along * inverse;
        let lost = T::select(within, T::zero(), across * across);
        (shrink * along, r * shrink * (d.x * d.x + d.y * d.y - lost))
    }
}

impl<T: Real> Disc<T> {
    /// As [`Self::evaluate`], but on the inner branch in the lanes `held`, wherever `x` lies, unless the disc is a
    /// point.
    #[inline(always)]
    pub fn evaluate_held(&self, x: &Vector2<T>, held: T::Mask) -> DiscEvaluation<T> {
        let (inverse, within) = self.radius.inverse_length(squared_length(x));
        let inner = within | (held & T::zero().lt(self.radius));
        on_branch(x, inverse, self.radius.shrink(inverse, inner), inner)
    }
}

#[inline(always)]
fn squared_length<T: Real>(x: &Vector2<T>) -> T {
    x.x.mul_add(x.x, x.y * x.y)
}

/// Value and derivative of the inner branch in the lanes `inner`, of the outer one elsewhere.
#[inline(always)]
fn on_branch<T: Real>(x: &Vector2<T>, inverse: T, shrink: T, inner: T::Mask) -> DiscEvaluation<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let (ex, ey) = (x.x * inverse, x.y * inverse);
    let slide = ey * shrink;
    DiscEvaluation {
        value: Vector2::new(x.x * shrink, x.y * shrink),
        jacobian: Symmetric2 {
            xx: T::select(inner, one, ey * slide),
            xy: -T::select(inner, zero, ex * slide),
            yy: T::select(inner, one, ex * ex * shrink),
        },
        by_radius: Vector2::new(T::select(inner, zero, ex), T::select(inner, zero, ey)),
    }
}

impl<T: Real> ConvexSet for Disc<T> {
    type Point = Vector2<T>;
    type Scalar = T;

    #[inline(always)]
    fn project(&self, x: Vector2<T>) -> Vector2<T> {
        let (inverse, within) = self.radius.inverse_length(squared_length(&x));
        let shrink = self.radius.shrink(inverse, within);
        Vector2::new(x.x * shrink, x.y * shrink)
    }

    #[inline(always)]
    fn support(&self, v: Vector2<T>) -> T {
        self.radius * (v.x * v.x + v.y * v.y).sqrt()
    }
}

/// Squared length below which a vector has no direction: a disc of radius zero has no derivative at the origin.
const TINY: f64 = 1e-200;
