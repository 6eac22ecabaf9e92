//! Newton's method on the augmented Lagrangian of a stage, in the lanes of a register.
//!
//! The iteration is that of [`crate::solver`]; this file is the planar chain's inner problem. Every link's velocities
//! are kept in its own frame, where friction is diagonal and the arm to a joint is along e_y. A pass from head to tail
//! takes the Newton step and evaluates all laws at its end; a pass from tail to head eliminates the chain.
//!
//! At the end of a full step the linearised laws balance exactly, so what is out of balance there is the remainder of
//! the laws' linearisation. The curvature of the inner function is at least that of the kinetic energy: the remainder's norm in M^-1
//! bounds the distance to its minimum, link by link, and no further solve is needed to know it. With friction at contacts, which
//! makes the tangent unsymmetric, this is an estimate, and the certificate judges.

use nalgebra::Vector2;

use crate::contact::PAIRS_PER_LINK;
use crate::laws::{Halves, Skin, Whole};
use crate::math::{Mask, Real, add_scaled, select_into};
use crate::planar::{Stage, StageSolution};
use crate::solver::{self, LawForm, MotorTerm, NewtonStep, Outcome, StageProblem, SurfaceTerm, Tuning};

use super::contact_friction::ContactFriction;
use super::link_term::{LinkTerm, linear};
use super::self_contacts::SelfContacts;
use super::sweep::Quadratic;
use super::terms::{ContactTerm, OnLink, StopTerm};
use super::unilateral::RowLaw;
use super::unsolved::Unsolved;

/// Workspace of the solver, re-used from stage to stage.
pub struct Newton<T: Real = f64> {
    pub(super) links: Vec<LinkTerm<T>>,
    pub(super) skin: Option<Skin>,
    /// Of the joint before each link but the first; empty where no joint is near a stop.
    pub(super) stops: Vec<StopTerm<T>>,
    /// Of the same; empty where robots have none.
    pub(super) motors: Vec<MotorTerm<T>>,
    /// Of each link; empty where the ground does not resist spin.
    pub(super) spins: Vec<MotorTerm<T>>,
    /// Friction of the ground on what can be pushed; as links these have none.
    pub(super) surfaces: Vec<SurfaceTerm<T>>,
    pub(super) contacts: Vec<ContactTerm<T>>,
    pub(super) obstacle_friction: ContactFriction<OnLink<T>, T>,
    pub(super) self_contacts: SelfContacts<T>,
    /// Whether the bounds of friction at contacts stay as they are instead of following the normal impulses.
    are_bounds_held: bool,
    /// Newton steps of the present solve.
    steps: u32,
    /// Lanes in which these bounds follow the normal impulses: none that has converged, since bounds that were held would move.
    following: T::Mask,
    /// Step of the velocity of link 1's free end, in the frame of link 1.
    head: Vector2<T>,
    /// Value of the whole chain at that end, and of each obstacle that can be pushed, behind the links, at its centre.
    chain: Quadratic<T>,
    pub(super) movables: Vec<Quadratic<T>>,
    /// Inverse of the least mass and of the least inertia of a link.
    pub(super) mobility: [T; 2],
}

/// Where a step leads.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepEnd<T> {
    /// Derivative of the inner function along the step \[J\].
    slope: T,
    /// Square of the difference to the laws' linearisations at the start of the step, in the norm of M^-1 \[J\].
    remainder: T,
}

impl<T: Real> Newton<T> {
    pub fn new(links: usize) -> Self {
        Self {
            links: vec![LinkTerm::vacant(); links],
            skin: None,
            stops: Vec::with_capacity(links - 1),
            motors: Vec::new(),
            spins: Vec::with_capacity(links),
            surfaces: Vec::with_capacity(links),
            contacts: Vec::with_capacity(PAIRS_PER_LINK * links),
            obstacle_friction: ContactFriction::new(PAIRS_PER_LINK * links),
            self_contacts: SelfContacts::new(links),
            are_bounds_held: false,
            steps: 0,
            following: T::Mask::of(|_| false),
            head: Vector2::new(T::zero(), T::zero()),
            chain: Quadratic::zero(),
            movables: Vec::with_capacity(links),
            mobility: [T::zero(); 2],
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
        self.steps = 0;
        self.follow(lanes);
        let outcome = solver::solve(self, tolerance, max_iterations, lanes);
        self.write(stage, solution, lanes);
        outcome
    }

    /// The same with the bounds of friction at contacts that the stage has.
    #[inline(always)]
    pub fn solve_with_held_bounds(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        tolerance: f64,
        max_iterations: u32,
        lanes: T::Mask,
    ) -> Outcome<T> {
        self.are_bounds_held = true;
        let outcome = self.solve(stage, solution, tolerance, max_iterations, lanes);
        self.are_bounds_held = false;
        outcome
    }

    /// How far the bounds of friction at contacts are from those of the normal impulses, as a velocity \[m/s\].
    #[inline(always)]
    pub fn bound_error(&self) -> T {
        let between_links = self.self_contacts.squared_bound_error();
        self.obstacle_friction.squared_bound_error(&self.contacts).max(between_links).sqrt()
    }

    /// Whether the bounds of friction at contacts follow the normal impulses at every velocity. Where that does not converge
    /// soon they are held for a while: inner problems then have a minimum, which a search along the steps finds from anywhere.
    #[inline(always)]
    fn do_bounds_follow(&self) -> bool {
        !self.are_bounds_held && self.steps % (FOLLOWING + HOLDING) <= FOLLOWING
    }

    /// Lets bounds follow in the given lanes, if any are to.
    #[inline(always)]
    fn follow(&mut self, lanes: T::Mask) {
        let follows = self.do_bounds_follow();
        self.following = lanes & T::Mask::of(|_| follows);
    }

    /// Whether there is more than a chain: rows between links, or obstacles that can be pushed.
    #[inline(always)]
    pub(super) fn is_coupled(&self) -> bool {
        !(self.self_contacts.is_empty() && self.movables.is_empty())
    }

    #[inline(always)]
    pub(super) fn is_rough(&self) -> bool {
        !self.obstacle_friction.terms.is_empty()
    }

    /// Takes one Newton step; `COUPLED` tells what [`Self::is_coupled`] does, and `ROUGH` whether any contact may have friction.
    #[inline(always)]
    pub(super) fn step<const COUPLED: bool, const ROUGH: bool>(
        &mut self,
        halves: impl Halves,
        active: T::Mask,
        damped: bool,
    ) -> NewtonStep<T> {
        let are_bounds_followed = self.do_bounds_follow();
        let mut descent = self.eliminate::<COUPLED, ROUGH>();
        if COUPLED {
            let chain = self.links.len() - self.movables.len();
            let (chain, free) = self.links.split_at_mut(chain);
            let mut substitute = back_substitution(self.head);
            for link in chain {
                substitute(link);
            }
            for (link, value) in free.iter_mut().zip(&self.movables) {
                link.step = link.segment.substitute(&mut value.minimiser().0, &mut T::zero());
            }
            descent -= self.self_contacts.correct(&mut self.links, &self.chain, &self.movables);
        }
        let end = self.descend::<COUPLED, ROUGH>(halves, descent, active, damped);
        NewtonStep {
            // The length of the step as a velocity; `max` would swallow NaN.
            length: (descent.abs() * self.mobility[0]).sqrt(),
            distance: T::splat(CHAIN) * (end.remainder * self.mobility[0]).sqrt(),
            changed: ROUGH && !are_bounds_followed && self.do_bounds_follow(),
        }
    }

    /// From tail to head: eliminates the chain. Returns how much steeper the inner function descends along the next
    /// step, g H^-1 g \[J\].
    #[inline(always)]
    fn eliminate<const COUPLED: bool, const ROUGH: bool>(&mut self) -> T {
        let mut behind = Quadratic::zero();
        let (mut moment_behind, mut descent) = (T::zero(), T::zero());
        let chain = self.links.len() - self.movables.len();
        for ((i, link), value) in self.links.iter_mut().enumerate().skip(chain).zip(&mut self.movables) {
            let mut own = link.model;
            if COUPLED {
                own.subtract_force(&self.self_contacts.force[i]);
            }
            let (at_centre, decrease) = link.segment.eliminate::<ROUGH>(Quadratic::zero(), own, T::zero());
            *value = at_centre;
            descent += decrease + at_centre.minimiser().1;
        }
        for (i, link) in self.links[..chain].iter_mut().enumerate().rev() {
            let mut own = link.model;
            if COUPLED {
                own.subtract_force(&self.self_contacts.force[i]);
            }
            own.gw += moment_behind - link.joint_moment;
            moment_behind = link.joint_moment;
            let (before, decrease) = link.segment.eliminate::<ROUGH>(behind, own, link.joint_stiffness);
            behind = before;
            descent += decrease;
        }
        let (head, decrease) = behind.minimiser();
        (self.head, self.chain) = (head, behind);
        descent + decrease
    }

    /// Takes the step that [`Self::eliminate`] prepared, in the given lanes, and shortens it where it overshoots and
    /// `damped` is true; the slope falls by `descent` at its start.
    #[inline(always)]
    fn descend<const COUPLED: bool, const ROUGH: bool>(
        &mut self,
        halves: impl Halves,
        descent: T,
        active: T::Mask,
        damped: bool,
    ) -> StepEnd<T> {
        self.steps += 1;
        self.follow(active);
        let full = self.take_step::<COUPLED, ROUGH>(halves, active);
        let mut accuracy = T::splat(TUNING.overshoot) * descent;
        let mut overshoots = active & accuracy.lt(full.slope);
        if !damped || !overshoots.any() {
            return full;
        }
        if ROUGH && self.do_bounds_follow() {
            // The tangent is that of no function, so that steps need not descend.
            accuracy = T::splat(-TUNING.overshoot) * self.slope_at_start();
            overshoots = overshoots & T::zero().lt(accuracy) & accuracy.lt(full.slope);
            if !overshoots.any() {
                return full;
            }
        }
        let (fraction, _) = self.step_length(accuracy, overshoots);
        for link in &mut self.links {
            let shortened = add_scaled(&link.start, &link.step, fraction);
            select_into(&mut link.twist, overshoots, &shortened);
        }
        let shortened = self.evaluate_here(LawForm::Present);
        let remainder = T::select(overshoots, T::splat(f64::INFINITY), full.remainder);
        StepEnd { remainder, ..shortened }
    }

    /// From head to tail: takes the Newton step in full in the given lanes and evaluates all laws at its end.
    #[inline(always)]
    fn take_step<const COUPLED: bool, const ROUGH: bool>(&mut self, halves: impl Halves, lanes: T::Mask) -> StepEnd<T> {
        if COUPLED {
            for link in &mut self.links {
                link.advance(lanes);
            }
            return self.evaluate_laws::<true, ROUGH>(halves, LawForm::Present, |_| ());
        }
        self.evaluate_laws::<false, ROUGH>(halves, LawForm::Present, full_step(self.head, lanes))
    }

    /// Forces and stiffnesses of all laws at the present twists, to which `advance` brings each link first; contacts
    /// between links need twists that are already there.
    #[inline(always)]
    pub(super) fn evaluate_laws<const COUPLED: bool, const ROUGH: bool>(
        &mut self,
        halves: impl Halves,
        form: LawForm,
        mut advance: impl FnMut(&mut LinkTerm<T>),
    ) -> StepEnd<T> {
        let zero = T::zero();
        let (mut slope, mut forces, mut moments) = (zero, zero, zero);
        let follows = self.following;
        if COUPLED {
            slope = self.self_contacts.evaluate(form, &self.links, follows);
        }
        let mut unsolved = Unsolved::new();
        let mut contacts = self.contacts.iter_mut().enumerate().peekable();
        let mut friction = self.obstacle_friction.terms.iter_mut().peekable();
        let chain = self.links.len() - self.surfaces.len();
        let (mut omega, mut change) = (zero, zero);
        for (i, link) in self.links.iter_mut().enumerate() {
            advance(link);
            let mut model = link.inertia_model();
            let stiffness = link.friction.evaluate(halves, &linear(&link.twist));
            model.add_friction(&stiffness, &link.friction.impulse());
            if let Some(spin) = self.spins.get_mut(i) {
                let (impulse, stiffness) = spin.evaluate(form, link.twist.z);
                (model.gw, model.ww) = (model.gw - impulse, model.ww + stiffness);
            }
            if COUPLED && i >= chain {
                model.add_surface(&mut self.surfaces[i - chain], &link.twist);
            }
            while let Some((k, contact)) = contacts.next_if(|(_, contact)| contact.row.link == i) {
                let stiffness = contact.law.evaluate(form, contact.velocity(&link.twist));
                model.add_rank_one(&contact.row.direction, stiffness, -contact.law.impulse);
                if ROUGH && let Some(term) = friction.next_if(|term| term.law.normal == k) {
                    let across = term.law.evaluate(form, term.velocity(&link.twist), contact.law.impulse, follows);
                    model.add_rank_one(&term.row.direction, across, -term.law.impulse());
                    let coupling = term.law.ratio * stiffness;
                    model.add_coupling(&term.row.direction, &contact.row.direction, coupling);
                }
            }
            let mut expected = link.model.gradient_after::<ROUGH>(&link.step);
            let (mut x, mut y, mut moment) = (model.gx - expected.x, model.gy - expected.y, model.gw - expected.z);
            if COUPLED {
                let coupled = &self.self_contacts.remainder[i];
                (x, y, moment) = (x - coupled.x, y - coupled.y, moment - coupled.z);
                expected += coupled - self.self_contacts.force[i];
            }
            link.model = model;
            let (joint_rate, joint_step) = (link.twist.z - omega, link.step.z - change);
            (omega, change) = (link.twist.z, link.step.z);
            let expected_moment = link.joint_stiffness.subtract_from(joint_step, link.joint_moment);
            if ROUGH {
                if COUPLED && i >= chain {
                    unsolved.add_free(&expected);
                } else {
                    unsolved.add(&link.segment, &expected, expected_moment);
                }
            }
            let motor = i.checked_sub(1).and_then(|joint| self.motors.get_mut(joint));
            (link.joint_moment, link.joint_stiffness) = link.actuator.evaluate_with(motor, form, joint_rate);
            if i > 0
                && let Some(stop) = self.stops.get_mut(i - 1)
            {
                link.joint_stiffness += stop.evaluate(form, joint_rate);
                link.joint_moment += stop.moment();
            }
            let torque = link.joint_moment - expected_moment;
            slope = link.joint_moment.subtract_from(joint_step, slope + model.slope_along(&link.step));
            forces = x.mul_add(x, y.mul_add(y, forces));
            moments = moment.mul_add(moment, torque.mul_add(torque, moments));
        }
        if ROUGH {
            let left = unsolved.squares();
            (forces, moments) = (forces + left[0], moments + left[1]);
        }
        StepEnd { slope, remainder: forces * self.mobility[0] + moments * self.mobility[1] }
    }

    /// Makes multipliers of the ground's friction, which are impulses, what belongs to these with a skin.
    #[inline(always)]
    pub(super) fn raise(&mut self, lanes: T::Mask) {
        if let Some(skin) = self.skin {
            for link in &mut self.links {
                link.friction.raise(skin, lanes);
            }
        }
    }

    /// Worst error of the multipliers of the ground's friction.
    #[inline(always)]
    pub(super) fn squared_friction_error(&self, halves: impl Halves) -> T {
        let mut squared = T::zero();
        for link in &self.links {
            squared = squared.max(link.friction.squared_error(halves, &linear(&link.twist), link.mass));
        }
        for (surface, link) in self.surfaces.iter().zip(self.pushed()) {
            squared = squared.max(surface.squared_error(&link.twist, link.mass));
        }
        squared
    }

    /// What can be pushed, behind the links.
    #[inline(always)]
    pub(super) fn pushed(&self) -> &[LinkTerm<T>] {
        &self.links[self.links.len() - self.surfaces.len()..]
    }
}

impl Newton {
    /// [`Self::solve`] of one robot, compiled once.
    pub fn solve_one(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        max_iterations: u32,
    ) -> Outcome {
        f64::call(
            #[inline(always)]
            move || self.solve(stage, solution, tolerance, max_iterations, true),
        )
    }
}

impl<T: Real> StageProblem<T> for Newton<T> {
    const TUNING: Tuning = TUNING;

    #[inline(always)]
    fn evaluate(&mut self, form: LawForm) {
        self.evaluate_here(form);
    }

    #[inline(always)]
    fn newton_step(&mut self, active: T::Mask, damped: bool) -> NewtonStep<T> {
        if !self.is_coupled() && self.skin.is_none() {
            if self.is_rough() {
                self.rough_step(active, damped)
            } else {
                self.step::<false, false>(Whole, active, damped)
            }
        } else {
            self.coupled_step(active, damped)
        }
    }

    #[inline(always)]
    fn multiplier_error(&self) -> T {
        let mut squared = match self.skin {
            None => self.squared_friction_error(Whole),
            Some(skin) => T::call(
                #[inline(always)]
                || self.squared_friction_error(skin),
            ),
        };
        for stop in &self.stops {
            squared = squared.max(stop.squared_error());
        }
        for motor in self.motors.iter().chain(&self.spins) {
            squared = squared.max(motor.squared_error());
        }
        for contact in &self.contacts {
            squared = squared.max(contact.law.squared_error());
        }
        squared = squared.max(self.obstacle_friction.squared_error(&self.contacts, self.are_bounds_held));
        squared.max(self.self_contacts.squared_error(self.are_bounds_held)).sqrt()
    }

    #[inline(always)]
    fn stiffen(&mut self, factor: T) {
        self.links.iter_mut().for_each(|link| link.friction.stiffen(factor));
        self.stops.iter_mut().for_each(|stop| stop.stiffen(factor));
        self.motors.iter_mut().for_each(|motor| motor.stiffen(factor));
        self.spins.iter_mut().for_each(|spin| spin.stiffen(factor));
        self.surfaces.iter_mut().for_each(|surface| surface.stiffen(factor));
        self.contacts.iter_mut().for_each(|contact| contact.law.stiffen(factor));
        self.obstacle_friction.stiffen(factor);
        self.self_contacts.stiffen(factor);
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        self.links.iter_mut().for_each(|link| link.friction.recentre(lanes));
        self.raise(lanes);
        self.stops.iter_mut().for_each(|stop| stop.recentre(lanes));
        self.motors.iter_mut().for_each(|motor| motor.recentre(lanes));
        self.spins.iter_mut().for_each(|spin| spin.recentre(lanes));
        self.surfaces.iter_mut().for_each(|surface| surface.recentre(lanes));
        self.contacts.iter_mut().for_each(|contact| contact.law.recentre(lanes));
        self.obstacle_friction.recentre(lanes);
        self.self_contacts.recentre(lanes);
        if !self.are_bounds_held {
            self.obstacle_friction.move_bounds(&self.contacts, lanes);
            self.self_contacts.move_bounds(lanes);
        }
    }
}

/// Writes the Newton steps of the links from the first to the last, given that of the chain's free end.
#[inline(always)]
fn back_substitution<T: Real>(head: Vector2<T>) -> impl FnMut(&mut LinkTerm<T>) {
    let (mut end, mut omega) = (head, T::zero());
    #[inline(always)]
    move |link| link.step = link.segment.substitute(&mut end, &mut omega)
}

/// Takes the Newton steps of the links in full, from the first to the last, in the given lanes.
#[inline(always)]
fn full_step<T: Real>(head: Vector2<T>, lanes: T::Mask) -> impl FnMut(&mut LinkTerm<T>) {
    let mut substitute = back_substitution(head);
    #[inline(always)]
    move |link| {
        substitute(link);
        link.advance(lanes);
    }
}

/// An outer step with this penalty gains five to six digits, and one is mostly enough; a stick stiffness beyond 1e8
/// masses would show round-off in the impulses.
pub(super) const TUNING: Tuning = Tuning { penalty: 1e6, ..Tuning::COMMON };

/// Bounds follow in the first evaluations of a solve, the warm start's and one for each of so many Newton steps. In the rest of
/// a period of both they move with the multipliers only.
const FOLLOWING: u32 = 12;
const HOLDING: u32 = 6;

/// How much larger the certificate's residual may be than the norm of the remainder \[-\]: imbalances add up
/// along the chain.
const CHAIN: f64 = 20.0;
