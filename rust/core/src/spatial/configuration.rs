//! The chain in coordinates in which joints cannot open: pose of link 1 and joint angles.

use nalgebra::Vector3;

use crate::math::{Laned, Real};
use crate::robot::{Axes, Robot};
use crate::stepping::{MAX_RATE, MAX_SPEED};

use super::spatial_vector::{SpatialVector, Twist, along, combined, cross, scaled, sum};
use super::{Pose, StageLink, hinge_directions};

/// What the places of the links depend on besides the configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainShape<T = f64> {
    /// Distances of each CG from the joints in front of the link and behind it \[m\].
    pub arms: Vec<[T; 2]>,
    pub axes: Vec<Axes>,
}

impl<T: Real> ChainShape<T> {
    pub fn new(robot: &Robot) -> Self {
        Self { arms: robot.links.iter().map(|link| link.arms().map(T::splat)).collect(), axes: robot.axes.clone() }
    }
}

/// Pose of link 1 and joint angles: all values are admissible, and joints stay closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration<T = f64> {
    /// CG of link 1, frame I \[m\].
    pub position: Vector3<T>,
    /// Unit quaternion of link 1, R_B^I: w, x, y, z.
    pub orientation: [T; 4],
    /// (phi_h, phi_v) of each joint, zero about an axis that it does not have \[rad\].
    pub angle: Vec<[T; 2]>,
    /// Centre of each obstacle that can be pushed, and its turn about the vertical \[m\], \[rad\].
    pub moved: Vec<SpatialVector<T>>,
}

/// Velocity: the twist of link 1, frame I, and the joint rates.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainVelocity<T = f64> {
    pub head: Twist<T>,
    /// (phi_h', phi_v') of each joint \[rad/s\].
    pub rate: Vec<[T; 2]>,
    /// Of each obstacle that can be pushed.
    pub moved: Vec<Twist<T>>,
}

/// Where a link is, frame I.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<T = f64> {
    /// CG \[m\].
    pub position: Vector3<T>,
    /// e_x^B, e_y^B, e_z^B.
    pub axes: [Vector3<T>; 3],
}

/// Where the centre line of a link is, frame I: all that contacts with its surface depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkAxis<T = f64> {
    /// CG \[m\].
    pub position: Vector3<T>,
    /// e_z^B.
    pub axis: Vector3<T>,
}

impl<T: Real> Configuration<T> {
    /// Link 1 at the origin, frame B parallel to frame I, all joints straight.
    pub fn straight(links: usize) -> Self {
        let (zero, one) = (T::zero(), T::splat(1.0));
        Self {
            position: Vector3::new(zero, zero, zero),
            orientation: [one, zero, zero, zero],
            angle: vec![[zero; 2]; links - 1],
            moved: Vec::new(),
        }
    }

    /// The same among so many obstacles that can be pushed.
    pub fn among(self, movables: usize) -> Self {
        Self { moved: vec![SpatialVector::zero(); movables], ..self }
    }

    pub fn copy_from(&mut self, other: &Self) {
        self.position = other.position;
        self.orientation = other.orientation;
        self.angle.copy_from_slice(&other.angle);
        self.moved.copy_from_slice(&other.moved);
    }

    /// Takes the configuration that `base` reaches with the constant velocity `velocity` within `duration`.
    ///
    /// Link 1 turns by the exponential of the angular velocity; the quaternion is put back on the unit sphere, so that
    /// round-off does not add up.
    #[inline(always)]
    pub fn travel(&mut self, base: &Self, velocity: &ChainVelocity<T>, duration: T) {
        self.position = along(&base.position, &velocity.head.linear, duration);
        let turn = scaled(&velocity.head.angular, duration);
        self.orientation = normalised(&product(&exponential(&turn), &base.orientation));
        for (angle, (base, rate)) in self.angle.iter_mut().zip(base.angle.iter().zip(&velocity.rate)) {
            *angle = [base[0] + duration * rate[0], base[1] + duration * rate[1]];
        }
        for (moved, (base, u)) in self.moved.iter_mut().zip(base.moved.iter().zip(&velocity.moved)) {
            *moved = base.plus_scaled(u, duration);
        }
    }

    /// Where all links are. A cardan joint turns about the near link's e_y, then about the far link's e_x
    /// (T 4.92)-(T 4.94).
    #[inline(always)]
    pub fn place_links(&self, shape: &ChainShape<T>, frames: &mut [Frame<T>]) {
        let arms = &shape.arms;
        let mut frame = Frame { position: self.position, axes: rotation(&self.orientation) };
        frames[0] = frame;
        for (i, (angle, axes)) in self.angle.iter().zip(&shape.axes).enumerate() {
            let joint = along(&frame.position, &frame.axes[2], arms[i][1]);
            for (axis, angle) in angle.iter().enumerate().filter(|(axis, _)| axes.has(*axis)) {
                frame.axes = turned(*axes, axis, &frame.axes, angle.sin_cos());
            }
            frame.position = along(&joint, &frame.axes[2], arms[i + 1][0]);
            frames[i + 1] = frame;
        }
    }
}

impl<T: Real> ChainVelocity<T> {
    pub fn rest(links: usize) -> Self {
        Self { head: Twist::zero(), rate: vec![[T::zero(); 2]; links - 1], moved: Vec::new() }
    }

    /// The same among so many obstacles that can be pushed.
    pub fn among(self, movables: usize) -> Self {
        Self { moved: vec![SpatialVector::zero(); movables], ..self }
    }

    pub fn copy_from(&mut self, other: &Self) {
        self.head = other.head;
        self.rate.copy_from_slice(&other.rate);
        self.moved.copy_from_slice(&other.moved);
    }

    /// Takes u + factor (v - u).
    #[inline(always)]
    pub fn blend(&mut self, u: &Self, v: &Self, factor: T) {
        let rest = T::splat(1.0) - factor;
        self.head = u.head.scaled(rest).plus_scaled(&v.head, factor);
        for (rate, (u, v)) in self.rate.iter_mut().zip(u.rate.iter().zip(&v.rate)) {
            *rate = [rest * u[0] + factor * v[0], rest * u[1] + factor * v[1]];
        }
        for (moved, (u, v)) in self.moved.iter_mut().zip(u.moved.iter().zip(&v.moved)) {
            *moved = u.scaled(rest).plus_scaled(v, factor);
        }
    }

    /// Twists of all links placed at `frames`, and behind them of what can be pushed.
    #[inline(always)]
    pub fn twists(&self, frames: &[Frame<T>], shape: &ChainShape<T>, twist: &mut [Twist<T>]) {
        let arms = &shape.arms;
        twist[0] = self.head;
        for (i, (rate, axes)) in self.rate.iter().zip(&shape.axes).enumerate() {
            let (near, far) = (&frames[i], &frames[i + 1]);
            let before = twist[i];
            let joint = before.velocity_at(&scaled(&near.axes[2], arms[i][1]));
            let [first, second] = hinge_directions(*axes, &near.axes, &far.axes);
            let angular = along(&along(&before.angular, &first, rate[0]), &second, rate[1]);
            let linear = sum(&joint, &cross(&angular, &scaled(&far.axes[2], arms[i + 1][0])));
            twist[i + 1] = Twist { linear, angular };
        }
        twist[frames.len()..].copy_from_slice(&self.moved);
    }
}

impl ChainVelocity {
    /// Whether the velocity is finite, and that of a robot rather than of a diverged computation.
    pub fn is_plausible(&self) -> bool {
        let Twist { linear, angular } = &self.head;
        let turns = self.rate.iter().flatten().chain(angular.iter());
        let moved = self.moved.iter().all(|u| u.linear.amax() < MAX_SPEED && u.angular.amax() < MAX_RATE);
        linear.iter().all(|v| v.abs() < MAX_SPEED) && turns.into_iter().all(|omega| omega.abs() < MAX_RATE) && moved
    }
}

impl LinkAxis {
    pub fn of(pose: &Pose) -> Self {
        Self { position: pose.position, axis: pose.axis() }
    }

    /// A line without a length.
    pub fn at(position: &Vector3<f64>) -> Self {
        Self { position: *position, axis: Vector3::x() }
    }
}

impl<T: Real> Frame<T> {
    /// The centre line of a lane's link.
    pub fn axis_of(&self, lane: usize) -> LinkAxis {
        LinkAxis { position: self.position.lane(lane), axis: self.axes[2].lane(lane) }
    }

    pub fn origin() -> Self {
        let (zero, one) = (T::zero(), T::splat(1.0));
        Self {
            position: Vector3::new(zero, zero, zero),
            axes: [Vector3::new(one, zero, zero), Vector3::new(zero, one, zero), Vector3::new(zero, zero, one)],
        }
    }

    /// Height of the front (0) or rear (1) sphere's lowest point \[m\] (T 4.8).
    #[inline(always)]
    pub fn ground_gap(&self, link: &StageLink<T>, end: usize) -> T {
        self.position.z + link.spheres()[end] * self.axes[2].z - link.radius
    }
}

/// Columns of the rotation matrix of a unit quaternion.
#[inline(always)]
pub fn rotation<T: Real>(q: &[T; 4]) -> [Vector3<T>; 3] {
    let [w, x, y, z] = *q;
    let (one, two) = (T::splat(1.0), T::splat(2.0));
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        Vector3::new(one - two * (yy + zz), two * (x * y + w * z), two * (x * z - w * y)),
        Vector3::new(two * (x * y - w * z), one - two * (xx + zz), two * (y * z + w * x)),
        Vector3::new(two * (x * z + w * y), two * (y * z - w * x), one - two * (xx + yy)),
    ]
}

/// Axes of a link that is turned about one axis of a joint: e_y, e_x, or the hinge's own; given sine and cosine.
#[inline(always)]
fn turned<T: Real>(axes: Axes, axis: usize, near: &[Vector3<T>; 3], (sin, cos): (T, T)) -> [Vector3<T>; 3] {
    let [x, y, z] = near;
    match axes {
        Axes::About(own) => turned_about(&own.map(T::splat), near, (sin, cos)),
        _ if axis == 0 => [along(&scaled(x, cos), z, -sin), *y, along(&scaled(z, cos), x, sin)],
        _ => [*x, along(&scaled(y, cos), z, sin), along(&scaled(z, cos), y, -sin)],
    }
}

/// The same about the unit vector `axis` along these axes.
#[inline(always)]
fn turned_about<T: Real>(axis: &[T; 3], near: &[Vector3<T>; 3], (sin, cos): (T, T)) -> [Vector3<T>; 3] {
    let [a, b, c] = *axis;
    let rest = T::splat(1.0) - cos;
    let (ab, bc, ca) = (rest * a * b, rest * b * c, rest * c * a);
    [
        combined(near, &[cos + rest * a * a, ab + sin * c, ca - sin * b]),
        combined(near, &[ab - sin * c, cos + rest * b * b, bc + sin * a]),
        combined(near, &[ca + sin * b, bc - sin * a, cos + rest * c * c]),
    ]
}

/// Quaternion of the rotation about and by the vector `turn` \[rad\].
#[inline(always)]
fn exponential<T: Real>(turn: &Vector3<T>) -> [T; 4] {
    let half = T::splat(0.5);
    let squared = turn.x * turn.x + turn.y * turn.y + turn.z * turn.z;
    let angle = squared.sqrt();
    let (sin, cos) = (half * angle).sin_cos();
    let series = half - squared / T::splat(48.0);
    let factor = T::select(squared.lt(T::splat(SMALL)), series, sin / angle);
    [cos, factor * turn.x, factor * turn.y, factor * turn.z]
}

#[inline(always)]
fn product<T: Real>(p: &[T; 4], q: &[T; 4]) -> [T; 4] {
    let [a, b, c, d] = *p;
    let [w, x, y, z] = *q;
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

#[inline(always)]
fn normalised<T: Real>(q: &[T; 4]) -> [T; 4] {
    let [w, x, y, z] = *q;
    let inverse = T::splat(1.0) / (w * w + x * x + y * y + z * z).sqrt();
    [w * inverse, x * inverse, y * inverse, z * inverse]
}

/// Squared angle below which the series is exact to round-off.
const SMALL: f64 = 1e-6;
