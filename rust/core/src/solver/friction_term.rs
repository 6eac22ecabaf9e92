use nalgebra::Vector2;

use crate::laws::{Coulomb, Evaluation, Halves, Symmetric2, Unit};
use crate::math::{Real, select_into};

/// Friction with given semi-axes in proximal form around a multiplier, in coordinates in which its ellipse is the unit
/// disc.
#[derive(Debug, Clone, Copy)]
pub struct FrictionTerm<T> {
    law: Coulomb<T, Unit>,
    /// r \[1/(kg m^2/s^2)\]: the stiffness of sticking along the longer axis over the square of that axis.
    penalty: T,
    centre: Vector2<T>,
    value: Vector2<T>,
}

impl<T: Real> FrictionTerm<T> {
    /// Friction within `axes` \[N s\] around the impulse of the last stage; `penalty` is the stiffness of sticking
    /// along the longer axis \[kg\].
    #[inline(always)]
    pub fn new(axes: Vector2<T>, impulse: &Vector2<T>, penalty: T) -> Self {
        let inverse = inverse_or_zero(axes);
        let of_longer = T::select(axes.y.le(axes.x), inverse.x, inverse.y);
        let centre = Vector2::new(impulse.x * inverse.x, impulse.y * inverse.y);
        Self { law: Coulomb::with_axes(axes), penalty: penalty * (of_longer * of_longer), centre, value: centre }
    }

    /// P_T \[N s\].
    #[inline(always)]
    pub fn impulse(&self) -> Vector2<T> {
        self.law.scaled(&self.value)
    }

    /// Moves to a slip velocity; returns the stiffness there.
    #[inline(always)]
    pub fn evaluate(&mut self, halves: impl Halves, slip: &Vector2<T>) -> Symmetric2<T> {
        let Evaluation { value, stiffness } = self.law.evaluate(halves, &self.centre, self.penalty, slip);
        self.value = value;
        stiffness
    }

    /// First and second derivative by alpha of the law's function at `slip + alpha rate`.
    #[inline(always)]
    pub fn along(&self, halves: impl Halves, slip: &Vector2<T>, rate: &Vector2<T>, alpha: T) -> (T, T) {
        self.law.along(halves, &self.centre, self.penalty, slip, rate, alpha)
    }

    /// The alpha at which the slope of the law's function nearly jumps; NaN where the rate is zero.
    #[inline(always)]
    pub fn kink(&self, halves: impl Halves, slip: &Vector2<T>, rate: &Vector2<T>) -> T {
        self.law.kink(halves, &self.centre, self.penalty, slip, rate)
    }

    /// Square of how far the velocity of a link of mass `mass` is from obeying the law because the multiplier is not
    /// yet the impulse \[m^2/s^2\].
    ///
    /// Sticking, the constraint is violated by |P - P_centre| / r. Sliding at speed gamma, the friction's direction is
    /// off by |P - P_centre| / (r gamma), which changes the link's velocity by that angle times a / m, but by no more
    /// than gamma itself.
    #[inline(always)]
    pub fn squared_error(&self, halves: impl Halves, slip: &Vector2<T>, mass: T) -> T {
        let (zero, infinity) = (T::zero(), T::splat(f64::INFINITY));
        let (multiplier, p) = (halves.gradient(&self.value), halves.in_disc(&self.value));
        let (x, y) = (multiplier.x - self.centre.x, multiplier.y - self.centre.y);
        let change = x * x + y * y;
        let longer = self.law.shape.x.max(self.law.shape.y);
        let slides = T::splat(SLIDING).lt(p.x * p.x + p.y * p.y);
        let squared_speed = slip.x * slip.x + slip.y * slip.y;
        // Either stiffness by one division: the larger violation is that over the smaller of the two.
        let (sticking, sliding) = (self.penalty * longer, self.penalty * mass);
        let (sticking, sliding) = (sticking * sticking, sliding * sliding * squared_speed);
        let stiffness = T::select(slides, sticking.min(sliding), sticking);
        let violation = (change / stiffness).min(T::select(slides, squared_speed, infinity));
        // A link without friction has no violation, however slowly it moves.
        T::select(zero.lt(change) & zero.lt(sticking), violation, zero)
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
    }

    /// Makes the multiplier, an impulse after [`Self::new`] and [`Self::recentre`], what belongs to it in these halves.
    #[inline(always)]
    pub fn raise(&mut self, halves: impl Halves, lanes: T::Mask) {
        let multiplier = halves.gradient(&self.centre);
        select_into(&mut self.centre, lanes, &multiplier);
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        select_into(&mut self.centre, lanes, &self.value);
    }
}

/// Inverses of the axes by one division; zero for a zero axis.
#[inline(always)]
fn inverse_or_zero<T: Real>(axes: Vector2<T>) -> Vector2<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let has = [zero.lt(axes.x), zero.lt(axes.y)];
    let [x, y] = [T::select(has[0], axes.x, one), T::select(has[1], axes.y, one)];
    let inverse = one / (x * y);
    Vector2::new(T::select(has[0], y * inverse, zero), T::select(has[1], x * inverse, zero))
}

/// Squared impulse, over that of sliding, from which on a contact counts as sliding.
const SLIDING: f64 = 1.0 - 1e-9;
