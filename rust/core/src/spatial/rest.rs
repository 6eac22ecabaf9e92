//! Robots at rest: a stage that keeps a robot at rest is solved without a linear solve.
//!
//! Where many links are close to slipping, a stage at rest takes hundreds of linear solves, although its solution is
//! known: the forces of the last stage and zero velocity. That candidate is certified first, like every solution.

use crate::math::{Mask, Real};
use crate::robot::Robot;
use crate::spatial::{ChainVelocity, Stage, StageDrive, StageSolution, Twist, certify};

/// The candidate: zero velocity under the impulses from which a solver would start.
#[derive(Debug, Clone)]
pub struct RestCandidate<T> {
    solution: StageSolution<T>,
    /// Acceleration against which a robot may be held \[m/s^2\].
    weak: T,
    /// The least of the links' inertias, over their lengths, over the largest. The certificate divides the imbalance of
    /// a joint by the inertia of the link in front; the link behind may be lighter by as much.
    evenness: T,
}

impl<T: Real> RestCandidate<T> {
    pub fn new(robot: &Robot) -> Self {
        let inertias = || robot.links.iter().map(|link| link.inertia / (0.5 * link.length));
        let (least, most) = (inertias().fold(f64::INFINITY, f64::min), inertias().fold(0.0, f64::max));
        Self {
            solution: StageSolution::new(robot.link_count()),
            weak: T::splat(SHARE * robot.gravity),
            evenness: T::splat(least / most),
        }
    }

    /// Those of the given lanes in which zero velocity, under the impulses of the solver's `start`, solves the stage to
    /// `tolerance` \[m/s\], and to the bound that follows from gravity and the robot, see [`Self::bound`].
    #[inline(always)]
    pub fn holds(&mut self, lanes: T::Mask, stage: &Stage<T>, start: &StageSolution<T>, tolerance: f64) -> T::Mask {
        if !lanes.any() {
            return lanes;
        }
        let bound = self.bound(stage.coefficient, tolerance);
        let tried = lanes & fastest(stage, start).le(bound);
        if !tried.any() {
            return tried;
        }
        let solution = &mut self.solution;
        solution.copy_from(start);
        solution.twist.fill(Twist::zero());
        solution.rate.fill([T::zero(); 2]);
        for (drive, joint) in solution.actuator.iter_mut().zip(&stage.joints) {
            for axis in 0..2 {
                drive[axis] = at_rest(&joint[axis]);
            }
        }
        tried & certify(stage, solution).residual().le(bound)
    }

    /// Largest imbalance of a robot at rest, as a velocity per stage \[m/s\]. While the robot is at rest it is held
    /// against an acceleration of this over the stage's coefficient, hence a share of gravity bounds it however short
    /// the step.
    #[inline(always)]
    fn bound(&self, coefficient: T, tolerance: f64) -> T {
        T::splat(tolerance.min(LOOSEST)).min(self.weak * coefficient) * self.evenness
    }

    /// Makes the candidate of [`Self::holds`] the solution in the given lanes.
    #[inline(always)]
    pub fn write(&self, lanes: T::Mask, solution: &mut StageSolution<T>) {
        solution.select_into(lanes, &self.solution);
    }
}

/// What a drive gives a joint that does not turn.
#[inline(always)]
pub(super) fn at_rest<T: Real>(joint: &StageDrive<T>) -> T {
    let absorbed = joint.drive.min(joint.slack).max(-joint.slack);
    (joint.drive - absorbed).min(joint.limit).max(-joint.limit)
}

/// About the speed of the fastest point of the robot \[m/s\].
#[inline(always)]
fn fastest<T: Real>(stage: &Stage<T>, start: &StageSolution<T>) -> T {
    let mut fastest = T::zero();
    for (link, Twist { linear, angular }) in stage.links.iter().zip(&start.twist) {
        let moving = linear.x.abs().max(linear.y.abs()).max(linear.z.abs());
        let turning = angular.x.abs().max(angular.y.abs()).max(angular.z.abs());
        fastest = fastest.max(moving.max(turning * link.half_length));
    }
    fastest
}

/// Whether a robot moves so little that the forces of a step from there on are those of rest, not those that stopped
/// it.
pub fn is_at_rest(velocity: &ChainVelocity) -> bool {
    let Twist { linear, angular } = &velocity.head;
    let mut numbers = linear.iter().chain(angular.iter()).chain(velocity.rate.iter().flatten());
    numbers.all(|number| number.abs() <= AT_REST)
}

/// Loosest tolerance of a robot at rest \[m/s\], the default one.
const LOOSEST: f64 = 1e-6;

/// Acceleration against which a robot may be held, over gravity.
const SHARE: f64 = 3e-5;

/// \[m/s\], \[rad/s\]
const AT_REST: f64 = 1e-5;
