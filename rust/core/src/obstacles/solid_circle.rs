//! Places at which a centre line touches a cylinder: its side, and the rim of its top face where the line comes over it
//! and where it leaves it.

use nalgebra::{Vector2, Vector3};

use super::solid::{Solid, SolidContact, SolidLine};
use super::{CentreLine, Peg, Separation};

/// The side, and the two crossings of the rim.
pub(super) const FEATURES: usize = 3;

/// Depth, negative, of a line that crosses the circle, and the positions between which it does.
pub(super) fn crossing(peg: &Peg, shadow: &CentreLine) -> Option<(f64, [f64; 2])> {
    let at = shadow.nearest(&centre(peg));
    let depth = (shadow.point(at) - centre(peg)).norm() - peg.radius;
    (depth < 0.0).then(|| (depth, chord(peg, shadow).map(|along| along.clamp(-1.0, 1.0))))
}

/// How a crossing line leaves the circle: at the feature of the side.
pub(super) fn way_out(peg: &Peg, shadow: &CentreLine, feature: usize) -> Separation {
    let at = shadow.nearest(&centre(peg));
    let offset = shadow.point(at) - centre(peg);
    let lateral = Vector2::new(-shadow.half.y, shadow.half.x).try_normalize(0.0);
    let normal = offset.try_normalize(0.0).or(lateral).unwrap_or_else(Vector2::x);
    Separation { distance: offset.norm() - peg.radius, normal, along: at, is_redundant: feature != SIDE }
}

fn centre(peg: &Peg) -> Vector2<f64> {
    Vector2::new(peg.x, peg.y)
}

/// Places at which the straight line enters and leaves the circle, infinite for an upright one.
fn chord(peg: &Peg, shadow: &CentreLine) -> [f64; 2] {
    let (offset, squared) = (shadow.middle - centre(peg), shadow.half.norm_squared());
    let middle = -offset.dot(&shadow.half) / squared;
    let nearest = (offset + shadow.half * middle).norm_squared();
    let half = ((peg.radius * peg.radius - nearest).max(0.0) / squared).sqrt();
    if squared > 0.0 { [middle - half, middle + half] } else { [f64::NEG_INFINITY, f64::INFINITY] }
}

impl Solid<'_> {
    pub(super) fn circle_contact(&self, peg: &Peg, line: &SolidLine, part: usize) -> SolidContact {
        let shadow = line.shadow();
        let beside = shadow.nearest(&centre(peg));
        let is_over = (shadow.point(beside) - centre(peg)).norm() < peg.radius;
        let passes_below = line.point(beside).z <= self.height;
        match part {
            0 if is_over => SolidContact::AWAY,
            0 if passes_below => self.with_nearest(peg, line, beside),
            0 => {
                let lower = if line.half.z > 0.0 { -1.0 } else { 1.0 };
                let along = self.settle(peg, line, [beside, if line.half.z == 0.0 { beside } else { lower }]);
                self.with_nearest(peg, line, along)
            }
            _ if !is_over => SolidContact::AWAY,
            part => {
                let [enters, leaves] = chord(peg, &shadow);
                let (rim, outward) = if part == 1 { (enters, -1.0) } else { (leaves, 1.0) };
                // The end above the face is the ground's.
                if rim.abs() >= 1.0 {
                    return SolidContact::AWAY;
                }
                let falls = line.half.z * outward <= 0.0;
                let along = self.settle(peg, line, [rim, if falls { outward } else { beside }]);
                let is_none = !falls && along == beside;
                if is_none { SolidContact::AWAY } else { self.with_nearest(peg, line, along) }
            }
        }
    }

    /// The position between two where the distance from the rim is least: where its derivative, which grows away from the
    /// circle's centre, changes sign; the second of the two where it does not.
    fn settle(&self, peg: &Peg, line: &SolidLine, [from, to]: [f64; 2]) -> f64 {
        let rise = |along: f64| {
            let point = line.point(along);
            let offset = point.xy() - centre(peg);
            let distance = offset.norm();
            let beside = if distance > 0.0 { (1.0 - peg.radius / distance) * offset.dot(&line.half.xy()) } else { 0.0 };
            beside + (point.z - self.height).max(0.0) * line.half.z
        };
        let direction = to - from;
        let falls = |along: f64| rise(along) * direction < 0.0;
        if !falls(from) {
            return from;
        }
        if falls(to) {
            return to;
        }
        let (mut low, mut high) = (from, to);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if falls(middle) { low = middle } else { high = middle }
        }
        high
    }

    /// The contact with the nearest point of the side or the rim.
    fn with_nearest(&self, peg: &Peg, line: &SolidLine, along: f64) -> SolidContact {
        let point = line.point(along);
        let outward = (point.xy() - centre(peg)).try_normalize(0.0).unwrap_or_else(Vector2::x);
        let nearest = (centre(peg) + outward * peg.radius).push(point.z.min(self.height));
        SolidContact::between(line, along, &nearest, Vector3::z())
    }
}

/// Place of the side, after the two ends.
const SIDE: usize = 2;

/// Bisections of a centre line: to round-off.
const HALVINGS: u32 = 52;
