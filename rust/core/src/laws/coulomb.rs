use nalgebra::Vector2;

use crate::math::Real;

use super::disc::{Disc, DiscEvaluation, Radius, Symmetric2, Unit};
use super::skin::Halves;

/// Orthotropic Coulomb friction in proximal form (T 3.63 != D4), in coordinates in which its ellipse is a disc.
///
/// With S = diag(shape) the impulse is S p, the slip is measured as S gamma, and `p = prox_disc(x)` with
/// `x = centre - r S gamma`. Where `-gamma in N_C(S p)` holds for the ellipse C, `-S gamma in N_disc(p)` holds for the
/// disc and the other way round. A zero axis, or a zero radius, is harmless: no impulse, no stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb<T = f64, R = T> {
    /// Semi-axes of the ellipse over the radius of the disc.
    pub shape: Vector2<T>,
    pub disc: Disc<R>,
}

/// Impulse of a friction law and its stiffness against the slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation<T = f64> {
    /// p, or S p of a [`Skin`](super::Skin), in disc coordinates.
    pub value: Vector2<T>,
    /// -d(S p)/d(gamma) = r S D S \[kg\].
    pub stiffness: Symmetric2<T>,
}

impl<T: Real> Coulomb<T, Unit> {
    /// The ellipse with the given semi-axes as a unit disc.
    #[inline(always)]
    pub fn with_axes(axes: Vector2<T>) -> Self {
        Self { shape: axes, disc: Disc { radius: Unit } }
    }
}

impl<T: Real, R: Radius<T>> Coulomb<T, R> {
    /// S v.
    #[inline(always)]
    pub fn scaled(&self, v: &Vector2<T>) -> Vector2<T> {
        Vector2::new(self.shape.x * v.x, self.shape.y * v.y)
    }

    /// p and stiffness at the slip `gamma`.
    #[inline(always)]
    pub fn evaluate(&self, halves: impl Halves, centre: &Vector2<T>, r: T, gamma: &Vector2<T>) -> Evaluation<T> {
        let x = self.argument(centre, r, gamma);
        let side = halves.side(x.x);
        self.stiffness_of(halves.out_of_disc(self.disc.evaluate(&halves.scaled(&x, side)), side), r)
    }

    /// x = centre - r S gamma.
    #[inline(always)]
    fn argument(&self, centre: &Vector2<T>, r: T, gamma: &Vector2<T>) -> Vector2<T> {
        let s = &self.shape;
        Vector2::new((r * s.x).subtract_from(gamma.x, centre.x), (r * s.y).subtract_from(gamma.y, centre.y))
    }

    #[inline(always)]
    fn stiffness_of(&self, DiscEvaluation { value, jacobian: d, .. }: DiscEvaluation<T>, r: T) -> Evaluation<T> {
        let s = &self.shape;
        let (rx, ry) = (r * s.x, r * s.y);
        Evaluation { value, stiffness: Symmetric2 { xx: rx * s.x * d.xx, xy: rx * s.y * d.xy, yy: ry * s.y * d.yy } }
    }

    /// First and second derivative by alpha of the law's convex function at `gamma + alpha rate`.
    #[inline(always)]
    pub fn along(
        &self,
        halves: impl Halves,
        centre: &Vector2<T>,
        r: T,
        gamma: &Vector2<T>,
        rate: &Vector2<T>,
        alpha: T,
    ) -> (T, T) {
        let (slip, d) = (self.scaled(gamma), self.scaled(rate));
        let x = Vector2::new(centre.x - r * (slip.x + alpha * d.x), centre.y - r * (slip.y + alpha * d.y));
        let side = halves.side(x.x);
        let (first, second) = self.disc.along(&halves.scaled(&x, side), &halves.scaled(&d, side), r);
        (-first, second)
    }

    /// The alpha at which `|centre - r S (gamma + alpha rate)|` is least: there the slope of the law's function nearly
    /// jumps. NaN where the rate is zero.
    #[inline(always)]
    pub fn kink(&self, halves: impl Halves, centre: &Vector2<T>, r: T, gamma: &Vector2<T>, rate: &Vector2<T>) -> T {
        let (d, x) = (self.scaled(rate), self.argument(centre, r, gamma));
        halves.least(&x, &d, r)
    }
}
