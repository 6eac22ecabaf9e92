//! Laws along a step as functions of how much of it is taken: a search evaluates them several times, and each takes a few
//! operations only.

use nalgebra::Vector2;

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::laws::Halves;
use crate::math::{Mask, Real};
use crate::solver::{NearestKink, add};
use crate::spatial::stage::CONTACTS_PER_LINK;

/// Friction and contacts along the present step.
pub(super) struct RayLaws<T> {
    discs: Vec<DiscOnRay<T>>,
    split: Vec<SplitOnRay<T>>,
    contacts: Vec<ContactOnRay<T>>,
}

/// A friction law, p = prox_disc(x - alpha r d): by Pythagoras |x - alpha r d|^2 = (r |d| (alpha - least))^2 + rest.
#[derive(Debug, Clone, Copy)]
struct DiscOnRay<T> {
    /// The alpha at which the point is nearest to the centre.
    least: T,
    /// r |d|^2 \[J\], zero without friction.
    rise: T,
    /// (r |d|)^2, the rest, and the square of the radius \[N^2 s^2\].
    growth: T,
    rest: T,
    bound: T,
}

/// The same of two halves of discs, of which that counts on whose side x_x lies.
#[derive(Debug, Clone, Copy)]
struct SplitOnRay<T> {
    halves: [DiscOnRay<T>; 2],
    /// x_x at the start, and how much it falls.
    x: T,
    fall: T,
}

/// A unilateral contact, P = max(wanted - alpha fall, 0), whose velocity changes by `rate`.
#[derive(Debug, Clone, Copy)]
struct ContactOnRay<T> {
    wanted: T,
    fall: T,
    rate: T,
}

impl<T: Real> RayLaws<T> {
    pub fn new(links: usize) -> Self {
        // Both ends of a link, its roll, and obstacles; both ends, both stops of two axes, obstacles and other links.
        Self {
            discs: Vec::with_capacity((3 + CONTACTS_PER_LINK) * links),
            split: Vec::with_capacity(2 * links),
            contacts: Vec::with_capacity((6 + CONTACTS_PER_LINK + LINK_CONTACTS_PER_LINK) * links),
        }
    }

    /// Begins a step.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.discs.clear();
        self.split.clear();
        self.contacts.clear();
    }

    /// Friction in a disc of `radius` and stiffness r, at the point x = centre - r gamma^ of the start; the slip changes by `d`.
    #[inline(always)]
    pub fn add_friction<H: Halves>(&mut self, halves: H, radius: T, x: &Vector2<T>, d: &Vector2<T>, r: T) {
        if !T::zero().lt(radius).any() {
            return;
        }
        let [first, second] = halves.sides();
        let disc = DiscOnRay::new(radius, &halves.scaled(x, first), &halves.scaled(d, first), r);
        if !H::DIFFER {
            self.discs.push(disc);
            return;
        }
        let other = DiscOnRay::new(radius, &halves.scaled(x, second), &halves.scaled(d, second), r);
        self.split.push(SplitOnRay { halves: [disc, other], x: x.x, fall: r * d.x });
    }

    /// A contact that presses with `wanted` at the start, unless it is negative, whose velocity changes by `rate`.
    #[inline(always)]
    pub fn add_contact(&mut self, wanted: T, rate: T, r: T) {
        let fall = r * rate;
        if T::zero().lt(wanted.max(wanted - fall)).any() {
            self.contacts.push(ContactOnRay { wanted, fall, rate });
        }
    }

    /// First and second derivative of all laws' functions by alpha.
    #[inline(always)]
    pub fn derivatives(&self, alpha: T) -> (T, T) {
        let mut sum = (T::zero(), T::zero());
        for disc in &self.discs {
            add(&mut sum, disc.derivatives(alpha));
        }
        for split in &self.split {
            add(&mut sum, split.derivatives(alpha));
        }
        for contact in &self.contacts {
            add(&mut sum, contact.derivatives(alpha));
        }
        sum
    }

    /// Shows `nearest` where slips are least. Laws without friction or change show the start, which lies inside no bracket.
    #[inline(always)]
    pub fn visit_kinks(&self, nearest: &mut NearestKink<T>) {
        for disc in self.discs.iter().chain(self.split.iter().flat_map(|split| &split.halves)) {
            nearest.consider(disc.least);
        }
    }
}

impl<T: Real> DiscOnRay<T> {
    #[inline(always)]
    fn new(radius: T, x: &Vector2<T>, d: &Vector2<T>, r: T) -> Self {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let rise = T::select(zero.lt(radius), r * d.x.mul_add(d.x, d.y * d.y), zero);
        let changes = T::splat(TINY).lt(rise);
        let inverse = T::select(changes, one / T::select(changes, rise, one), zero);
        let across = x.x.mul_add(d.y, -(x.y * d.x));
        Self {
            least: x.x.mul_add(d.x, x.y * d.y) * inverse,
            rise,
            growth: r * rise,
            rest: across * across * (inverse * r),
            bound: radius * radius,
        }
    }

    /// -(p . d) and -(dp / d alpha) . d.
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let one = T::splat(1.0);
        let away = alpha - self.least;
        let squared = (self.growth * away).mul_add(away, self.rest);
        let within = squared.le(self.bound);
        let inverse = one / T::select(within, one, squared);
        // Outside, only the component across p follows.
        let shrink = T::select(within, one, (self.bound * inverse).sqrt());
        let across = T::select(within, one, self.rest * inverse);
        let rise = self.rise * shrink;
        (rise * away, rise * across)
    }
}

impl<T: Real> SplitOnRay<T> {
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let is_first = T::zero().le(self.fall.subtract_from(alpha, self.x));
        let (first, second) = (self.halves[0].derivatives(alpha), self.halves[1].derivatives(alpha));
        (T::select(is_first, first.0, second.0), T::select(is_first, first.1, second.1))
    }
}

impl<T: Real> ContactOnRay<T> {
    #[inline(always)]
    fn derivatives(&self, alpha: T) -> (T, T) {
        let pressing = self.fall.subtract_from(alpha, self.wanted);
        let stiffness = T::select(T::zero().lt(pressing), self.fall, T::zero());
        (-(pressing.max(T::zero()) * self.rate), stiffness * self.rate)
    }
}

/// r |d|^2 below which a quotient by it may be no number \[J\].
const TINY: f64 = 1e-200;
