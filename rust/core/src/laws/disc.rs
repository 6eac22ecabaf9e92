use nalgebra::Vector2;

use crate::math::{Mask, Real};

use super::ConvexSet;

/// Isotropic Coulomb friction, C_T1 = {|lambda| <= radius} (T 3.61).
///
/// All of friction in the plane, isotropic or not, is projected here: an ellipse is a disc in the coordinates of
/// [`Coulomb`](super::Coulomb).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc<T = f64> {
    pub radius: T,
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
}

/// What scales a point to its projection.
struct Scaling<T: Real> {
    /// 1 / max(|x|, radius).
    inverse: T,
    /// Factor from x to its projection.
    shrink: T,
    /// Whether the projection is the identity.
    inner: T::Mask,
}

impl<T: Real> Disc<T> {
    /// The disc of radius 1.
    #[inline(always)]
    pub fn unit() -> Self {
        Self { radius: T::splat(1.0) }
    }

    /// The projection and its derivative at `x`; in the lanes `held` of a disc that is more than a point, of the inner
    /// branch wherever `x` lies.
    #[inline(always)]
    pub fn evaluate(&self, x: &Vector2<T>, held: T::Mask) -> DiscEvaluation<T> {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let Scaling { inverse, shrink, inner } = self.scaling(x, held);
        let (ex, ey) = (x.x * inverse, x.y * inverse);
        let slide = ey * shrink;
        DiscEvaluation {
            value: Vector2::new(x.x * shrink, x.y * shrink),
            jacobian: Symmetric2 {
                xx: T::select(inner, one, ey * slide),
                xy: -T::select(inner, zero, ex * slide),
                yy: T::select(inner, one, ex * ex * shrink),
            },
        }
    }

    /// `p . d` and `r d^T D d` with p = prox_C(x) and D its Jacobian: along x - alpha r d, the first two derivatives by
    /// alpha of the function whose gradient is p but for the sign of the first.
    #[inline(always)]
    pub fn along(&self, x: &Vector2<T>, d: &Vector2<T>, r: T) -> (T, T) {
        let Scaling { inverse, shrink, inner } = self.scaling(x, T::Mask::of(|_| false));
        let along = x.x * d.x + x.y * d.y;
        // Inside, p follows x; outside, only its component across p does, shrunk.
        let across = along * inverse;
        let lost = T::select(inner, T::zero(), across * across);
        (shrink * along, r * shrink * (d.x * d.x + d.y * d.y - lost))
    }

    #[inline(always)]
    fn scaling(&self, x: &Vector2<T>, held: T::Mask) -> Scaling<T> {
        let (squared, bound) = (x.x * x.x + x.y * x.y, self.radius * self.radius);
        let inverse = T::splat(1.0) / squared.max(bound).max(T::splat(TINY)).sqrt();
        // On the boundary included: friction at its bound holds what does not slip.
        let inner = (squared.le(bound) | held) & T::zero().lt(self.radius);
        Scaling { inverse, shrink: T::select(inner, T::splat(1.0), self.radius * inverse), inner }
    }
}

impl<T: Real> ConvexSet for Disc<T> {
    type Point = Vector2<T>;
    type Scalar = T;

    #[inline(always)]
    fn project(&self, x: Vector2<T>) -> Vector2<T> {
        let shrink = self.scaling(&x, T::Mask::of(|_| false)).shrink;
        Vector2::new(x.x * shrink, x.y * shrink)
    }

    #[inline(always)]
    fn support(&self, v: Vector2<T>) -> T {
        self.radius * (v.x * v.x + v.y * v.y).sqrt()
    }
}

/// Squared length below which a vector has no direction: a disc of radius zero has no derivative at the origin.
const TINY: f64 = 1e-200;
