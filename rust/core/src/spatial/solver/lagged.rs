//! Coulomb's law as a sequence of convex problems, for stages on which Newton's method on the law itself goes round.
//!
//! With the *lag* s = mu |gamma_T|, impulse P and slip gamma obey Coulomb's law exactly where
//! `K ∋ P _|_ gamma + s n ∈ K*`, K = {|P_T| <= mu P_N} (De Saxcé). For a given lag that is the optimality condition of a
//! strongly convex problem, which Newton's method with a line search solves from anywhere: its impulses are
//! `P = proj_K(P_centre - (gamma + s n) / delta)`. The lag then takes the present slip and the centres the impulses. A
//! robot that the contacts can hold does not slip: without lags it is at rest as soon as the compliance is removed. Rolling
//! friction has the radius of the normal impulses of the problem before.

use crate::solver::{CoulombForm, CoupledStage};
use crate::spatial::{Stage, StageSolution};

use super::CoulombNewton;

/// What becomes of the lags after each problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lag {
    /// They stay zero: exact for a robot that does not slip.
    None,
    Follows,
}

impl CoulombNewton {
    /// Solves convex problems one after the other, beginning at the velocities of `solution` and without lags, until
    /// `accept` takes what it is given after each of them, or the linear solves are `most`. The first one selects the shortest
    /// impulses. If no lags follow, contacts become stiffer from problem to problem. Returns the linear solves.
    pub(super) fn lag(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        most: u32,
        lag: Lag,
        mut accept: impl FnMut(&StageSolution) -> bool,
    ) -> u32 {
        self.load(stage, solution, tolerance);
        self.form.is_lagged = true;
        let stiffest = STIFFEST * self.form.compliance;
        let (problems, round_off) = match lag {
            Lag::None => (MOST_AT_REST, 0.0),
            Lag::Follows => (MOST_PROBLEMS, ROUND_OFF),
        };
        let mut solves = 0;
        for _ in 0..problems {
            solves += self.descend(round_off);
            self.write(solution);
            if accept(solution) || solves >= most {
                break;
            }
            match lag {
                Lag::None => self.form.compliance = (STIFFER * self.form.compliance).max(stiffest),
                Lag::Follows => self.take_lags(),
            }
            self.recentre();
        }
        solves
    }

    fn take_lags(&mut self) {
        let Self { chain, contacts, obstacle_friction, .. } = self;
        chain.links.iter_mut().for_each(|link| link.ground.lag(&link.twist));
        obstacle_friction
            .iter_mut()
            .zip(contacts)
            .for_each(|(friction, contact)| friction.lag(&chain.links[contact.link].twist));
    }

    /// Newton's method on a convex problem. Imbalances of closed contacts are longer than the step by the square root of
    /// their stiffness over the mass.
    fn descend(&mut self, round_off: f64) -> u32 {
        let CoulombForm { weight, compliance, .. } = self.form;
        let negligible = (ACCURACY * self.tolerance * (weight * compliance).sqrt()).max(round_off);
        let least = negligible * negligible * weight;
        self.defects();
        for solves in 1..=MAX_ITERATIONS {
            self.find_step();
            let slope = self.slope();
            if slope.is_nan() || slope >= -least {
                return solves;
            }
            self.search_convex(slope);
        }
        MAX_ITERATIONS
    }

    /// Goes along the step to where the function no longer descends, or to its end.
    fn search_convex(&mut self, slope: f64) {
        let (mut low, mut high, mut fraction) = ((0.0, slope), (1.0, f64::INFINITY), 1.0);
        for _ in 0..MAX_EVALUATIONS {
            self.move_along(fraction);
            self.defects();
            let here = self.slope();
            if here.abs() <= FLAT * slope.abs() || (fraction == 1.0 && here < 0.0) {
                break;
            }
            if here < 0.0 {
                low = (fraction, here);
            } else {
                high = (fraction, here);
            }
            let secant = low.1 / (low.1 - high.1);
            fraction = low.0 + (high.0 - low.0) * secant.clamp(INSIDE, 1.0 - INSIDE);
        }
    }

    /// Derivative of the convex function along the step \[J\].
    fn slope(&self) -> f64 {
        let links = self.chain.links.iter().map(|link| {
            let [yaw, pitch] = link.axes.map(|axis| axis.moment * axis.step_rate);
            let driven = if link.is_free { 0.0 } else { yaw + pitch };
            link.step.dot(&link.missing) - driven
        });
        links.sum()
    }
}

/// Convex problems, the same without lags, and Newton steps for one of them. Lags settle slowly: with 40 problems a stage of a
/// climbing helix may stay open (`test_a_helix_that_rolls_climbs_a_pole`).
const MOST_PROBLEMS: u32 = 100;
const MOST_AT_REST: u32 = 20;
const MAX_ITERATIONS: u32 = 50;

/// Compliance over that of the problem before, and the least one, over that of the first.
const STIFFER: f64 = 0.1;
const STIFFEST: f64 = 1e-3;

/// Imbalance over the tolerance below which no step is taken, and the least length of one where robots move \[m/s\].
const ACCURACY: f64 = 0.03;
const ROUND_OFF: f64 = 1e-12;

/// A search ends where the slope is this share of that at its start; its bracket shrinks by this share at least.
const FLAT: f64 = 0.1;
const INSIDE: f64 = 0.1;
const MAX_EVALUATIONS: u32 = 20;
