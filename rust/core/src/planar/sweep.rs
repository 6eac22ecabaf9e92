//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! Unknowns are the velocity p of the free end of link 1 and the angular velocities omega_i. Link i
//! has the joint velocity p_i at its near end, so that its CG moves with p_i + omega_i (L/2) e_y and
//! its far end with p_{i+1} = p_i + omega_i L e_y. Given the minimum V_{i+1}(p_{i+1}, omega_i) of all
//! that lies behind, a quadratic of three variables, minimising over omega_i is one scalar pivot and
//! leaves V_i(p_i, omega_{i-1}) of the same form: the recursion of linear-quadratic control.

use nalgebra::Vector3;

use crate::math::Real;

use super::Heading;

/// Quadratic model of one link and the joint before it, in the link's twist x = (v_x, v_y, omega):
/// `g . x + x^T H x / 2 + k (omega_i - omega_{i-1})^2 / 2`.
#[derive(Debug, Clone, Copy)]
pub struct LinkModel<T> {
    pub heading: Heading<T>,
    pub half_length: T,
    /// The symmetric H.
    pub xx: T,
    pub xy: T,
    pub yy: T,
    pub xw: T,
    pub yw: T,
    pub ww: T,
    /// g.
    pub gx: T,
    pub gy: T,
    pub gw: T,
    /// Stiffness k of the joint before this link; zero for the first.
    pub stiffness: T,
}

/// What eliminating omega_i leaves behind for the back substitution:
/// `omega_i = px p_x + py p_y + previous omega_{i-1} + constant`.
#[derive(Debug, Clone, Copy)]
pub struct Elimination<T> {
    px: T,
    py: T,
    previous: T,
    constant: T,
}

/// V(p, omega): a quadratic of the velocity p of a point and an angular velocity, as in [`LinkModel`].
#[derive(Clone, Copy)]
struct Value<T> {
    xx: T,
    xy: T,
    yy: T,
    xw: T,
    yw: T,
    ww: T,
    gx: T,
    gy: T,
    gw: T,
}

impl<T: Real> Elimination<T> {
    pub fn zero() -> Self {
        let zero = T::zero();
        Self { px: zero, py: zero, previous: zero, constant: zero }
    }
}

impl<T: Real> Value<T> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = T::zero();
        Self { xx: zero, xy: zero, yy: zero, xw: zero, yw: zero, ww: zero, gx: zero, gy: zero, gw: zero }
    }

    /// The same value seen from another point: p = p_new + omega (ax, ay).
    #[inline(always)]
    fn seen_from(self, ax: T, ay: T) -> Self {
        let px = self.xx * ax + self.xy * ay;
        let py = self.xy * ax + self.yy * ay;
        Value {
            xw: self.xw + px,
            yw: self.yw + py,
            ww: self.ww + ax * (self.xw + self.xw + px) + ay * (self.yw + self.yw + py),
            gw: self.gw + ax * self.gx + ay * self.gy,
            ..self
        }
    }

    /// Adds a link's own model at its CG.
    #[inline(always)]
    fn plus(self, link: &LinkModel<T>) -> Self {
        Value {
            xx: self.xx + link.xx,
            xy: self.xy + link.xy,
            yy: self.yy + link.yy,
            xw: self.xw + link.xw,
            yw: self.yw + link.yw,
            ww: self.ww + link.ww,
            gx: self.gx + link.gx,
            gy: self.gy + link.gy,
            gw: self.gw + link.gw,
        }
    }

    /// Minimises over omega with the spring k (omega - omega_before)^2 / 2 added; what is left is a
    /// function of p and omega_before.
    #[inline(always)]
    fn eliminate(self, k: T) -> (Elimination<T>, Self) {
        let inverse = T::splat(1.0) / (self.ww + k);
        let (px, py, constant, previous) = (self.xw * inverse, self.yw * inverse, self.gw * inverse, k * inverse);
        let left = Value {
            xx: self.xx - self.xw * px,
            xy: self.xy - self.xw * py,
            yy: self.yy - self.yw * py,
            xw: px * k,
            yw: py * k,
            ww: self.ww * previous,
            gx: self.gx - self.xw * constant,
            gy: self.gy - self.yw * constant,
            gw: k * constant,
        };
        (Elimination { px: -px, py: -py, previous, constant: -constant }, left)
    }

    /// The p that minimises V(p, 0).
    #[inline(always)]
    fn minimiser(&self) -> (T, T) {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        let x = (self.xy * self.gy - self.yy * self.gx) / determinant;
        let y = (self.xy * self.gx - self.xx * self.gy) / determinant;
        (x, y)
    }
}

impl<T: Real> LinkModel<T> {
    pub fn zero() -> Self {
        let zero = T::zero();
        Self {
            heading: Heading { cos: T::splat(1.0), sin: zero },
            half_length: zero,
            xx: zero,
            xy: zero,
            yy: zero,
            xw: zero,
            yw: zero,
            ww: zero,
            gx: zero,
            gy: zero,
            gw: zero,
            stiffness: zero,
        }
    }

    /// Adds `force w . x + penalty (w . x)^2 / 2`.
    #[inline(always)]
    pub fn add_rank_one(&mut self, w: &Vector3<T>, penalty: T, force: T) {
        let (px, py, pz) = (penalty * w.x, penalty * w.y, penalty * w.z);
        self.xx += px * w.x;
        self.xy += px * w.y;
        self.yy += py * w.y;
        self.xw += px * w.z;
        self.yw += py * w.z;
        self.ww += pz * w.z;
        self.gx += force * w.x;
        self.gy += force * w.y;
        self.gw += force * w.z;
    }

    /// (L/2) e_y: velocity of the far end relative to the CG for omega = 1.
    #[inline(always)]
    fn arm(&self) -> (T, T) {
        (-self.heading.sin * self.half_length, self.heading.cos * self.half_length)
    }
}

/// Minimises the sum of all link models over the motions the joints allow; writes the twists.
#[inline(always)]
pub fn minimise<T: Real>(links: &[LinkModel<T>], eliminations: &mut [Elimination<T>], twist: &mut [Vector3<T>]) {
    let p = eliminate(links, eliminations).minimiser();
    substitute(links, eliminations, p, twist);
}

/// From tail to head; returns V_1(p).
#[inline(always)]
fn eliminate<T: Real>(links: &[LinkModel<T>], eliminations: &mut [Elimination<T>]) -> Value<T> {
    let mut value = Value::zero();
    for (link, elimination) in links.iter().zip(eliminations).rev() {
        // From the far end to the CG, the link itself, and on to the near end.
        let (ax, ay) = link.arm();
        let total = value.seen_from(ax, ay).plus(link).seen_from(ax, ay);
        (*elimination, value) = total.eliminate(link.stiffness);
    }
    value
}

/// From head to tail.
#[inline(always)]
fn substitute<T: Real>(
    links: &[LinkModel<T>],
    eliminations: &[Elimination<T>],
    head: (T, T),
    twist: &mut [Vector3<T>],
) {
    let ((mut px, mut py), mut omega) = (head, T::zero());
    for ((link, e), twist) in links.iter().zip(eliminations).zip(twist) {
        omega = e.px * px + e.py * py + e.previous * omega + e.constant;
        let (ax, ay) = link.arm();
        *twist = Vector3::new(px + ax * omega, py + ay * omega, omega);
        px = twist.x + ax * omega;
        py = twist.y + ay * omega;
    }
}
