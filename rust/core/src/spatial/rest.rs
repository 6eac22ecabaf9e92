//! Robots at rest: a stage that keeps a robot at rest is solved without a linear solve.
//!
//! Where many links are close to slipping, a stage at rest takes hundreds of linear solves, although its solution is
//! known: the forces of the last stage and zero velocity. That candidate is certified first, like every solution.

use crate::math::{Mask, Real};
use crate::spatial::{ChainVelocity, Stage, StageDrive, StageSolution, Twist, certify};
use crate::stepping::AT_REST;

/// The candidate: zero velocity under given impulses.
pub struct RestCandidate<T = f64> {
    solution: StageSolution<T>,
}

impl<T: Real> RestCandidate<T> {
    pub fn new(links: usize) -> Self {
        Self { solution: StageSolution::new(links) }
    }

    /// Those of the given lanes in which zero velocity, under the impulses of the solver's `start`, solves the stage to
    /// `tolerance` \[m/s\], and to the [`bound`] that follows from the step and the robot.
    #[inline(always)]
    pub fn holds(&mut self, lanes: T::Mask, stage: &Stage<T>, start: &StageSolution<T>, tolerance: f64) -> T::Mask {
        if !lanes.any() {
            return lanes;
        }
        let bound = bound(stage, tolerance);
        let tried = lanes & fastest(stage, start).le(T::splat(SLOW) * bound);
        if !tried.any() {
            return tried;
        }
        tried & self.residual(stage, start).le(bound)
    }

    /// Certified residual of zero velocity under the impulses of `solution`.
    #[inline(always)]
    pub fn residual(&mut self, stage: &Stage<T>, solution: &StageSolution<T>) -> T {
        let own = &mut self.solution;
        own.copy_from(solution);
        own.twist.fill(Twist::zero());
        own.rate.fill([T::zero(); 2]);
        for (drive, joint) in own.actuator.iter_mut().zip(&stage.joints) {
            for axis in 0..2 {
                drive[axis] = at_rest(&joint[axis]);
            }
        }
        certify(stage, own).residual()
    }

    /// Makes the last candidate the solution in the given lanes.
    #[inline(always)]
    pub fn write(&self, lanes: T::Mask, solution: &mut StageSolution<T>) {
        solution.select_into(lanes, &self.solution);
    }
}

/// Largest imbalance of a robot at rest, as a velocity per stage \[m/s\]. While the robot is at rest it is held against an
/// acceleration of this over the stage's coefficient, which is bounded however short the step. The
/// certificate divides the imbalance of a joint by the inertia of the link in front; the link behind may be lighter.
#[inline(always)]
pub fn bound<T: Real>(stage: &Stage<T>, tolerance: f64) -> T {
    let (mut least, mut most) = (T::splat(f64::INFINITY), T::zero());
    // Lanes may have neighbours among more obstacles that can be pushed.
    for link in &stage.links[..stage.chain()] {
        let inertia = link.inertia / link.half_length;
        (least, most) = (least.min(inertia), most.max(inertia));
    }
    T::splat(tolerance.min(LOOSEST)).min(T::splat(WEAK) * stage.coefficient) * (least / most)
}

/// What a drive gives a joint that does not turn.
#[inline(always)]
fn at_rest<T: Real>(joint: &StageDrive<T>) -> T {
    let absorbed = joint.drive.min(joint.slack).max(-joint.slack);
    (joint.drive - absorbed).min(joint.limit).max(-joint.limit)
}

/// About the speed of the fastest point of the robot \[m/s\].
#[inline(always)]
pub fn fastest<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>) -> T {
    let mut fastest = T::zero();
    for (link, Twist { linear, angular }) in stage.links.iter().zip(&solution.twist) {
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
    let twists =
        [(linear, angular)].into_iter().chain(velocity.moved.iter().map(|moved| (&moved.linear, &moved.angular)));
    let mut numbers = twists.flat_map(|(v, w)| v.iter().chain(w.iter())).chain(velocity.rate.iter().flatten());
    numbers.all(|number| number.abs() <= AT_REST)
}

/// Speed over the bound below which rest is tried.
const SLOW: f64 = 1e-2;

/// Loosest tolerance of a robot at rest \[m/s\], that of the solvers by default.
const LOOSEST: f64 = 1e-6;

/// Acceleration against which a robot may be held, a small share of gravity \[m/s^2\].
const WEAK: f64 = 3e-4;
