//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! Unknowns are the velocity p of the free end of link 1 and the angular velocities omega_i. Link i
//! has the joint velocity p_i at its near end, so that its CG moves with p_i + omega_i (L/2) e_y and
//! its far end with p_{i+1} = p_i + omega_i L e_y. Given the minimum V_{i+1}(p_{i+1}, omega_i) of all
//! that lies behind, a quadratic of three variables, minimising over omega_i is one scalar pivot and
//! leaves V_i(p_i, omega_{i-1}) of the same form: the recursion of linear-quadratic control.

use nalgebra::{Matrix2, Vector2};

use super::{Heading, Twist};

/// Quadratic model of one link and the joint before it, in the link's twist x = (v_x, v_y, omega):
/// `g . x + x^T H x / 2 + k (omega_i - omega_{i-1})^2 / 2`.
#[derive(Debug, Clone, Copy)]
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
/// `omega_i = feedback . p_i + previous * omega_{i-1} + constant`.
#[derive(Debug, Clone, Copy)]
pub struct Elimination {
    feedback: Vector2<f64>,
    previous: f64,
    constant: f64,
}

/// V(p, omega): a quadratic of the velocity p of a point and an angular velocity.
#[derive(Clone, Copy)]
struct Value {
    pp: Matrix2<f64>,
    pw: Vector2<f64>,
    ww: f64,
    gp: Vector2<f64>,
    gw: f64,
}

impl Value {
    const ZERO: Value = Value {
        pp: Matrix2::new(0.0, 0.0, 0.0, 0.0),
        pw: Vector2::new(0.0, 0.0),
        ww: 0.0,
        gp: Vector2::new(0.0, 0.0),
        gw: 0.0,
    };

    /// The same value seen from another point: p = p_new + omega `arm`.
    fn seen_from(&self, arm: Vector2<f64>) -> Value {
        let pp_arm = self.pp * arm;
        Value {
            pp: self.pp,
            pw: self.pw + pp_arm,
            ww: self.ww + arm.dot(&(self.pw * 2.0 + pp_arm)),
            gp: self.gp,
            gw: self.gw + arm.dot(&self.gp),
        }
    }

    fn plus(&self, other: &Value) -> Value {
        Value {
            pp: self.pp + other.pp,
            pw: self.pw + other.pw,
            ww: self.ww + other.ww,
            gp: self.gp + other.gp,
            gw: self.gw + other.gw,
        }
    }
}

impl LinkModel {
    /// Adds `force w . x + penalty (w . x)^2 / 2`.
    pub fn add_rank_one(&mut self, w: &Twist, penalty: f64, force: f64) {
        let pw = w * penalty;
        self.xx += pw.x * w.x;
        self.xy += pw.x * w.y;
        self.yy += pw.y * w.y;
        self.xw += pw.x * w.z;
        self.yw += pw.y * w.z;
        self.ww += pw.z * w.z;
        self.gx += force * w.x;
        self.gy += force * w.y;
        self.gw += force * w.z;
    }

    /// The model as a function of the CG's velocity and omega.
    fn value(&self) -> Value {
        Value {
            pp: Matrix2::new(self.xx, self.xy, self.xy, self.yy),
            pw: Vector2::new(self.xw, self.yw),
            ww: self.ww,
            gp: Vector2::new(self.gx, self.gy),
            gw: self.gw,
        }
    }

    fn arm(&self) -> Vector2<f64> {
        self.heading.lateral() * self.half_length
    }
}

/// Minimises the sum of all link models over the motions the joints allow; writes the twists.
pub fn minimise(links: &[LinkModel], eliminations: &mut [Elimination], twist: &mut [Twist]) {
    let head = eliminate(links, eliminations);
    let p = -solve_symmetric(&head.pp, head.gp);
    substitute(links, eliminations, p, twist);
}

/// From tail to head; returns V_1(p).
fn eliminate(links: &[LinkModel], eliminations: &mut [Elimination]) -> Value {
    let mut behind = Value::ZERO;
    for (link, elimination) in links.iter().zip(eliminations).rev() {
        let arm = link.arm();
        // Far end to CG, add the link, CG to near end.
        let total = behind.seen_from(arm).plus(&link.value()).seen_from(arm);
        let k = link.stiffness;
        let pivot = total.ww + k;
        let feedback = total.pw / pivot;
        let constant = total.gw / pivot;
        behind = Value {
            pp: total.pp - total.pw * feedback.transpose(),
            pw: feedback * k,
            ww: total.ww * k / pivot,
            gp: total.gp - total.pw * constant,
            gw: k * constant,
        };
        *elimination = Elimination { feedback: -feedback, previous: k / pivot, constant: -constant };
    }
    behind
}

/// From head to tail.
fn substitute(links: &[LinkModel], eliminations: &[Elimination], head: Vector2<f64>, twist: &mut [Twist]) {
    let (mut p, mut omega) = (head, 0.0);
    for ((link, e), twist) in links.iter().zip(eliminations).zip(twist) {
        omega = e.feedback.dot(&p) + e.previous * omega + e.constant;
        let half_way = link.arm() * omega;
        let v = p + half_way;
        *twist = Twist::new(v.x, v.y, omega);
        p = v + half_way;
    }
}

fn solve_symmetric(a: &Matrix2<f64>, b: Vector2<f64>) -> Vector2<f64> {
    let determinant = a.m11 * a.m22 - a.m12 * a.m12;
    Vector2::new(a.m22 * b.x - a.m12 * b.y, a.m11 * b.y - a.m12 * b.x) / determinant
}

impl Default for LinkModel {
    fn default() -> Self {
        let heading = Heading { cos: 1.0, sin: 0.0 };
        let (xx, yy, ww) = (1.0, 1.0, 1.0);
        let (xy, xw, yw, gx, gy, gw) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        Self { heading, half_length: 0.0, xx, xy, yy, xw, yw, ww, gx, gy, gw, stiffness: 0.0 }
    }
}

impl Default for Elimination {
    fn default() -> Self {
        Self { feedback: Vector2::zeros(), previous: 0.0, constant: 0.0 }
    }
}
