//! Solver of a stage: semismooth Newton on a convex problem whose friction radii follow the normal impulses.
//!
//! Every set-valued law is replaced by its [proximal form](super::proximal) around the multiplier zero, P = prox_C(-r gamma):
//! contacts with a vanishing compliance 1/r, the same for all of them, which selects the shortest of all impulses that move
//! the robot alike. For given friction radii the velocities then minimise a strongly convex, piecewise smooth function:
//! Newton's method on it, one O(n) [`sweep`](super::sweep) a step and a [search along the ray](super::ray) that brackets the
//! zero of the slope, converges from anywhere. At the end the multipliers move to the impulses, once, which undoes the
//! compliance to round-off where it would show.
//!
//! Coulomb's law asks for radii mu P_N of the normal impulses found. Each assembly takes them from the normal impulses at
//! hand, so that forces are those of the coupled problem, and only the tangent neglects that the radii vary: errors shrink
//! some twentyfold a step. Normal impulses in the middle of a search may be absurd, as penalties make them; then the radii
//! of before are kept until the convex problem is all but solved. Where all this does not converge soon,
//! radii are held until it is solved entirely, and move then, by shorter ways while that gains little.
//!
//! Several robots are solved side by side: a lane that has converged keeps its velocities and impulses
//! while the others go on, so that each takes exactly the steps it would take alone.

use nalgebra::Vector2;

use crate::math::{Mask, Real};

use super::link_term::{GroundTerm, LinkTerm};
use super::progress::{Assembly, Corrections, Progress};
use super::proximal::{DriveTerm, FrictionTerm, PegTerm};
use super::screw::{Screw, inner};
use super::sweep::{Quadratic, Segment};
use super::{Outcome, Stage, StageFriction, StageSolution};

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct Newton<T: Real = f64> {
    pub(super) links: Vec<LinkTerm<T>>,
    pub(super) pegs: Vec<PegTerm<T>>,
    friction: StageFriction<T>,
    /// Step of link 1's twist.
    head: Screw<T>,
    /// Mass of the lightest link.
    lightest: T,
}

impl<T: Real> Newton<T> {
    pub fn new(links: usize) -> Self {
        let zero = T::zero();
        Self {
            links: Vec::with_capacity(links),
            pegs: Vec::with_capacity(4 * links),
            friction: StageFriction { sliding: Vector2::new(zero, zero), rolling: zero },
            head: Screw::zero(),
            lightest: zero,
        }
    }

    /// Solves `stage`, starting from the twists and normal impulses in `solution`, to velocities within
    /// about `tolerance` \[m/s\], in at most `max_iterations` linear solves.
    ///
    /// The starting twists need not satisfy the joints: the first link's twist and all joint rates are kept and the rest
    /// follows. Lanes not in `lanes` are left as they are.
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
        let progress = Progress::new(T::splat(tolerance), true, self.lightest, lanes);
        self.descend_from(progress, solution, max_iterations)
    }

    /// The same with every convex problem solved before the friction radii move.
    pub fn solve_strictly(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        tolerance: f64,
        max_iterations: u32,
        lanes: T::Mask,
    ) -> Outcome<T> {
        self.warm_up(stage, solution);
        let progress = Progress::new(T::splat(tolerance), false, self.lightest, lanes);
        self.descend_from(progress, solution, max_iterations)
    }

    #[inline(always)]
    fn descend_from(
        &mut self,
        mut progress: Progress<T>,
        solution: &mut StageSolution<T>,
        max_iterations: u32,
    ) -> Outcome<T> {
        let mut here = self.assemble(T::Mask::of(|_| false));
        self.release();
        for _ in 0..max_iterations {
            progress.count();
            let kept;
            (here, kept) = self.descend(&here, &progress);
            let corrections = progress.judge(&here, kept);
            if corrections.lanes().any() {
                self.correct(&corrections);
                let corrected = self.assemble(corrections.couple);
                here.select_into(corrections.lanes(), &corrected);
            }
            if !progress.active.any() {
                break;
            }
            progress.prepare(&here);
        }
        self.write(solution);
        progress.outcome
    }

    /// From now on contacts are open or closed as their velocities say.
    #[inline(always)]
    fn release(&mut self) {
        for link in &mut self.links {
            link.ends[0].normal.release();
            link.ends[1].normal.release();
        }
        self.pegs.iter_mut().for_each(|peg| peg.contact.release());
    }

    /// Laws with the friction radii of the warm start, and twists that satisfy the joints.
    #[inline(always)]
    fn warm_up(&mut self, stage: &Stage<T>, solution: &StageSolution<T>) {
        self.friction = stage.friction;
        self.lightest = stage.links[0].mass;
        self.links.clear();
        let mut total = T::zero();
        for link in &stage.links {
            self.lightest = self.lightest.min(link.mass);
            total += link.mass;
        }
        let penalty = T::splat(PENALTY / stage.links.len() as f64) * total;
        for i in 0..stage.links.len() {
            let term = self.link_term(stage, solution, i, penalty);
            self.links.push(term);
        }
        self.pegs.clear();
        let pegs = stage.pegs.iter().zip(&solution.peg);
        self.pegs.extend(pegs.map(|(peg, &impulse)| PegTerm::new(peg, penalty, impulse)));
    }

    #[inline(always)]
    fn link_term(&self, stage: &Stage<T>, solution: &StageSolution<T>, i: usize, penalty: T) -> LinkTerm<T> {
        let (zero, link) = (T::zero(), &stage.links[i]);
        let before = if i > 0 { &stage.links[i - 1] } else { link };
        let hinge = [link.hinge(&before.axes[1]), link.hinge(&link.axes[0])];
        let segment = Segment::new(before.joint_arm() + link.joint_arm(), hinge);
        let (twist, rates, drives) = match self.links.last() {
            Some(previous) => {
                let relative = solution.twist[i].angular - solution.twist[i - 1].angular;
                let rates = [inner(&before.axes[1], &relative), inner(&link.axes[0], &relative)];
                (
                    segment.follow(&previous.twist, &rates),
                    rates,
                    stage.joints[i - 1].map(|drive| DriveTerm::new(&drive)),
                )
            }
            None => (solution.twist[0], [zero; 2], [DriveTerm::none(); 2]),
        };
        let mu = &stage.friction;
        let [front, rear] = solution.normal[i];
        let radius = mu.rolling * (front + rear);
        LinkTerm {
            segment,
            link: *link,
            ends: [GroundTerm::new(link, 0, mu, front, penalty), GroundTerm::new(link, 1, mu, rear, penalty)],
            rolling: FrictionTerm::new(Vector2::new(radius, radius), penalty),
            drives,
            start: twist,
            step: Screw::zero(),
            twist,
            start_rates: rates,
            step_rates: [zero; 2],
            rates,
            kinks: [zero; 2],
        }
    }

    /// One damped Newton step from `here`. In coupled lanes the friction radii follow the normal impulses, unless the
    /// step overshoots or the impulses are beyond belief: those of contacts that close during the step are as large as
    /// their penalties make them. Also returns the lanes in which they followed.
    #[inline(always)]
    fn descend(&mut self, here: &Assembly<T>, progress: &Progress<T>) -> (Assembly<T>, T::Mask) {
        let (active, coupled) = (progress.active, progress.coupled);
        self.substitute(active);
        self.for_each_friction(|friction| friction.remember());
        let full = self.assemble(coupled);
        let accuracy = (T::splat(OVERSHOOT) * here.descent).max(progress.negligible());
        let overshoots = active & accuracy.lt(full.slope);
        let undone = overshoots | (coupled & !full.is_plausible(here.largest_radius));
        if !undone.any() {
            return (full, coupled);
        }
        self.for_each_friction(|friction| friction.restore(undone));
        if overshoots.any() {
            let fraction = self.zero_of_slope(accuracy, overshoots);
            self.links.iter_mut().for_each(|link| link.shorten(fraction, overshoots));
        }
        let kept = coupled & !undone;
        (self.assemble(kept), kept)
    }

    /// From tail to head: forces and stiffnesses of all laws at the present twists, and the elimination
    /// of the chain.
    #[inline(always)]
    fn assemble(&mut self, coupled: T::Mask) -> Assembly<T> {
        let zero = T::zero();
        let (mut slope, mut descent, mut radius_error, mut multiplier_error) = (zero, zero, zero, zero);
        let (mut largest_radius, mut squared_speed) = (zero, zero);
        let mut pegs = self.pegs.iter_mut().rev().peekable();
        let mut behind = Quadratic::zero();
        for (i, link) in self.links.iter_mut().enumerate().rev() {
            let mut own = link.inertia_model();
            radius_error = radius_error.max(link.respond_to_ground(&mut own, &self.friction, coupled));
            multiplier_error = multiplier_error.max(link.multiplier_error());
            largest_radius = largest_radius.max(link.largest_radius());
            squared_speed = squared_speed.max(inner(&link.twist.linear, &link.twist.linear));
            while let Some(peg) = pegs.next_if(|peg| peg.link == i) {
                let penalty = peg.contact.respond(peg.direction.dot(&link.twist));
                own.add_rank_one(&peg.direction, penalty, -peg.contact.value);
                multiplier_error = multiplier_error.max(peg.contact.error());
            }
            slope += own.gradient.dot(&link.step);
            let total = behind.plus(&own);
            if i == 0 {
                behind = total;
                break;
            }
            let drives = [link.drives[0].respond(link.rates[0]), link.drives[1].respond(link.rates[1])];
            slope -= drives[0].value * link.step_rates[0] + drives[1].value * link.step_rates[1];
            let (before, decrease) = link.segment.eliminate(total, &drives);
            behind = before;
            descent += decrease;
        }
        let (head, decrease) = behind.minimiser();
        self.head = head;
        Assembly {
            slope,
            descent: descent + decrease,
            radius_error,
            largest_radius,
            fastest: squared_speed.sqrt(),
            multiplier_error,
        }
    }

    /// From head to tail: the Newton step, taken in full in the given lanes.
    #[inline(always)]
    fn substitute(&mut self, lanes: T::Mask) {
        let mut before = self.head;
        for (i, link) in self.links.iter_mut().enumerate() {
            if i > 0 {
                (link.step_rates, before) = link.segment.substitute(&before);
            }
            link.step = before;
            link.start = link.twist;
            link.start_rates = link.rates;
            link.shorten(T::splat(1.0), lanes);
        }
    }

    /// Moves friction radii and multipliers, but for those that the next assembly couples.
    #[inline(always)]
    fn correct(&mut self, corrections: &Corrections<T>) {
        if corrections.settle.any() {
            self.move_radii(corrections.settle, corrections.fraction);
        }
        if corrections.recentre.any() {
            self.recentre(corrections.recentre);
        }
    }

    /// Moves the radii towards those of the normal impulses at hand in the given lanes.
    #[inline(always)]
    fn move_radii(&mut self, lanes: T::Mask, fraction: T) {
        let friction = self.friction;
        self.for_each_friction(|friction| friction.remember());
        self.links.iter_mut().for_each(|link| link.take_radii(&friction));
        self.for_each_friction(|friction| friction.move_part_way(fraction, lanes));
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        self.for_each_friction(|friction| friction.recentre(lanes));
        for link in &mut self.links {
            link.ends[0].normal.recentre(lanes);
            link.ends[1].normal.recentre(lanes);
        }
        self.pegs.iter_mut().for_each(|peg| peg.contact.recentre(lanes));
    }

    #[inline(always)]
    fn for_each_friction(&mut self, mut act: impl FnMut(&mut FrictionTerm<T>)) {
        for link in &mut self.links {
            act(&mut link.ends[0].friction);
            act(&mut link.ends[1].friction);
            act(&mut link.rolling);
        }
    }

    #[inline(always)]
    fn write(&self, solution: &mut StageSolution<T>) {
        for (i, link) in self.links.iter().enumerate() {
            solution.twist[i] = link.twist;
            solution.normal[i] = [link.ends[0].normal.value, link.ends[1].normal.value];
            solution.friction[i] = [link.ends[0].friction.value, link.ends[1].friction.value];
            // The law was asked for (omega_x, omega_y), the rolling velocity is (-omega_y, omega_x).
            solution.rolling[i] = Vector2::new(-link.rolling.value.y, link.rolling.value.x);
            if i > 0 {
                solution.rate[i - 1] = link.rates;
                solution.drive[i - 1] = [link.drives[0].value, link.drives[1].value];
            }
        }
        for (impulse, peg) in solution.peg.iter_mut().zip(&self.pegs) {
            *impulse = peg.contact.value;
        }
    }
}

/// Stiffness r of a contact over the mean mass of a link. The compliance lets a contact that bears a link's weight give
/// way by g c / r, some 1e-10 m/s: far below every tolerance, and far above what round-off does to the sum of impulses.
const PENALTY: f64 = 1e6;

/// A step is damped if the slope at its end exceeds this times the descent at its start.
const OVERSHOOT: f64 = 0.1;
