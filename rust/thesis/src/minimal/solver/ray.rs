//! The inner function along u + alpha du, for the line search.

use nalgebra::Vector3;
use snake_core::laws::Whole;
use snake_core::solver::Ray;

use crate::minimal::motion::Twist;
use crate::minimal::stage::Stage;

use super::newton::{Newton, actuator};

/// The inner function along a Newton step.
#[derive(Debug)]
pub(super) struct Step<'a> {
    pub newton: &'a Newton,
    pub stage: &'a Stage,
    pub start: &'a [Twist],
    pub change: &'a [Twist],
    /// Slope at alpha = 0 of inertia, viscous friction and the feedforward of momentum, and its constant rise.
    quadratic: [f64; 2],
}

impl<'a> Step<'a> {
    pub fn new(newton: &'a Newton, stage: &'a Stage, start: &'a [Twist], change: &'a [Twist]) -> Self {
        let (mut slope, mut rise) = (0.0, 0.0);
        let f = stage.momentum_feedforward;
        let mean = |u: &[Twist]| if f > 0.0 { stage.mean_motion(&newton.composite, u) } else { Vector3::zeros() };
        let means = [mean(start), mean(change)];
        for ((link, u), du) in stage.links.iter().zip(start).zip(change) {
            let momentum = Vector3::new(link.mass * du.x, link.mass * du.y, link.inertia * du.z);
            slope += momentum.dot(&(u - link.reference));
            rise += momentum.dot(du);
            if f > 0.0 {
                slope += f * Stage::relative_momentum(link, u, &means[0]).dot(du);
                rise += f * Stage::relative_momentum(link, du, &means[1]).dot(du);
            }
            for (slip, rate) in link.slip(u).iter().zip(&link.slip(du)) {
                let viscous = link.viscous.component_mul(rate);
                slope += viscous.dot(slip);
                rise += viscous.dot(rate);
            }
        }
        Self { newton, stage, start, change, quadratic: [slope, rise] }
    }
}

impl Ray<f64> for Step<'_> {
    #[inline(always)]
    fn derivatives(&self, alpha: f64) -> (f64, f64) {
        let Self { newton, stage, start, change, quadratic } = self;
        let (mut slope, mut curvature) = (quadratic[0] + alpha * quadratic[1], quadratic[1]);
        let mut add = |(first, second): (f64, f64)| {
            slope += first;
            curvature += second;
        };
        for (i, (link, pair)) in stage.links.iter().zip(&newton.friction).enumerate() {
            let (slips, rates) = (link.slip(&start[i]), link.slip(&change[i]));
            for (k, term) in pair.iter().enumerate() {
                add(term.along(Whole, &slips[k], &rates[k], alpha));
            }
        }
        for (j, joint) in stage.joints.iter().enumerate() {
            let rate = |twist: &[Twist]| twist[j + 1].z - twist[j].z;
            add(actuator(joint).along(rate(start), rate(change), alpha));
        }
        (slope, curvature)
    }
}
