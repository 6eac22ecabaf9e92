//! The peg contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::recovery::{DEEP, RECOVERY_SPEED, SAME_SIDE, remaining_gap};
use crate::math::Real;
use crate::pegs::PegGrid;
use crate::robot::Link;
use crate::scene::Peg;
use crate::spatial::{Frame, Laned, StagePeg, Twist, Wrench, nearest_point};

use super::stage_work::StageWork;

/// A pair that took part in the last stage, and its force \[N\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    pub link: usize,
    pub peg: usize,
    pub force: f64,
}

/// Where one link is during a stage.
pub struct Situation<'a> {
    link: &'a Link,
    /// At the start of the step, at the base of the stage, and at its predicted end.
    start: Frame,
    base: Frame,
    end: Frame,
    /// Twist with which the end is predicted.
    expected: Twist,
    /// c \[s\].
    coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    elapsed: f64,
}

/// Plane that separates a link from a peg: normal, point of the centre line, and gap.
struct Plane {
    normal: Vector3<f64>,
    /// From the CG to the point.
    arm: Vector3<f64>,
    gap: f64,
}

impl<'a> Situation<'a> {
    /// Link `index` of a lane's robot in the current stage.
    pub fn of<T: Real>(work: &StageWork<T>, lane: usize, index: usize, link: &'a Link, elapsed: f64) -> Self {
        Self {
            link,
            start: work.start_frames[index].lane(lane),
            base: work.base_frames[index].lane(lane),
            end: work.frames[index].lane(lane),
            expected: work.expected[index].lane(lane),
            coefficient: work.stage.coefficient.lane(lane),
            elapsed,
        }
    }

    /// Calls `add` with every peg that may matter and its contact.
    pub fn visit(&self, index: usize, pegs: &PegGrid, mut add: impl FnMut(usize, StagePeg)) {
        let displacement = (self.end.position - self.start.position).norm();
        let reach = self.link.reach() + displacement + MARGIN;
        let near = &self.end.position;
        pegs.visit_near(near.x, near.y, reach, |peg| {
            let contact = self.contact(&pegs.pegs()[peg], displacement);
            if contact.offset * self.coefficient < MARGIN {
                add(peg, StagePeg { link: index, ..contact });
            }
        });
    }

    /// Direction and offset of a pair.
    ///
    /// The end-of-stage gap is linearised at the predicted end configuration, so that a sustained contact is exact to
    /// second order. Where the prediction runs deep into a peg, or past it, the side is uncertain, and the gap is
    /// linearised at the start of the step.
    fn contact(&self, peg: &Peg, displacement: f64) -> StagePeg {
        let touching = peg.radius + self.link.radius;
        let at_start = self.plane(&self.start, peg);
        let mut plane = self.plane(&self.end, peg);
        let c = self.coefficient;
        let mut travelled = c * plane.normal.dot(&self.expected.velocity_at(&plane.arm));
        let deep = plane.gap < -DEEP * touching;
        if deep || (displacement > touching && at_start.normal.dot(&plane.normal) < SAME_SIDE) {
            // Where the point of the start lies at the base of the stage.
            let along = at_start.arm.dot(&self.start.axes[2]);
            let moved = self.base.position + self.base.axes[2] * along - (self.start.position + at_start.arm);
            plane = at_start;
            travelled = -plane.normal.dot(&moved);
        }
        let depth = (-self.plane(&self.start, peg).gap).max(0.0);
        let kept = remaining_gap(depth, self.elapsed);
        StagePeg {
            link: 0,
            direction: Wrench { linear: plane.normal, angular: plane.arm.cross(&plane.normal) },
            offset: ((plane.gap - kept - travelled) / c).max(-RECOVERY_SPEED),
        }
    }

    fn plane(&self, frame: &Frame, peg: &Peg) -> Plane {
        let (offset, along) = nearest_point(self.link, &frame.position, &frame.axes[2], peg);
        let distance = offset.norm();
        let across = Vector2::new(-frame.axes[2].y, frame.axes[2].x);
        let normal = offset.try_normalize(0.0).or(across.try_normalize(0.0)).unwrap_or_else(Vector2::x);
        Plane {
            normal: Vector3::new(normal.x, normal.y, 0.0),
            arm: frame.axes[2] * along,
            gap: distance - (peg.radius + self.link.radius),
        }
    }
}

/// Predicted gap up to which a pair takes part \[m\].
const MARGIN: f64 = 0.02;
