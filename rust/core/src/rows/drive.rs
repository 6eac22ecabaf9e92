//! The drive of a joint axis in a stage.

use serde::{Deserialize, Serialize};

use crate::math::{Real, laned};

use super::Saved;

/// One joint axis: the impulse that drives phi upwards is `clamp(shrink(drive - stiffness phi'))`, where `shrink` takes up to
/// `slack` off its argument's magnitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct DriveRow<T = f64> {
    /// b = c (k_P (phi_d - phi_base) + k_D phi_d') \[N m s\].
    pub drive: T,
    /// k = c (c k_P + k_D) \[N m s^2\].
    pub stiffness: T,
    /// c times the torque limit \[N m s\].
    #[serde(with = "crate::rows::limit")]
    pub limit: T,
    /// Part of the drive that backlash absorbs, `stiffness` times half the backlash over c; zero without \[N m s\].
    pub slack: T,
}

laned! {
    DriveRow { drive, stiffness, limit, slack };
}

impl<T: Real> DriveRow<T> {
    /// Of an axis that nothing drives.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        Self { drive: zero, stiffness: zero, limit: zero, slack: zero }
    }
}
