//! Friction of a stage in proximal form: ellipses of one shape, whose size follows the normal impulses.

use nalgebra::Vector2;

use crate::laws::{Disc, DiscEvaluation, Halves, Symmetric2};
use crate::math::{Mask, Real, select_into};

/// What the friction laws of a stage share: the shape of the ellipse, its size but for the normal impulse, and the
/// penalty.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionLaw<T> {
    /// Semi-axes over the longer one, S, and their inverses, zero for an axis that is none.
    pub shape: Vector2<T>,
    inverse_shape: Vector2<T>,
    /// Longer semi-axis over the normal impulse \[-\].
    strength: T,
    /// Stiffness r of sticking along the stronger axis \[kg\].
    penalty: T,
}

/// Friction in an ellipse with the semi-axes a S, in coordinates in which it is a disc of radius a: the slip is
/// gamma^ = S gamma, the impulse is S p, and p = prox_disc(centre - r gamma^). A radius of zero is harmless.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionTerm<T: Real> {
    /// a \[N s\].
    pub radius: T,
    /// The multiplier.
    centre: Vector2<T>,
    /// p, or S p with a skin \[N s\].
    pub value: Vector2<T>,
    /// Change of the value by that of the radius \[-\].
    by_radius: Vector2<T>,
    /// Of a contact that slips, the radius from which on it would stick \[N s\].
    length: T,
    /// Whether the contact counts as sticking whatever its velocity.
    held: T::Mask,
}

impl<T: Real> FrictionLaw<T> {
    /// `coefficients` are the semi-axes over the normal impulse.
    #[inline(always)]
    pub fn new(coefficients: Vector2<T>, penalty: T) -> Self {
        let strength = coefficients.x.max(coefficients.y);
        let (x, inverse_x) = share(coefficients.x, strength);
        let (y, inverse_y) = share(coefficients.y, strength);
        Self { shape: Vector2::new(x, y), inverse_shape: Vector2::new(inverse_x, inverse_y), strength, penalty }
    }

    /// Radius under a normal impulse (T 4.84), (T 4.87); one that pulls, as a contact held closed may, bears no
    /// friction.
    #[inline(always)]
    pub fn radius(&self, normal: T) -> T {
        (self.strength * normal).max(T::zero())
    }

    /// S v.
    #[inline(always)]
    pub fn scaled(&self, v: &Vector2<T>) -> Vector2<T> {
        Vector2::new(self.shape.x * v.x, self.shape.y * v.y)
    }
}

/// A semi-axis over the longer one, and the inverse of that.
#[inline(always)]
fn share<T: Real>(axis: T, longer: T) -> (T, T) {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let is_one = T::splat(LEAST_COEFFICIENT).lt(axis);
    let share = axis / longer.max(T::splat(LEAST_COEFFICIENT));
    (T::select(is_one, share, zero), T::select(is_one, one / share, zero))
}

impl<T: Real> FrictionTerm<T> {
    /// A contact whose friction was `impulse`, within the ellipse, counts as sticking until it is released.
    #[inline(always)]
    pub fn new(law: &FrictionLaw<T>, radius: T, impulse: &Vector2<T>) -> Self {
        let none = Vector2::new(T::zero(), T::zero());
        let p = Vector2::new(law.inverse_shape.x * impulse.x, law.inverse_shape.y * impulse.y);
        Self { radius, centre: none, value: none, by_radius: none, length: T::zero(), held: sticks(&p, radius) }
    }

    #[inline(always)]
    fn disc(&self) -> Disc<T> {
        Disc { radius: self.radius }
    }

    /// A contact in the air.
    #[inline(always)]
    pub fn vanish(&mut self) {
        (self.value, self.by_radius) = (Vector2::new(T::zero(), T::zero()), Vector2::new(T::zero(), T::zero()));
    }

    /// From now on the contact sticks or slips as its velocity determines.
    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// Takes the `wanted` radius where it differs by no more than `largest_change`; returns by how much it did.
    #[inline(always)]
    pub fn follow(&mut self, wanted: T, largest_change: T) -> T {
        let change = (wanted - self.radius).abs();
        self.radius = T::select(change.le(largest_change), wanted, self.radius);
        change
    }

    /// Decides anew, in these halves, whether a contact whose friction was `impulse` sticks until it is released.
    #[inline(always)]
    pub fn hold(&mut self, halves: impl Halves, law: &FrictionLaw<T>, impulse: &Vector2<T>) {
        let p = Vector2::new(law.inverse_shape.x * impulse.x, law.inverse_shape.y * impulse.y);
        self.held = sticks(&halves.in_disc(&p), self.radius);
    }

    /// Moves to the slip gamma^; returns the stiffness -dp/dgamma^ there.
    #[inline(always)]
    pub fn evaluate(&mut self, halves: impl Halves, law: &FrictionLaw<T>, gamma: &Vector2<T>) -> Symmetric2<T> {
        let r = law.penalty;
        let x = Vector2::new(r.subtract_from(gamma.x, self.centre.x), r.subtract_from(gamma.y, self.centre.y));
        let side = halves.side(x.x);
        let evaluation = self.disc().evaluate_held(&halves.scaled(&x, side), self.held);
        let DiscEvaluation { value, jacobian, by_radius, length } = halves.out_of_disc(evaluation, side);
        (self.value, self.by_radius, self.length) = (value, by_radius, length);
        Symmetric2 { xx: r * jacobian.xx, xy: r * jacobian.xy, yy: r * jacobian.yy }
    }

    /// Change of the value where the radius becomes `radius` at the present slip: friction that is too large for
    /// the disc grows with it until the contact sticks.
    #[inline(always)]
    pub fn change_with(&self, radius: T) -> Vector2<T> {
        let change = radius.min(self.length) - self.radius;
        Vector2::new(change * self.by_radius.x, change * self.by_radius.y)
    }

    /// First and second derivative of the law's function at gamma^ + alpha rate by alpha.
    #[inline(always)]
    pub fn along(
        &self,
        halves: impl Halves,
        law: &FrictionLaw<T>,
        gamma: &Vector2<T>,
        rate: &Vector2<T>,
        alpha: T,
    ) -> (T, T) {
        let (r, x) = (law.penalty, Vector2::new(alpha.mul_add(rate.x, gamma.x), alpha.mul_add(rate.y, gamma.y)));
        let x = Vector2::new(r.subtract_from(x.x, self.centre.x), r.subtract_from(x.y, self.centre.y));
        let side = halves.side(x.x);
        let (first, second) = self.disc().along(&halves.scaled(&x, side), &halves.scaled(rate, side), r);
        (-first, second)
    }

    /// How far the centre is from the impulse, squared: over the squared penalty it is the velocity by which the law is
    /// violated, when sliding the slip times the angle by which friction is misdirected.
    #[inline(always)]
    pub fn squared_error(&self, halves: impl Halves, law: &FrictionLaw<T>) -> T {
        let multiplier = halves.gradient(&self.value);
        let error = law.scaled(&Vector2::new(multiplier.x - self.centre.x, multiplier.y - self.centre.y));
        error.x.mul_add(error.x, error.y * error.y)
    }

    /// After [`Self::recentre`] in the given lanes, what belongs to multiplier and branch in these halves.
    #[inline(always)]
    pub fn raise(&mut self, halves: impl Halves, lanes: T::Mask) {
        self.held = lanes & sticks(&halves.in_disc(&self.value), self.radius);
        select_into(&mut self.centre, lanes, &halves.gradient(&self.value));
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        select_into(&mut self.centre, lanes, &self.value);
        // Velocity and multiplier now carry the same friction: both together would make a sticking contact slip.
        self.held = lanes & sticks(&self.centre, self.radius);
    }

    /// The impulse becomes the multiplier in the given lanes, and the impulse what it will then be at the slip gamma^ of
    /// the last evaluation, on the branch of `stiffness`.
    #[inline(always)]
    pub fn recentre_here(
        &mut self,
        halves: impl Halves,
        gamma: &Vector2<T>,
        stiffness: &Symmetric2<T>,
        lanes: T::Mask,
    ) {
        select_into(&mut self.centre, lanes, &halves.gradient(&self.value));
        let Symmetric2 { xx, xy, yy } = *stiffness;
        let value = Vector2::new(
            xy.subtract_from(gamma.y, xx.subtract_from(gamma.x, self.value.x)),
            yy.subtract_from(gamma.y, xy.subtract_from(gamma.x, self.value.y)),
        );
        select_into(&mut self.value, lanes, &value);
    }

    /// The alpha at which the slip gamma^ + alpha rate is least; not a number if it does not change, or has no friction.
    #[inline(always)]
    pub fn kink(&self, halves: impl Halves, gamma: &Vector2<T>, rate: &Vector2<T>) -> T {
        // Friction lies on the other side of the slip.
        let kink = halves.least(&Vector2::new(-gamma.x, -gamma.y), rate, T::splat(1.0));
        T::select(T::zero().lt(self.radius), kink, T::splat(f64::NAN))
    }
}

/// Whether friction p in a disc is certainly that of a contact that sticks, though the radius may belong to another
/// normal impulse.
#[inline(always)]
fn sticks<T: Real>(p: &Vector2<T>, radius: T) -> T::Mask {
    (p.x * p.x + p.y * p.y).le(T::splat(STICKS) * radius * radius)
}

/// Squared impulse over the squared radius below which a contact counts as sticking \[-\].
const STICKS: f64 = 0.98;

/// Coefficient of friction below which there is none: quotients of two that are larger are numbers.
const LEAST_COEFFICIENT: f64 = 1e-100;
