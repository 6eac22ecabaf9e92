//! Limits of the joint angles in both axes of a Cardan joint.
//!
//! The unilateral constraint `0 <= P  _|_  limit -+ phi >= 0` is laid out like a contact between the two links, with the
//! half length of the first one as lever, so that gaps are in metres and impulses in newton seconds. The angle at the end
//! of a stage is linear in its rate, phi = phi_B + c phi', which is the relative angular velocity about the joint's axis:
//! the end of a stage obeys the limit exactly.

use crate::math::Real;
use crate::robot::Link;

use super::spatial_vector::{Wrench, scaled};
use super::{Frame, PairPlace};

/// The stop of one axis of a joint on one side.
#[derive(Debug, Clone, Copy)]
pub struct JointStop {
    joint: usize,
    /// 0 for yaw, 1 for pitch.
    axis: usize,
    /// 1 for the largest angle, -1 for the least.
    side: f64,
    /// \[m\]
    lever: f64,
}

impl JointStop {
    /// The stops within `clearance` \[rad\] of which joints are; `angle` gives the angles of a joint.
    pub fn near<'a>(
        links: &'a [Link],
        angle: impl Fn(usize) -> [f64; 2] + 'a,
        limit: f64,
        clearance: f64,
    ) -> impl Iterator<Item = Self> + 'a {
        let stops = links[..links.len() - 1].iter().enumerate().flat_map(|(joint, link)| {
            let places = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
            places.map(|(axis, side)| Self { joint, axis, side, lever: 0.5 * link.length })
        });
        stops.filter(move |stop| stop.side * angle(stop.joint)[stop.axis] > limit - clearance)
    }

    pub fn place(&self) -> PairPlace {
        let contact = 2 * self.axis + usize::from(self.side < 0.0);
        PairPlace { links: [self.joint, self.joint + 1], contact }
    }

    /// What is left of the way to the stop, negative beyond it \[m\]; `angle` as in [`Self::near`].
    pub fn gap(&self, angle: impl Fn(usize) -> [f64; 2], limit: f64) -> f64 {
        self.lever * (limit - self.side * angle(self.joint)[self.axis])
    }

    /// w of both links, which are at the given frames: `gap' = w[0] . u_0 + w[1] . u_1`.
    pub fn direction(&self, [near, far]: &[Frame; 2]) -> [Wrench; 2] {
        let axis = [near.axes[1], far.axes[0]][self.axis];
        [1.0, -1.0].map(|of_link| Wrench { angular: scaled(&axis, of_link * self.side * self.lever), ..Wrench::zero() })
    }
}

/// The largest magnitude of any joint angle.
#[inline(always)]
pub fn largest_angle<T: Real>(angles: &[[T; 2]]) -> T {
    // A fold would be compiled as a function without the instructions of the kernel.
    let mut largest = T::zero();
    for [yaw, pitch] in angles {
        largest = largest.max(yaw.abs()).max(pitch.abs());
    }
    largest
}

/// Stops of a joint: both axes, to either side.
pub const JOINT_STOPS: usize = 4;
