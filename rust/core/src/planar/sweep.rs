//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! Unknowns are the velocity p of the free end of link 1 and the angular velocities omega_i. Link i
//! has the joint velocity p_i at its near end, so that its CG moves with p_i + omega_i (L/2) e_y and
//! its far end with p_{i+1} = p_i + omega_i L e_y. Given the minimum V_{i+1}(p_{i+1}, omega_i) of all
//! that lies behind, a quadratic of three variables, minimising over omega_i is one scalar pivot and
//! leaves V_i(p_i, omega_{i-1}) of the same form: the recursion of linear-quadratic control.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::{Heading, Twist};

/// Quadratic model of one link and the joint before it, in the link's twist:
/// `g . x + x^T H x / 2 + k (omega_i - omega_{i-1})^2 / 2`.
#[derive(Debug, Clone, Copy)]
pub struct LinkModel {
    pub heading: Heading,
    pub half_length: f64,
    pub hessian: Matrix3<f64>,
    pub gradient: Twist,
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

/// V(p, omega) = p^T pp p / 2 + omega pw . p + ww omega^2 / 2 + gp . p + gw omega.
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

    /// The same value seen from the near end: p_far = p_near + omega `arm`.
    fn carried_along(&self, arm: Vector2<f64>) -> Value {
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
    fn value(&self) -> Value {
        let h = &self.hessian;
        Value {
            pp: h.fixed_view::<2, 2>(0, 0).into_owned(),
            pw: Vector2::new(h.m13, h.m23),
            ww: h.m33,
            gp: self.gradient.xy(),
            gw: self.gradient.z,
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
        let own = link.value().carried_along(arm);
        let total = own.plus(&behind.carried_along(arm * 2.0));
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

impl Default for Elimination {
    fn default() -> Self {
        Self { feedback: Vector2::zeros(), previous: 0.0, constant: 0.0 }
    }
}
