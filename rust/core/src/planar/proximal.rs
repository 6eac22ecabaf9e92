//! The set-valued laws of a stage in proximal form, around given multipliers, in the link's frame.
//!
//! P = prox_C(P_centre - r gamma) is the gradient of a smooth convex function of the velocity gamma; its
//! derivative is a generalised Hessian of rank one or two.

use nalgebra::{Vector2, Vector3};

use crate::math::{Real, dot};

use super::sweep::Quadratic;
use super::{StageContact, StageJoint, StageLink};

/// Which smooth piece of a law answers: the one that the last impulses lay on, or the one at the present velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Piece {
    Last,
    Present,
}

/// Friction of one link in coordinates in which its ellipse is the unit disc: gamma^ = A gamma with
/// A = diag(a_x, a_y), the impulse is A p, and p = prox_disc(centre - r gamma^). A zero axis is harmless.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionTerm<T> {
    axes: Vector2<T>,
    penalty: T,
    centre: Vector2<T>,
    value: Vector2<T>,
}

/// One link-peg contact: P = max(centre - r gamma, 0).
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactTerm<T> {
    pub link: usize,
    direction: Vector3<T>,
    offset: T,
    penalty: T,
    centre: T,
    value: T,
}

/// The actuator of one joint, D = clamp(y - prox_S(y)) with y = drive - stiffness omega_J and S = [-slack, slack],
/// which needs no multiplier.
#[derive(Debug, Clone, Copy)]
pub(super) struct DriveTerm<T> {
    joint: StageJoint<T>,
    pub value: T,
}

impl<T: Real> FrictionTerm<T> {
    /// `penalty` is the stiffness of sticking along the stronger axis \[kg\].
    #[inline(always)]
    pub fn new(link: &StageLink<T>, impulse: &Vector2<T>, penalty: T) -> Self {
        let a = link.friction;
        let largest = a.x.max(a.y);
        let penalty = ratio(penalty, largest * largest);
        let centre = Vector2::new(ratio(impulse.x, a.x), ratio(impulse.y, a.y));
        Self { axes: a, penalty, centre, value: centre }
    }

    /// P_T \[N s\].
    #[inline(always)]
    pub fn impulse(&self) -> Vector2<T> {
        Vector2::new(self.axes.x * self.value.x, self.axes.y * self.value.y)
    }

    /// Moves to the slip velocity (u.x, u.y) and adds gradient and Hessian to `model`.
    ///
    /// The Hessian is r A D A with D = I when sticking, (I - p p^T) / |x| when sliding.
    #[inline(always)]
    pub fn respond(&mut self, u: &Vector3<T>, model: &mut Quadratic<T>) {
        let one = T::splat(1.0);
        let a = self.axes;
        let (rax, ray) = (self.penalty * a.x, self.penalty * a.y);
        let x = self.centre.x - rax * u.x;
        let y = self.centre.y - ray * u.y;
        let squared = x * x + y * y;
        let shrink = one / squared.max(one).sqrt();
        let (px, py) = (x * shrink, y * shrink);
        self.value = Vector2::new(px, py);
        let sticks = squared.le(one);
        let slide_x = py * shrink;
        model.xx += rax * a.x * T::select(sticks, one, py * slide_x);
        model.xy -= rax * a.y * T::select(sticks, T::zero(), px * slide_x);
        model.yy += ray * a.y * T::select(sticks, one, px * px * shrink);
        model.gx -= a.x * px;
        model.gy -= a.y * py;
    }

    /// First and second derivative of the law's function at u + alpha du by alpha.
    #[inline(always)]
    pub fn along(&self, u: &Vector3<T>, du: &Vector3<T>, alpha: T) -> (T, T) {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let a = self.axes;
        let (dx, dy) = (a.x * du.x, a.y * du.y);
        let x = self.centre.x - self.penalty * (a.x * u.x + alpha * dx);
        let y = self.centre.y - self.penalty * (a.y * u.y + alpha * dy);
        let squared = x * x + y * y;
        let shrink = one / squared.max(one).sqrt();
        let along = (x * dx + y * dy) * shrink;
        // Sticking, p follows x; sliding, only its component across p, shrunk.
        let lost = T::select(squared.le(one), zero, along * along);
        (-along, self.penalty * shrink * (dx * dx + dy * dy - lost))
    }

    /// The alpha at which |centre - r A (u + alpha du)| is least; not a number if du is zero.
    #[inline(always)]
    pub fn kink(&self, u: &Vector3<T>, du: &Vector3<T>) -> T {
        let a = self.axes;
        let (dx, dy) = (a.x * du.x, a.y * du.y);
        let x = self.centre.x - self.penalty * a.x * u.x;
        let y = self.centre.y - self.penalty * a.y * u.y;
        (x * dx + y * dy) / (self.penalty * (dx * dx + dy * dy))
    }

    /// Square of how far the velocity is from obeying the law because the centre is not yet the value.
    ///
    /// Sticking, the constraint is violated by |P - P_centre| / r. Sliding at speed gamma, the friction's
    /// direction is off by |P - P_centre| / (r gamma), which changes the link's velocity by that angle
    /// times a / m, but by no more than gamma itself.
    #[inline(always)]
    pub fn squared_error(&self, u: &Vector3<T>, mass: T) -> T {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let (x, y) = (self.value.x - self.centre.x, self.value.y - self.centre.y);
        let largest = self.axes.x.max(self.axes.y);
        let velocity = ratio(T::splat(1.0), self.penalty * largest);
        let violation = (x * x + y * y) * (velocity * velocity);
        let slides = T::splat(1.0 - 1e-9).lt(self.value.x * self.value.x + self.value.y * self.value.y);
        let squared_speed = u.x * u.x + u.y * u.y;
        let amplification = T::select(slides, (largest * largest / (mass * mass * squared_speed)).max(one), one);
        let bound = T::select(slides, squared_speed, T::splat(f64::INFINITY));
        // A link without friction has no violation, however slowly it moves.
        T::select(zero.lt(violation), (violation * amplification).min(bound), zero)
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre.x = T::select(lanes, self.value.x, self.centre.x);
        self.centre.y = T::select(lanes, self.value.y, self.centre.y);
    }
}

impl<T: Real> ContactTerm<T> {
    /// `penalty` is the stiffness of the closed contact \[kg\].
    #[inline(always)]
    pub fn new(contact: &StageContact<T>, link: &StageLink<T>, impulse: T, penalty: T) -> Self {
        let in_plane = link.heading.to_link(contact.direction.xy());
        Self {
            link: contact.link,
            direction: Vector3::new(in_plane.x, in_plane.y, contact.direction.z),
            offset: contact.offset,
            penalty,
            centre: impulse,
            value: impulse,
        }
    }

    /// P_H \[N s\].
    #[inline(always)]
    pub fn impulse(&self) -> T {
        self.value
    }

    /// Moves to the twist u and adds gradient and Hessian to `model`.
    #[inline(always)]
    pub fn respond(&mut self, piece: Piece, u: &Vector3<T>, model: &mut Quadratic<T>) {
        let wanted = self.centre - self.penalty * (dot(&self.direction, u) + self.offset);
        let closed = T::zero().lt(if piece == Piece::Last { self.centre } else { wanted });
        self.value = T::select(closed, wanted, T::zero());
        let penalty = T::select(closed, self.penalty, T::zero());
        model.add_rank_one(&self.direction, penalty, -self.value);
    }

    /// First and second derivative of the law's function at u + alpha du by alpha.
    #[inline(always)]
    pub fn along(&self, u: &Vector3<T>, du: &Vector3<T>, alpha: T) -> (T, T) {
        let rate = dot(&self.direction, du);
        let wanted = self.centre - self.penalty * (dot(&self.direction, u) + self.offset + alpha * rate);
        let penalty = T::select(T::zero().lt(wanted), self.penalty, T::zero());
        (-wanted.max(T::zero()) * rate, penalty * rate * rate)
    }

    /// Square of the violation |P - P_centre| / r.
    #[inline(always)]
    pub fn squared_error(&self) -> T {
        let violation = (self.value - self.centre) / self.penalty;
        violation * violation
    }

    #[inline(always)]
    pub fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
    }

    #[inline(always)]
    pub fn recentre(&mut self, lanes: T::Mask) {
        self.centre = T::select(lanes, self.value, self.centre);
    }
}

impl<T: Real> DriveTerm<T> {
    #[inline(always)]
    pub fn new(joint: &StageJoint<T>, impulse: T) -> Self {
        Self { joint: *joint, value: impulse }
    }

    /// No actuator at all.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        Self::new(&StageJoint { drive: zero, stiffness: zero, limit: zero, slack: zero }, zero)
    }

    /// Moves to the joint rate omega_J; returns the drive's present stiffness.
    #[inline(always)]
    pub fn respond(&mut self, piece: Piece, rate: T) -> T {
        let (wanted, answers) = self.wanted(rate);
        let (asked, within) = match piece {
            Piece::Last => (self.value, self.value.abs().lt(T::splat(BELOW_LIMIT) * self.joint.limit)),
            Piece::Present => (wanted, wanted.abs().le(self.joint.limit)),
        };
        self.value = T::select(within, wanted, clamp(asked, self.joint.limit));
        T::select(within & answers, self.joint.stiffness, T::zero())
    }

    /// First and second derivative of the law's function at omega_J + alpha change by alpha.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        let (wanted, answers) = self.wanted(rate + alpha * change);
        let free = answers & wanted.abs().le(self.joint.limit);
        let stiffness = T::select(free, self.joint.stiffness, T::zero());
        (-clamp(wanted, self.joint.limit) * change, stiffness * change * change)
    }

    /// The drive without limit, and whether the play lets it answer to the rate.
    #[inline(always)]
    fn wanted(&self, rate: T) -> (T, T::Mask) {
        let tight = self.joint.drive - self.joint.stiffness * rate;
        let wanted = tight - clamp(tight, self.joint.slack);
        (wanted, self.joint.slack.le(tight.abs()))
    }
}

#[inline(always)]
fn clamp<T: Real>(x: T, limit: T) -> T {
    x.min(limit).max(-limit)
}

/// p / a, or 0 along a zero axis.
#[inline(always)]
fn ratio<T: Real>(p: T, a: T) -> T {
    T::select(T::zero().lt(a), p / a, T::zero())
}

/// Share of the torque limit up to which the last drive was within it: forces carry round-off from stage to stage.
const BELOW_LIMIT: f64 = 1.0 - 1e-9;
