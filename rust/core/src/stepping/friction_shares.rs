//! What is left of the ground's friction at each contact in a stage: the Stribeck effect (T 7.5.4), and patches.
//!
//! A bound that falls with the slip it bounds makes a stage non-convex, and its solution not unique once the falling
//! slope exceeds m / c. So the bounds of a stage follow from slips that are known before it, and the stage stays
//! convex. Implicit Euler takes the slip u_A at the start of the step, to first order. The two-stage scheme takes u_A
//! in its first stage and, in its second, the slip extrapolated to `u_A + (u_1 - u_A) / (2 gamma^2)`: with weights (1 -
//! gamma, gamma) of the stages the bounds then are those of the middle of the step, and order two is kept where links
//! slide on (a semi-implicit Runge-Kutta scheme in the sense of Boscarino, Filbet and Russo, 2016).
//!
//! The factor of a patch is that of the start of the part of a step. A part of second order that takes a contact across a
//! border is taken again up to there.

use nalgebra::Vector2;

use crate::laws::remaining;
use crate::math::{MAX_LANES, Real};
use crate::obstacles::Patches;

use super::sdirk::GAMMA;

/// What is left of the friction at the contacts with the ground of robots in the lanes of a register.
pub struct FrictionShares<T> {
    /// Whether any lane's ground has the effect, or patches.
    pub is_any: bool,
    drop: T,
    /// Square of the speed at which half of the drop is reached \[m^2/s^2\].
    squared_scale: T,
    /// Slip of each contact from which its bound follows.
    slip: Vec<Vector2<T>>,
    patches: Patches,
    /// Of the patches, and where the contacts were at the start of the part.
    factor: Vec<T>,
    start: Vec<[ContactPoint; MAX_LANES]>,
}

/// A contact with the ground, seen from above.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactPoint {
    /// \[m\], \[m/s\]
    pub position: Vector2<f64>,
    pub velocity: Vector2<f64>,
}

impl<T: Real> FrictionShares<T> {
    pub fn new(contacts: usize, speed: f64, patches: &Patches) -> Self {
        let zero = T::zero();
        let points = if patches.is_empty() { 0 } else { contacts };
        Self {
            is_any: false,
            drop: zero,
            squared_scale: T::splat(speed * speed),
            slip: vec![Vector2::new(zero, zero); contacts],
            patches: patches.clone(),
            factor: vec![T::splat(1.0); contacts],
            start: vec![[ContactPoint::default(); MAX_LANES]; points],
        }
    }

    /// Takes the drop of friction of the lanes' robots.
    pub fn load(&mut self, drop: impl Fn(usize) -> f64) {
        self.is_any = self.has_patches() || (0..T::LANES).any(|lane| drop(lane) > 0.0);
        for lane in 0..T::LANES {
            self.drop.set_lane(lane, drop(lane));
        }
    }

    pub fn has_patches(&self) -> bool {
        !self.patches.is_empty()
    }

    /// Takes the factors of the patches on which a lane's contacts begin a part; one that is at a border, of that to which it
    /// moves.
    pub fn find_patches(&mut self, lane: usize, contacts: impl Iterator<Item = ContactPoint>) {
        for ((factor, start), contact) in self.factor.iter_mut().zip(&mut self.start).zip(contacts) {
            let ContactPoint { position, velocity } = contact;
            let ahead = position + velocity.try_normalize(0.0).unwrap_or_default() * AT_BORDER;
            factor.set_lane(lane, self.patches.factor_at(&ahead));
            start[lane] = contact;
        }
    }

    /// Time after which the first of a lane's contacts leaves its patch in a part of length `h`, by where it ends; none for
    /// those that do not touch. Infinite where none leaves \[s\].
    pub fn first_crossing(&self, lane: usize, h: f64, ends: impl Iterator<Item = Option<Vector2<f64>>>) -> f64 {
        let contacts = self.start.iter().zip(&self.factor).zip(ends);
        contacts
            .filter_map(|((start, factor), end)| {
                let (ContactPoint { position, velocity }, end) = (start[lane], end?);
                let share = self.patches.first_change([&position, &end], factor.lane(lane), AT_BORDER)?;
                // With the acceleration that is constant and leads to the end, and a little beyond the border.
                let way = (end - position).norm();
                let (speed, to_border) = (velocity.dot(&(end - position)) / way, share * way + 0.5 * AT_BORDER);
                let acceleration = 2.0 * (way - speed * h) / (h * h);
                let at = 2.0 * to_border / (speed + (speed * speed + 2.0 * acceleration * to_border).sqrt());
                let is_within = at > 0.0 && at < h;
                Some(if is_within { at } else { h * (to_border / way).min(LATEST) })
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Takes the slip of a stage that starts with the step.
    #[inline(always)]
    pub fn begin_step(&mut self, start: impl Fn(usize) -> Vector2<T>) {
        if self.is_any {
            for (contact, slip) in self.slip.iter_mut().enumerate() {
                *slip = start(contact);
            }
        }
    }

    /// Takes the slip of the second stage, as far from the start of the step as the end of the first.
    #[inline(always)]
    pub fn extrapolate(&mut self, end: impl Fn(usize) -> Vector2<T>) {
        let weight = T::splat(0.5 / (GAMMA * GAMMA));
        for (contact, slip) in self.slip.iter_mut().enumerate() {
            let end = end(contact);
            *slip = Vector2::new(slip.x + (end.x - slip.x) * weight, slip.y + (end.y - slip.y) * weight);
        }
    }

    /// Number of contacts.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.factor.len()
    }

    /// What is left of the friction at a contact.
    #[inline(always)]
    pub fn share(&self, contact: usize) -> T {
        let u = &self.slip[contact];
        remaining(self.drop, self.squared_scale, u.x * u.x + u.y * u.y) * self.factor[contact]
    }
}

/// Distance from a border within which a contact counts as at it \[m\].
const AT_BORDER: f64 = 1e-6;

/// Latest crossing, over the length of the part: one that is taken again is shorter.
const LATEST: f64 = 0.999;
