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
            ray: Ray::with_capacity(links),
        }
    }

    /// Solves `stage`, starting from the twists and impulses in `solution`, to velocities within
    /// about `tolerance` \[m/s\], in at most `max_iterations` linear solves.
    ///
    /// The starting twists need not satisfy the joints: the first link's twist and all angular
    /// velocities are kept and the rest follows.
    pub fn solve(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64, max_iterations: u32) -> Outcome {
        self.start(stage, solution);
        self.linearise(stage, solution);
        let mut outcome = Outcome { iterations: 0, converged: false };
        while outcome.iterations < max_iterations {
            outcome.iterations += 1;
            minimise(&self.models, &mut self.eliminations, &mut self.direction);
            let step = self.descend(stage, solution);
            if !step.is_finite() {
                break;
            }
            self.linearise(stage, solution);
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
    fn start(&mut self, stage: &Stage, solution: &mut StageSolution) {
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

    /// One damped Newton step; returns its undamped length as a velocity \[m/s\].
    fn descend(&mut self, stage: &Stage, solution: &mut StageSolution) -> f64 {
        self.ray.cast(stage, &solution.twist, &self.direction, &self.friction, &self.contact);
        let slope = self.ray.slope(0.0);
        let fraction = self.ray.search(slope);
        for (u, direction) in solution.twist.iter_mut().zip(&self.direction) {
            *u += direction * fraction;
        }
        (-slope / stage.links[0].mass).max(0.0).sqrt()
    }

    /// Impulses, gradient and generalised Hessian of the inner function at the present twists.
    fn linearise(&mut self, stage: &Stage, solution: &mut StageSolution) {
        let twist = &solution.twist;
        for (((model, friction), link), u) in self.models.iter_mut().zip(&mut self.friction).zip(&stage.links).zip(twist) {
            *model = link_model(link, u, friction);
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
fn link_model(link: &StageLink, u: &Twist, friction: &mut Proximal<Vector2<f64>>) -> LinkModel {
    let a = link.friction;
    let x = friction.centre - a.component_mul(&link.heading.to_link(u.xy())) * friction.penalty;
    let norm_squared = x.norm_squared();
    let (p, dxx, dxy, dyy) = if norm_squared <= 1.0 {
        (x, 1.0, 0.0, 1.0)
    } else {
        let shrink = 1.0 / norm_squared.sqrt();
        let p = x * shrink;
        (p, p.y * p.y * shrink, -p.x * p.y * shrink, p.x * p.x * shrink)
    };
    friction.value = p;
    let ra = a * friction.penalty;
    let (hxx, hxy, hyy) = (ra.x * a.x * dxx, ra.x * a.y * dxy, ra.y * a.y * dyy);
    let (c, s) = (link.heading.cos, link.heading.sin);
    let (cc, cs, ss) = (c * c, c * s, s * s);
    let force = link.heading.to_world(a.component_mul(&p));
    let change = u - link.reference;
    LinkModel {
        heading: link.heading,
        half_length: link.half_length,
        xx: link.mass + cc * hxx - 2.0 * cs * hxy + ss * hyy,
        xy: cs * (hxx - hyy) + (cc - ss) * hxy,
        yy: link.mass + ss * hxx + 2.0 * cs * hxy + cc * hyy,
        xw: 0.0,
        yw: 0.0,
        ww: link.inertia,
        gx: link.mass * change.x - force.x,
        gy: link.mass * change.y - force.y,
        gw: link.inertia * change.z,
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
