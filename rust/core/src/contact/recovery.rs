//! How a penetration is undone: the same in all models (T 3.55 != D10).

use crate::math::{Mask, Real};

/// Gap that a contact may keep at the end of a stage, zero or negative \[m\]: what is left of the penetration `depth`
/// from before the step, `elapsed` after its start.
#[inline(always)]
pub fn remaining_gap<T: Real>(depth: T, elapsed: T) -> T {
    if !T::zero().lt(depth).any() {
        return T::zero();
    }
    let one = T::splat(1.0);
    let speed_up = one + depth / T::splat(SLIGHT_DEPTH);
    -depth * (one - speed_up * elapsed / T::splat(RECOVERY_TIME)).max(T::zero())
}

/// Gap of a contact at the end of a stage without motion, over the stage's coefficient `c` \[m/s\]: from the gap of its
/// plane, what that `travelled` with the motion up to there, and the penetration `depth` from before the step, which
/// began `elapsed` before the end of the stage.
pub fn offset(gap: f64, travelled: f64, depth: f64, c: f64, elapsed: f64) -> f64 {
    ((gap - remaining_gap(depth, elapsed) - travelled) / c).max(-RECOVERY_SPEED)
}

/// Predicted penetration, relative to the sum of the radii, beyond which the side of a peg is uncertain.
pub const DEEP: f64 = 0.1;

/// Cosine between the normals at the start and at the predicted end of a step down to which the link is certainly still
/// on the same side of the peg.
pub const SAME_SIDE: f64 = 0.5;

/// Fastest separation of a penetrating contact \[m/s\]: an initial penetration is undone over several steps instead of
/// being thrown out within one.
pub const RECOVERY_SPEED: f64 = 0.2;

/// Time within which a slight penetration, as the linearisation of the gap leaves it, fades \[s\]: undone within a
/// short stage it would kick the robot. Deeper ones fade faster, so that fast motions do not add them up.
pub const RECOVERY_TIME: f64 = 0.05;

/// Penetration above which the faster decay dominates \[m\].
const SLIGHT_DEPTH: f64 = 5e-4;
