//! The first part of a step after a robot was placed or its reference has jumped.

use crate::gait::JointTarget;

/// Length of the first part after a robot was placed or its reference has jumped, where steps are `step` long \[s\].
pub fn first_part(step: f64) -> f64 {
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

/// Length of the first part, in steps.
const FIRST: f64 = 0.02;

/// Deviations from the reference up to which a joint moves with it \[rad\], \[rad/s\].
const AT_REFERENCE: f64 = 1e-3;
const WITH_REFERENCE: f64 = 1e-2;
