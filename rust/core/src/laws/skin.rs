use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::math::Real;

use super::disc::{DiscEvaluation, Symmetric2};

/// Friction along a link that differs forward and backward: two half-ellipses with a common semi-axis across, in
/// coordinates in which the half with the longer semi-axis along is half a disc.
///
/// A force of the set is P = S p with p in the disc, S = diag(s, 1) and s the [share](Halves::side) on the side of p_x. In
/// place of |P|^2 / 2 the proximal form takes the convex h(P) = |p|^2 / 2, whose minimum of `h(P) - y . P` over the set is
/// S prox_disc(S y) with s on the side of y_x: the normals of the set where P_x = 0 are across, so both lie on one
/// side. The law `-gamma in N_C(P)` holds exactly where P belongs to y = grad h(P) - r gamma.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// Semi-axes along of the half with P_x >= 0 and of the other one, over the longer of both.
    shares: [f64; 2],
}

impl Skin {
    /// Coefficients of friction of a link that slides forward and backward, and across, as those of the longer half and
    /// the skin; none where both halves are alike. Links point backward, so sliding forward is resisted with P_x >= 0.
    pub fn of([forward, across]: [f64; 2], backward: Option<f64>) -> (Vector2<f64>, Option<Self>) {
        let backward = backward.unwrap_or(forward);
        let longer = forward.max(backward);
        let skin = (forward != backward).then(|| Self { shares: [forward / longer, backward / longer] });
        (Vector2::new(longer, across), skin)
    }

    /// Semi-axes along, over the longer one: of the half with P_x >= 0 and of the other one.
    pub fn shares(&self) -> [f64; 2] {
        self.shares
    }
}

/// How the set of a friction law follows from a disc: chosen once for a solve.
pub trait Halves: Copy {
    /// Whether there are two halves.
    const DIFFER: bool;

    /// s where P_x >= 0 and where it is negative.
    fn sides<T: Real>(&self) -> [T; 2];

    /// s on the side on which `x` lies.
    #[inline(always)]
    fn side<T: Real>(&self, x: T) -> T {
        let [positive, negative] = self.sides();
        T::select(T::zero().le(x), positive, negative)
    }

    /// S v.
    fn scaled<T: Real>(&self, v: &Vector2<T>, side: T) -> Vector2<T>;

    /// Force and derivative, of those in the disc.
    fn out_of_disc<T: Real>(&self, evaluation: DiscEvaluation<T>, side: T) -> DiscEvaluation<T>;

    /// p of a force P, without a part along where the share is zero.
    fn in_disc<T: Real>(&self, force: &Vector2<T>) -> Vector2<T>;

    /// grad h(P), the multiplier that belongs to a force.
    #[inline(always)]
    fn gradient<T: Real>(&self, force: &Vector2<T>) -> Vector2<T> {
        self.in_disc(&self.in_disc(force))
    }

    /// The alpha at which |S (x - alpha r d)| is least.
    fn least<T: Real>(&self, x: &Vector2<T>, d: &Vector2<T>, r: T) -> T;
}

/// The disc itself.
#[derive(Debug, Clone, Copy)]
pub struct Whole;

impl Halves for Whole {
    const DIFFER: bool = false;

    #[inline(always)]
    fn sides<T: Real>(&self) -> [T; 2] {
        [T::splat(1.0); 2]
    }

    #[inline(always)]
    fn scaled<T: Real>(&self, v: &Vector2<T>, _side: T) -> Vector2<T> {
        *v
    }

    #[inline(always)]
    fn out_of_disc<T: Real>(&self, evaluation: DiscEvaluation<T>, _side: T) -> DiscEvaluation<T> {
        evaluation
    }

    #[inline(always)]
    fn in_disc<T: Real>(&self, force: &Vector2<T>) -> Vector2<T> {
        *force
    }

    #[inline(always)]
    fn least<T: Real>(&self, x: &Vector2<T>, d: &Vector2<T>, r: T) -> T {
        (x.x * d.x + x.y * d.y) / (r * (d.x * d.x + d.y * d.y))
    }
}

impl Halves for Skin {
    const DIFFER: bool = true;

    #[inline(always)]
    fn sides<T: Real>(&self) -> [T; 2] {
        [T::splat(self.shares[0]), T::splat(self.shares[1])]
    }

    #[inline(always)]
    fn scaled<T: Real>(&self, v: &Vector2<T>, side: T) -> Vector2<T> {
        Vector2::new(side * v.x, v.y)
    }

    #[inline(always)]
    fn out_of_disc<T: Real>(
        &self,
        DiscEvaluation { value, jacobian: d, by_radius }: DiscEvaluation<T>,
        side: T,
    ) -> DiscEvaluation<T> {
        let jacobian = Symmetric2 { xx: side * side * d.xx, xy: side * d.xy, yy: d.yy };
        let (value, by_radius) = (self.scaled(&value, side), self.scaled(&by_radius, side));
        DiscEvaluation { value, jacobian, by_radius }
    }

    #[inline(always)]
    fn in_disc<T: Real>(&self, force: &Vector2<T>) -> Vector2<T> {
        let side = self.side(force.x);
        let has_part = T::zero().lt(side);
        Vector2::new(T::select(has_part, force.x / T::select(has_part, side, T::splat(1.0)), T::zero()), force.y)
    }

    #[inline(always)]
    fn least<T: Real>(&self, x: &Vector2<T>, d: &Vector2<T>, r: T) -> T {
        let [positive, negative] = self.sides();
        let first = Whole.least(&self.scaled(x, positive), &self.scaled(d, positive), r);
        let second = Whole.least(&self.scaled(x, negative), &self.scaled(d, negative), r);
        T::select(T::zero().le(x.x - first * r * d.x), first, second)
    }
}
