//! Friction of a stage in proximal form: ellipses of one shape, whose size follows the normal impulses.

use nalgebra::Vector2;

use crate::math::{Mask, Real};

use super::proximal::select;

/// What the friction laws of a stage share: the shape of the ellipse, its size but for the normal impulse, and the
/// penalty.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionLaw<T> {
    /// Semi-axes over the longer one, S, and their inverses, zero for an axis that is none.
    shape: Vector2<T>,
    inverse_shape: Vector2<T>,
    /// Longer semi-axis over the normal impulse \[-\].
    strength: T,
    /// Stiffness r of sticking along the stronger axis \[kg\].
    penalty: T,
}

/// Friction in an ellipse with the semi-axes a S, in coordinates in which it is a disc of radius a: gamma^ = S gamma,
/// the impulse is S p, and p = prox_disc(centre - r gamma^). A radius of zero is harmless.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionTerm<T: Real> {
    /// a \[N s\].
    pub radius: T,
    /// The multiplier.
    centre: Vector2<T>,
    /// p \[N s\].
    value: Vector2<T>,
    /// Radius to return to.
    remembered: T,
    /// Whether the contact counts as sticking whatever its velocity.
    held: T::Mask,
}

/// Stiffness of a friction law against its two velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stiffness<T> {
    pub xx: T,
    pub xy: T,
    pub yy: T,
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
    fn scaled(&self, v: &Vector2<T>) -> Vector2<T> {
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
        Self { radius, centre: none, value: none, remembered: radius, held: sticks(&p, radius) }
    }

    /// P \[N s\].
    #[inline(always)]
    pub fn impulse(&self, law: &FrictionLaw<T>) -> Vector2<T> {
        law.scaled(&self.value)
    }

    /// A contact in the air.
    #[inline(always)]
    pub fn vanish(&mut self) {
        self.value = Vector2::new(T::zero(), T::zero());
    }

    /// From now on the contact sticks or slips as its velocity says.
    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    #[inline(always)]
    pub fn remember(&mut self) {
        self.remembered = self.radius;
    }

    /// Takes the remembered radius back.
    #[inline(always)]
    pub fn restore(&mut self, lanes: T::Mask) {
        self.radius = T::select(lanes, self.remembered, self.radius);
    }

    /// A fraction of the way from the remembered radius to the present one in the given lanes, in others the remembered
    /// one.
    #[inline(always)]
    pub fn move_part_way(&mut self, fraction: T, lanes: T::Mask) {
        let there = self.remembered + fraction * (self.radius - self.remembered);
        self.radius = T::select(lanes, there, self.remembered);
    }

    /// Moves to the slip velocity gamma; returns the stiffness r S D S with D = I when sticking,
    /// a (I - p p^T / a^2) / |x| when sliding.
    #[inline(always)]
    pub fn respond(&mut self, law: &FrictionLaw<T>, gamma: &Vector2<T>) -> Stiffness<T> {
        let (one, a, s) = (T::splat(1.0), self.radius, &law.shape);
        let (rx, ry) = (law.penalty * s.x, law.penalty * s.y);
        let (x, y) = (self.centre.x - rx * gamma.x, self.centre.y - ry * gamma.y);
        let (inverse, inside) = self.inverse_length(x, y);
        let sticks = inside | (self.held & T::zero().lt(a));
        let shrink = T::select(sticks, one, a * inverse);
        self.value = Vector2::new(x * shrink, y * shrink);
        let (ex, ey) = (x * inverse, y * inverse);
        let slide_x = ey * shrink;
        Stiffness {
            xx: rx * s.x * T::select(sticks, one, ey * slide_x),
            xy: -(rx * s.y * T::select(sticks, T::zero(), ex * slide_x)),
            yy: ry * s.y * T::select(sticks, one, ex * ex * shrink),
        }
    }

    /// 1 / max(|x|, a), and whether x lies in the disc.
    #[inline(always)]
    fn inverse_length(&self, x: T, y: T) -> (T, T::Mask) {
        let (squared, bound) = (x * x + y * y, self.radius * self.radius);
        (T::splat(1.0) / squared.max(bound).max(T::splat(TINY)).sqrt(), squared.lt(bound))
    }

    /// First and second derivative of the law's function at gamma + alpha rate by alpha.
    #[inline(always)]
    pub fn along(&self, law: &FrictionLaw<T>, gamma: &Vector2<T>, rate: &Vector2<T>, alpha: T) -> (T, T) {
        let (zero, one, r) = (T::zero(), T::splat(1.0), law.penalty);
        let (slip, d) = (law.scaled(gamma), law.scaled(rate));
        let x = self.centre.x - r * (slip.x + alpha * d.x);
        let y = self.centre.y - r * (slip.y + alpha * d.y);
        let (inverse, sticks) = self.inverse_length(x, y);
        let shrink = T::select(sticks, one, self.radius * inverse);
        let along = x * d.x + y * d.y;
        // Sticking, p follows x; sliding, only its component across p, shrunk.
        let across = along * inverse;
        let lost = T::select(sticks, zero, across * across);
        (-(shrink * along), r * shrink * (d.x * d.x + d.y * d.y - lost))
    }

    /// How far the centre is from the impulse, squared: over the squared penalty it is the velocity by which the law is
    /// violated, when sliding the slip times the angle by which friction is misdirected.
    #[inline(always)]
    pub fn squared_error(&self, law: &FrictionLaw<T>) -> T {
        let off = law.scaled(&Vector2::new(self.value.x - self.centre.x, self.value.y - self.centre.y));
        off.x * off.x + off.y * off.y
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = select(lanes, &self.value, &self.centre);
        // The velocity still says what the multiplier does now: both together would make what sticks slip.
        self.held = lanes & sticks(&self.centre, self.radius);
    }

    /// The alpha at which the slip gamma + alpha rate is least; not a number if it does not change, or has no friction.
    #[inline(always)]
    pub fn kink(&self, law: &FrictionLaw<T>, gamma: &Vector2<T>, rate: &Vector2<T>) -> T {
        let (slip, d) = (law.scaled(gamma), law.scaled(rate));
        let kink = -(slip.x * d.x + slip.y * d.y) / (d.x * d.x + d.y * d.y);
        T::select(T::zero().lt(self.radius), kink, T::splat(f64::NAN))
    }
}

/// Whether friction p in a disc is certainly that of a contact that sticks: its radius may be that of another normal
/// impulse.
#[inline(always)]
fn sticks<T: Real>(p: &Vector2<T>, radius: T) -> T::Mask {
    (p.x * p.x + p.y * p.y).le(T::splat(STICKS) * radius * radius)
}

const STICKS: f64 = 0.98;

/// Coefficient of friction below which there is none: quotients of two that are larger are numbers.
const LEAST_COEFFICIENT: f64 = 1e-100;

/// Squared impulse below which there is none \[N^2 s^2\].
const TINY: f64 = 1e-200;
