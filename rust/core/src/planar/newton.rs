//! Solver of a stage: method of multipliers outside, semismooth Newton inside.
//!
//! Around the multipliers of the last stage, each set-valued law is replaced by its proximal form
//! P = prox_C(P_centre - r gamma), which is the gradient of a smooth convex function of gamma (the
//! augmented Lagrangian). The inner problem is then strongly convex with a piecewise smooth gradient:
//! Newton's method on it, one O(n) [`sweep`](super::sweep) a step and a line search that brackets the
//! zero of the slope, converges from anywhere. Moving the centre to the new impulses and repeating is
//! the proximal point method on the dual, which converges whether or not the impulses are unique.
//! Friction is treated in coordinates in which its ellipse is the unit disc; a zero axis is harmless.

use nalgebra::{Matrix3, Vector2, Vector3};

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

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton {
    models: Vec<LinkModel>,
    eliminations: Vec<Elimination>,
    direction: Vec<Twist>,
    trial: Vec<Twist>,
    /// Penalty r of each link's friction in unit-disc coordinates, and of each contact.
    friction_penalty: Vec<f64>,
    contact_penalty: Vec<f64>,
    /// Centres of the proximal forms: friction as a point of the unit disc, contact as an impulse.
    friction_centre: Vec<Vector2<f64>>,
    contact_centre: Vec<f64>,
    /// The proximal forms at the present velocity.
    friction: Vec<Vector2<f64>>,
    contact: Vec<f64>,
}

impl Newton {
    pub fn new(links: usize) -> Self {
        Self {
            models: Vec::with_capacity(links),
            eliminations: vec![Elimination::default(); links],
            direction: vec![Twist::zeros(); links],
            trial: vec![Twist::zeros(); links],
            friction_penalty: vec![0.0; links],
            contact_penalty: Vec::with_capacity(links),
            friction_centre: vec![Vector2::zeros(); links],
            contact_centre: Vec::with_capacity(links),
            friction: vec![Vector2::zeros(); links],
            contact: Vec::with_capacity(links),
        }
    }

    /// Solves `stage`, starting from the twists and impulses in `solution`, to velocities within
    /// about `tolerance` \[m/s\], in at most `max_iterations` linear solves.
    ///
    /// The starting twists need not satisfy the joints: the first link's twist and all angular
    /// velocities are kept and the rest follows.
    pub fn solve(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64, max_iterations: u32) -> Outcome {
        self.start(stage, solution);
        self.linearise(stage, &solution.twist, &mut solution.drive);
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
                self.linearise(stage, &solution.twist, &mut solution.drive);
            }
        }
        self.finish(stage, solution);
        outcome
    }

    /// Penalties, centres from the warm start, and twists that satisfy the joints.
    fn start(&mut self, stage: &Stage, solution: &mut StageSolution) {
        for (i, link) in stage.links.iter().enumerate() {
            self.friction_penalty[i] = friction_penalty(link);
            self.friction_centre[i] = into_unit_disc(link, solution.friction[i]);
        }
        self.contact_centre.clear();
        self.contact_centre.extend_from_slice(&solution.contact);
        self.contact_penalty.clear();
        self.contact_penalty.extend(stage.contacts.iter().map(|contact| PENALTY * stage.links[contact.link].mass));
        self.contact.clear();
        self.contact.resize(stage.contacts.len(), 0.0);
        follow_joints(&stage.links, &mut solution.twist);
    }

    /// One damped Newton step; returns its length as a velocity \[m/s\].
    ///
    /// The slope of the convex inner function along the direction rises monotonically. A full step
    /// that does not overshoot is taken; otherwise the zero of the slope is bracketed.
    fn descend(&mut self, stage: &Stage, solution: &mut StageSolution) -> f64 {
        let slope = self.slope();
        let length = (-slope / stage.links[0].mass).max(0.0).sqrt();
        self.evaluate_at(stage, solution, 1.0);
        let end_slope = self.slope();
        if end_slope > OVERSHOOT * -slope {
            self.bracket(stage, solution, slope, end_slope);
        }
        solution.twist.copy_from_slice(&self.trial);
        length
    }

    /// Regula falsi (Illinois) for the zero of the slope on (0, 1); ends at the best point found.
    fn bracket(&mut self, stage: &Stage, solution: &mut StageSolution, slope: f64, end_slope: f64) {
        let (mut low, mut slope_low) = (0.0, slope);
        let (mut high, mut slope_high) = (1.0, end_slope);
        for _ in 0..MAX_BRACKETINGS {
            let alpha = high - slope_high * (high - low) / (slope_high - slope_low);
            self.evaluate_at(stage, solution, alpha);
            let here = self.slope();
            if here.abs() <= OVERSHOOT * -slope {
                break;
            }
            if here > 0.0 {
                (high, slope_high) = (alpha, here);
                slope_low *= 0.5;
            } else {
                (low, slope_low) = (alpha, here);
                slope_high *= 0.5;
            }
        }
    }

    /// Moves the trial point to `alpha` along the direction and linearises there.
    fn evaluate_at(&mut self, stage: &Stage, solution: &mut StageSolution, alpha: f64) {
        for ((trial, start), direction) in self.trial.iter_mut().zip(&solution.twist).zip(&self.direction) {
            *trial = start + direction * alpha;
        }
        let trial = std::mem::take(&mut self.trial);
        self.linearise(stage, &trial, &mut solution.drive);
        self.trial = trial;
    }

    /// Derivative of the inner function along the direction at the point last linearised \[J\].
    fn slope(&self) -> f64 {
        self.models.iter().zip(&self.direction).map(|(model, direction)| model.gradient.dot(direction)).sum()
    }

    /// Gradient and generalised Hessian of the inner function at `twist`.
    fn linearise(&mut self, stage: &Stage, twist: &[Twist], drive: &mut [f64]) {
        self.models.clear();
        for (i, (link, u)) in stage.links.iter().zip(twist).enumerate() {
            let (model, friction) = link_model(link, u, self.friction_centre[i], self.friction_penalty[i]);
            self.friction[i] = friction;
            self.models.push(model);
        }
        for (j, joint) in stage.joints.iter().enumerate() {
            let wanted = joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z);
            drive[j] = wanted.clamp(-joint.limit, joint.limit);
            self.models[j].gradient.z += drive[j];
            self.models[j + 1].gradient.z -= drive[j];
            self.models[j + 1].stiffness = if wanted.abs() <= joint.limit { joint.stiffness } else { 0.0 };
        }
        for (b, contact) in stage.contacts.iter().enumerate() {
            let w = &contact.direction;
            let penalty = self.contact_penalty[b];
            let impulse = self.contact_centre[b] - penalty * (w.dot(&twist[contact.link]) + contact.offset);
            self.contact[b] = impulse.max(0.0);
            if impulse > 0.0 {
                let model = &mut self.models[contact.link];
                model.gradient -= w * impulse;
                model.hessian += w * (penalty * w).transpose();
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
        for (i, link) in stage.links.iter().enumerate() {
            let largest = link.friction.max();
            if largest > 0.0 {
                let change = (self.friction[i] - self.friction_centre[i]).norm() / (self.friction_penalty[i] * largest);
                let speed = twist[i].xy().norm();
                let sliding = if self.friction[i].norm_squared() > 1.0 - 1e-9 { largest / (link.mass * speed) } else { 0.0 };
                worst = worst.max(change * sliding.max(1.0));
            }
        }
        for (b, penalty) in self.contact_penalty.iter().enumerate() {
            worst = worst.max((self.contact[b] - self.contact_centre[b]).abs() / penalty);
        }
        worst
    }

    fn recentre(&mut self) {
        self.friction_centre.copy_from_slice(&self.friction);
        self.contact_centre.copy_from_slice(&self.contact);
    }

    fn finish(&self, stage: &Stage, solution: &mut StageSolution) {
        for (i, link) in stage.links.iter().enumerate() {
            solution.friction[i] = self.friction[i].component_mul(&link.friction);
        }
        solution.contact.copy_from_slice(&self.contact);
    }
}

/// Quadratic model of one link's inertia and friction, and the friction as a point of the unit disc.
///
/// In scaled coordinates gamma^ = A R^T v with A = diag(a_x, a_y), friction acts with R A p,
/// p = prox_disc(x), x = centre - r gamma^, and the Hessian is r R A D A R^T with
/// D = I when sticking, (I - p p^T) / |x| when sliding.
fn link_model(link: &StageLink, u: &Twist, centre: Vector2<f64>, penalty: f64) -> (LinkModel, Vector2<f64>) {
    let a = link.friction;
    let x = centre - a.component_mul(&link.heading.to_link(u.xy())) * penalty;
    let norm = x.norm();
    let (p, dxx, dxy, dyy) = if norm <= 1.0 {
        (x, 1.0, 0.0, 1.0)
    } else {
        let p = x / norm;
        (p, p.y * p.y / norm, -p.x * p.y / norm, p.x * p.x / norm)
    };
    let (hxx, hxy, hyy) = (penalty * a.x * a.x * dxx, penalty * a.x * a.y * dxy, penalty * a.y * a.y * dyy);
    let (c, s) = (link.heading.cos, link.heading.sin);
    let xx = c * c * hxx - 2.0 * c * s * hxy + s * s * hyy;
    let xy = c * s * (hxx - hyy) + (c * c - s * s) * hxy;
    let yy = s * s * hxx + 2.0 * c * s * hxy + c * c * hyy;
    let force = link.heading.to_world(a.component_mul(&p));
    let change = u - link.reference;
    let model = LinkModel {
        heading: link.heading,
        half_length: link.half_length,
        hessian: Matrix3::new(link.mass + xx, xy, 0.0, xy, link.mass + yy, 0.0, 0.0, 0.0, link.inertia),
        gradient: Vector3::new(
            link.mass * change.x - force.x,
            link.mass * change.y - force.y,
            link.inertia * change.z,
        ),
        stiffness: 0.0,
    };
    (model, p)
}

/// r in unit-disc coordinates: a stick stiffness of `PENALTY` masses along the stronger axis.
fn friction_penalty(link: &StageLink) -> f64 {
    let largest = link.friction.max();
    if largest > 0.0 { PENALTY * link.mass / (largest * largest) } else { 0.0 }
}

/// A friction impulse as a point of the unit disc.
fn into_unit_disc(link: &StageLink, impulse: Vector2<f64>) -> Vector2<f64> {
    impulse.zip_map(&link.friction, |p, a| if a > 0.0 { p / a } else { 0.0 })
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

/// Stick stiffness over link mass: large enough that an outer step gains two to three digits, small
/// enough that the kinks of the inner problem stay easy to cross.
const PENALTY: f64 = 1e3;

/// An inner solve ends when its last step is this much shorter than the multipliers' error.
const INNER_ACCURACY: f64 = 0.1;

/// Largest slope behind the minimum, relative to the slope at the start, that a full step may have.
const OVERSHOOT: f64 = 0.25;

/// The bracket halves at least every second evaluation.
const MAX_BRACKETINGS: u32 = 30;
