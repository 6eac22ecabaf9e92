//! The inner function of the solver along a line u + alpha du: its slope, cheaply, for any alpha.

use nalgebra::{Vector2, Vector3};

use crate::math::{Mask, Real};

use super::Stage;
use super::newton::Proximal;

/// Slope of a strongly convex, piecewise smooth function of alpha; it rises monotonically.
#[derive(Debug, Clone)]
pub(super) struct Ray<T> {
    /// Inertia: slope at 0 and its constant rise.
    inertia: [T; 2],
    friction: Vec<FrictionRay<T>>,
    drives: Vec<DriveRay<T>>,
    contacts: Vec<ContactRay<T>>,
}

/// p = prox_disc(start + alpha change) adds `p . change / r`.
#[derive(Debug, Clone, Copy)]
struct FrictionRay<T> {
    start: [T; 2],
    change: [T; 2],
    weight: T,
}

/// The joint impulse clamp(start + alpha change, limit) adds minus itself times the joint's rate.
#[derive(Debug, Clone, Copy)]
struct DriveRay<T> {
    start: T,
    change: T,
    limit: T,
    rate: T,
}

/// P = max(start + alpha change, 0) adds `P change / r`.
#[derive(Debug, Clone, Copy)]
struct ContactRay<T> {
    start: T,
    change: T,
    weight: T,
}

impl<T: Real> Ray<T> {
    pub fn with_capacity(links: usize) -> Self {
        Self {
            inertia: [T::zero(); 2],
            friction: Vec::with_capacity(links),
            drives: Vec::with_capacity(links),
            contacts: Vec::with_capacity(links),
        }
    }

    /// Prepares the line through `twist` along `direction`.
    #[inline(always)]
    pub fn cast(
        &mut self,
        stage: &Stage<T>,
        twist: &[Vector3<T>],
        direction: &[Vector3<T>],
        friction: &[Proximal<T, Vector2<T>>],
        contact: &[Proximal<T, T>],
    ) {
        self.inertia = [T::zero(); 2];
        self.friction.clear();
        for (i, link) in stage.links.iter().enumerate() {
            let (u, du, proximal) = (&twist[i], &direction[i], &friction[i]);
            let momentum = Vector3::new(link.mass * du.x, link.mass * du.y, link.inertia * du.z);
            self.inertia[0] +=
                dot(&momentum, &Vector3::new(u.x - link.reference.x, u.y - link.reference.y, u.z - link.reference.z));
            self.inertia[1] += dot(&momentum, du);
            let (c, s) = (link.heading.cos, link.heading.sin);
            let scale = [-proximal.penalty * link.friction.x, -proximal.penalty * link.friction.y];
            let weight = T::splat(1.0) / proximal.penalty;
            self.friction.push(FrictionRay {
                start: [
                    proximal.centre.x + scale[0] * (c * u.x + s * u.y),
                    proximal.centre.y + scale[1] * (c * u.y - s * u.x),
                ],
                change: [scale[0] * (c * du.x + s * du.y), scale[1] * (c * du.y - s * du.x)],
                weight: T::select(T::zero().lt(proximal.penalty), weight, T::zero()),
            });
        }
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
        self.contacts.clear();
        for (contact, proximal) in stage.contacts.iter().zip(contact) {
            let opening = dot(&contact.direction, &twist[contact.link]) + contact.offset;
            self.contacts.push(ContactRay {
                start: proximal.centre - proximal.penalty * opening,
                change: -proximal.penalty * dot(&contact.direction, &direction[contact.link]),
                weight: T::splat(1.0) / proximal.penalty,
            });
        }
    }

    /// First and generalised second derivative of the inner function by alpha \[J\].
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let (mut slope, mut curvature) = (self.inertia[0] + alpha * self.inertia[1], self.inertia[1]);
        for ray in &self.friction {
            let (dx, dy) = (ray.change[0], ray.change[1]);
            let (x, y) = (ray.start[0] + dx * alpha, ray.start[1] + dy * alpha);
            let norm_squared = x * x + y * y;
            let shrink = one / norm_squared.max(one).sqrt();
            let (px, py) = (x * shrink, y * shrink);
            let along = px * dx + py * dy;
            // Sticking, p follows x; sliding, only its component across p, shrunk.
            let lost = T::select(norm_squared.le(one), zero, along * along);
            slope += ray.weight * along;
            curvature += ray.weight * shrink * (dx * dx + dy * dy - lost);
        }
        for ray in &self.drives {
            let wanted = ray.start + alpha * ray.change;
            slope -= wanted.min(ray.limit).max(-ray.limit) * ray.rate;
            curvature -= T::select(wanted.abs().le(ray.limit), ray.change * ray.rate, zero);
        }
        for ray in &self.contacts {
            let impulse = ray.start + alpha * ray.change;
            let change = T::select(zero.lt(impulse), ray.change, zero);
            slope += ray.weight * change * impulse;
            curvature += ray.weight * change * change;
        }
        (slope, curvature)
    }

    /// A zero of the slope on (0, 1) up to `accuracy` times the descent at 0, in the given lanes;
    /// `slope` is the negative slope at 0. Where the slope at 1 is not positive it is 1.
    ///
    /// Newton's method from the end, which crosses a stiff contact or a stuck link in one step, kept
    /// within the bracket by bisection.
    #[inline(always)]
    pub fn zero_of_slope(&self, slope: T, accuracy: T, lanes: T::Mask) -> T {
        let (mut low, mut high) = (T::zero(), T::splat(1.0));
        let (mut alpha, mut searching) = (high, lanes);
        for _ in 0..MAX_EVALUATIONS {
            let (here, curvature) = self.derivatives(alpha);
            searching = searching & (accuracy * -slope).lt(here.abs());
            let beyond = T::zero().lt(here);
            low = T::select(beyond, low, alpha);
            high = T::select(beyond, alpha, high);
            searching = searching & low.lt(high);
            if !searching.any() {
                break;
            }
            let newton = alpha - here / curvature;
            let inside = low.lt(newton) & newton.lt(high);
            let next = T::select(inside, newton, T::splat(0.5) * (low + high));
            alpha = T::select(searching, next, alpha);
        }
        alpha
    }
}

#[inline(always)]
fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// A few evaluations suffice; the bound guards against NaN.
const MAX_EVALUATIONS: u32 = 40;
