//! Progress of a solve: which lanes have converged, in which friction follows normal impulses, which need correction.

use crate::math::{Mask, Real};
use crate::solver::Outcome;

/// Results of a pass over the chain at the trial velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Assembly<T> {
    /// How steeply the convex function descends along the next step, g H^-1 g \[J\]; an estimate where friction follows.
    pub descent: T,
    /// How far the friction radii are from those of the normal impulses, as a velocity \[m/s\].
    pub radius_error: T,
    /// The largest friction radius, over the mass \[m/s\].
    pub largest_radius: T,
    /// Speed of the fastest link's CG \[m/s\].
    pub fastest: T,
    /// How far the velocities are from obeying the laws because the centres are not yet the impulses \[m/s\].
    pub multiplier_error: T,
}

/// Lanes in which a pass does more than evaluate.
#[derive(Debug, Clone, Copy)]
pub(super) struct PassLanes<T: Real> {
    /// Twists take the step.
    pub moving: T::Mask,
    /// Friction radii become those of the normal impulses, and the tangent knows that they will in the next step.
    pub following: T::Mask,
    /// The change of a radius, as a velocity \[m/s\], up to which its normal impulse counts as plausible; negative where radii do
    /// not follow.
    pub plausible: T,
    /// Normal impulses may be none that a radius can take, on the branch of the last stage or where multipliers have moved:
    /// friction is extrapolated to theirs, and the tangent knows.
    pub extrapolated: T::Mask,
    /// Multipliers move to the impulses.
    pub recentred: T::Mask,
}

/// What is to be done before the next step; a lane needs at most one of these. Its velocities do not change during the
/// next pass over the chain, in which others take their steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corrections<T: Real> {
    /// Radii move towards those of the solved convex problem's normal impulses.
    pub move_radii: T::Mask,
    /// All is solved but for the compliance: multipliers move to the impulses.
    pub recentre: T::Mask,
}

/// State of a solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress<T: Real> {
    tolerance: T,
    patience: T,
    /// Mass that turns the length of a step into a velocity.
    mass: T,
    pub active: T::Mask,
    /// What has been done since the last pass over the chain.
    pub corrections: Corrections<T>,
    /// Lanes whose multipliers move to the impulses at the end of the next step, if friction radii follow in it; those in which
    /// they have done so at the end of the last one, and at that of any.
    pub recentre_next: T::Mask,
    just_recentred: T::Mask,
    recentred: T::Mask,
    /// Lanes whose steps have become much shorter, or multipliers moved, so that the next one is taken in full.
    pub converging: T::Mask,
    /// Length of the last step \[m/s\].
    last_length: T,
    /// Whether there has been a pass.
    begun: bool,
    /// Lanes at the end of a step.
    arrived: T::Mask,
    /// Linear solves after which a lane is abandoned.
    most: T,
    pub outcome: Outcome<T>,
}

impl<T: Real> Assembly<T> {
    /// Before the first pass.
    #[inline(always)]
    pub fn nowhere() -> Self {
        let zero = T::zero();
        Self { descent: zero, radius_error: zero, largest_radius: zero, fastest: zero, multiplier_error: zero }
    }
}

impl<T: Real> Corrections<T> {
    #[inline(always)]
    pub fn lanes(&self) -> T::Mask {
        self.move_radii | self.recentre
    }
}

impl<T: Real> Progress<T> {
    /// With `patient` false, friction radii move only when the convex problem is solved.
    #[inline(always)]
    pub fn new(tolerance: T, patient: bool, mass: T, lanes: T::Mask, max_iterations: u32) -> Self {
        let none = T::Mask::of(|_| false);
        Self {
            tolerance,
            patience: T::splat(if patient { PATIENCE } else { -1.0 }),
            mass,
            active: lanes,
            corrections: Corrections { move_radii: none, recentre: none },
            recentre_next: none,
            just_recentred: none,
            recentred: none,
            converging: none,
            last_length: T::zero(),
            begun: false,
            arrived: none,
            most: T::splat(f64::from(max_iterations)),
            outcome: Outcome { iterations: T::zero(), converged: none },
        }
    }

    /// The lanes that take a step. In others the solve has converged, or their laws are evaluated at the same velocities,
    /// as all are at first.
    #[inline(always)]
    pub fn moving(&self) -> T::Mask {
        let begun = T::Mask::of(|_| self.begun);
        begun & self.active & !self.corrections.lanes()
    }

    /// Those of them whose step is searched for where it overshoots.
    #[inline(always)]
    pub fn searching(&self) -> T::Mask {
        let is_searched = self.is_hard() | T::splat(TAKEN_IN_FULL).le(self.outcome.iterations);
        self.moving() & !self.converging & is_searched
    }

    /// The lanes of the next pass, which takes a shorter step in those that overshoot. These and hard ones keep their friction
    /// radii, so that the step after that is one of the convex problem and descends.
    #[inline(always)]
    pub fn lanes(&self, here: &Assembly<T>, overshoots: T::Mask) -> PassLanes<T> {
        let (moving, follows) = (self.moving(), !self.is_hard());
        let following = moving & follows & !overshoots;
        let plausible = T::select(following, self.plausible(here), T::splat(-1.0));
        let (holding, recentred) = (self.active & !moving & follows, self.recentre_next & following);
        PassLanes { moving, following, plausible, extrapolated: holding | recentred, recentred }
    }

    /// Change of a friction radius, as a velocity, up to which its normal impulse counts as plausible.
    #[inline(always)]
    fn plausible(&self, here: &Assembly<T>) -> T {
        let motion = T::splat(PLAUSIBLE) * (here.largest_radius + here.fastest);
        let is_accurate = self.last_length.le((T::splat(TRUST) * here.radius_error.min(motion)).max(self.tolerance));
        T::select(is_accurate, T::splat(f64::INFINITY), T::splat(PLAUSIBLE) * here.largest_radius)
    }

    /// Records a pass.
    #[inline(always)]
    pub fn record(&mut self, lanes: &PassLanes<T>) {
        let PassLanes { moving, recentred, .. } = *lanes;
        self.begun = true;
        self.just_recentred = recentred;
        self.recentred = self.recentred | recentred;
        self.outcome.iterations += T::select(moving, T::splat(1.0), T::zero());
        self.arrived = moving;
    }

    /// Updates the state of the solve by the steps that ended `here`; returns what is to be corrected.
    #[inline(always)]
    pub fn update(&mut self, here: &Assembly<T>) -> Corrections<T> {
        let tolerance = self.tolerance;
        // The length of the next step as a velocity; `max` would drop NaN.
        let next = (here.descent.abs() / self.mass).sqrt();
        let is_close = next.le(T::splat(CLOSE) * here.largest_radius);
        let shorter = next.le(T::splat(CONVERGING) * self.last_length);
        let early = self.outcome.iterations.lt(T::splat(UNSEARCHED));
        self.converging = self.arrived & early & (self.just_recentred | (is_close & shorter));
        self.last_length = next;
        let hard = self.is_hard();
        let mistaken = self.arrived & tolerance.lt(here.radius_error);
        let nearly_solved = next.le((T::splat(NEARLY_SOLVED) * here.radius_error).max(tolerance));
        let move_radii = mistaken & hard & nearly_solved;
        // Where multipliers have just moved, impulses are those of the linearised laws.
        let solved = self.arrived & !mistaken & !self.just_recentred & next.le(T::splat(ACCURACY) * tolerance);
        let at_rest = T::select(hard, T::splat(EXACT_AT_LAST), T::splat(EXACT_AT_REST));
        let exact = here.multiplier_error.le(self.creep(here) + at_rest * tolerance);
        self.outcome.converged = self.outcome.converged | (solved & exact);
        // A step that is not finite ends its lane: it is below no bound. One was taken, so that it shows in the
        // velocities.
        let goes_on = next.lt(T::splat(f64::INFINITY)) & self.outcome.iterations.lt(self.most);
        self.active = self.active & !(self.arrived & (self.outcome.converged | !goes_on));
        // A lane that has ended keeps its impulses while others continue.
        let is_minimised = !hard | next.le(T::splat(INNER_ACCURACY) * here.multiplier_error);
        let recentre = solved & !exact & self.active & is_minimised;
        let is_strict = tolerance.lt(T::splat(STRICT) * here.fastest);
        let may_recentre = is_close & self.will_be_exact(next, here) & !exact & !self.recentred & !is_strict;
        // A lane cannot end with impulses that are linearised: re-evaluated beside a neighbour they would be others.
        let has_time = (self.outcome.iterations + T::splat(1.0)).lt(self.most);
        self.recentre_next = self.active & self.arrived & here.radius_error.le(T::zero()) & may_recentre & has_time;
        self.corrections = Corrections { move_radii: move_radii & self.active, recentre };
        self.corrections
    }

    /// Whether multipliers that move to the impulses at the end of a step of length `next` will leave nothing to be
    /// removed: that length bounds by which share of themselves they are wrong.
    #[inline(always)]
    fn will_be_exact(&self, next: T, here: &Assembly<T>) -> T::Mask {
        (next * here.multiplier_error).le(self.creep(here) * here.largest_radius)
    }

    /// Violation that the compliance may leave because the robot moves \[m/s\].
    #[inline(always)]
    fn creep(&self, here: &Assembly<T>) -> T {
        (T::splat(EXACT) * here.fastest).min(self.tolerance)
    }

    /// Decrease below which nothing is searched for \[J\].
    #[inline(always)]
    pub fn negligible(&self) -> T {
        T::splat(NEGLIGIBLE) * self.mass * self.tolerance * self.tolerance
    }

    /// From here on convex problems are solved before friction radii move.
    #[inline(always)]
    pub fn is_hard(&self) -> T::Mask {
        self.patience.lt(self.outcome.iterations)
    }
}

/// Linear solves after which a stage counts as hard: from there on convex problems are solved before radii move.
const PATIENCE: f64 = 20.0;

/// Change of a friction radius over the largest of all up to which its normal impulse counts as plausible: that of a
/// contact that closes during a step may exceed the solution's by orders of magnitude.
const PLAUSIBLE: f64 = 5.0;

/// Length of a step over the error of the friction radii, or over that of usual ones, below which all normal impulses are
/// plausible: in it errors of the forces of closed contacts are divided by the square root of the penalty.
const TRUST: f64 = 1e-2;

/// Length of the next step over that of the last one from which on it needs no line search: Newton's method converges
/// quadratically.
const CONVERGING: f64 = 0.2;

/// First steps of a stage that are taken in full wherever they lead, unless it is hard: the impulses before predict well which
/// contacts stay closed and which stick, and the second step corrects the first. Searching them takes more than it saves.
const TAKEN_IN_FULL: f64 = 2.0;

/// Linear solves after which every step is searched: steps taken in full may lead back to where they came from.
const UNSEARCHED: f64 = 7.0;

/// Length of a step over the error of the friction radii below which the normal impulses of a hard stage count as accurate:
/// the next radii depend on how errors change.
const NEARLY_SOLVED: f64 = 1e-3;

/// Length of the next step over the tolerance below which none is needed. Steps converge quadratically, so that a small value
/// costs little, and errors of all steps of a run may add up (`the_path_does_not_depend_on_warm_starts`).
const ACCURACY: f64 = 0.01;

/// In a hard stage multipliers move once the next step is no longer than this times the error of the multipliers, so that
/// convex problems are solved ever better.
const INNER_ACCURACY: f64 = 10.0;

/// Length of the next step over the largest friction radius from which on impulses are known to a tenth, so that
/// multipliers may move to them. The steps after that also remove the compliance, which would take two or three passes
/// at the end.
const CLOSE: f64 = 0.1;

/// Tolerance over the speed of the robot below which multipliers move only at the end: how contacts share a load that the
/// model leaves open depends slightly on when they do.
const STRICT: f64 = 1e-7;

/// Violation of the laws that is left to the compliance, over the speed of the robot but at most the tolerance, and over
/// the tolerance: creep is slower than motion by this factor, and at rest there is none.
const EXACT: f64 = 1e-6;
const EXACT_AT_REST: f64 = 1e-7;

/// The same over the tolerance in a hard stage: where a contact at rest is close to slipping, multipliers may turn by a
/// tiny angle per step for hundreds of steps. With a thousandth soft robots crept by a micrometre per second.
const EXACT_AT_LAST: f64 = 1e-6;

/// Decrease below which nothing is searched for, in squared tolerances: short steps that are not searched may lead back to
/// where they came from, most of all at rest, where multipliers settle to a millionth of the tolerance.
const NEGLIGIBLE: f64 = 1e-7;
