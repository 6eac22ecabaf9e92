//! Solver of a stage: semismooth Newton on a problem whose friction radii follow the normal impulses.
//!
//! Every set-valued law is replaced by its [proximal form](super::terms) around the multiplier zero,
//! `P = prox_C(-r gamma)`: contacts with a vanishing compliance 1/r, the same for all of them, which selects the
//! shortest of all impulses that move the robot alike; stops that press begin at what their actuators give. Once close to the
//! solution the multipliers move to the impulses, which removes the compliance; where that leaves more than round-off, they move
//! again at the end.
//!
//! Coulomb's law requires the radii mu P_N of the resulting normal impulses. Each assembly takes them from the present
//! normal impulses, and its tangent knows that they vary: Newton's method, one O(n) [`sweep`](super::sweep) per step, converges
//! quadratically. For given radii the velocities minimise a strongly convex, piecewise smooth function, so a step that
//! overshoots is [shortened](super::ray) and keeps its radii. In the middle of a search penalties may make normal impulses
//! implausible; contacts with such impulses keep their radii until steps are short. Where that does not converge, radii are held
//! until the convex problem is nearly solved and moved afterwards, to where [their last moves](Anderson) suggest.
//!
//! Several robots are solved side by side: a lane that has converged keeps its velocities and impulses while the others
//! continue, so that each takes exactly the steps it would take without neighbours.

use crate::laws::{Halves, Whole};
use crate::math::{Mask, Real};
use crate::solver::{LawForm, MotorTerm, Outcome, SurfaceTerm};

use super::anderson::Anderson;
use super::friction_term::FrictionTerm;
use super::link_term::{GroundLaws, LinkTerm};
use super::obstacle_friction::ObstacleFriction;
use super::progress::{Assembly, PassLanes, Progress};
use super::ray_laws::RayLaws;
use super::self_contacts::SelfContacts;
use super::sweep::{ActuatorModel, Affine};
use super::terms::{ObstacleTerm, StopTerm};
use crate::spatial::spatial_vector::{Twist, inner};
use crate::spatial::stage::CONTACTS_PER_LINK;
use crate::spatial::{Stage, StageFriction, StageSolution};

/// Workspace of the solver, re-used from stage to stage.
pub struct Newton<T: Real = f64> {
    pub(super) links: Vec<LinkTerm<T>>,
    /// Of the axes of the joints in turn; empty where no joint is near a stop.
    pub(super) stops: Vec<StopTerm<T>>,
    /// Of the same axes; empty where robots have none.
    pub(super) motors: Vec<MotorTerm<T>>,
    pub(super) contacts: Vec<ObstacleTerm<T>>,
    pub(super) obstacle_friction: ObstacleFriction<T>,
    pub(super) self_contacts: SelfContacts<T>,
    /// Friction of what can be pushed, which is behind the chain in `links`, and its functions in the last elimination.
    pub(super) surfaces: Vec<SurfaceTerm<T>>,
    pub(super) movables: Vec<Affine<T>>,
    pub(super) laws: GroundLaws<T>,
    /// Workspace of a search.
    pub(super) ray: RayLaws<T>,
    /// Of the radii of all friction discs.
    anderson: Anderson<T>,
    /// Step of link 1's twist, and the function of it after the last elimination.
    head: Twist<T>,
    eliminated: Affine<T>,
    /// Mass of the lightest link.
    pub(super) lightest: T,
    /// Whether a contact is held closed or sticking.
    pub(super) is_holding: bool,
    /// Whether friction radii may follow the normal impulses before the convex problem is solved.
    patient: bool,
}

impl<T: Real> Newton<T> {
    /// Friction radii follow the normal impulses at every step while that converges soon.
    pub fn new(links: usize) -> Self {
        Self::with_patience(links, true)
    }

    /// Every convex problem is solved before the friction radii move.
    pub fn strict(links: usize) -> Self {
        Self::with_patience(links, false)
    }

    fn with_patience(links: usize, patient: bool) -> Self {
        let zero = T::zero();
        Self {
            links: Vec::with_capacity(links),
            stops: Vec::with_capacity(2 * (links - 1)),
            motors: Vec::new(),
            contacts: Vec::with_capacity(CONTACTS_PER_LINK * links),
            obstacle_friction: ObstacleFriction::new(links),
            self_contacts: SelfContacts::new(links),
            surfaces: Vec::with_capacity(links),
            movables: Vec::with_capacity(links),
            laws: GroundLaws::new(&StageFriction::none(), zero),
            ray: RayLaws::new(links),
            anderson: Anderson::new((3 + CONTACTS_PER_LINK) * links, MIXING),
            head: Twist::zero(),
            eliminated: Affine::zero(),
            lightest: zero,
            is_holding: false,
            patient,
        }
    }

    /// Solves `stage`, starting from the twists and ground impulses in `solution`, to velocities within
    /// about `tolerance` \[m/s\], in at most `max_iterations` linear solves.
    ///
    /// The starting twists need not satisfy the joints: the first link's twist and all joint rates are kept and the
    /// rest follows. Lanes not in `lanes` take no step; what `solution` has of them afterwards means nothing.
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
        self.anderson.start();
        let mut progress = Progress::new(T::splat(tolerance), self.patient, self.lightest, lanes, max_iterations);
        self.go_on(&mut progress);
        self.write(solution);
        progress.outcome
    }

    /// Takes steps from the present twists until no lane is active.
    #[inline(always)]
    fn go_on(&mut self, progress: &mut Progress<T>) {
        // The first pass moves no lane.
        let mut here = Assembly::nowhere();
        while progress.active.any() {
            here = self.descend(&here, progress);
            self.release();
            let corrections = progress.update(&here);
            if corrections.move_radii.any() {
                self.move_radii(corrections.move_radii);
            }
            if corrections.recentre.any() {
                self.recentre(corrections.recentre);
            }
        }
    }

    /// Goes on in lanes that have converged, to a hundredth of `tolerance`, which was that of the solve: forces of stiff
    /// contacts may be out of balance by the square root of the penalty times the length of the next step. Counts the
    /// steps; what `solution` has of other lanes afterwards means nothing.
    #[inline(always)]
    pub fn polish(
        &mut self,
        solution: &mut StageSolution<T>,
        outcome: &mut Outcome<T>,
        tolerance: f64,
        lanes: T::Mask,
    ) {
        let tolerance = T::splat(POLISHED * tolerance);
        self.anderson.start();
        let mut progress = Progress::new(tolerance, self.patient, self.lightest, lanes, MOST_POLISHING);
        // Apart from the code of stages that need none.
        T::call(
            #[inline(always)]
            || self.go_on(&mut progress),
        );
        outcome.iterations += progress.outcome.iterations;
        self.write(solution);
    }

    /// From now on contacts are open or closed, and stick or slip, as their velocities determine.
    #[inline(always)]
    fn release(&mut self) {
        if !std::mem::take(&mut self.is_holding) {
            return;
        }
        for link in &mut self.links {
            link.ends[0].normal.release();
            link.ends[1].normal.release();
            for friction in link.frictions() {
                friction.release();
            }
        }
        self.stops.iter_mut().for_each(StopTerm::release);
        self.motors.iter_mut().for_each(MotorTerm::release);
        for contact in &mut self.contacts {
            contact.normal.release();
        }
        self.obstacle_friction.frictions().for_each(FrictionTerm::release);
        self.self_contacts.release();
    }

    /// One Newton step from `here` in the lanes that move, damped where it is searched for and overshoots. The friction radii
    /// follow the normal impulses, unless the step is damped, the stage is hard, or an impulse is implausible: those of
    /// contacts that close during the step are as large as their penalties make them.
    #[inline(always)]
    fn descend(&mut self, here: &Assembly<T>, progress: &mut Progress<T>) -> Assembly<T> {
        let moving = progress.moving();
        let searching = progress.searching();
        let (mut fraction, mut overshoots) = (T::splat(1.0), T::Mask::of(|_| false));
        if moving.any() && self.self_contacts.is_empty() {
            self.substitute();
        }
        if searching.any() {
            let accuracy = (T::splat(OVERSHOOT) * here.descent).max(progress.negligible());
            (fraction, overshoots) = self.step_length(accuracy, searching);
        }
        let lanes = progress.lanes(here, overshoots);
        let there = self.pass(fraction, &lanes);
        progress.record(&lanes);
        there
    }

    /// [`assemble`](Self::assemble) by the code for the laws of the stage.
    #[inline(always)]
    fn pass(&mut self, fraction: T, lanes: &PassLanes<T>) -> Assembly<T> {
        if let Some(skin) = self.laws.skin {
            // Apart from the code of other stages.
            T::call(
                #[inline(always)]
                move || self.assemble::<true>(skin, fraction, lanes),
            )
        } else if lanes.recentred.any() {
            self.assemble::<true>(Whole, fraction, lanes)
        } else {
            self.assemble::<false>(Whole, fraction, lanes)
        }
    }

    /// From tail to head: twists a fraction of the step on in lanes that move, forces and stiffnesses of all laws there, and the
    /// elimination of the chain. Unless `RECENTRING` there are no lanes in which multipliers move.
    #[inline(always)]
    fn assemble<const RECENTRING: bool>(
        &mut self,
        halves: impl Halves,
        fraction: T,
        lanes: &PassLanes<T>,
    ) -> Assembly<T> {
        let PassLanes { moving, recentred, .. } = *lanes;
        let zero = T::zero();
        let (mut descent, mut radius_error, mut squared_error) = (zero, zero, zero);
        let (mut largest_radius, mut squared_speed) = (zero, zero);
        let touches_itself = !self.self_contacts.is_empty();
        if touches_itself {
            let links = &self.links;
            squared_error = self.self_contacts.evaluate(
                #[inline(always)]
                |link| links[link].twist_after(fraction, moving),
                recentred,
            );
        }
        let mut contacts = self.contacts.iter_mut().enumerate().rev().peekable();
        let mut behind = Affine::zero();
        let chain = self.links.len() - self.surfaces.len();
        for (i, link) in self.links.iter_mut().enumerate().rev() {
            link.go(fraction, moving);
            if touches_itself {
                self.self_contacts.add_gradient(i, &mut behind.gradient);
            }
            if i >= chain {
                let surface = &mut self.surfaces[i - chain];
                squared_error = squared_error.max(link.evaluate_surface(surface, &mut behind, &self.laws, recentred));
            } else {
                radius_error = radius_error.max(link.evaluate::<RECENTRING>(halves, &mut behind, &self.laws, lanes));
                squared_error = squared_error.max(link.squared_error(halves, &self.laws));
                largest_radius = largest_radius.max(link.largest_radius());
            }
            squared_speed = squared_speed.max(inner(&link.twist.linear, &link.twist.linear));
            while let Some((k, contact)) = contacts.next_if(|(_, contact)| contact.link == i) {
                let closing = contact.direction.dot(&link.twist);
                let penalty = contact.normal.evaluate(closing);
                let load = contact.normal.value;
                if RECENTRING {
                    contact.normal.recentre_here(closing, penalty, recentred);
                }
                behind.add_rank_one(&contact.direction, penalty, -contact.normal.value);
                squared_error = squared_error.max(contact.normal.squared_error());
                let errors = self.obstacle_friction.evaluate::<RECENTRING>(
                    (k, contact),
                    (load, penalty),
                    &link.twist,
                    &mut behind,
                    (lanes, lanes.plausible * link.mass),
                );
                if let Some(error) = errors {
                    radius_error = radius_error.max(error.radius * link.inverse_mass);
                    largest_radius = largest_radius.max(error.largest * link.inverse_mass);
                    squared_error = squared_error.max(error.squared);
                }
            }
            if i >= chain {
                let decrease;
                (link.step, decrease) = behind.solution();
                descent += decrease;
                self.movables[i - chain] = std::mem::replace(&mut behind, Affine::zero());
                continue;
            }
            if i == 0 {
                break;
            }
            let mut axes = [ActuatorModel { stiffness: T::zero(), impulse: T::zero() }; 2];
            for (k, axis) in axes.iter_mut().enumerate() {
                let (rate, mut motor) = (link.rates[k], self.motors.get_mut(2 * (i - 1) + k));
                (axis.impulse, axis.stiffness) =
                    link.actuators[k].evaluate_with(motor.as_deref_mut(), LawForm::Present, rate);
                if let Some(motor) = motor {
                    axis.impulse += motor.recentre_here(rate, recentred);
                    squared_error = squared_error.max(motor.squared_error() * self.laws.penalty * self.laws.penalty);
                }
            }
            if let Some(stops) = self.stops.get_mut(2 * (i - 1)..2 * i) {
                for ((stop, axis), rate) in stops.iter_mut().zip(&mut axes).zip(link.rates) {
                    stop.add_to(axis, rate, recentred);
                    squared_error = squared_error.max(stop.squared_error());
                }
            }
            descent += link.segment.eliminate(&mut behind, &axes, touches_itself);
        }
        let (head, decrease) = behind.solution();
        (self.head, self.eliminated) = (head, behind);
        descent += decrease;
        if touches_itself {
            self.substitute();
            descent -= self.self_contacts.correct(&mut self.links, &self.eliminated, &self.movables);
        }
        Assembly {
            descent,
            radius_error,
            largest_radius,
            fastest: squared_speed.sqrt(),
            multiplier_error: squared_error.sqrt() / self.laws.penalty,
        }
    }

    /// From head to tail: the Newton step without the stiffness of contacts between links.
    #[inline(always)]
    fn substitute(&mut self) {
        let (mut before, chain) = (self.head, self.links.len() - self.surfaces.len());
        self.links[0].step = before;
        for link in &mut self.links[1..chain] {
            before = link.take_step(&before);
        }
    }

    /// The links, without what can be pushed.
    #[inline(always)]
    pub(super) fn chain(&self) -> &[LinkTerm<T>] {
        &self.links[..self.links.len() - self.surfaces.len()]
    }

    /// What can be pushed, with its friction.
    #[inline(always)]
    pub(super) fn pushed(&self) -> impl Iterator<Item = (&LinkTerm<T>, &SurfaceTerm<T>)> {
        self.links[self.chain().len()..].iter().zip(&self.surfaces)
    }

    /// Moves the friction radii to where [`Anderson`] expects those of the normal impulses, in the given lanes.
    #[inline(always)]
    fn move_radii(&mut self, lanes: T::Mask) {
        let Self { anderson, links, obstacle_friction, contacts, laws, .. } = self;
        let of_ground = 3 * links.len();
        for (i, link) in links.iter_mut().enumerate() {
            anderson.compare(3 * i, link.radii(laws), lanes);
        }
        anderson.compare(of_ground, obstacle_friction.radii(contacts), lanes);
        anderson.combine(lanes);
        for (i, link) in links.iter_mut().enumerate() {
            anderson.go(3 * i, link.radii(laws), lanes);
        }
        anderson.go(of_ground, obstacle_friction.radii(contacts), lanes);
    }

    #[inline(always)]
    fn recentre(&mut self, lanes: T::Mask) {
        // Closures of `for_each` would be compiled as functions without the instructions of the kernel.
        self.is_holding = true;
        for link in &mut self.links {
            link.ends[0].normal.recentre(lanes);
            link.ends[1].normal.recentre(lanes);
            for friction in link.frictions() {
                friction.recentre(lanes);
            }
            if let Some(skin) = self.laws.skin {
                for end in &mut link.ends {
                    end.friction.raise(skin, lanes);
                }
            }
        }
        for stop in &mut self.stops {
            stop.recentre(lanes);
        }
        for motor in &mut self.motors {
            motor.recentre(lanes);
        }
        for contact in &mut self.contacts {
            contact.normal.recentre(lanes);
        }
        for friction in self.obstacle_friction.frictions() {
            friction.recentre(lanes);
        }
        self.self_contacts.recentre(lanes);
        for surface in &mut self.surfaces {
            surface.recentre(lanes);
        }
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

/// Of the radii in hard stages, where many discs share the load: what is left of it moves between them.
const MIXING: f64 = 0.5;

/// Tolerance of a polish over that of the solve, and the most linear solves that it may take.
const POLISHED: f64 = 0.01;
const MOST_POLISHING: u32 = 30;

/// A step is damped if the slope at its end exceeds this times the descent at its start.
const OVERSHOOT: f64 = 0.1;
