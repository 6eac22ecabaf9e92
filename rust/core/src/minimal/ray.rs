//! The inner function of the solver along a line u + alpha du: its slope, cheaply, for any alpha.

use nalgebra::{Vector2, Vector3};

use crate::math::line_search::Along;

use super::motion::{Composite, Twist};
use super::newton::Proximal;
use super::stage::Stage;

/// Slope of a strongly convex, piecewise smooth function of alpha; it rises monotonically.
#[derive(Debug, Clone)]
pub(super) struct Ray {
    /// Inertia, viscous friction and the following term: slope at 0 and its constant rise.
    quadratic: [f64; 2],
    friction: Vec<FrictionRay>,
    drives: Vec<DriveRay>,
}

/// p = prox_disc(start + alpha change) adds `-p . change / r`.
#[derive(Debug, Clone, Copy)]
struct FrictionRay {
    start: Vector2<f64>,
    change: Vector2<f64>,
    weight: f64,
}

/// The joint impulse clamp(start + alpha change, limit) adds minus itself times the joint's rate.
#[derive(Debug, Clone, Copy)]
struct DriveRay {
    start: f64,
    change: f64,
    limit: f64,
    rate: f64,
}

impl Ray {
    pub fn with_capacity(links: usize) -> Self {
        Self { quadratic: [0.0; 2], friction: Vec::with_capacity(2 * links), drives: Vec::with_capacity(links) }
    }

    /// Prepares the line through `twist` along `direction`.
    pub fn cast(
        &mut self,
        stage: &Stage,
        composite: &Composite,
        twist: &[Twist],
        direction: &[Twist],
        friction: &[[Proximal; 2]],
    ) {
        let (mut slope, mut rise) = (0.0, 0.0);
        let f = stage.following;
        let means =
            [twist, direction].map(|u| if f > 0.0 { stage.mean_motion(composite, u) } else { Vector3::zeros() });
        self.friction.clear();
        for (i, link) in stage.links.iter().enumerate() {
            let (u, du) = (&twist[i], &direction[i]);
            let momentum = Vector3::new(link.mass * du.x, link.mass * du.y, link.inertia * du.z);
            slope += momentum.dot(&(u - link.reference));
            rise += momentum.dot(du);
            if f > 0.0 {
                slope += f * Stage::relative_momentum(link, u, &means[0]).dot(du);
                rise += f * Stage::relative_momentum(link, du, &means[1]).dot(du);
            }
            let (slips, changes) = (link.slip(u), link.slip(du));
            for k in 0..2 {
                let viscous = link.viscous.component_mul(&changes[k]);
                slope += viscous.dot(&slips[k]);
                rise += viscous.dot(&changes[k]);
                let Proximal { penalty, centre, .. } = friction[i][k];
                let scale = link.coulomb * -penalty;
                self.friction.push(FrictionRay {
                    start: centre + scale.component_mul(&slips[k]),
                    change: scale.component_mul(&changes[k]),
                    weight: if penalty > 0.0 { penalty.recip() } else { 0.0 },
                });
            }
        }
        self.quadratic = [slope, rise];
        self.drives.clear();
        for (j, joint) in stage.joints.iter().enumerate() {
            let rate = direction[j + 1].z - direction[j].z;
            self.drives.push(DriveRay {
                start: joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z),
                change: -joint.stiffness * rate,
                limit: joint.limit,
                rate,
            });
        }
    }
}

impl Along<f64> for Ray {
    #[inline(always)]
    fn derivatives(&self, alpha: f64) -> (f64, f64) {
        let (mut slope, mut curvature) = (self.quadratic[0] + alpha * self.quadratic[1], self.quadratic[1]);
        for ray in &self.friction {
            let x = ray.start + ray.change * alpha;
            let norm_squared = x.norm_squared();
            let shrink = norm_squared.max(1.0).sqrt().recip();
            let along = x.dot(&ray.change) * shrink;
            // Sticking, p follows x; sliding, only its component across p, shrunk.
            let lost = if norm_squared <= 1.0 { 0.0 } else { along * along };
            slope += ray.weight * along;
            curvature += ray.weight * shrink * (ray.change.norm_squared() - lost);
        }
        for ray in &self.drives {
            let wanted = ray.start + alpha * ray.change;
            slope -= wanted.clamp(-ray.limit, ray.limit) * ray.rate;
            if wanted.abs() <= ray.limit {
                curvature -= ray.change * ray.rate;
            }
        }
        (slope, curvature)
    }
}
