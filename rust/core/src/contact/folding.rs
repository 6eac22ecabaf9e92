use std::f64::consts::{FRAC_PI_2, PI};

use crate::math::Real;
use crate::robot::Link;

/// Bounds on a robot's posture within which no two links that are not neighbours can be close to each other.
///
/// Seen along a middle link, the links before and behind it lie on either side of it while both joints bend by less
/// than a right angle: they are apart by its length. Seen along the mean direction of links that all point within half
/// of `range` of it, every link leads on by its length times the cosine of that half: links with two or more between
/// them are apart by what those two lead on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldingBound {
    /// Largest angle of a joint \[rad\].
    bend: f64,
    /// Largest difference of the absolute angles of any two links \[rad\].
    range: f64,
}

impl FoldingBound {
    /// Bounds within which the surfaces of links that are not neighbours are more than `clearance` apart \[m\].
    pub fn new(links: &[Link], clearance: f64) -> Self {
        let thickest = links.iter().map(|link| link.radius).fold(0.0, f64::max);
        // Links that reach beyond their joints may touch in any posture.
        let is_slender = |link: &Link| link.contact_half_length <= 0.5 * link.length;
        let apart = |triple: &[Link]| triple[1].length > triple[0].radius + triple[2].radius + clearance;
        let bend = if links.iter().all(is_slender) && links.windows(3).all(apart) { FRAC_PI_2 } else { 0.0 };
        let cosine = |four: &[Link]| (four[0].radius + thickest + clearance) / (four[1].length + four[2].length);
        let cosine = links.windows(4).map(cosine).fold(0.0, f64::max);
        Self { bend, range: if cosine < 1.0 { (2.0 * cosine.acos()).min(PI) } else { 0.0 } }
    }

    /// The lanes in which links of these absolute angles may be close to each other.
    #[inline(always)]
    pub fn exceeded_by<T: Real>(&self, angles: impl Iterator<Item = T>) -> T::Mask {
        let (mut least, mut most) = (T::splat(f64::INFINITY), T::splat(-f64::INFINITY));
        let mut bend = T::zero();
        let mut before = None;
        for angle in angles {
            (least, most) = (least.min(angle), most.max(angle));
            bend = bend.max((angle - before.unwrap_or(angle)).abs());
            before = Some(angle);
        }
        T::splat(self.bend).lt(bend) | T::splat(self.range).lt(most - least)
    }
}
