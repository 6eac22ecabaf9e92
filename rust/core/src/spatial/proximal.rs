//! The set-valued laws of a stage in proximal form, around given multipliers.
//!
//! P = prox_C(P_centre - r gamma) is the gradient of a smooth convex function of the velocity gamma; its
//! derivative is a generalised Hessian of rank one or two. Around the multiplier zero it is the law with a compliance 1/r; the
//! same r for all contacts selects (T 4.78 != D43) the shortest of all impulses that move the robot alike.

use nalgebra::{Vector2, Vector3};

use crate::math::{Mask, Real};

use super::screw::Screw;
use super::sweep::DriveModel;
use super::{StageDrive, StagePeg};

/// Unilateral contact: P = max(centre - r (gamma + offset), 0).
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactTerm<T: Real> {
    offset: T,
    penalty: T,
    centre: T,
    /// Whether the contact counts as closed whatever its velocity: one for yes, zero for no.
    held: T::Mask,
    pub value: T,
}

/// Friction in an ellipse, in coordinates in which it is the unit disc: gamma^ = A gamma, the impulse is A p, and
/// p = prox_disc(centre - r gamma^ / max(a)^2). A zero axis is harmless.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionTerm<T: Real> {
    /// Semi-axes of the ellipse \[N s\].
    pub axes: Vector2<T>,
    penalty: T,
    /// Penalty in scaled coordinates, r / max(a)^2.
    scaled_penalty: T,
    /// The multiplier, and the same in scaled coordinates.
    centre: Vector2<T>,
    scaled_centre: Vector2<T>,
    /// P \[N s\].
    pub value: Vector2<T>,
    /// Semi-axes to return to.
    remembered: Vector2<T>,
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

/// The actuator of one joint axis, D = clamp(drive - stiffness phi').
#[derive(Debug, Clone, Copy)]
pub(super) struct DriveTerm<T> {
    data: StageDrive<T>,
    pub value: T,
}

impl<T: Real> ContactTerm<T> {
    #[inline(always)]
    pub fn new(offset: T, penalty: T, impulse: T) -> Self {
        Self { offset, penalty, centre: T::zero(), held: T::zero().lt(impulse), value: T::zero() }
    }

    /// Moves to the velocity gamma; returns the present stiffness.
    #[inline(always)]
    pub fn respond(&mut self, gamma: T) -> T {
        let wanted = self.centre - self.penalty * (gamma + self.offset);
        self.value = T::select(self.held, wanted, wanted.max(T::zero()));
        T::select(T::zero().lt(wanted) | self.held, self.penalty, T::zero())
    }

    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// First and second derivative of the law's function at gamma + alpha rate by alpha.
    #[inline(always)]
    pub fn along(&self, gamma: T, rate: T, alpha: T) -> (T, T) {
        let wanted = self.centre - self.penalty * (gamma + self.offset + alpha * rate);
        let penalty = T::select(T::zero().lt(wanted), self.penalty, T::zero());
        (-wanted.max(T::zero()) * rate, penalty * rate * rate)
    }

    /// How far the centre is from the impulse, squared: over the squared penalty it is the velocity by which the law is
    /// violated.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let x = self.value - self.centre;
        x * x
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = T::select(lanes, self.value, self.centre);
    }
}

impl<T: Real> FrictionTerm<T> {
    /// `penalty` is the stiffness of sticking along the stronger axis \[kg\]. A contact whose friction was `impulse`,
    /// within the ellipse, counts as sticking until it is released.
    #[inline(always)]
    pub fn new(axes: Vector2<T>, penalty: T, impulse: &Vector2<T>) -> Self {
        let none = Vector2::new(T::zero(), T::zero());
        let mut term = Self {
            axes,
            penalty,
            scaled_penalty: T::zero(),
            centre: none,
            scaled_centre: none,
            value: none,
            remembered: axes,
            held: T::Mask::of(|_| false),
        };
        let inverse = inverses(&axes);
        term.held = sticks(&Vector2::new(impulse.x * inverse.x, impulse.y * inverse.y));
        term.resize(axes);
        term
    }

    /// From now on the contact sticks or slips as its velocity says.
    #[inline(always)]
    pub fn release(&mut self) {
        self.held = T::Mask::of(|_| false);
    }

    /// Takes new semi-axes.
    #[inline(always)]
    pub fn resize(&mut self, axes: Vector2<T>) {
        self.axes = axes;
        let inverse = inverses(&axes);
        let of_longer = T::select(axes.x.lt(axes.y), inverse.y, inverse.x);
        self.scaled_penalty = self.penalty * (of_longer * of_longer);
        self.scaled_centre = Vector2::new(self.centre.x * inverse.x, self.centre.y * inverse.y);
    }

    #[inline(always)]
    pub fn remember(&mut self) {
        self.remembered = self.axes;
    }

    /// Takes the remembered semi-axes back.
    #[inline(always)]
    pub fn restore(&mut self, lanes: T::Mask) {
        self.resize(select(lanes, &self.remembered, &self.axes));
    }

    /// A fraction of the way from the remembered semi-axes to the present ones in the given lanes, in others the
    /// remembered ones.
    #[inline(always)]
    pub fn move_part_way(&mut self, fraction: T, lanes: T::Mask) {
        let (old, new) = (self.remembered, self.axes);
        let there = Vector2::new(old.x + fraction * (new.x - old.x), old.y + fraction * (new.y - old.y));
        self.resize(select(lanes, &there, &old));
    }

    /// Moves to the slip velocity gamma; returns the stiffness r A D A with D = I when sticking,
    /// (I - p p^T) / |x| when sliding.
    #[inline(always)]
    pub fn respond(&mut self, gamma: &Vector2<T>) -> Stiffness<T> {
        let one = T::splat(1.0);
        let a = self.axes;
        let (rax, ray) = (self.scaled_penalty * a.x, self.scaled_penalty * a.y);
        let (x, y) = (self.scaled_centre.x - rax * gamma.x, self.scaled_centre.y - ray * gamma.y);
        let squared = x * x + y * y;
        let shrink = T::select(self.held, one, one / squared.max(one).sqrt());
        let (px, py) = (x * shrink, y * shrink);
        self.value = Vector2::new(a.x * px, a.y * py);
        let sticks = squared.le(one) | self.held;
        let slide_x = py * shrink;
        Stiffness {
            xx: rax * a.x * T::select(sticks, one, py * slide_x),
            xy: -(rax * a.y * T::select(sticks, T::zero(), px * slide_x)),
            yy: ray * a.y * T::select(sticks, one, px * px * shrink),
        }
    }

    /// First and second derivative of the law's function at gamma + alpha rate by alpha.
    #[inline(always)]
    pub fn along(&self, gamma: &Vector2<T>, rate: &Vector2<T>, alpha: T) -> (T, T) {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let (a, r) = (self.axes, self.scaled_penalty);
        let (dx, dy) = (a.x * rate.x, a.y * rate.y);
        let x = self.scaled_centre.x - r * (a.x * gamma.x + alpha * dx);
        let y = self.scaled_centre.y - r * (a.y * gamma.y + alpha * dy);
        let squared = x * x + y * y;
        let shrink = one / squared.max(one).sqrt();
        let along = (x * dx + y * dy) * shrink;
        // Sticking, p follows x; sliding, only its component across p, shrunk.
        let lost = T::select(squared.le(one), zero, along * along);
        (-along, r * shrink * (dx * dx + dy * dy - lost))
    }

    /// How far the centre is from the impulse, squared: over the squared penalty it is the velocity by which the law is
    /// violated, when sliding the slip times the angle by which friction is misdirected.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let (x, y) = (self.value.x - self.centre.x, self.value.y - self.centre.y);
        x * x + y * y
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = select(lanes, &self.value, &self.centre);
        self.resize(self.axes);
        // The velocity still says what the multiplier does now: both together would make what sticks slip.
        self.held = lanes & sticks(&self.scaled_centre);
    }

    /// The alpha at which the slip gamma + alpha rate is least; not a number if it does not change.
    #[inline(always)]
    pub fn kink(&self, gamma: &Vector2<T>, rate: &Vector2<T>) -> T {
        let a = self.axes;
        let (dx, dy) = (a.x * rate.x, a.y * rate.y);
        -(a.x * gamma.x * dx + a.y * gamma.y * dy) / (dx * dx + dy * dy)
    }
}

impl<T: Real> DriveTerm<T> {
    #[inline(always)]
    pub fn new(data: &StageDrive<T>) -> Self {
        Self { data: *data, value: T::zero() }
    }

    /// No actuator at all.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        Self::new(&StageDrive { drive: zero, stiffness: zero, limit: zero })
    }

    /// Moves to the joint rate.
    #[inline(always)]
    pub fn respond(&mut self, rate: T) -> DriveModel<T> {
        let (wanted, free) = self.wanted(rate);
        self.value = clamp(wanted, self.data.limit);
        DriveModel { stiffness: T::select(free, self.data.stiffness, T::zero()), value: self.value }
    }

    /// First and second derivative of the law's function at rate + alpha change by alpha.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        let (wanted, free) = self.wanted(rate + alpha * change);
        let stiffness = T::select(free, self.data.stiffness, T::zero());
        (-clamp(wanted, self.data.limit) * change, stiffness * change * change)
    }

    /// The drive without limit, and whether the limit allows it.
    #[inline(always)]
    fn wanted(&self, rate: T) -> (T, T::Mask) {
        let wanted = self.data.drive - self.data.stiffness * rate;
        (wanted, wanted.abs().le(self.data.limit))
    }
}

/// A peg's contact together with its direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct PegTerm<T: Real> {
    pub link: usize,
    pub direction: Screw<T>,
    pub contact: ContactTerm<T>,
}

impl<T: Real> PegTerm<T> {
    #[inline(always)]
    pub fn new(peg: &StagePeg<T>, penalty: T, impulse: T) -> Self {
        Self { link: peg.link, direction: peg.direction, contact: ContactTerm::new(peg.offset, penalty, impulse) }
    }
}

/// Whether friction in the unit disc is certainly that of a contact that sticks: its radius may be that of another
/// normal impulse.
#[inline(always)]
fn sticks<T: Real>(p: &Vector2<T>) -> T::Mask {
    (p.x * p.x + p.y * p.y).lt(T::splat(STICKS))
}

const STICKS: f64 = 0.98;

#[inline(always)]
fn clamp<T: Real>(x: T, limit: T) -> T {
    x.min(limit).max(-limit)
}

/// `yes` in the given lanes, elsewhere `no`.
#[inline(always)]
pub(super) fn select<T: Real>(lanes: T::Mask, yes: &Vector2<T>, no: &Vector2<T>) -> Vector2<T> {
    Vector2::new(T::select(lanes, yes.x, no.x), T::select(lanes, yes.y, no.y))
}

/// 1 / a for both semi-axes, or 0 for one that is none; divisions are dear.
#[inline(always)]
fn inverses<T: Real>(a: &Vector2<T>) -> Vector2<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let (has_x, has_y) = (T::splat(SHORTEST_AXIS).lt(a.x), T::splat(SHORTEST_AXIS).lt(a.y));
    let (x, y) = (T::select(has_x, a.x, one), T::select(has_y, a.y, one));
    let inverse = one / (x * y);
    Vector2::new(T::select(has_x, y * inverse, zero), T::select(has_y, x * inverse, zero))
}

/// Semi-axis below which there is no friction \[N s\]: products of two that are longer are numbers.
const SHORTEST_AXIS: f64 = 1e-100;

/// (x, y) of a vector.
#[inline(always)]
pub(super) fn horizontal<T: Real>(v: &Vector3<T>) -> Vector2<T> {
    Vector2::new(v.x, v.y)
}
