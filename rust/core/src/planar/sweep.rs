//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! Unknowns are the velocity p of the free end of link 1 and the angular velocities omega_i. Link i
//! has the joint velocity p_i at its near end, so that its CG moves with p_i + omega_i (L/2) e_y and
//! its far end with p_{i+1} = p_i + omega_i L e_y. Given the minimum V_{i+1}(p_{i+1}, omega_i) of all
//! that lies behind, a quadratic of three variables, minimising over omega_i is one scalar pivot and
//! leaves V_i(p_i, omega_{i-1}) of the same form: the recursion of linear-quadratic control.

use super::{Heading, Twist};

/// Quadratic model of one link and the joint before it, in the link's twist x = (v_x, v_y, omega):
/// `g . x + x^T H x / 2 + k (omega_i - omega_{i-1})^2 / 2`.
#[derive(Debug, Clone, Copy, Default)]
pub struct LinkModel {
    pub heading: Heading,
    pub half_length: f64,
    /// The symmetric H.
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
    pub xw: f64,
    pub yw: f64,
    pub ww: f64,
    /// g.
    pub gx: f64,
    pub gy: f64,
    pub gw: f64,
    /// Stiffness k of the joint before this link; zero for the first.
    pub stiffness: f64,
}

/// What eliminating omega_i leaves behind for the back substitution:
/// `omega_i = px p_x + py p_y + previous omega_{i-1} + constant`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Elimination {
    px: f64,
    py: f64,
    previous: f64,
    constant: f64,
}

/// V(p, omega): a quadratic of the velocity p of a point and an angular velocity, as in [`LinkModel`].
#[derive(Clone, Copy, Default)]
struct Value {
    xx: f64,
    xy: f64,
    yy: f64,
    xw: f64,
    yw: f64,
    ww: f64,
    gx: f64,
    gy: f64,
    gw: f64,
}

impl Value {
    /// The same value seen from another point: p = p_new + omega (ax, ay).
    #[inline]
    fn seen_from(self, ax: f64, ay: f64) -> Value {
        let px = self.xx * ax + self.xy * ay;
        let py = self.xy * ax + self.yy * ay;
        Value {
            xw: self.xw + px,
            yw: self.yw + py,
            ww: self.ww + ax * (2.0 * self.xw + px) + ay * (2.0 * self.yw + py),
            gw: self.gw + ax * self.gx + ay * self.gy,
            ..self
        }
    }

    /// Adds a link's own model at its CG.
    #[inline]
    fn plus(self, link: &LinkModel) -> Value {
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
    #[inline]
    fn eliminate(self, k: f64) -> (Elimination, Value) {
        let inverse = 1.0 / (self.ww + k);
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
    fn minimiser(&self) -> (f64, f64) {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        let x = (self.xy * self.gy - self.yy * self.gx) / determinant;
        let y = (self.xy * self.gx - self.xx * self.gy) / determinant;
        (x, y)
    }
}

impl LinkModel {
    /// Adds `force w . x + penalty (w . x)^2 / 2`.
    pub fn add_rank_one(&mut self, w: &Twist, penalty: f64, force: f64) {
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
    #[inline]
    fn arm(&self) -> (f64, f64) {
        (-self.heading.sin * self.half_length, self.heading.cos * self.half_length)
    }
}

/// Minimises the sum of all link models over the motions the joints allow; writes the twists.
pub fn minimise(links: &[LinkModel], eliminations: &mut [Elimination], twist: &mut [Twist]) {
    let p = eliminate(links, eliminations).minimiser();
    substitute(links, eliminations, p, twist);
}

/// From tail to head; returns V_1(p).
fn eliminate(links: &[LinkModel], eliminations: &mut [Elimination]) -> Value {
    let mut value = Value::default();
    for (link, elimination) in links.iter().zip(eliminations).rev() {
        // From the far end to the CG, the link itself, and on to the near end.
        let (ax, ay) = link.arm();
        let total = value.seen_from(ax, ay).plus(link).seen_from(ax, ay);
        (*elimination, value) = total.eliminate(link.stiffness);
    }
    value
}

/// From head to tail.
fn substitute(links: &[LinkModel], eliminations: &[Elimination], head: (f64, f64), twist: &mut [Twist]) {
    let ((mut px, mut py), mut omega) = (head, 0.0);
    for ((link, e), twist) in links.iter().zip(eliminations).zip(twist) {
        omega = e.px * px + e.py * py + e.previous * omega + e.constant;
        let (ax, ay) = link.arm();
        *twist = Twist::new(px + ax * omega, py + ay * omega, omega);
        px = twist.x + ax * omega;
        py = twist.y + ay * omega;
    }
}
