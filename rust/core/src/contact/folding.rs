use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;

use crate::math::{Real, dot};
use crate::robot::Link;

/// How far a robot is folded.
#[derive(Debug, Clone, Copy)]
pub struct Folding<T> {
    /// Largest angle of a joint \[rad\].
    pub bend: T,
    /// Largest difference of the absolute angles of any two links \[rad\].
    pub range: T,
}

/// Bounds on a robot's posture within which no two links that are not neighbours can be close to each other.
///
/// Seen along a middle link, the links before and behind it lie on either side of it while both joints bend by less
/// than a right angle: they are apart by its length. Seen along the mean direction of links that all point within half
/// of `range` of it, every link advances by its length times the cosine of that half: links with two or more between
/// them are apart by the advance of those two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldingBound {
    /// Largest angle of a joint \[rad\].
    bend: f64,
    /// Largest difference of the absolute angles of any two links \[rad\].
    range: f64,
    /// Least cosine of the angle between neighbours, and of that between a link and the mean direction.
    cosine: [f64; 2],
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
        let range = if cosine < 1.0 { (2.0 * cosine.acos()).min(PI) } else { 0.0 };
        let least = |angle: f64, cosine: f64| if angle > 0.0 { cosine } else { f64::INFINITY };
        Self { bend, range, cosine: [least(bend, 0.0), least(range, cosine)] }
    }

    /// The lanes in which a joint is bent so far that the links on either side of a link may be close to each other.
    #[inline(always)]
    pub fn is_sharp<T: Real>(&self, posture: &Folding<T>) -> T::Mask {
        T::splat(self.bend).lt(posture.bend)
    }

    /// The lanes in which links of a posture may be close to each other.
    #[inline(always)]
    pub fn exceeded_by<T: Real>(&self, posture: &Folding<T>) -> T::Mask {
        self.is_sharp(posture) | T::splat(self.range).lt(posture.range)
    }

    /// The lanes in which links along these axes in 3D may be close to each other.
    #[inline(always)]
    pub fn exceeded_by_axes<T: Real>(&self, axes: impl Iterator<Item = Vector3<T>> + Clone) -> T::Mask {
        let zero = T::zero();
        let mut sum = Vector3::new(zero, zero, zero);
        let mut bend = T::splat(f64::INFINITY);
        let mut before = None;
        for axis in axes.clone() {
            sum = Vector3::new(sum.x + axis.x, sum.y + axis.y, sum.z + axis.z);
            bend = before.map_or(bend, |before| bend.min(dot(&before, &axis)));
            before = Some(axis);
        }
        let mut ahead = T::splat(f64::INFINITY);
        for axis in axes {
            ahead = ahead.min(dot(&axis, &sum));
        }
        let [least_bend, least_ahead] = self.cosine.map(T::splat);
        // Also where the axes cancel and the mean direction is undefined.
        !(least_bend.lt(bend) & (least_ahead * dot(&sum, &sum).sqrt()).lt(ahead))
    }
}

impl<T: Real> Folding<T> {
    /// Of links of these absolute angles.
    #[inline(always)]
    pub fn of(angles: impl Iterator<Item = T>) -> Self {
        let (mut least, mut most) = (T::splat(f64::INFINITY), T::splat(-f64::INFINITY));
        let mut bend = T::zero();
        let mut before = None;
        for angle in angles {
            (least, most) = (least.min(angle), most.max(angle));
            bend = bend.max((angle - before.unwrap_or(angle)).abs());
            before = Some(angle);
        }
        Self { bend, range: most - least }
    }
}
