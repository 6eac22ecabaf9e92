//! Friction of a stage in proximal form: ellipses of one shape, whose size follows the normal impulses.

use nalgebra::Vector2;

use crate::laws::{Disc, DiscEvaluation, Halves, Symmetric2};
use crate::math::{Mask, Real, select_into};

use super::progress::PassLanes;
use super::ray_laws::RayLaws;

/// What the friction laws of a stage share: the shape of the ellipse, its size but for the normal impulse, and the
/// penalty.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionLaw<T> {
    /// Semi-axes over the longer one, S, and their inverses, zero for an axis that is none.
    pub shape: Vector2<T>,
    inverse_shape: Vector2<T>,
    /// Longer semi-axis over the normal impulse \[-\].
    pub strength: T,
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
    /// Whether the contact counts as sticking whatever its velocity.
    held: T::Mask,
}

/// How friction varies: -dp/dgamma^, and its change by that of the radius, zero where the next step keeps that.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionTangent<T> {
    pub stiffness: Symmetric2<T>,
    pub by_radius: Vector2<T>,
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
        Self { radius, centre: none, value: none, held: sticks(&p, radius) }
    }

    #[inline(always)]
    fn disc(&self) -> Disc<T> {
        Disc { radius: self.radius }
    }

    /// A contact in the air: it has no impulse, and no multiplier in the lanes `recentred`.
    #[inline(always)]
    pub fn vanish(&mut self, recentred: T::Mask) {
        self.value = Vector2::new(T::zero(), T::zero());
        select_into(&mut self.centre, recentred, &self.value);
    }

    /// From now on the contact sticks or slips as its velocity determines.
    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// Takes the `wanted` radius where it differs by no more than `most`; returns how far it is from it otherwise.
    #[inline(always)]
    pub fn follow(&mut self, wanted: T, most: T) -> T {
        let change = (wanted - self.radius).abs();
        let follows = change.le(most);
        self.radius = T::select(follows, wanted, self.radius);
        T::select(follows, T::zero(), change)
    }

    /// Decides anew, in these halves, whether a contact whose friction was `impulse` sticks until it is released.
    #[inline(always)]
    pub fn hold(&mut self, halves: impl Halves, law: &FrictionLaw<T>, impulse: &Vector2<T>) {
        let p = Vector2::new(law.inverse_shape.x * impulse.x, law.inverse_shape.y * impulse.y);
        self.held = sticks(&halves.in_disc(&p), self.radius);
    }

    /// Moves to the slip gamma^. The radius is `error` short of that of its normal impulse, as [`Self::follow`] has it;
    /// multipliers have moved since, after which that radius is `wanted`, negative under an impulse that pulls.
    #[inline(always)]
    pub fn evaluate<const RECENTRING: bool>(
        &mut self,
        halves: impl Halves,
        law: &FrictionLaw<T>,
        gamma: &Vector2<T>,
        (error, wanted): (T, T),
        lanes: &PassLanes<T>,
    ) -> FrictionTangent<T> {
        let (r, zero) = (law.penalty, T::zero());
        let x = Vector2::new(r.subtract_from(gamma.x, self.centre.x), r.subtract_from(gamma.y, self.centre.y));
        let side = halves.side(x.x);
        let evaluation = self.disc().evaluate_held(&halves.scaled(&x, side), self.held);
        let DiscEvaluation { value, jacobian, by_radius } = halves.out_of_disc(evaluation, side);
        self.value = value;
        let stiffness = Symmetric2 { xx: r * jacobian.xx, xy: r * jacobian.xy, yy: r * jacobian.yy };
        if RECENTRING {
            self.recentre_here(halves, gamma, &stiffness, lanes.recentred);
        }
        let change = T::select(lanes.extrapolated, wanted - self.radius, zero);
        self.value.x = change.mul_add(by_radius.x, self.value.x);
        self.value.y = change.mul_add(by_radius.y, self.value.y);
        let follows = lanes.extrapolated | (lanes.following & error.le(zero));
        let by_radius = Vector2::new(T::select(follows, by_radius.x, zero), T::select(follows, by_radius.y, zero));
        FrictionTangent { stiffness, by_radius }
    }

    /// Adds the law at gamma^ + alpha rate.
    #[inline(always)]
    pub fn add_along(
        &self,
        halves: impl Halves,
        law: &FrictionLaw<T>,
        gamma: &Vector2<T>,
        rate: &Vector2<T>,
        ray: &mut RayLaws<T>,
    ) {
        let r = law.penalty;
        let x = Vector2::new(r.subtract_from(gamma.x, self.centre.x), r.subtract_from(gamma.y, self.centre.y));
        ray.add_friction(halves, self.radius, &x, rate, r);
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
    fn recentre_here(&mut self, halves: impl Halves, gamma: &Vector2<T>, stiffness: &Symmetric2<T>, lanes: T::Mask) {
        select_into(&mut self.centre, lanes, &halves.gradient(&self.value));
        let Symmetric2 { xx, xy, yy } = *stiffness;
        let value = Vector2::new(
            xy.subtract_from(gamma.y, xx.subtract_from(gamma.x, self.value.x)),
            yy.subtract_from(gamma.y, xy.subtract_from(gamma.x, self.value.y)),
        );
        select_into(&mut self.value, lanes, &value);
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
