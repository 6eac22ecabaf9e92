//! Distances along horizontal rays, and along any of other bodies than vertical ones.

use nalgebra::{Vector2, Vector3};

use super::{Body, ConvexPolygon, Cylinder, HeightField, ObstacleGrid, Peg, PlacedMovable};

impl ObstacleGrid {
    /// Lowers each of `distances` \[m\] to that of the nearest obstacle from `origin` along the horizontal ray of the unit
    /// vector in `rays` at a `height` \[m\] over the plane. Exact with the origin outside of all obstacles.
    pub fn cast_rays(&self, origin: &Vector2<f64>, height: f64, rays: &[Vector2<f64>], distances: &mut [f64]) {
        let farthest = distances.iter().copied().fold(0.0, f64::max);
        self.visit_obstacles(origin, farthest, |obstacle| {
            if self.top(obstacle) < height {
                return;
            }
            let (peg, body) = (self.pegs().get(obstacle), self.body(obstacle));
            for (ray, distance) in rays.iter().zip(&mut *distances) {
                let found = match (peg, body) {
                    (Some(peg), _) => peg.distance_along(origin, ray),
                    (_, Some(body)) => body.distance_along(&origin.push(height), &ray.push(0.0)),
                    _ => self.polygon(obstacle).distance_along(origin, ray),
                };
                *distance = distance.min(found);
            }
        });
    }
}

impl Peg {
    /// Distance from a point along the ray of a unit vector, infinite where the ray misses \[m\].
    pub fn distance_along(&self, origin: &Vector2<f64>, ray: &Vector2<f64>) -> f64 {
        let centre = Vector2::new(self.x, self.y) - origin;
        let (nearest, beside) = (ray.dot(&centre), ray.perp(&centre));
        let half_chord_squared = self.radius * self.radius - beside * beside;
        if nearest >= 0.0 && half_chord_squared >= 0.0 { nearest - half_chord_squared.sqrt() } else { f64::INFINITY }
    }
}

impl PlacedMovable<'_> {
    /// The same to something that can be pushed, at a `height` \[m\].
    pub fn distance_along(&self, origin: &Vector2<f64>, height: f64, ray: &Vector2<f64>) -> f64 {
        if let Some((outline, turn)) = self.outline() {
            let back = turn.inverse();
            return outline.distance_along(&(back * (origin - self.pose.xy())), &(back * ray));
        }
        let above = if self.is_ball { height - self.height } else { 0.0 };
        let cut = |disc: Peg| Peg { radius: (disc.radius * disc.radius - above * above).sqrt(), ..disc };
        // A ray over or under a ball has no radius, and misses.
        self.disc().map_or(f64::INFINITY, |disc| cut(disc).distance_along(origin, ray))
    }
}

impl ConvexPolygon {
    /// Infinite where the ray misses; a wall without thickness cannot be hit on its end.
    fn distance_along(&self, origin: &Vector2<f64>, ray: &Vector2<f64>) -> f64 {
        let vertices = self.vertices();
        let to_edge = |edge: usize| {
            let along = vertices[(edge + 1) % vertices.len()] - vertices[edge];
            let offset = vertices[edge] - origin;
            // offset + share along = distance ray; of parallel lines both are infinite or no numbers.
            let (across, share) = (ray.perp(&along), -ray.perp(&offset));
            let (distance, share) = (offset.perp(&along) / across, share / across);
            let is_hit = distance >= 0.0 && (-ROUNDING..=1.0 + ROUNDING).contains(&share);
            if is_hit { distance } else { f64::INFINITY }
        };
        (0..vertices.len()).map(to_edge).fold(f64::INFINITY, f64::min)
    }
}

impl Body {
    /// From an origin outside along the ray of a unit vector; infinite where it misses \[m\].
    pub fn distance_along(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
        match self {
            Self::HeightField(field) => field.distance_along(origin, ray),
            Self::Polyhedron(hull) => entry(hull.planes().map(|(normal, point)| {
                let height = (origin - point).dot(&normal);
                (height, ray.dot(&normal))
            })),
            Self::Cylinder(cylinder) => cylinder.distance_along(origin, ray),
        }
    }
}

impl Cylinder {
    fn distance_along(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
        let offset = origin - self.start;
        let (from, along) = (offset.dot(&self.axis), ray.dot(&self.axis));
        let (place, across) = (offset - self.axis * from, ray - self.axis * along);
        // |place + distance across| = radius, as half of the chord on both sides of the middle.
        let squared = across.norm_squared();
        let middle = -place.dot(&across) / squared;
        let half_squared = (self.radius * self.radius - (place + across * middle).norm_squared()) / squared;
        let [first, last] = [middle - half_squared.sqrt(), middle + half_squared.sqrt()];
        if self.is_pipe {
            let is_on = |distance: &f64| *distance >= 0.0 && (0.0..=self.length).contains(&(from + distance * along));
            return [first, last].into_iter().find(is_on).unwrap_or(f64::INFINITY);
        }
        let is_parallel = squared < PARALLEL;
        let misses = if is_parallel { place.norm() > self.radius } else { half_squared < 0.0 };
        if misses {
            return f64::INFINITY;
        }
        // Between both ends and, unless the ray is parallel to the axis, between both ends of the chord.
        let [enters, leaves] = if is_parallel { [f64::NEG_INFINITY, f64::INFINITY] } else { [first, last] };
        entry([(-from, -along), (from - self.length, along), (enters, -1.0), (-leaves, 1.0)])
    }
}

impl HeightField {
    /// In one triangle after the other, in which the height over the field is linear.
    fn distance_along(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
        let rectangle = self.rectangle();
        let sides = (0..2).flat_map(|axis| {
            [(rectangle.low[axis] - origin[axis], -ray[axis]), (origin[axis] - rectangle.high[axis], ray[axis])]
        });
        let is_over = rectangle.distance(&origin.xy()) == 0.0;
        let mut at = if is_over { 0.0 } else { entry(sides) };
        if at == f64::INFINITY {
            return at;
        }
        // Lines of the grid and diagonals: coordinates that are whole numbers there, and their rates.
        let (place, rate) = (self.local(&origin.xy()), ray.xy() / self.spacing());
        let lines = [(place.x, rate.x), (place.y, rate.y), (place.y - place.x, rate.y - rate.x)];
        loop {
            let to_next = |(place, rate): (f64, f64)| {
                let whole = place + rate * at;
                let next = if rate > 0.0 { (whole + AT_LINE).floor() + 1.0 } else { (whole - AT_LINE).ceil() - 1.0 };
                if rate == 0.0 { f64::INFINITY } else { (next - place) / rate }
            };
            let next = lines.map(to_next).into_iter().fold(f64::INFINITY, f64::min);
            let height = |distance: f64| {
                let point = origin + ray * distance;
                let middle = origin + ray * (0.5 * (at + next));
                Some(point.z - self.height_of_triangle_at(&middle.xy(), &point.xy())?)
            };
            // Beside the field; a vertical ray stays over one triangle.
            let vertical = || self.height_at(&origin.xy()).map_or(f64::INFINITY, |top| (top - origin.z) / ray.z);
            if next == f64::INFINITY {
                return Some(vertical()).filter(|distance| *distance >= 0.0).unwrap_or(f64::INFINITY);
            }
            let (Some(start), Some(end)) = (height(at), height(next)) else { return f64::INFINITY };
            if start <= 0.0 {
                return at;
            }
            if end <= 0.0 {
                return at + (next - at) * start / (start - end);
            }
            at = next;
        }
    }
}

/// Where a ray enters a convex body, from the heights of its origin above the planes around the body and their rates;
/// infinite where it misses.
fn entry(planes: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    for (height, rate) in planes {
        if rate < 0.0 {
            enters = enters.max(-height / rate);
        } else if rate > 0.0 {
            leaves = leaves.min(-height / rate);
        } else if height > 0.0 {
            return f64::INFINITY;
        }
    }
    if enters <= leaves { enters } else { f64::INFINITY }
}

/// Squared sine between a ray and an axis that count as parallel.
const PARALLEL: f64 = 1e-20;

/// Share of a cell within which a ray is at a line of the grid.
const AT_LINE: f64 = 1e-9;

/// By how much of an edge a ray may miss it, so that none passes between two edges.
const ROUNDING: f64 = 1e-12;
