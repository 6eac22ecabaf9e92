//! Set-valued force laws as convex sets, and their single-valued relatives (T 3.5.2).
//!
//! A law `-gamma in N_C(lambda)` is the set `C` of admissible forces; its proximal form (T 3.64) is
//! `lambda = prox_C(lambda - r gamma)` for any `r > 0`, where `prox_C` is the nearest-point projection on `C`.
//!
//! A law that a solver uses is one type, generic over [`Real`](crate::math::Real), with those of these methods that it
//! needs ([`Ellipse`] is the nearest-point projection that schemes as printed and dense solvers take):
//!
//! | method | gives |
//! | --- | --- |
//! | `project` | prox_C(x) |
//! | `evaluate` | prox_C(x) with its generalised Jacobian, or the branch of it that the caller holds the law on |
//! | `along` | first and second derivative of the law's convex function along a ray, for the exact line search |
//!
//! Whether a force and a velocity obey a law is checked by [`crate::judge`], which shares no code with this module.

mod actuator;
mod backlash;
mod cone;
mod coulomb;
mod disc;
mod ellipse;
mod half_line;
mod interval;
mod limit_surface;
mod skin;
mod spin;
mod stribeck;

pub use actuator::LimitedActuator;
pub use backlash::Backlash;
pub use cone::Cone;
pub use coulomb::{Coulomb, Evaluation};
pub use disc::{Disc, DiscEvaluation, Radius, Symmetric2, Unit};
pub use ellipse::Ellipse;
pub use half_line::HalfLine;
pub use interval::Interval;
pub use limit_surface::{Ball, LimitSurface, SurfaceEvaluation};
pub use skin::{Halves, Skin, Whole};
pub use spin::spin_coefficient;
pub use stribeck::{Stribeck, remaining};

/// A closed convex set that contains the origin.
pub trait ConvexSet {
    type Point;

    /// The point of the set nearest to `x` in the Euclidean norm, prox_C(x).
    fn project(&self, x: Self::Point) -> Self::Point;

    /// The support function sup over lambda in C of lambda . v.
    ///
    /// With v = -gamma this is the dissipation rate of the law; Fenchel's inequality
    /// `support(-gamma) + lambda . gamma >= 0` is an equality exactly when the law holds. Solvers need only `project`; tests
    /// use this.
    fn support(&self, v: Self::Point) -> Self::Scalar;

    /// Number type of the coordinates.
    type Scalar;
}
