//! Set-valued force laws as convex sets with a nearest-point projection (T 3.5.2).
//!
//! A law `-gamma in N_C(lambda)` is the set `C` of admissible forces; its proximal form (T 3.64) is
//! `lambda = prox_C(lambda - r gamma)` for any `r > 0`, where `prox_C` is [`ConvexSet::project`].

mod disc;
mod ellipse;
mod interval;
mod non_negative;
mod stribeck;

pub use disc::Disc;
pub use ellipse::Ellipse;
pub use interval::Interval;
pub use non_negative::NonNegative;
pub use stribeck::{Stribeck, remaining};

/// A closed convex set that contains the origin.
pub trait ConvexSet {
    type Point;

    /// The point of the set nearest to `x` in the Euclidean norm, prox_C(x).
    fn project(&self, x: Self::Point) -> Self::Point;

    /// The support function sup over lambda in C of lambda . v.
    ///
    /// With v = -gamma this is the dissipation rate of the law; Fenchel's inequality
    /// `support(-gamma) + lambda . gamma >= 0` is an equality exactly when the law holds.
    fn support(&self, v: Self::Point) -> f64;
}
