//! The inner function of the solver along a line u + alpha du: its slope, cheaply, for any alpha.

use nalgebra::Vector2;

use super::newton::Proximal;
use super::{Stage, Twist};

/// Slope of a strongly convex, piecewise smooth function of alpha; it rises monotonically.
#[derive(Debug, Clone)]
pub(super) struct Ray {
    /// Inertia: slope at 0 and its constant rise.
    inertia: [f64; 2],
    friction: Vec<FrictionRay>,
    drives: Vec<DriveRay>,
    contacts: Vec<ContactRay>,
}

/// p = prox_disc(start + alpha change) adds `p . change / r`.
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

/// P = max(start + alpha change, 0) adds `P change / r`.
#[derive(Debug, Clone, Copy)]
struct ContactRay {
    start: f64,
    change: f64,
    weight: f64,
}

impl Ray {
    pub fn with_capacity(links: usize) -> Self {
        Self {
            inertia: [0.0; 2],
            friction: Vec::with_capacity(links),
            drives: Vec::with_capacity(links),
            contacts: Vec::with_capacity(links),
        }
    }

    /// Prepares the line through `twist` along `direction`.
    pub fn cast(
        &mut self,
        stage: &Stage,
        twist: &[Twist],
        direction: &[Twist],
        friction: &[Proximal<Vector2<f64>>],
        contact: &[Proximal<f64>],
    ) {
        self.inertia = [0.0; 2];
        self.friction.clear();
        for (((link, u), du), proximal) in stage.links.iter().zip(twist).zip(direction).zip(friction) {
            let momentum = Twist::new(link.mass * du.x, link.mass * du.y, link.inertia * du.z);
            self.inertia[0] += momentum.dot(&(u - link.reference));
            self.inertia[1] += momentum.dot(du);
            let scaled = link.friction * -proximal.penalty;
            if proximal.penalty > 0.0 {
                self.friction.push(FrictionRay {
                    start: proximal.centre + scaled.component_mul(&link.heading.to_link(u.xy())),
                    change: scaled.component_mul(&link.heading.to_link(du.xy())),
                    weight: 1.0 / proximal.penalty,
                });
            }
        }
        self.drives.clear();
        for ((joint, u), du) in stage.joints.iter().zip(twist.windows(2)).zip(direction.windows(2)) {
            let rate = du[1].z - du[0].z;
            self.drives.push(DriveRay {
                start: joint.drive - joint.stiffness * (u[1].z - u[0].z),
                change: -joint.stiffness * rate,
                limit: joint.limit,
                rate,
            });
        }
        self.contacts.clear();
        for (contact, proximal) in stage.contacts.iter().zip(contact) {
            let opening = contact.direction.dot(&twist[contact.link]) + contact.offset;
            self.contacts.push(ContactRay {
                start: proximal.centre - proximal.penalty * opening,
                change: -proximal.penalty * contact.direction.dot(&direction[contact.link]),
                weight: 1.0 / proximal.penalty,
            });
        }
    }

    /// Derivative of the inner function by alpha \[J\].
    pub fn slope(&self, alpha: f64) -> f64 {
        let mut slope = self.inertia[0] + alpha * self.inertia[1];
        for ray in &self.friction {
            let x = ray.start + ray.change * alpha;
            let norm = x.norm_squared().max(1.0).sqrt();
            slope += ray.weight * x.dot(&ray.change) / norm;
        }
        for ray in &self.drives {
            slope -= (ray.start + alpha * ray.change).clamp(-ray.limit, ray.limit) * ray.rate;
        }
        for ray in &self.contacts {
            slope += ray.weight * ray.change * (ray.start + alpha * ray.change).max(0.0);
        }
        slope
    }

    /// A zero of the slope on (0, 1) by regula falsi (Illinois), up to `accuracy` times the descent at
    /// 0; `slope` is the negative slope at 0, and the slope at 1 is positive.
    pub fn zero_of_slope(&self, slope: f64, accuracy: f64) -> f64 {
        let (mut low, mut slope_low) = (0.0, slope);
        let (mut high, mut slope_high) = (1.0, self.slope(1.0));
        let mut alpha = 1.0;
        for _ in 0..MAX_BRACKETINGS {
            alpha = high - slope_high * (high - low) / (slope_high - slope_low);
            let here = self.slope(alpha);
            if here.abs() <= accuracy * -slope {
                break;
            }
            if here > 0.0 {
                (high, slope_high) = (alpha, here);
                slope_low *= 0.5;
            } else {
                (low, slope_low) = (alpha, here);
                slope_high *= 0.5;
            }
        }
        alpha
    }
}

/// The bracket shrinks fast; the bound only guards against NaN.
const MAX_BRACKETINGS: u32 = 40;
