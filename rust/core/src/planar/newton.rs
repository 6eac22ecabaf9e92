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

use nalgebra::Vector2;

use super::ray::Ray;
use super::sweep::{Elimination, LinkModel, minimise};
use super::{Stage, StageLink, StageSolution, Twist};

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Linear solves.
    pub iterations: u32,
    /// Whether the solver's own stopping rule was met; the certificate judges independently.
    pub converged: bool,
}

/// The proximal form of one law: penalty r, centre, and its value at the present velocity.
///
/// Friction (`V = Vector2`) lives in the unit disc, contact (`V = f64`) is an impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Proximal<V> {
    pub penalty: f64,
    pub centre: V,
    pub value: V,
}

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton {
    friction: Vec<Proximal<Vector2<f64>>>,
    contact: Vec<Proximal<f64>>,
    models: Vec<LinkModel>,
    eliminations: Vec<Elimination>,
    direction: Vec<Twist>,
    start: Vec<Twist>,
    ray: Ray,
}

impl Newton {
    pub fn new(links: usize) -> Self {
        let at_rest = Proximal { penalty: 0.0, centre: Vector2::zeros(), value: Vector2::zeros() };
        Self {
            friction: vec![at_rest; links],
            contact: Vec::with_capacity(links),
            models: vec![LinkModel::default(); links],
            eliminations: vec![Elimination::default(); links],
            direction: vec![Twist::zeros(); links],
            start: vec![Twist::zeros(); links],
            ray: Ray::with_capacity(links),
        }
    }

    /// Solves `stage`, starting from the twists and impulses in `solution`, to velocities within
    /// about `tolerance` \[m/s\], in at most `max_iterations` linear solves.
    ///
    /// The starting twists need not satisfy the joints: the first link's twist and all angular
    /// velocities are kept and the rest follows.
    pub fn solve(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64, max_iterations: u32) -> Outcome {
        self.warm_up(stage, solution);
        self.linearise(stage, solution);
        let mut outcome = Outcome { iterations: 0, converged: false };
        while outcome.iterations < max_iterations {
            outcome.iterations += 1;
            minimise(&self.models, &mut self.eliminations, &mut self.direction);
            let step = self.descend(stage, solution);
            if !step.is_finite() {
                break;
            }
            let multiplier_error = self.multiplier_error(stage, &solution.twist);
            if step <= tolerance && multiplier_error <= tolerance {
                outcome.converged = true;
                break;
            }
            if step <= tolerance.max(INNER_ACCURACY * multiplier_error) {
                self.recentre();
                self.linearise(stage, solution);
            }
        }
        self.write_impulses(stage, solution);
        outcome
    }

    /// Penalties, centres from the warm start, and twists that satisfy the joints.
    fn warm_up(&mut self, stage: &Stage, solution: &mut StageSolution) {
        for ((friction, link), impulse) in self.friction.iter_mut().zip(&stage.links).zip(&solution.friction) {
            let centre = impulse.zip_map(&link.friction, |p, a| if a > 0.0 { p / a } else { 0.0 });
            *friction = Proximal { penalty: friction_penalty(link), centre, value: centre };
        }
        self.contact.clear();
        self.contact.extend(stage.contacts.iter().zip(&solution.contact).map(|(contact, &impulse)| Proximal {
            penalty: PENALTY * stage.links[contact.link].mass,
            centre: impulse,
            value: impulse,
        }));
        follow_joints(&stage.links, &mut solution.twist);
    }

    /// One damped Newton step, linearised at its end; returns its undamped length as a velocity \[m/s\].
    fn descend(&mut self, stage: &Stage, solution: &mut StageSolution) -> f64 {
        let slope = self.slope();
        self.start.copy_from_slice(&solution.twist);
        self.move_along(stage, solution, 1.0);
        if self.slope() > OVERSHOOT * -slope {
            self.ray.cast(stage, &self.start, &self.direction, &self.friction, &self.contact);
            let fraction = self.ray.zero_of_slope(slope, OVERSHOOT);
            self.move_along(stage, solution, fraction);
        }
        (-slope / stage.links[0].mass).max(0.0).sqrt()
    }

    fn move_along(&mut self, stage: &Stage, solution: &mut StageSolution, fraction: f64) {
        for ((u, start), direction) in solution.twist.iter_mut().zip(&self.start).zip(&self.direction) {
            *u = start + direction * fraction;
        }
        self.linearise(stage, solution);
    }

    /// Derivative of the inner function along the direction where it was last linearised \[J\].
    fn slope(&self) -> f64 {
        let along = |(model, du): (&LinkModel, &Twist)| model.gx * du.x + model.gy * du.y + model.gw * du.z;
        self.models.iter().zip(&self.direction).map(along).sum()
    }

    /// Impulses, gradient and generalised Hessian of the inner function at the present twists.
    fn linearise(&mut self, stage: &Stage, solution: &mut StageSolution) {
        let twist = &solution.twist;
        for (i, link) in stage.links.iter().enumerate() {
            self.models[i] = link_model(link, &twist[i], &mut self.friction[i]);
        }
        for (j, joint) in stage.joints.iter().enumerate() {
            let wanted = joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z);
            let drive = wanted.clamp(-joint.limit, joint.limit);
            solution.drive[j] = drive;
            self.models[j].gw += drive;
            self.models[j + 1].gw -= drive;
            self.models[j + 1].stiffness = if drive == wanted { joint.stiffness } else { 0.0 };
        }
        for (contact, proximal) in stage.contacts.iter().zip(&mut self.contact) {
            let w = &contact.direction;
            let impulse = proximal.centre - proximal.penalty * (w.dot(&twist[contact.link]) + contact.offset);
            proximal.value = impulse.max(0.0);
            if impulse > 0.0 {
                self.models[contact.link].add_rank_one(w, proximal.penalty, -impulse);
            }
        }
    }

    /// How far the velocities are from obeying the laws because the centres are not yet the
    /// impulses \[m/s\].
    ///
    /// Sticking or in contact, the constraint is violated by |P - P_centre| / r. Sliding at speed
    /// gamma, the friction's direction is off by |P - P_centre| / (r gamma), which changes the link's
    /// velocity by that angle times a / m.
    fn multiplier_error(&self, stage: &Stage, twist: &[Twist]) -> f64 {
        let mut worst: f64 = 0.0;
        for ((friction, link), u) in self.friction.iter().zip(&stage.links).zip(twist) {
            let largest = link.friction.max();
            if largest > 0.0 {
                let change = (friction.value - friction.centre).norm() / (friction.penalty * largest);
                let slides = friction.value.norm_squared() > 1.0 - 1e-9;
                let amplification = if slides { largest / (link.mass * u.xy().norm()) } else { 1.0 };
                worst = worst.max(change * amplification.max(1.0));
            }
        }
        for contact in &self.contact {
            worst = worst.max((contact.value - contact.centre).abs() / contact.penalty);
        }
        worst
    }

    fn recentre(&mut self) {
        self.friction.iter_mut().for_each(|friction| friction.centre = friction.value);
        self.contact.iter_mut().for_each(|contact| contact.centre = contact.value);
    }

    fn write_impulses(&self, stage: &Stage, solution: &mut StageSolution) {
        for ((impulse, friction), link) in solution.friction.iter_mut().zip(&self.friction).zip(&stage.links) {
            *impulse = friction.value.component_mul(&link.friction);
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
#[inline]
fn link_model(link: &StageLink, u: &Twist, friction: &mut Proximal<Vector2<f64>>) -> LinkModel {
    let (c, s) = (link.heading.cos, link.heading.sin);
    let (ax, ay) = (link.friction.x, link.friction.y);
    let (rax, ray) = (friction.penalty * ax, friction.penalty * ay);
    let x = friction.centre.x - rax * (c * u.x + s * u.y);
    let y = friction.centre.y - ray * (c * u.y - s * u.x);
    let norm_squared = x * x + y * y;
    let (px, py, dxx, dxy, dyy) = if norm_squared <= 1.0 {
        (x, y, 1.0, 0.0, 1.0)
    } else {
        let shrink = 1.0 / norm_squared.sqrt();
        let (px, py) = (x * shrink, y * shrink);
        (px, py, py * py * shrink, -px * py * shrink, px * px * shrink)
    };
    friction.value = Vector2::new(px, py);
    let (hxx, hxy, hyy) = (rax * ax * dxx, rax * ay * dxy, ray * ay * dyy);
    let (fx, fy) = (ax * px, ay * py);
    let cross = 2.0 * c * s * hxy;
    LinkModel {
        heading: link.heading,
        half_length: link.half_length,
        xx: link.mass + c * c * hxx - cross + s * s * hyy,
        xy: c * s * (hxx - hyy) + (c * c - s * s) * hxy,
        yy: link.mass + s * s * hxx + cross + c * c * hyy,
        xw: 0.0,
        yw: 0.0,
        ww: link.inertia,
        gx: link.mass * (u.x - link.reference.x) - (c * fx - s * fy),
        gy: link.mass * (u.y - link.reference.y) - (s * fx + c * fy),
        gw: link.inertia * (u.z - link.reference.z),
        stiffness: 0.0,
    }
}

/// r in unit-disc coordinates: a stick stiffness of `PENALTY` masses along the stronger axis.
fn friction_penalty(link: &StageLink) -> f64 {
    let largest = link.friction.max();
    if largest > 0.0 { PENALTY * link.mass / (largest * largest) } else { 0.0 }
}

/// Velocities of links 2..n from the joints, given the twist of link 1 and all angular velocities.
fn follow_joints(links: &[StageLink], twist: &mut [Twist]) {
    for i in 1..links.len() {
        let far = twist[i - 1].xy() + links[i - 1].heading.lateral() * (links[i - 1].half_length * twist[i - 1].z);
        let v = far + links[i].heading.lateral() * (links[i].half_length * twist[i].z);
        twist[i].x = v.x;
        twist[i].y = v.y;
    }
}

/// Stick stiffness over link mass: large enough that an outer step gains three to four digits, small
/// enough that the kinks of the inner problem stay easy to cross.
const PENALTY: f64 = 1e4;

/// An inner solve ends when its last step is no longer than this times the multipliers' error: the
/// step after a short Newton step is quadratically shorter.
const INNER_ACCURACY: f64 = 10.0;

/// A step is damped if the slope at its end exceeds this times the descent at its start.
const OVERSHOOT: f64 = 0.1;
