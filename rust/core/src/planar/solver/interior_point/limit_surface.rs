//! Friction of the ground on one link as a second-order cone: slip (t, gamma^) with t >= |gamma^| and impulse
//! (1, p) with |p| <= 1, in coordinates in which the limit surface is the unit ball. That of a link is a disc: its third axis,
//! the moment, is zero.
//!
//! Nesterov and Todd's scaling W, with W z = W^-1 s = lambda, makes slip and impulse look alike. It is
//! `W = eta [w_0, w_1^T; w_1, I + w_1 w_1^T / (1 + w_0)]` with w_0^2 = 1 + |w_1|^2.

use nalgebra::{Matrix3, Vector3, Vector4};

use crate::planar::solver::sweep::Quadratic;
use crate::planar::{Heading, Stage};

/// A point (head, tail) of the space in which the cone is head >= |tail|.
type Point = Vector4<f64>;

#[derive(Debug, Clone, Copy)]
pub(super) struct SurfaceCone {
    /// t and gamma^: upper bound of the dissipation, and the slip it bounds \[J\].
    t: f64,
    slip: Vector3<f64>,
    /// p.
    impulse: Vector3<f64>,
    scaling: Scaling,
    /// Right-hand side of the linearised complementarity, W^-1 (lambda \ ...).
    right: Point,
    /// The last direction.
    ds: Point,
    dz: Point,
}

/// What the ground can do to a link, or to what can be pushed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground {
    heading: Heading,
    /// Semi-axes of the limit surface \[N s\], \[N m s\].
    axes: Vector3<f64>,
    /// That bounds the stiffness of sticking.
    softness: f64,
}

impl Ground {
    pub fn of(stage: &Stage, node: usize) -> Self {
        let link = &stage.links[node];
        let axes = if node < stage.chain() { link.friction.push(0.0) } else { stage.limit_surface(node) };
        let largest = axes.x.max(axes.y);
        Self { heading: link.heading, axes, softness: largest * largest / (STIFFEST_FRICTION * link.mass) }
    }

    pub fn has_friction(&self) -> bool {
        self.axes.x.max(self.axes.y) > 0.0
    }
}

/// eta and w of the scaling, and the scaled point.
#[derive(Debug, Clone, Copy)]
struct Scaling {
    eta: f64,
    w: Point,
    lambda: Point,
}

impl SurfaceCone {
    pub fn new() -> Self {
        let scaling = Scaling { eta: 1.0, w: Point::x(), lambda: Point::x() };
        let zero = Vector3::zeros();
        let nothing = Point::zeros();
        Self { t: 1.0, slip: zero, impulse: zero, scaling, right: nothing, ds: nothing, dz: nothing }
    }

    /// No impulse, at the velocity `u`; `mu` is the energy by which t exceeds the slip.
    pub fn begin(&mut self, on: &Ground, u: &Vector3<f64>, mu: f64) {
        self.slip = slip(on, u);
        self.t = self.slip.norm() + mu;
        self.impulse = Vector3::zeros();
    }

    /// s . z, what this law adds to the duality gap \[J\].
    pub fn gap(&self) -> f64 {
        self.t + self.slip.dot(&self.impulse)
    }

    /// Scales, and targets the boundary (the affine direction).
    pub fn aim_affine(&mut self) {
        let (s, z) = (self.s(), self.z());
        self.scaling = Scaling::between(&s, &z);
        self.right = -self.scaling.unscale(&self.scaling.lambda);
    }

    /// Targets the central path's point `mu`, with Mehrotra's correction for the last direction.
    pub fn aim_central(&mut self, mu: f64) {
        let Scaling { lambda, .. } = self.scaling;
        let (ds, dz) = (self.scaling.unscale(&self.ds), self.scaling.scale(&self.dz));
        let target = Point::new(mu, 0.0, 0.0, 0.0) - product(&ds, &dz);
        self.right = self.scaling.unscale(&(divide(&lambda, &target) - lambda));
    }

    /// Targets the central path's point `mu`, to first order.
    pub fn aim_centre(&mut self, mu: f64) {
        let Scaling { lambda, .. } = self.scaling;
        self.right = self.scaling.unscale(&(divide(&lambda, &Point::new(mu, 0.0, 0.0, 0.0)) - lambda));
    }

    /// Adds the linearised law to the link's quadratic model, in its frame.
    pub fn condense(&self, on: &Ground, model: &mut Quadratic<f64>) {
        let a = on.axes;
        let impulse = (self.impulse + self.forced(on.softness)).component_mul(&a);
        let stiffness = self.stiffness(on.softness);
        model.subtract_force(&impulse);
        model.xx += a.x * a.x * stiffness[(0, 0)];
        model.xy += a.x * a.y * stiffness[(0, 1)];
        model.yy += a.y * a.y * stiffness[(1, 1)];
        model.xw += a.x * a.z * stiffness[(0, 2)];
        model.yw += a.y * a.z * stiffness[(1, 2)];
        model.ww += a.z * a.z * stiffness[(2, 2)];
    }

    /// The direction that belongs to the change `du` of the link's velocity.
    pub fn follow(&mut self, on: &Ground, du: &Vector3<f64>) {
        let change = slip(on, du);
        let dp = self.forced(on.softness) - self.stiffness(on.softness) * change;
        let Scaling { eta, w, .. } = self.scaling;
        // Row 0 of Delta z = right - W^-2 Delta s, where z_0 stays 1.
        let (head, tail) = (2.0 * w.x * w.x - 1.0, tail(&w) * (-2.0 * w.x));
        let dt = (self.right.x * eta * eta - tail.dot(&change)) / head;
        self.ds = Point::new(dt, change.x, change.y, change.z);
        self.dz = Point::new(0.0, dp.x, dp.y, dp.z);
    }

    /// Longest step along the direction that stays in both cones.
    pub fn longest_step(&self) -> f64 {
        longest_step(&self.s(), &self.ds).min(longest_step(&self.z(), &self.dz))
    }

    /// s . z after a step `alpha` \[J\].
    pub fn gap_after(&self, alpha: f64) -> f64 {
        (self.s() + self.ds * alpha).dot(&(self.z() + self.dz * alpha))
    }

    /// Takes the step; the slip is that of the new velocity `u`.
    pub fn advance(&mut self, on: &Ground, alpha: f64, u: &Vector3<f64>) {
        self.t += alpha * self.ds.x;
        self.slip = slip(on, u);
        self.impulse += tail(&self.dz) * alpha;
        // Round-off must not push the point out of the cone.
        self.t = self.t.max(self.slip.norm() * (1.0 + ROUND_OFF) + f64::MIN_POSITIVE);
        let norm = self.impulse.norm();
        if norm > 1.0 - ROUND_OFF {
            self.impulse *= (1.0 - ROUND_OFF) / norm;
        }
    }

    /// Force and moment \[N s\], \[N m s\].
    pub fn impulse(&self, on: &Ground) -> Vector3<f64> {
        self.impulse.component_mul(&on.axes)
    }

    fn s(&self) -> Point {
        Point::new(self.t, self.slip.x, self.slip.y, self.slip.z)
    }

    fn z(&self) -> Point {
        Point::new(1.0, self.impulse.x, self.impulse.y, self.impulse.z)
    }

    /// Delta p per -Delta gamma^: W^-2 without its row 0, `(I - 2 w_1 w_1^T / (1 + 2 |w_1|^2)) / eta^2`, in series
    /// with `softness`.
    fn stiffness(&self, softness: f64) -> Matrix3<f64> {
        let across = 1.0 / (self.scaling.eta * self.scaling.eta);
        let tail = tail(&self.scaling.w);
        let along = across / (1.0 + 2.0 * tail.norm_squared());
        let in_series = |k: f64| k / (1.0 + softness * k);
        let direction = if tail == Vector3::zeros() { tail } else { tail.normalize() };
        let (across, along) = (in_series(across), in_series(along));
        Matrix3::identity() * across + direction * direction.transpose() * (along - across)
    }

    /// Delta p at Delta gamma^ = 0.
    fn forced(&self, softness: f64) -> Vector3<f64> {
        let w = &self.scaling.w;
        let free = tail(&self.right) + tail(w) * (2.0 * w.x * self.right.x / (2.0 * w.x * w.x - 1.0));
        let across = 1.0 / (self.scaling.eta * self.scaling.eta);
        let tail = tail(w);
        let along = across / (1.0 + 2.0 * tail.norm_squared());
        let direction = if tail == Vector3::zeros() { tail } else { tail.normalize() };
        let forward = direction * direction.dot(&free);
        (free - forward) / (1.0 + softness * across) + forward / (1.0 + softness * along)
    }
}

impl Scaling {
    fn between(s: &Point, z: &Point) -> Self {
        let (s_size, z_size) = (size(s), size(z));
        let (s_unit, z_unit) = (s / s_size, z / z_size);
        let gamma = (0.5 * (1.0 + s_unit.dot(&z_unit))).sqrt();
        let w = (s_unit + reflect(&z_unit)) / (2.0 * gamma);
        let mut scaling = Self { eta: (s_size / z_size).sqrt(), w, lambda: *z };
        scaling.lambda = scaling.scale(z);
        scaling
    }

    /// W x.
    fn scale(&self, x: &Point) -> Point {
        rotate(&self.w, x) * self.eta
    }

    /// W^-1 x.
    fn unscale(&self, x: &Point) -> Point {
        rotate(&reflect(&self.w), x) / self.eta
    }
}

/// The hyperbolic rotation `[w_0, w_1^T; w_1, I + w_1 w_1^T / (1 + w_0)] x`.
fn rotate(w: &Point, x: &Point) -> Point {
    let along = tail(w).dot(&tail(x));
    let rotated = tail(x) + tail(w) * (x.x + along / (1.0 + w.x));
    Point::new(w.x * x.x + along, rotated.x, rotated.y, rotated.z)
}

fn tail(x: &Point) -> Vector3<f64> {
    Vector3::new(x.y, x.z, x.w)
}

fn reflect(x: &Point) -> Point {
    Point::new(x.x, -x.y, -x.z, -x.w)
}

/// sqrt(x_0^2 - |x_1|^2), the distance from the cone's boundary.
fn size(x: &Point) -> f64 {
    let norm = tail(x).norm();
    ((x.x - norm) * (x.x + norm)).max(f64::MIN_POSITIVE).sqrt()
}

/// Jordan's product a o b of the cone.
fn product(a: &Point, b: &Point) -> Point {
    let across = tail(b) * a.x + tail(a) * b.x;
    Point::new(a.dot(b), across.x, across.y, across.z)
}

/// The d with lambda o d = x.
fn divide(lambda: &Point, x: &Point) -> Point {
    let norm = tail(lambda).norm();
    let determinant = ((lambda.x - norm) * (lambda.x + norm)).max(f64::MIN_POSITIVE);
    let head = (lambda.x * x.x - tail(lambda).dot(&tail(x))) / determinant;
    let across = (tail(x) - tail(lambda) * head) / lambda.x;
    Point::new(head, across.x, across.y, across.z)
}

/// Longest alpha for which x + alpha d lies in the cone.
fn longest_step(x: &Point, d: &Point) -> f64 {
    let a = d.x * d.x - tail(d).norm_squared();
    let b = x.x * d.x - tail(x).dot(&tail(d));
    let c = size(x).powi(2);
    let discriminant = b * b - a * c;
    // The first positive root of a alpha^2 + 2 b alpha + c, in the form without cancellation.
    let root = if discriminant < 0.0 || (a >= 0.0 && b >= 0.0) {
        f64::INFINITY
    } else if b < 0.0 {
        c / (-b + discriminant.sqrt())
    } else {
        -(b + discriminant.sqrt()) / a
    };
    if d.x < 0.0 { root.min(-x.x / d.x) } else { root }
}

/// gamma^ = A R^T u.
fn slip(on: &Ground, u: &Vector3<f64>) -> Vector3<f64> {
    let velocity = on.heading.to_link(u.xy());
    velocity.push(u.z).component_mul(&on.axes)
}

/// Largest stiffness of friction, in link masses: it keeps the linear systems solvable.
const STIFFEST_FRICTION: f64 = 1e12;

/// Relative distance kept from the boundary of the cones.
const ROUND_OFF: f64 = 1e-15;
