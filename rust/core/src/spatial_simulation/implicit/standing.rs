//! A robot that stands still goes on standing where nothing has changed: its stage is solved without a solver.
//!
//! Where many links are all but slipping, a stage at rest takes hundreds of linear solves, although its solution is
//! known: the forces of the last stage, and no velocity. That is judged first, as every solution is.

use crate::math::{Mask, Real};
use crate::spatial::{Screw, Stage, StageSolution, certify};

/// What is tried: no velocity, under the impulses from which a solver would start.
#[derive(Debug, Clone)]
pub struct Standing<T> {
    solution: StageSolution<T>,
}

impl<T: Real> Standing<T> {
    pub fn new(links: usize) -> Self {
        Self { solution: StageSolution::new(links) }
    }

    /// The lanes in which no velocity, under the impulses of the solver's `start`, solves the stage to `tolerance`
    /// \[m/s\], or to [`LOOSEST`] where less is asked.
    #[inline(always)]
    pub fn holds(&mut self, stage: &Stage<T>, start: &StageSolution<T>, tolerance: f64) -> T::Mask {
        let tolerance = tolerance.min(LOOSEST);
        let slow = slow(stage, start, T::splat(SLOW * tolerance));
        if !slow.any() {
            return slow;
        }
        let zero = T::zero();
        let solution = &mut self.solution;
        solution.copy_from(start);
        solution.twist.fill(Screw::zero());
        solution.rate.fill([zero; 2]);
        for (drive, joint) in solution.drive.iter_mut().zip(&stage.joints) {
            for axis in 0..2 {
                drive[axis] = joint[axis].drive.min(joint[axis].limit).max(-joint[axis].limit);
            }
        }
        slow & certify(stage, solution).residual().le(T::splat(tolerance))
    }

    /// Takes what [`Self::holds`] tried for the solution in the given lanes.
    #[inline(always)]
    pub fn write(&self, lanes: T::Mask, solution: &mut StageSolution<T>) {
        let own = &self.solution;
        for i in 0..own.twist.len() {
            solution.twist[i].select_into(lanes, &own.twist[i]);
            solution.rolling[i].x = T::select(lanes, own.rolling[i].x, solution.rolling[i].x);
            solution.rolling[i].y = T::select(lanes, own.rolling[i].y, solution.rolling[i].y);
            for end in 0..2 {
                let (kept, friction) = (&own.friction[i][end], &mut solution.friction[i][end]);
                friction.x = T::select(lanes, kept.x, friction.x);
                friction.y = T::select(lanes, kept.y, friction.y);
                solution.normal[i][end] = T::select(lanes, own.normal[i][end], solution.normal[i][end]);
            }
        }
        for j in 0..own.rate.len() {
            for axis in 0..2 {
                solution.rate[j][axis] = T::select(lanes, own.rate[j][axis], solution.rate[j][axis]);
                solution.drive[j][axis] = T::select(lanes, own.drive[j][axis], solution.drive[j][axis]);
            }
        }
        for (impulse, kept) in solution.peg.iter_mut().zip(&own.peg) {
            *impulse = T::select(lanes, *kept, *impulse);
        }
    }
}

/// The lanes in which no point of the robot moves faster than about `bound` \[m/s\].
#[inline(always)]
fn slow<T: Real>(stage: &Stage<T>, start: &StageSolution<T>, bound: T) -> T::Mask {
    let mut fastest = T::zero();
    for (link, Screw { linear, angular }) in stage.links.iter().zip(&start.twist) {
        let moving = linear.x.abs().max(linear.y.abs()).max(linear.z.abs());
        let turning = angular.x.abs().max(angular.y.abs()).max(angular.z.abs());
        fastest = fastest.max(moving.max(turning * link.half_length));
    }
    fastest.le(bound)
}

/// Speed over the tolerance below which a robot is tried. What sets out from rest is past it after one solved stage.
const SLOW: f64 = 1e-2;

/// Loosest tolerance to which a robot may stand \[m/s\], the default one: what is left unbalanced by it moves no joint
/// by more than some 1e-8 rad, however long the robot stands.
const LOOSEST: f64 = 1e-6;
