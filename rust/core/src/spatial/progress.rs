//! How a solve goes on: which lanes have converged, which may couple friction to normal impulses, which need correction.

use crate::math::{Mask, Real};

/// How a solve ended, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Outcome<T: Real = f64> {
    /// Linear solves, a whole number.
    pub iterations: T,
    /// Whether the solver's own stopping rule was met; the certificate judges independently.
    pub converged: T::Mask,
}

/// What a pass over the chain finds at the trial velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Assembly<T> {
    /// Derivative of the convex function along the last step \[J\].
    pub slope: T,
    /// How much steeper it descends along the next step: g H^-1 g \[J\].
    pub descent: T,
    /// By how much the friction radii had to move, as a velocity \[m/s\].
    pub radius_error: T,
    /// The largest friction radius, over the mass \[m/s\].
    pub largest_radius: T,
    /// Speed of the fastest link's CG \[m/s\].
    pub fastest: T,
    /// How far the velocities are from obeying the laws because the centres are not yet the impulses \[m/s\].
    pub multiplier_error: T,
}

/// What is to be done before the next step; a lane needs at most one of these.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corrections<T: Real> {
    /// Friction radii take the normal impulses, as trustworthy as they are by now.
    pub couple: T::Mask,
    /// The convex problem is solved: radii move by this fraction of the way.
    pub settle: T::Mask,
    pub fraction: T,
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
    /// Lanes whose friction radii follow the normal impulses during the next step.
    pub coupled: T::Mask,
    /// Error of the friction radii when they last moved for a solved convex problem, and how far they move.
    last_error: T,
    fraction: T,
    pub outcome: Outcome<T>,
}

impl<T: Real> Assembly<T> {
    /// Whether the normal impulses found can be those of the solution.
    #[inline(always)]
    pub fn is_plausible(&self, largest_radius: T) -> T::Mask {
        self.radius_error.le(largest_radius)
    }

    /// Takes `other` over in the given lanes.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, other: &Self) {
        self.slope = T::select(lanes, other.slope, self.slope);
        self.descent = T::select(lanes, other.descent, self.descent);
        self.radius_error = T::select(lanes, other.radius_error, self.radius_error);
        self.largest_radius = T::select(lanes, other.largest_radius, self.largest_radius);
        self.fastest = T::select(lanes, other.fastest, self.fastest);
        self.multiplier_error = T::select(lanes, other.multiplier_error, self.multiplier_error);
    }
}

impl<T: Real> Corrections<T> {
    #[inline(always)]
    pub fn lanes(&self) -> T::Mask {
        self.couple | self.settle | self.recentre
    }
}

impl<T: Real> Progress<T> {
    /// With `patient` false, friction radii move only when the convex problem is solved.
    #[inline(always)]
    pub fn new(tolerance: T, patient: bool, mass: T, lanes: T::Mask) -> Self {
        let none = T::Mask::of(|_| false);
        Self {
            tolerance,
            patience: T::splat(if patient { PATIENCE } else { -1.0 }),
            mass,
            active: lanes,
            coupled: if patient { lanes } else { none },
            last_error: T::splat(f64::INFINITY),
            fraction: T::splat(1.0),
            outcome: Outcome { iterations: T::zero(), converged: none },
        }
    }

    /// Counts one linear solve.
    #[inline(always)]
    pub fn count(&mut self) {
        self.outcome.iterations += T::select(self.active, T::splat(1.0), T::zero());
    }

    /// Learns from a step that ended `here`; in the lanes `kept` the friction radii followed.
    #[inline(always)]
    pub fn judge(&mut self, here: &Assembly<T>, kept: T::Mask) -> Corrections<T> {
        let tolerance = self.tolerance;
        // The length of the next step as a velocity; `max` would swallow NaN.
        let next = (here.descent.abs() / self.mass).sqrt();
        let stubborn = self.is_stubborn();
        let mistaken = self.active & tolerance.lt(here.radius_error);
        let couple = mistaken & !stubborn & !kept & next.le(T::splat(TRUST) * here.radius_error);
        let settle = mistaken & stubborn & next.le(tolerance);
        self.pace(settle, here.radius_error);
        let solved = self.active & !mistaken & next.le(T::splat(ACCURACY) * tolerance);
        let exact = here.multiplier_error.le(T::splat(EXACT) * here.fastest + T::splat(EXACT_AT_REST) * tolerance);
        self.outcome.converged = self.outcome.converged | (solved & exact);
        // A step that is not finite ends its lane: it is below no bound.
        self.active = self.active & !self.outcome.converged & next.lt(T::splat(f64::INFINITY));
        Corrections { couple, settle, fraction: self.fraction, recentre: solved & !exact }
    }

    /// Moves of the radii become shorter while they gain little, and longer again when they gain much.
    #[inline(always)]
    fn pace(&mut self, lanes: T::Mask, error: T) {
        let slow = (T::splat(SLOW_GAIN) * self.last_error).lt(error);
        let fast = error.lt(T::splat(FAST_GAIN) * self.last_error);
        let shorter = (T::splat(0.5) * self.fraction).max(T::splat(SHORTEST_MOVE));
        let longer = (T::splat(1.5) * self.fraction).min(T::splat(1.0));
        let fraction = T::select(slow, shorter, T::select(fast, longer, self.fraction));
        self.fraction = T::select(lanes, fraction, self.fraction);
        self.last_error = T::select(lanes, error, self.last_error);
    }

    /// Decrease below which nothing is searched for \[J\].
    #[inline(always)]
    pub fn negligible(&self) -> T {
        T::splat(NEGLIGIBLE) * self.mass * self.tolerance * self.tolerance
    }

    /// Decides on the next step from where it starts.
    #[inline(always)]
    pub fn prepare(&mut self, here: &Assembly<T>) {
        self.coupled = self.active & !self.is_stubborn() & here.is_plausible(here.largest_radius);
    }

    #[inline(always)]
    fn is_stubborn(&self) -> T::Mask {
        self.patience.lt(self.outcome.iterations)
    }
}

/// Linear solves after which a stage counts as hard: from there on convex problems are solved before radii move.
const PATIENCE: f64 = 20.0;

/// Gains of such a move below which the next one is shorter, and above which it is longer.
const SLOW_GAIN: f64 = 0.7;
const FAST_GAIN: f64 = 0.2;
const SHORTEST_MOVE: f64 = 0.1;

/// Length of a step over the error of the friction radii below which the normal impulses are trusted: forces of closed
/// contacts show in it diminished by the square root of the penalty.
const TRUST: f64 = 1e-2;

/// Length of the next step over the tolerance below which none is needed. Imbalances of closed contacts are longer than
/// it by the square root of the penalty.
const ACCURACY: f64 = 0.1;

/// Violation of the laws that is left to the compliance, over the speed of the robot, and over the tolerance: what creeps is
/// slower than what moves by so much, and at rest nothing creeps.
const EXACT: f64 = 1e-6;
const EXACT_AT_REST: f64 = 1e-3;

/// Decrease below which nothing is searched for, in squared tolerances.
const NEGLIGIBLE: f64 = 1e-3;
