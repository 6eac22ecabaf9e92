//! Solver of a stage: method of multipliers outside, semismooth Newton inside.
//!
//! Around the last impulses each friction law is replaced by its proximal form
//! `P = prox_C(P_centre - r gamma)`, the gradient of a smooth convex function of the slip. The inner problem is then
//! strongly convex and piecewise smooth: Newton's method with a search for the zero of the slope. Moving the centre
//! to the new impulses and repeating is the proximal point method on the dual, which converges though the impulses
//! are not unique. Friction lives in coordinates in which its ellipse is the unit disc.
//!
//! The term `f M_22_bar` of input-output linearisation is `f (M - Q Q^T)` with Q the momenta of three orthonormal
//! rigid motions: a heavier chain less a matrix of rank three, so one factorisation and three more gradients.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::math::line_search::step_length;

use super::chain::{ChainFactor, Curvature};
use super::motion::{Composite, Twist, quarter_turn};
use super::ray::Ray;
use super::stage::{Stage, StageLink, StageSolution};

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Linear solves.
    pub iterations: u32,
    /// Whether the solver's own stopping rule was met; the certificate judges independently.
    pub converged: bool,
}

/// The proximal form of the friction at one contact point, in the unit disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Proximal {
    /// r.
    pub penalty: f64,
    pub centre: Vector2<f64>,
    pub value: Vector2<f64>,
}

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton {
    friction: Vec<[Proximal; 2]>,
    curvature: Vec<Curvature>,
    gradient: Vec<Vector3<f64>>,
    factor: ChainFactor,
    scratch: Vec<f64>,
    direction: Vec<Twist>,
    start: Vec<Twist>,
    composite: Composite,
    /// Q: momenta of three orthonormal rigid motions, link by link, and the motions that answer them.
    rigid: [Vec<Vector3<f64>>; 3],
    answer: [Vec<Twist>; 3],
    ray: Ray,
    lightest: f64,
    stiffening: f64,
}

impl Newton {
    pub fn new(links: usize) -> Self {
        let nothing = Vector2::zeros();
        let proximal = Proximal { penalty: 0.0, centre: nothing, value: nothing };
        let curvature = Curvature { swing: nothing, link: Matrix3::zeros(), joint: 0.0 };
        let still = vec![Twist::zeros(); links];
        Self {
            friction: vec![[proximal; 2]; links],
            curvature: vec![curvature; links],
            gradient: still.clone(),
            factor: ChainFactor::new(links),
            scratch: vec![0.0; links],
            direction: still.clone(),
            start: still.clone(),
            composite: Composite { mass: 1.0, centre: nothing, inertia: 1.0 },
            rigid: std::array::from_fn(|_| still.clone()),
            answer: std::array::from_fn(|_| still.clone()),
            ray: Ray::with_capacity(links),
            lightest: 0.0,
            stiffening: 1.0,
        }
    }

    /// Solves `stage` from the twists and impulses in `solution` to velocities within about `tolerance` \[m/s\], in at
    /// most `max_iterations` linear solves. The starting twists must be a motion of the chain.
    pub fn solve(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        max_iterations: u32,
    ) -> Outcome {
        self.warm_up(stage, solution);
        self.linearise(stage, solution);
        let mut outcome = Outcome { iterations: 0, converged: false };
        let mut last_error = f64::INFINITY;
        while outcome.iterations < max_iterations {
            outcome.iterations += 1;
            self.find_direction(stage);
            let step = self.descend(stage, solution);
            let multiplier_error = self.multiplier_error(stage, &solution.twist);
            outcome.converged = step <= tolerance && multiplier_error <= tolerance;
            if outcome.converged || !step.is_finite() {
                break;
            }
            let stubborn = outcome.iterations > PATIENCE;
            let accuracy = if stubborn { STRICT_ACCURACY } else { INNER_ACCURACY };
            if step <= tolerance.max(accuracy * multiplier_error) {
                if stubborn && multiplier_error > SLOW_GAIN * last_error {
                    self.stiffen();
                }
                last_error = multiplier_error;
                self.recentre();
                self.linearise(stage, solution);
            }
        }
        self.write_impulses(stage, solution);
        outcome
    }

    /// Penalties and centres from the warm start, and the rigid motions.
    fn warm_up(&mut self, stage: &Stage, solution: &StageSolution) {
        self.stiffening = 1.0;
        self.lightest = stage.links.iter().map(|link| link.mass).fold(f64::INFINITY, f64::min);
        for ((pair, link), impulse) in self.friction.iter_mut().zip(&stage.links).zip(&solution.friction) {
            let largest = link.coulomb.max();
            let penalty = if largest > 0.0 { PENALTY * link.mass / (largest * largest) } else { 0.0 };
            for (proximal, impulse) in pair.iter_mut().zip(impulse) {
                let centre = impulse.zip_map(&link.coulomb, |p, a| if a > 0.0 { p / a } else { 0.0 });
                *proximal = Proximal { penalty, centre, value: centre };
            }
        }
        if stage.following > 0.0 {
            self.composite = stage.composite();
            let Composite { mass, centre, inertia } = self.composite;
            let (linear, angular) = (mass.sqrt().recip(), inertia.sqrt().recip());
            for (i, link) in stage.links.iter().enumerate() {
                self.rigid[0][i] = Vector3::new(link.mass * linear, 0.0, 0.0);
                self.rigid[1][i] = Vector3::new(0.0, link.mass * linear, 0.0);
                let turning = quarter_turn(link.arm - centre) * (link.mass * angular);
                self.rigid[2][i] = turning.push(link.inertia * angular);
            }
        }
    }

    /// The Newton direction: minimiser of the quadratic model.
    fn find_direction(&mut self, stage: &Stage) {
        let Self { factor, curvature, gradient, scratch, direction, rigid, answer, .. } = self;
        factor.factorise(curvature);
        factor.solve(gradient, scratch, direction);
        let f = stage.following;
        if f == 0.0 {
            return;
        }
        // (H - f Q Q^T)^-1 by the formula of Sherman, Morrison and Woodbury; `answer` is -H^-1 Q.
        for (q, y) in rigid.iter().zip(answer.iter_mut()) {
            factor.solve(q, scratch, y);
        }
        let inner = |q: &[Vector3<f64>], y: &[Twist]| q.iter().zip(y).map(|(q, y)| q.dot(y)).sum::<f64>();
        let small = Matrix3::from_fn(|i, j| inner(&rigid[i], &answer[j])) + Matrix3::identity() / f;
        let pull = Vector3::from_fn(|i, _| inner(&rigid[i], direction));
        let weight = small.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * pull);
        for (i, du) in direction.iter_mut().enumerate() {
            *du -= answer[0][i] * weight.x + answer[1][i] * weight.y + answer[2][i] * weight.z;
        }
    }

    /// One damped Newton step, linearised at its end; returns its undamped length as a velocity \[m/s\].
    fn descend(&mut self, stage: &Stage, solution: &mut StageSolution) -> f64 {
        let slope = self.slope();
        self.start.copy_from_slice(&solution.twist);
        if slope >= 0.0 {
            // Not a descent: round-off, the minimum is reached.
            return 0.0;
        }
        self.move_along(stage, solution, 1.0);
        if self.slope() > -OVERSHOOT * slope {
            self.ray.cast(stage, &self.composite, &self.start, &self.direction, &self.friction);
            let (fraction, _) = step_length(&self.ray, -OVERSHOOT * slope, true);
            self.move_along(stage, solution, fraction);
        }
        (-slope / self.lightest).sqrt()
    }

    fn move_along(&mut self, stage: &Stage, solution: &mut StageSolution, fraction: f64) {
        for ((u, start), du) in solution.twist.iter_mut().zip(&self.start).zip(&self.direction) {
            *u = start + du * fraction;
        }
        self.linearise(stage, solution);
    }

    /// Derivative of the inner function along the direction where it was last linearised \[J\].
    fn slope(&self) -> f64 {
        self.gradient.iter().zip(&self.direction).map(|(g, du)| g.dot(du)).sum()
    }

    /// Impulses, gradient and generalised Hessian of the inner function at the present twists.
    fn linearise(&mut self, stage: &Stage, solution: &mut StageSolution) {
        let f = stage.following;
        let twist = &solution.twist;
        let mean = if f > 0.0 { stage.mean_motion(&self.composite, twist) } else { Vector3::zeros() };
        for (i, link) in stage.links.iter().enumerate() {
            let u = &twist[i];
            let (mut gradient, curvature) = friction_model(link, u, &mut self.friction[i]);
            let inertia = Vector3::new(link.mass, link.mass, link.inertia);
            gradient += inertia.component_mul(&(u - link.reference));
            if f > 0.0 {
                gradient += Stage::relative_momentum(link, u, &mean) * f;
            }
            self.gradient[i] = gradient;
            let link_curvature = curvature + Matrix3::from_diagonal(&(inertia * (1.0 + f)));
            self.curvature[i] = Curvature { swing: link.swing(), link: link_curvature, joint: 0.0 };
        }
        for (j, joint) in stage.joints.iter().enumerate() {
            let wanted = joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z);
            let drive = wanted.clamp(-joint.limit, joint.limit);
            self.gradient[j].z += drive;
            self.gradient[j + 1].z -= drive;
            if wanted.abs() <= joint.limit {
                self.curvature[j + 1].joint = joint.stiffness;
            }
        }
    }

    /// How far the velocities are from obeying the laws because the centres are not yet the impulses \[m/s\].
    ///
    /// Sticking, the constraint is violated by |P - P_centre| / r. Sliding at speed gamma, the friction's direction
    /// is off by |P - P_centre| / (r gamma), which changes the link's velocity by that angle times a / m, but by no
    /// more than gamma itself.
    fn multiplier_error(&self, stage: &Stage, twist: &[Twist]) -> f64 {
        let mut worst: f64 = 0.0;
        for ((pair, link), u) in self.friction.iter().zip(&stage.links).zip(twist) {
            let largest = link.coulomb.max();
            if largest == 0.0 {
                continue;
            }
            for (proximal, slip) in pair.iter().zip(link.slip(u)) {
                let violation = (proximal.value - proximal.centre).norm() / (proximal.penalty * largest);
                let slides = proximal.value.norm_squared() > 1.0 - 1e-9;
                let speed = slip.norm();
                let amplified = violation * (largest / (link.mass * speed)).max(1.0);
                worst = worst.max(if slides { amplified.min(speed) } else { violation });
            }
        }
        worst
    }

    /// Raises the penalties tenfold, as far as round-off allows.
    fn stiffen(&mut self) {
        if self.stiffening < MAX_STIFFENING {
            self.stiffening *= 10.0;
            self.friction.iter_mut().flatten().for_each(|proximal| proximal.penalty *= 10.0);
        }
    }

    fn recentre(&mut self) {
        self.friction.iter_mut().flatten().for_each(|proximal| proximal.centre = proximal.value);
    }

    fn write_impulses(&self, stage: &Stage, solution: &mut StageSolution) {
        for ((impulse, pair), link) in solution.friction.iter_mut().zip(&self.friction).zip(&stage.links) {
            *impulse = pair.map(|proximal| proximal.value.component_mul(&link.coulomb));
        }
        stage.wanted_drives(&solution.twist, &mut solution.drive);
        for (drive, joint) in solution.drive.iter_mut().zip(&stage.joints) {
            *drive = drive.clamp(-joint.limit, joint.limit);
        }
    }
}

/// Gradient and Hessian of a link's friction by its twist; notes the impulses.
///
/// With gamma^ = A gamma, A = diag(a_x, a_y), Coulomb friction is A p with p = prox_disc(x), x = centre - r gamma^, and
/// its Hessian is r A D A with D = I when sticking, (I - p p^T) / |x| when sliding.
fn friction_model(link: &StageLink, u: &Twist, pair: &mut [Proximal; 2]) -> (Vector3<f64>, Matrix3<f64>) {
    let (a, v) = (link.coulomb, link.viscous);
    // Of along, across and omega.
    let (mut force, mut moment) = (Vector2::zeros(), 0.0);
    let (mut tt, mut tn, mut nn, mut tw, mut nw) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let slips = link.slip(u);
    for (k, proximal) in pair.iter_mut().enumerate() {
        let lever = if k == 0 { link.lever } else { -link.lever };
        let slip = slips[k];
        let ra = a * proximal.penalty;
        let x = proximal.centre - ra.component_mul(&slip);
        let norm_squared = x.norm_squared();
        let shrink = norm_squared.max(1.0).sqrt().recip();
        let p = x * shrink;
        proximal.value = p;
        let (dxx, dxy, dyy) = if norm_squared <= 1.0 {
            (1.0, 0.0, 1.0)
        } else {
            (p.y * p.y * shrink, -p.x * p.y * shrink, p.x * p.x * shrink)
        };
        let (hxx, hxy, hyy) = (ra.x * a.x * dxx + v.x, ra.x * a.y * dxy, ra.y * a.y * dyy + v.y);
        let impulse = a.component_mul(&p) - v.component_mul(&slip);
        force += impulse;
        moment += lever * impulse.y;
        (tt, tn, nn) = (tt + hxx, tn + hxy, nn + hyy);
        (tw, nw) = (tw + lever * hxy, nw + lever * hyy);
    }
    let ww = link.lever * link.lever * nn;
    let (c, s) = (link.axial.x, link.axial.y);
    let (cc, cs, ss) = (c * c, c * s, s * s);
    let cross = 2.0 * cs * tn;
    let (xx, xy, yy) = (cc * tt - cross + ss * nn, cs * (tt - nn) + (cc - ss) * tn, ss * tt + cross + cc * nn);
    let (xw, yw) = (c * tw - s * nw, s * tw + c * nw);
    let gradient = -link.to_world(force).push(moment);
    (gradient, Matrix3::new(xx, xy, xw, xy, yy, yw, xw, yw, ww))
}

/// Stick stiffness over link mass: an outer step gains three to four digits.
const PENALTY: f64 = 1e4;

/// An inner solve ends when its last step is no longer than this times the multipliers' error.
const INNER_ACCURACY: f64 = 10.0;

/// Linear solves after which a stage counts as hard: inner problems are then solved well before the centre moves.
const PATIENCE: u32 = 20;
const STRICT_ACCURACY: f64 = 0.1;
const SLOW_GAIN: f64 = 0.25;

/// Beyond a stick stiffness of 1e6 masses round-off in the velocities shows in the impulses.
const MAX_STIFFENING: f64 = 50.0;

/// A step is damped if the slope at its end exceeds this times the descent at its start.
const OVERSHOOT: f64 = 0.1;
