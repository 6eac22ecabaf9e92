//! The first steps after a robot was placed: short ones, until its links have come to rest on the ground.

use crate::gait::JointTarget;

/// Longest step of a robot that was placed `elapsed` \[s\] ago, where steps are `step` long \[s\].
pub fn longest_step(step: f64, elapsed: f64) -> f64 {
    step * (FIRST + elapsed / START_LASTS)
}

/// Length of the first step of a robot whose reference has just jumped, where steps are `step` long \[s\].
pub fn first_step(step: f64) -> f64 {
    step * FIRST
}

/// Latest end of a step from `time` over which the reference does not jump \[s\]: just before the next jump, or for a
/// robot that stands there just before the one after.
pub fn end_before(time: f64, next_jump: impl Fn(f64) -> f64) -> f64 {
    next_jump(time + 2.0 * JUST_BEFORE) - JUST_BEFORE
}

/// Time before a jump at which the step before it ends \[s\]: the reference there is still that of before.
const JUST_BEFORE: f64 = 1e-7;

/// Whether a joint moves with its reference: a robot placed in such motion has no start to resolve.
pub fn is_following(target: &JointTarget, angle: f64, rate: f64) -> bool {
    (target.angle - angle).abs() < AT_REFERENCE && (target.rate - rate).abs() < WITH_REFERENCE
}

/// Length of the first step, in steps.
const FIRST: f64 = 0.02;

/// Time over which steps then grow to their full length \[s\]: links that their joints set in motion at v come to rest
/// on the ground after about v / (mu g).
pub const START_LASTS: f64 = 0.2;

/// Deviations from the reference up to which a joint moves with it \[rad\], \[rad/s\].
const AT_REFERENCE: f64 = 1e-3;
const WITH_REFERENCE: f64 = 1e-2;
