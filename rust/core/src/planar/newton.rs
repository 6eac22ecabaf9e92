//! Solver of a stage: method of multipliers outside, semismooth Newton inside.
//!
//! Around the multipliers of the last stage, each set-valued law is replaced by its proximal form
//! P = prox_C(P_centre - r gamma), which is the gradient of a smooth convex function of gamma (the
//! augmented Lagrangian). The inner problem is then strongly convex with a piecewise smooth gradient:
//! Newton's method on it, one O(n) [`sweep`](super::sweep) a step and a search along the
//! [`Ray`](super::ray::Ray) that brackets the zero of the slope, converges from anywhere. Moving the
//! centre to the new impulses and repeating is the proximal point method on the dual, which converges
//! whether or not the impulses are unique.
//! Friction is treated in coordinates in which its ellipse is the unit disc; a zero axis is harmless.
//!
//! Several robots are solved side by side: a lane that has converged keeps its velocities and impulses
//! while the others go on, so that each takes exactly the steps it would take alone.

use nalgebra::{Vector2, Vector3};

use crate::math::{Mask, Real};

use super::ray::Ray;
use super::sweep::{Elimination, LinkModel, minimise};
use super::{Stage, StageLink, StageSolution};

/// How a solve ended, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Outcome<T: Real = f64> {
    /// Linear solves, a whole number.
    pub iterations: T,
    /// Whether the solver's own stopping rule was met; the certificate judges independently.
    pub converged: T::Mask,
}

/// The proximal form of one law: penalty r, centre, and its value at the present velocity.
///
/// Friction (`V` a vector) lives in the unit disc, contact (`V` a number) is an impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Proximal<T, V> {
    pub penalty: T,
    /// Square of the velocity \[m/s\] that belongs to a change of the value by 1 at this penalty.
    pub squared_velocity: T,
    pub centre: V,
    pub value: V,
}

impl<T: Real, V> Proximal<T, V> {
    #[inline(always)]
    fn stiffen(&mut self, factor: T) {
        self.penalty = self.penalty * factor;
        self.squared_velocity = self.squared_velocity / (factor * factor);
    }
}

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton<T = f64> {
    friction: Vec<Proximal<T, Vector2<T>>>,
    contact: Vec<Proximal<T, T>>,
    models: Vec<LinkModel<T>>,
    eliminations: Vec<Elimination<T>>,
    direction: Vec<Vector3<T>>,
    start: Vec<Vector3<T>>,
    ray: Ray<T>,
    /// Mass of the lightest link.
    lightest: T,
    /// How much the penalties have been raised during this solve.
    stiffening: T,
}

impl<T: Real> Newton<T> {
    pub fn new(links: usize) -> Self {
        let zero = T::zero();
        let nothing = Vector2::new(zero, zero);
        let at_rest = Vector3::new(zero, zero, zero);
        Self {
            friction: vec![Proximal { penalty: zero, squared_velocity: zero, centre: nothing, value: nothing }; links],
            contact: Vec::with_capacity(links),
            models: vec![LinkModel::zero(); links],
            eliminations: vec![Elimination::zero(); links],
            direction: vec![at_rest; links],
            start: vec![at_rest; links],
            ray: Ray::with_capacity(links),
            lightest: zero,
            stiffening: T::splat(1.0),
        }
    }

    /// Solves `stage`, starting from the twists and impulses in `solution`, to velocities within
    /// about `tolerance` \[m/s\], in at most `max_iterations` linear solves.
    ///
    /// The starting twists need not satisfy the joints: the first link's twist and all angular
    /// velocities are kept and the rest follows. Lanes not in `lanes` are left as they are.
    #[inline(always)]
    pub fn solve(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        tolerance: f64,
        max_iterations: u32,
        lanes: T::Mask,
    ) -> Outcome<T> {
        self.warm_up(stage, solution);
        self.linearise(stage, solution);
        let tolerance = T::splat(tolerance);
        let mut outcome = Outcome { iterations: T::zero(), converged: T::Mask::of(|_| false) };
        let mut active = lanes;
        let mut last_error = T::splat(f64::INFINITY);
        for _ in 0..max_iterations {
            outcome.iterations += T::select(active, T::splat(1.0), T::zero());
            minimise(&self.models, &mut self.eliminations, &mut self.direction);
            let step = self.descend(stage, solution, active);
            let multiplier_error = self.multiplier_error(stage, &solution.twist);
            outcome.converged = outcome.converged | (active & step.le(tolerance) & multiplier_error.le(tolerance));
            // A step that is not finite ends its lane: it is below no bound.
            active = active & !outcome.converged & step.lt(T::splat(f64::INFINITY));
            if !active.any() {
                break;
            }
            let stubborn = T::splat(PATIENCE).lt(outcome.iterations);
            let accuracy = T::select(stubborn, T::splat(STRICT_ACCURACY), T::splat(INNER_ACCURACY));
            let settled = active & step.le(tolerance.max(accuracy * multiplier_error));
            if settled.any() {
                self.stiffen(settled & stubborn & (T::splat(SLOW_GAIN) * last_error).lt(multiplier_error));
                last_error = T::select(settled, multiplier_error, last_error);
                self.recentre(settled);
                self.linearise(stage, solution);
            }
        }
        self.write_impulses(stage, solution);
        outcome
    }

    /// Penalties, centres from the warm start, and twists that satisfy the joints.
    #[inline(always)]
    fn warm_up(&mut self, stage: &Stage<T>, solution: &mut StageSolution<T>) {
        for ((friction, link), impulse) in self.friction.iter_mut().zip(&stage.links).zip(&solution.friction) {
            let a = &link.friction;
            let centre = Vector2::new(ratio(impulse.x, a.x), ratio(impulse.y, a.y));
            let penalty = friction_penalty(link);
            let velocity = ratio(T::splat(1.0), penalty * a.x.max(a.y));
            *friction = Proximal { penalty, squared_velocity: velocity * velocity, centre, value: centre };
        }
        self.stiffening = T::splat(1.0);
        self.lightest = stage.links[0].mass;
        for link in &stage.links {
            self.lightest = self.lightest.min(link.mass);
        }
        self.contact.clear();
        for (contact, &impulse) in stage.contacts.iter().zip(&solution.contact) {
            let penalty = T::splat(PENALTY) * stage.links[contact.link].mass;
            let velocity = T::splat(1.0) / penalty;
            self.contact.push(Proximal {
                penalty,
                squared_velocity: velocity * velocity,
                centre: impulse,
                value: impulse,
            });
        }
        follow_joints(&stage.links, &mut solution.twist);
    }

    /// One damped Newton step, linearised at its end; returns its undamped length as a velocity \[m/s\].
    #[inline(always)]
    fn descend(&mut self, stage: &Stage<T>, solution: &mut StageSolution<T>, active: T::Mask) -> T {
        let slope = self.slope();
        self.start.copy_from_slice(&solution.twist);
        // A slope that is not negative is round-off: the lane is at its minimum and stays there.
        let descends = active & slope.lt(T::zero());
        // 0 * slope is 0, or NaN to show that the lane is lost.
        let stay = T::zero() * slope;
        let mut fraction = T::select(active, T::select(descends, T::splat(1.0), stay), T::zero());
        self.move_along(stage, solution, fraction);
        let overshoots = descends & (T::splat(OVERSHOOT) * -slope).lt(self.slope());
        if overshoots.any() {
            self.ray.cast(stage, &self.start, &self.direction, &self.friction, &self.contact);
            let damped = self.ray.zero_of_slope(slope, T::splat(OVERSHOOT), overshoots);
            fraction = T::select(overshoots, damped, fraction);
            self.move_along(stage, solution, fraction);
        }
        // Adding 0 * slope lets NaN and infinity through, which `max` would swallow.
        (-slope / self.lightest).max(T::zero()).sqrt() + T::zero() * slope
    }

    #[inline(always)]
    fn move_along(&mut self, stage: &Stage<T>, solution: &mut StageSolution<T>, fraction: T) {
        let still = fraction.le(T::zero());
        for ((u, start), du) in solution.twist.iter_mut().zip(&self.start).zip(&self.direction) {
            u.x = T::select(still, start.x, start.x + du.x * fraction);
            u.y = T::select(still, start.y, start.y + du.y * fraction);
            u.z = T::select(still, start.z, start.z + du.z * fraction);
        }
        self.linearise(stage, solution);
    }

    /// Derivative of the inner function along the direction where it was last linearised \[J\].
    #[inline(always)]
    fn slope(&self) -> T {
        let mut slope = T::zero();
        for (model, du) in self.models.iter().zip(&self.direction) {
            slope += model.gx * du.x + model.gy * du.y + model.gw * du.z;
        }
        slope
    }

    /// Impulses, gradient and generalised Hessian of the inner function at the present twists.
    #[inline(always)]
    fn linearise(&mut self, stage: &Stage<T>, solution: &mut StageSolution<T>) {
        let twist = &solution.twist;
        for (i, link) in stage.links.iter().enumerate() {
            self.models[i] = link_model(link, &twist[i], &mut self.friction[i]);
        }
        for (j, joint) in stage.joints.iter().enumerate() {
            let wanted = joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z);
            let drive = wanted.min(joint.limit).max(-joint.limit);
            solution.drive[j] = drive;
            self.models[j].gw += drive;
            self.models[j + 1].gw -= drive;
            let free = wanted.abs().le(joint.limit);
            self.models[j + 1].stiffness = T::select(free, joint.stiffness, T::zero());
        }
        for (contact, proximal) in stage.contacts.iter().zip(&mut self.contact) {
            let w = &contact.direction;
            let u = &twist[contact.link];
            let opening = w.x * u.x + w.y * u.y + w.z * u.z + contact.offset;
            let impulse = proximal.centre - proximal.penalty * opening;
            proximal.value = impulse.max(T::zero());
            let penalty = T::select(T::zero().lt(impulse), proximal.penalty, T::zero());
            self.models[contact.link].add_rank_one(w, penalty, -proximal.value);
        }
    }

    /// How far the velocities are from obeying the laws because the centres are not yet the
    /// impulses \[m/s\].
    ///
    /// Sticking or in contact, the constraint is violated by |P - P_centre| / r. Sliding at speed
    /// gamma, the friction's direction is off by |P - P_centre| / (r gamma), which changes the link's
    /// velocity by that angle times a / m, but by no more than gamma itself.
    #[inline(always)]
    fn multiplier_error(&self, stage: &Stage<T>, twist: &[Vector3<T>]) -> T {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let mut worst_squared = zero;
        for ((friction, link), u) in self.friction.iter().zip(&stage.links).zip(twist) {
            let (x, y) = (friction.value.x - friction.centre.x, friction.value.y - friction.centre.y);
            let violation = (x * x + y * y) * friction.squared_velocity;
            let slides =
                T::splat(1.0 - 1e-9).lt(friction.value.x * friction.value.x + friction.value.y * friction.value.y);
            let largest = link.friction.x.max(link.friction.y);
            let momentum = link.mass * link.mass * (u.x * u.x + u.y * u.y);
            let amplification = T::select(slides, (largest * largest / momentum).max(one), one);
            let speed = T::select(slides, u.x * u.x + u.y * u.y, T::splat(f64::INFINITY));
            // A link without friction has no violation, however slowly it moves.
            let error = T::select(zero.lt(violation), (violation * amplification).min(speed), zero);
            worst_squared = worst_squared.max(error);
        }
        for contact in &self.contact {
            let change = contact.value - contact.centre;
            worst_squared = worst_squared.max(change * change * contact.squared_velocity);
        }
        worst_squared.sqrt()
    }

    /// Raises the penalties tenfold, as far as round-off allows.
    #[inline(always)]
    fn stiffen(&mut self, lanes: T::Mask) {
        let lanes = lanes & self.stiffening.lt(T::splat(MAX_STIFFENING));
        let factor = T::select(lanes, T::splat(10.0), T::splat(1.0));
        self.stiffening = self.stiffening * factor;
        for friction in &mut self.friction {
            friction.stiffen(factor);
        }
        for contact in &mut self.contact {
            contact.stiffen(factor);
        }
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        for friction in &mut self.friction {
            friction.centre.x = T::select(lanes, friction.value.x, friction.centre.x);
            friction.centre.y = T::select(lanes, friction.value.y, friction.centre.y);
        }
        for contact in &mut self.contact {
            contact.centre = T::select(lanes, contact.value, contact.centre);
        }
    }

    #[inline(always)]
    fn write_impulses(&self, stage: &Stage<T>, solution: &mut StageSolution<T>) {
        for ((impulse, friction), link) in solution.friction.iter_mut().zip(&self.friction).zip(&stage.links) {
            *impulse = Vector2::new(friction.value.x * link.friction.x, friction.value.y * link.friction.y);
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contact) {
            *impulse = contact.value;
        }
    }
}

/// Quadratic model of one link's inertia and friction; notes the friction.
///
/// In scaled coordinates gamma^ = A R^T v with A = diag(a_x, a_y), friction acts with R A p,
/// p = prox_disc(x), x = centre - r gamma^, and the Hessian is r R A D A R^T with
/// D = I when sticking, (I - p p^T) / |x| when sliding.
#[inline(always)]
fn link_model<T: Real>(link: &StageLink<T>, u: &Vector3<T>, friction: &mut Proximal<T, Vector2<T>>) -> LinkModel<T> {
    let (c, s) = (link.heading.cos, link.heading.sin);
    let (ax, ay) = (link.friction.x, link.friction.y);
    let (rax, ray) = (friction.penalty * ax, friction.penalty * ay);
    let x = friction.centre.x - rax * (c * u.x + s * u.y);
    let y = friction.centre.y - ray * (c * u.y - s * u.x);
    let one = T::splat(1.0);
    let norm_squared = x * x + y * y;
    let shrink = one / norm_squared.max(one).sqrt();
    let (px, py) = (x * shrink, y * shrink);
    friction.value = Vector2::new(px, py);
    let sticks = norm_squared.le(one);
    let hxx = rax * ax * T::select(sticks, one, py * py * shrink);
    let hxy = rax * ay * T::select(sticks, T::zero(), -px * py * shrink);
    let hyy = ray * ay * T::select(sticks, one, px * px * shrink);
    let (fx, fy) = (ax * px, ay * py);
    let (cc, cs, ss) = (c * c, c * s, s * s);
    let cross = (cs + cs) * hxy;
    LinkModel {
        heading: link.heading,
        half_length: link.half_length,
        xx: link.mass + cc * hxx - cross + ss * hyy,
        xy: cs * (hxx - hyy) + (cc - ss) * hxy,
        yy: link.mass + ss * hxx + cross + cc * hyy,
        xw: T::zero(),
        yw: T::zero(),
        ww: link.inertia,
        gx: link.mass * (u.x - link.reference.x) - (c * fx - s * fy),
        gy: link.mass * (u.y - link.reference.y) - (s * fx + c * fy),
        gw: link.inertia * (u.z - link.reference.z),
        stiffness: T::zero(),
    }
}

/// r in unit-disc coordinates: a stick stiffness of `PENALTY` masses along the stronger axis.
#[inline(always)]
fn friction_penalty<T: Real>(link: &StageLink<T>) -> T {
    let largest = link.friction.x.max(link.friction.y);
    let penalty = T::splat(PENALTY) * link.mass / (largest * largest);
    T::select(T::zero().lt(largest), penalty, T::zero())
}

/// Velocities of links 2..n from the joints, given the twist of link 1 and all angular velocities.
#[inline(always)]
fn follow_joints<T: Real>(links: &[StageLink<T>], twist: &mut [Vector3<T>]) {
    for i in 1..links.len() {
        let (near, far) = (&links[i - 1], &links[i]);
        let (swing_near, swing_far) = (near.half_length * twist[i - 1].z, far.half_length * twist[i].z);
        twist[i].x = twist[i - 1].x - near.heading.sin * swing_near - far.heading.sin * swing_far;
        twist[i].y = twist[i - 1].y + near.heading.cos * swing_near + far.heading.cos * swing_far;
    }
}

/// p / a, or 0 along a zero axis.
#[inline(always)]
fn ratio<T: Real>(p: T, a: T) -> T {
    T::select(T::zero().lt(a), p / a, T::zero())
}

/// Stick stiffness over link mass: large enough that an outer step gains three to four digits, small
/// enough that the kinks of the inner problem stay easy to cross.
const PENALTY: f64 = 1e4;

/// An inner solve ends when its last step is no longer than this times the multipliers' error: the
/// step after a short Newton step is quadratically shorter.
const INNER_ACCURACY: f64 = 10.0;

/// Linear solves after which a stage counts as hard: from there on the inner problems are solved well
/// before the centre moves, and penalties rise while the outer steps gain little.
const PATIENCE: f64 = 20.0;
const STRICT_ACCURACY: f64 = 0.1;
const SLOW_GAIN: f64 = 0.25;

/// Beyond a stick stiffness of 1e6 masses round-off in the velocities shows in the impulses.
const MAX_STIFFENING: f64 = 50.0;

/// A step is damped if the slope at its end exceeds this times the descent at its start.
const OVERSHOOT: f64 = 0.1;
