//! Limits of the joint angles: neighbouring links touch each other where their joint meets its stop.
//!
//! The unilateral constraint `0 <= P  _|_  limit -+ phi >= 0` is laid out like a contact between two links, with the
//! half length of the first link as lever, so that gaps are in metres and impulses in newton seconds. It is linear in
//! the twists: the end of a stage obeys it exactly.

use nalgebra::Vector3;

use crate::robot::Link;

use super::self_contact::PairPlace;

/// The stop of a joint on one side.
#[derive(Debug, Clone, Copy)]
pub struct JointStop {
    joint: usize,
    /// 1 for the largest angle, -1 for the least.
    side: f64,
    /// \[m\]
    lever: f64,
}

impl JointStop {
    /// The stop of a place; `None` if the links are not neighbours.
    pub fn at(place: &PairPlace, links: &[Link]) -> Option<Self> {
        let (joint, side) = (place.links[0], if place.end == 0 { 1.0 } else { -1.0 });
        place.is_stop().then(|| Self { joint, side, lever: 0.5 * links[joint].length })
    }

    /// The stops within `clearance` \[rad\] of which joints are; `angle` gives absolute angles.
    pub fn visit_near(
        links: &[Link],
        angle: impl Fn(usize) -> f64,
        limit: f64,
        clearance: f64,
        mut visit: impl FnMut(PairPlace, JointStop),
    ) {
        for (joint, link) in links[..links.len() - 1].iter().enumerate() {
            let bend = angle(joint + 1) - angle(joint);
            for (end, side) in [1.0, -1.0].into_iter().enumerate() {
                if side * bend > limit - clearance {
                    visit(PairPlace { links: [joint, joint + 1], end }, Self { joint, side, lever: 0.5 * link.length });
                }
            }
        }
    }

    /// What is left of the way to the stop, negative beyond it \[m\].
    pub fn gap(&self, angle: impl Fn(usize) -> f64, limit: f64) -> f64 {
        self.lever * (limit - self.side * (angle(self.joint + 1) - angle(self.joint)))
    }

    /// w of both links: `gap' = w[0] . u_0 + w[1] . u_1`.
    pub fn direction(&self) -> [Vector3<f64>; 2] {
        let turn = self.side * self.lever;
        [Vector3::new(0.0, 0.0, turn), Vector3::new(0.0, 0.0, -turn)]
    }
}
