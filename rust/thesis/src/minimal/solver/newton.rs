//! Newton's method on the augmented Lagrangian of a stage of the minimal model.
//!
//! The iteration is that of [`snake_core::solver`]; this file is the chain's inner problem in the frame of the stage.
//!
//! The term `f M_22_bar` of input-output linearisation is `f (M - Q Q^T)` with Q the momenta of three orthonormal
//! rigid motions: a heavier chain less a matrix of rank three, so one factorisation and three more gradients.

use nalgebra::{Matrix3, Vector2, Vector3};
use snake_core::laws::{LimitedActuator, Whole};
use snake_core::solver::{self, FrictionTerm, LawForm, NewtonStep, Outcome, StageProblem, Tuning, step_length};

use crate::minimal::motion::{Composite, Twist, quarter_turn};
use crate::minimal::stage::{Stage, StageJoint, StageLink, StageSolution};

use super::chain::{ChainFactor, Curvature};
use super::ray::Step;

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton {
    pub(super) friction: Vec<[FrictionTerm<f64>; 2]>,
    curvature: Vec<Curvature>,
    gradient: Vec<Vector3<f64>>,
    factor: ChainFactor,
    scratch: Vec<f64>,
    direction: Vec<Twist>,
    start: Vec<Twist>,
    pub(super) composite: Composite,
    /// Q: momenta of three orthonormal rigid motions, link by link, and -H^-1 Q.
    rigid: [Vec<Vector3<f64>>; 3],
    response: [Vec<Twist>; 3],
    lightest: f64,
}

impl Newton {
    pub fn new(links: usize) -> Self {
        let nothing = Vector2::zeros();
        let frictionless = FrictionTerm::new(nothing, &nothing, 0.0);
        let curvature = Curvature { swing: nothing, link: Matrix3::zeros(), joint: 0.0 };
        let still = vec![Twist::zeros(); links];
        Self {
            friction: vec![[frictionless; 2]; links],
            curvature: vec![curvature; links],
            gradient: still.clone(),
            factor: ChainFactor::new(links),
            scratch: vec![0.0; links],
            direction: still.clone(),
            start: still.clone(),
            composite: Composite { mass: 1.0, centre: nothing, inertia: 1.0 },
            rigid: std::array::from_fn(|_| still.clone()),
            response: std::array::from_fn(|_| still.clone()),
            lightest: 0.0,
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
        let mut inner = InnerProblem { newton: self, stage, twist: &mut solution.twist };
        let outcome = solver::solve(&mut inner, tolerance, max_iterations, true);
        self.write_impulses(stage, solution);
        outcome
    }

    /// Penalties and centres from the warm start, and the rigid motions.
    fn warm_up(&mut self, stage: &Stage, solution: &StageSolution) {
        self.lightest = stage.links.iter().map(|link| link.mass).fold(f64::INFINITY, f64::min);
        for ((pair, link), impulses) in self.friction.iter_mut().zip(&stage.links).zip(&solution.friction) {
            let penalty = TUNING.penalty * link.mass;
            *pair = impulses.map(|impulse| FrictionTerm::new(link.coulomb, &impulse, penalty));
        }
        if stage.momentum_feedforward > 0.0 {
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
        let Self { factor, curvature, gradient, scratch, direction, rigid, response, .. } = self;
        factor.factorise(curvature);
        factor.solve(gradient, scratch, direction);
        let f = stage.momentum_feedforward;
        if f == 0.0 {
            return;
        }
        // (H - f Q Q^T)^-1 by the formula of Sherman, Morrison and Woodbury; `response` is -H^-1 Q.
        for (q, y) in rigid.iter().zip(response.iter_mut()) {
            factor.solve(q, scratch, y);
        }
        let inner = |q: &[Vector3<f64>], y: &[Twist]| q.iter().zip(y).map(|(q, y)| q.dot(y)).sum::<f64>();
        let small = Matrix3::from_fn(|i, j| inner(&rigid[i], &response[j])) + Matrix3::identity() / f;
        let pull = Vector3::from_fn(|i, _| inner(&rigid[i], direction));
        let weight = small.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * pull);
        for (i, du) in direction.iter_mut().enumerate() {
            *du -= response[0][i] * weight.x + response[1][i] * weight.y + response[2][i] * weight.z;
        }
    }

    /// One damped Newton step, linearised at its end; returns its undamped length as a velocity \[m/s\].
    fn descend(&mut self, stage: &Stage, twist: &mut [Twist]) -> f64 {
        let slope = self.slope();
        self.start.copy_from_slice(twist);
        if slope >= 0.0 {
            // Not a descent: round-off, the minimum is reached.
            return 0.0;
        }
        self.move_along(stage, twist, 1.0);
        let accuracy = -TUNING.overshoot * slope;
        if self.slope() > accuracy {
            let ray = Step::new(self, stage, &self.start, &self.direction);
            let (fraction, _) = step_length(&ray, accuracy, true);
            self.move_along(stage, twist, fraction);
        }
        (-slope / self.lightest).sqrt()
    }

    fn move_along(&mut self, stage: &Stage, twist: &mut [Twist], fraction: f64) {
        for ((u, start), du) in twist.iter_mut().zip(&self.start).zip(&self.direction) {
            *u = start + du * fraction;
        }
        self.linearise(stage, twist);
    }

    /// Derivative of the inner function along the direction where it was last linearised \[J\].
    fn slope(&self) -> f64 {
        self.gradient.iter().zip(&self.direction).map(|(g, du)| g.dot(du)).sum()
    }

    /// Impulses, gradient and generalised Hessian of the inner function at the present twists.
    fn linearise(&mut self, stage: &Stage, twist: &[Twist]) {
        let f = stage.momentum_feedforward;
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
            let (impulse, stiffness) = actuator(joint).evaluate(twist[j + 1].z - twist[j].z);
            self.gradient[j].z += impulse;
            self.gradient[j + 1].z -= impulse;
            self.curvature[j + 1].joint = stiffness;
        }
    }

    fn write_impulses(&self, stage: &Stage, solution: &mut StageSolution) {
        for (impulse, pair) in solution.friction.iter_mut().zip(&self.friction) {
            *impulse = pair.map(|term| term.impulse());
        }
        stage.wanted_drives(&solution.twist, &mut solution.actuator);
        for (drive, joint) in solution.actuator.iter_mut().zip(&stage.joints) {
            *drive = drive.clamp(-joint.limit, joint.limit);
        }
    }
}

/// The inner problem at the twists of a solution.
struct InnerProblem<'a> {
    newton: &'a mut Newton,
    stage: &'a Stage,
    twist: &'a mut [Twist],
}

impl StageProblem<f64> for InnerProblem<'_> {
    const TUNING: Tuning = TUNING;

    /// Always at the present velocities: without contacts the last branch predicts nothing.
    fn evaluate(&mut self, _form: LawForm) {
        self.newton.linearise(self.stage, self.twist);
    }

    /// Every step is damped, the first included.
    fn newton_step(&mut self, _active: bool, _damped: bool) -> NewtonStep<f64> {
        self.newton.find_direction(self.stage);
        let length = self.newton.descend(self.stage, self.twist);
        NewtonStep { length, distance: length, changed: false }
    }

    fn multiplier_error(&self) -> f64 {
        let mut squared: f64 = 0.0;
        for ((pair, link), u) in self.newton.friction.iter().zip(&self.stage.links).zip(self.twist.iter()) {
            for (term, slip) in pair.iter().zip(&link.slip(u)) {
                squared = squared.max(term.squared_error(Whole, slip, link.mass));
            }
        }
        squared.sqrt()
    }

    fn recentre(&mut self, lanes: bool) {
        self.newton.friction.iter_mut().flatten().for_each(|term| term.recentre(lanes));
    }

    fn stiffen(&mut self, factor: f64) {
        self.newton.friction.iter_mut().flatten().for_each(|term| term.stiffen(factor));
    }
}

/// The law of a joint's actuator.
pub(super) fn actuator(joint: &StageJoint) -> LimitedActuator {
    LimitedActuator { offset: joint.drive, stiffness: joint.stiffness, limit: joint.limit }
}

/// Gradient and Hessian of a link's friction, Coulomb and viscous, by its twist; evaluates the Coulomb laws.
fn friction_model(link: &StageLink, u: &Twist, pair: &mut [FrictionTerm<f64>; 2]) -> (Vector3<f64>, Matrix3<f64>) {
    let v = link.viscous;
    // Sums over both contact points: force and moment, and stiffness along (t) and across (n) the link and against
    // turning (w).
    let (mut force, mut moment) = (Vector2::zeros(), 0.0);
    let (mut tt, mut tn, mut nn, mut tw, mut nw) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for ((term, slip), lever) in pair.iter_mut().zip(&link.slip(u)).zip([link.lever, -link.lever]) {
        let stiffness = term.evaluate(Whole, slip);
        let (hxx, hxy, hyy) = (stiffness.xx + v.x, stiffness.xy, stiffness.yy + v.y);
        let impulse = term.impulse() - v.component_mul(slip);
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

/// An outer step with this penalty gains three to four digits; a stick stiffness beyond 1e6 masses would show round-off
/// in the impulses. Multipliers are checked after every step.
const TUNING: Tuning = Tuning { penalty: 1e4, close: f64::INFINITY, ..Tuning::COMMON };
