//! Solver of a stage: method of multipliers outside, semismooth Newton inside.
//!
//! Around the multipliers of the last stage, each set-valued law is replaced by its
//! [proximal form](super::proximal) P = prox_C(P_centre - r gamma), which is the gradient of a smooth
//! convex function of gamma (the augmented Lagrangian). The inner problem is then strongly convex with a
//! piecewise smooth gradient: Newton's method on it, one O(n) [`sweep`](super::sweep) a step and a
//! [search along the ray](super::ray) that brackets the zero of the slope, converges from anywhere.
//! Moving the centre to the new impulses and repeating is the proximal point method on the dual, which
//! converges whether or not the impulses are unique.
//!
//! Every link's velocities are kept in its own frame, where friction is diagonal and the arm to a joint is
//! along e_y. A pass from head to tail takes the Newton step and asks all laws at its end for force and
//! stiffness; a pass from tail to head eliminates the chain.
//!
//! Impulses foretell better than velocities which contacts stay closed and which drives stay at their limit, so the
//! first step asks each law on the [piece](Piece) that its last impulse lay on, and is taken in full wherever it leads:
//! any start will do for the steps that follow.
//!
//! At the end of a full step the linearised laws balance exactly, so what is out of balance there is the laws' own
//! [remainder](Response::remainder). The inner function bends at least like the kinetic energy: the remainder's norm in
//! M^-1 bounds the distance to its minimum, link by link, and no further solve is needed to know it.
//!
//! Several robots are solved side by side: a lane that has converged keeps its velocities and impulses
//! while the others go on, so that each takes exactly the steps it would take alone.

use nalgebra::{Vector2, Vector3};

use crate::contact::{Outcome, PAIRS_PER_LINK};
use crate::math::{Mask, Real, add_scaled, select_into};

use super::link_term::{LinkTerm, in_frame};
use super::proximal::{ContactTerm, DriveTerm, FrictionTerm, Piece};
use super::sweep::{Quadratic, Segment};
use super::{Stage, StageLink, StageSolution};

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton<T = f64> {
    pub(super) links: Vec<LinkTerm<T>>,
    pub(super) contacts: Vec<ContactTerm<T>>,
    /// Step of the velocity of link 1's free end, in the frame of link 1.
    head: Vector2<T>,
    /// Inverse of the least mass and of the least inertia of a link.
    mobility: [T; 2],
    /// How much the penalties have been raised during this solve.
    stiffening: T,
}

/// What the laws answer to the velocities at the end of a step.
#[derive(Debug, Clone, Copy)]
struct Response<T> {
    /// Derivative of the inner function along the step \[J\].
    slope: T,
    /// Square of the difference to the laws' linearisations at the start of the step, in the norm of M^-1 \[J\].
    remainder: T,
}

impl<T: Real> Newton<T> {
    pub fn new(links: usize) -> Self {
        Self {
            links: Vec::with_capacity(links),
            contacts: Vec::with_capacity(PAIRS_PER_LINK * links),
            head: Vector2::new(T::zero(), T::zero()),
            mobility: [T::zero(); 2],
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
        let tolerance = T::splat(tolerance);
        let mut outcome = Outcome { iterations: T::zero(), converged: T::Mask::of(|_| false) };
        let mut active = lanes;
        let mut last_error = T::splat(f64::INFINITY);
        self.respond(Piece::Last);
        for iteration in 0..max_iterations {
            outcome.iterations += T::select(active, T::splat(1.0), T::zero());
            let descent = self.eliminate();
            let here = self.descend(descent, active, iteration > 0);
            // The length of the step as a velocity; `max` would swallow NaN.
            let length = (descent.abs() * self.mobility[0]).sqrt();
            let bound = T::splat(CHAIN) * (here.remainder * self.mobility[0]).sqrt();
            let stubborn = T::splat(PATIENCE).lt(outcome.iterations);
            let distance = T::select(stubborn, bound.min(length), bound);
            // A step that is not finite ends its lane: it is below no bound.
            active = active & length.lt(T::splat(f64::INFINITY));
            let close = active & distance.le(T::splat(CLOSE) * tolerance);
            if close.any() {
                let error = self.multiplier_error();
                let converged = close & distance.le(tolerance) & error.le(tolerance);
                outcome.converged = outcome.converged | converged;
                active = active & !converged;
                let accuracy = T::select(stubborn, T::splat(STRICT_ACCURACY), T::splat(INNER_ACCURACY));
                let settled = active & close & distance.le(tolerance.max(accuracy * error));
                if settled.any() {
                    self.stiffen(settled & stubborn & (T::splat(SLOW_GAIN) * last_error).lt(error));
                    last_error = T::select(settled, error, last_error);
                    self.recentre(settled);
                    self.respond(Piece::Present);
                }
            }
            if !active.any() {
                break;
            }
        }
        self.write(stage, solution);
        outcome
    }

    /// Laws around the warm start, and twists that satisfy the joints.
    #[inline(always)]
    fn warm_up(&mut self, stage: &Stage<T>, solution: &StageSolution<T>) {
        self.stiffening = T::splat(1.0);
        let (mut mass, mut inertia) = (stage.links[0].mass, stage.links[0].inertia);
        self.links.clear();
        let mut before = stage.links[0].heading;
        let mut end = Vector2::new(T::zero(), T::zero());
        for (i, link) in stage.links.iter().enumerate() {
            (mass, inertia) = (mass.min(link.mass), inertia.min(link.inertia));
            let segment = Segment::new(&link.heading, &before, link.half_length);
            if i == 0 {
                end = free_end(link, &solution.twist[0]);
            }
            let twist = segment.follow(solution.twist[i].z, &mut end);
            let friction = FrictionTerm::new(link, &solution.friction[i], T::splat(PENALTY) * link.mass);
            let drive =
                if i > 0 { DriveTerm::new(&stage.joints[i - 1], solution.drive[i - 1]) } else { DriveTerm::none() };
            self.links.push(LinkTerm::new(link, segment, friction, drive, twist));
            before = link.heading;
        }
        self.mobility = [mass, inertia].map(|least| T::splat(1.0) / least);
        self.contacts.clear();
        for (contact, &impulse) in stage.contacts.iter().zip(&solution.contact) {
            let link = &stage.links[contact.link];
            self.contacts.push(ContactTerm::new(contact, link, impulse, T::splat(PENALTY) * link.mass));
        }
    }

    /// One Newton step in the given lanes, `damped` where it overshoots; the slope falls by `descent` at its start.
    #[inline(always)]
    fn descend(&mut self, descent: T, active: T::Mask, damped: bool) -> Response<T> {
        self.substitute(active);
        let full = self.respond(Piece::Present);
        let overshoots = active & (T::splat(OVERSHOOT) * descent).lt(full.slope);
        if !damped || !overshoots.any() {
            return full;
        }
        let (fraction, _) = self.step_length(T::splat(OVERSHOOT) * descent, overshoots);
        for link in &mut self.links {
            let shortened = add_scaled(&link.start, &link.step, fraction);
            select_into(&mut link.twist, overshoots, &shortened);
        }
        let shortened = self.respond(Piece::Present);
        let remainder = T::select(overshoots, T::splat(f64::INFINITY), full.remainder);
        Response { remainder, ..shortened }
    }

    /// Forces and stiffnesses of all laws at the present twists.
    #[inline(always)]
    fn respond(&mut self, piece: Piece) -> Response<T> {
        let zero = T::zero();
        let (mut slope, mut forces, mut moments) = (zero, zero, zero);
        let mut contacts = self.contacts.iter_mut().peekable();
        let (mut omega, mut change) = (zero, zero);
        for (i, link) in self.links.iter_mut().enumerate() {
            let mut model = link.inertia_model();
            link.friction.respond(&link.twist, &mut model);
            while let Some(contact) = contacts.next_if(|contact| contact.link == i) {
                contact.respond(piece, &link.twist, &mut model);
            }
            let expected = link.model.gradient_after(&link.step);
            let (x, y, moment) = (model.gx - expected.x, model.gy - expected.y, model.gw - expected.z);
            link.model = model;
            let (joint_rate, joint_step) = (link.twist.z - omega, link.step.z - change);
            (omega, change) = (link.twist.z, link.step.z);
            let expected = link.drive.value - link.drive_stiffness * joint_step;
            link.drive_stiffness = link.drive.respond(piece, joint_rate);
            let torque = link.drive.value - expected;
            slope += model.slope_along(&link.step) - link.drive.value * joint_step;
            forces += x * x + y * y;
            moments += moment * moment + torque * torque;
        }
        Response { slope, remainder: forces * self.mobility[0] + moments * self.mobility[1] }
    }

    /// How far the velocities are from obeying the laws because the centres are not yet the impulses \[m/s\].
    #[inline(always)]
    fn multiplier_error(&self) -> T {
        let mut squared = T::zero();
        for link in &self.links {
            squared = squared.max(link.friction.squared_error(&link.twist, link.mass));
        }
        for contact in &self.contacts {
            squared = squared.max(contact.squared_error());
        }
        squared.sqrt()
    }

    /// From tail to head: eliminates the chain. Returns how much steeper the inner function descends along the next
    /// step, g H^-1 g \[J\].
    #[inline(always)]
    fn eliminate(&mut self) -> T {
        let mut behind = Quadratic::zero();
        let (mut drive_behind, mut descent) = (T::zero(), T::zero());
        for link in self.links.iter_mut().rev() {
            let mut own = link.model;
            own.gw += drive_behind - link.drive.value;
            drive_behind = link.drive.value;
            let (before, decrease) = link.segment.eliminate(behind, own, link.drive_stiffness);
            behind = before;
            descent += decrease;
        }
        let (head, decrease) = behind.minimiser();
        self.head = head;
        descent + decrease
    }

    /// From head to tail: the Newton step, taken in full in the given lanes.
    #[inline(always)]
    fn substitute(&mut self, lanes: T::Mask) {
        let (mut end, mut omega) = (self.head, T::zero());
        for link in &mut self.links {
            link.step = link.segment.substitute(&mut end, &mut omega);
            link.start = link.twist;
            let full = add_scaled(&link.start, &link.step, T::splat(1.0));
            select_into(&mut link.twist, lanes, &full);
        }
    }

    /// Raises the penalties tenfold, as far as round-off allows.
    #[inline(always)]
    fn stiffen(&mut self, lanes: T::Mask) {
        let lanes = lanes & self.stiffening.lt(T::splat(MAX_STIFFENING));
        let factor = T::select(lanes, T::splat(10.0), T::splat(1.0));
        self.stiffening = self.stiffening * factor;
        self.links.iter_mut().for_each(|link| link.friction.stiffen(factor));
        self.contacts.iter_mut().for_each(|contact| contact.stiffen(factor));
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        self.links.iter_mut().for_each(|link| link.friction.recentre(lanes));
        self.contacts.iter_mut().for_each(|contact| contact.recentre(lanes));
    }

    /// Velocities in the world frame, and impulses.
    #[inline(always)]
    fn write(&self, stage: &Stage<T>, solution: &mut StageSolution<T>) {
        for (i, link) in self.links.iter().enumerate() {
            let velocity = stage.links[i].heading.to_world(link.twist.xy());
            solution.twist[i] = Vector3::new(velocity.x, velocity.y, link.twist.z);
            solution.friction[i] = link.friction.impulse();
            if i > 0 {
                solution.drive[i - 1] = link.drive.value;
            }
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contacts) {
            *impulse = contact.impulse();
        }
    }
}

/// Velocity of the end without a joint of the first link, in its frame.
#[inline(always)]
fn free_end<T: Real>(link: &StageLink<T>, twist: &Vector3<T>) -> Vector2<T> {
    let u = in_frame(&link.heading, twist);
    Vector2::new(u.x, u.y - link.half_length * u.z)
}

/// Stick stiffness over link mass: large enough that an outer step gains five to six digits and one is mostly
/// enough.
const PENALTY: f64 = 1e6;

/// An inner solve ends when its last step is no longer than this times the multipliers' error: the
/// step after a short Newton step is quadratically shorter.
const INNER_ACCURACY: f64 = 10.0;

/// How much larger the judge's residual may be than the norm of the remainder: joints add up what is out of balance
/// along the chain.
const CHAIN: f64 = 20.0;

/// Distance from the inner minimum, in tolerances, within which the multipliers are looked at.
const CLOSE: f64 = 1e3;

/// Linear solves after which a stage counts as hard: from there on the inner problems are solved well
/// before the centre moves, and penalties rise while the outer steps gain little.
const PATIENCE: f64 = 20.0;
const STRICT_ACCURACY: f64 = 0.1;
const SLOW_GAIN: f64 = 0.25;

/// Beyond a stick stiffness of 1e8 masses round-off in the velocities shows in the impulses.
const MAX_STIFFENING: f64 = 50.0;

/// A step is damped if the slope at its end exceeds this times the descent at its start.
const OVERSHOOT: f64 = 0.1;
