//! The path of solutions along which friction at contacts grows from none to its own.
//!
//! With the bounds `s mu P_N` a stage has one solution at s = 0, where it is an optimisation problem. For s in [0, 1]
//! friction only takes energy and contacts are compliant, so where no gap demands a velocity no solution runs away, and
//! the path that starts at s = 0 cannot return there (it has one solution): it arrives at s = 1. On its way s may fall
//! again, where solutions meet and vanish. The path is followed by its length in velocities: a step along the tangent,
//! then Newton's method across it. Where the path turns round, the determinant of the tangent matrix changes its sign,
//! and so does the direction in which s grows.
//!
//! Symmetric robots have paths that fork. Velocities of no pattern that are added to those of the contacts and fade as s
//! grows make paths that do not (with probability one), and another one for each number.

use crate::solver::{CoupledStage, Defect, converge};

use super::coulomb_newton::CoulombNewton;

/// Workspace, one number for each velocity and impulse.
pub(super) struct CoulombPath {
    /// A point of the path, and its s.
    from: Vec<f64>,
    share: f64,
    /// The tangent there, of length 1.
    tangent: Vec<f64>,
    share_tangent: f64,
    /// A Newton step at constant s.
    step: Vec<f64>,
}

impl CoulombPath {
    pub fn new(unknowns: usize) -> Self {
        let [from, tangent, step] = [0; 3].map(|_| Vec::with_capacity(unknowns));
        Self { from, share: 0.0, tangent, share_tangent: 0.0, step }
    }

    /// Follows the path of this number from near the solution without friction at contacts, which `newton` holds.
    /// Returns linear solves and whether `newton` has reached the solution with friction.
    pub fn follow(&mut self, newton: &mut CoulombNewton, number: u32) -> (u32, bool) {
        let strength = SHIFTS[number as usize % SHIFTS.len()];
        let spread = |k: usize, ratio: f64| (ratio * (k + 1) as f64 + f64::from(number) * GOLDEN).fract();
        newton.set_shifts(|k| strength * spread(k, GOLDEN), |k| strength * (2.0 * spread(k, SILVER) - 1.0));
        newton.set_share(0.0);
        let (mut solves, mut is_on_path) = converge(newton);
        let mut length = FIRST_LENGTH;
        self.share = 0.0;
        while is_on_path && self.share < 1.0 && solves <= MOST_SOLVES {
            self.hold(newton);
            self.find_tangent(newton);
            let mut crossings = 0;
            loop {
                let (more, arrived) = self.advance(newton, length);
                (solves, is_on_path) = (solves + more, arrived);
                length *= if arrived { LONGER } else { SHORTER };
                if arrived || solves > MOST_SOLVES || crossings > MOST_CROSSINGS {
                    break;
                }
                if length < SHORTEST {
                    // A kink lies between, where the path turns so far that it does not cross the plane ahead.
                    self.place(newton, 2.0 * length);
                    self.find_tangent(newton);
                    (length, crossings) = (AFRESH * length, crossings + 1);
                }
            }
        }
        newton.set_share(1.0);
        (solves, is_on_path && self.share >= 1.0)
    }

    /// Takes a point of the path.
    fn hold(&mut self, newton: &mut CoulombNewton) {
        self.from.clear();
        newton.visit(|value, _, _| self.from.push(*value));
    }

    /// Takes the tangent for the tangent matrix where `newton` is.
    fn find_tangent(&mut self, newton: &mut CoulombNewton) {
        newton.find_step_with(0.0);
        self.step.clear();
        newton.visit(|_, step, _| self.step.push(step));
        newton.find_step_with(1.0);
        let (orientation, mut squared) = (newton.orientation(), 1.0);
        self.tangent.clear();
        let mut defects = self.step.iter();
        newton.visit(|_, step, weight| {
            let along = defects.next().map_or(step, |defect| step - defect);
            squared += (weight * along).powi(2);
            self.tangent.push(along);
        });
        self.share_tangent = orientation / squared.sqrt();
        self.tangent.iter_mut().for_each(|tangent| *tangent *= self.share_tangent);
    }

    /// Moves `newton` along the tangent.
    fn place(&self, newton: &mut CoulombNewton, length: f64) -> Defect {
        let mut at = self.from.iter().zip(&self.tangent);
        newton.visit(|value, _, _| *value = at.next().map_or(*value, |(from, tangent)| from + length * tangent));
        newton.set_share(self.share + length * self.share_tangent);
        newton.follow_joints();
        newton.defects()
    }

    /// A step along the tangent and back to the path. Returns linear solves, and whether a point of the path was found no
    /// further away than a few such steps.
    fn advance(&mut self, newton: &mut CoulombNewton, length: f64) -> (u32, bool) {
        let ahead = self.share + length * self.share_tangent;
        let lands = ahead >= 1.0;
        let length = if lands { (1.0 - self.share) / self.share_tangent } else { length };
        let mut share = if lands { 1.0 } else { ahead };
        let mut here = self.place(newton, length);
        for solves in 0..MOST_CORRECTIONS {
            if here.speed <= ON_PATH * newton.negligible() {
                let is_near = self.distance(newton, share) < FURTHEST * length;
                self.share = if is_near { share } else { self.share };
                return (solves, is_near);
            }
            share += self.correct(newton, share, length, lands);
            newton.set_share(share);
            newton.follow_joints();
            here = newton.defects();
        }
        (MOST_CORRECTIONS, false)
    }

    /// One step of Newton's method towards the path, across the tangent, or with constant s where it `lands`. Returns the
    /// change of s.
    fn correct(&mut self, newton: &mut CoulombNewton, share: f64, length: f64, lands: bool) -> f64 {
        newton.find_step_with(0.0);
        self.step.clear();
        newton.visit(|_, step, _| self.step.push(step));
        if !lands {
            newton.find_step_with(1.0);
        }
        let (mut along, mut rise) = (0.0, self.share_tangent);
        along += self.share_tangent * (share - self.share - length * self.share_tangent);
        let mut rows = self.from.iter().zip(&self.tangent).zip(&self.step);
        newton.visit(|value, step, weight| {
            if let Some(((from, tangent), own)) = rows.next() {
                let weighted = weight * weight * tangent;
                along += weighted * (*value + own - from - length * tangent);
                rise += weighted * (step - own);
            }
        });
        let change = if lands { 0.0 } else { -along / rise };
        let mut steps = self.step.iter();
        newton.visit(|value, step, _| {
            if let Some(own) = steps.next() {
                *value += own + change * (step - own);
            }
        });
        change
    }

    /// Distance from the last point of the path.
    fn distance(&self, newton: &mut CoulombNewton, share: f64) -> f64 {
        let mut squared = (share - self.share).powi(2);
        let mut from = self.from.iter();
        newton.visit(|value, _, weight| squared += from.next().map_or(0.0, |from| (weight * (*value - from)).powi(2)));
        squared.sqrt()
    }
}

/// Lengths of steps along the path \[m/s\]: the first, the shortest, after which a kink is crossed, and how often, and
/// factors from one to the next.
const FIRST_LENGTH: f64 = 0.1;
const SHORTEST: f64 = 1e-5;
const MOST_CROSSINGS: u32 = 6;
const AFRESH: f64 = 1e3;
const LONGER: f64 = 1.5;
const SHORTER: f64 = 0.5;

/// Newton steps back to the path, how far from its last point they may lead, over the length of the step, and what is
/// left of the defects, over what is negligible.
const MOST_CORRECTIONS: u32 = 5;
const FURTHEST: f64 = 3.0;
const ON_PATH: f64 = 100.0;

/// Corrections for the whole path.
const MOST_SOLVES: u32 = 1000;

/// Largest velocities that are added at s = 0, path by path \[m/s\].
const SHIFTS: [f64; 2] = [0.1, 0.01];

/// Ratios whose multiples are spread evenly, modulo 1.
const GOLDEN: f64 = 0.618_033_988_749_895;
const SILVER: f64 = 0.414_213_562_373_095;
