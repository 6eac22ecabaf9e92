//! Distances along rays, seen from above.

use nalgebra::Vector2;

use super::{ConvexPolygon, ObstacleGrid, Peg};

impl ObstacleGrid {
    /// Lowers each of `distances` \[m\] to that of the nearest obstacle from `origin` along the ray of the unit vector in
    /// `rays`; rays pass above obstacles that end below `height` \[m\]. Exact for outlines with `origin` outside.
    pub fn cast_rays(&self, origin: &Vector2<f64>, height: f64, rays: &[Vector2<f64>], distances: &mut [f64]) {
        let farthest = distances.iter().copied().fold(0.0, f64::max);
        self.visit_obstacles(origin, farthest, |obstacle| {
            if self.top(obstacle) < height || self.body(obstacle).is_some() {
                return;
            }
            let peg = self.pegs().get(obstacle);
            for (ray, distance) in rays.iter().zip(&mut *distances) {
                let found = match peg {
                    Some(peg) => peg.distance_along(origin, ray),
                    None => self.polygon(obstacle).distance_along(origin, ray),
                };
                *distance = distance.min(found);
            }
        });
    }
}

impl Peg {
    /// Infinite where the ray misses.
    fn distance_along(&self, origin: &Vector2<f64>, ray: &Vector2<f64>) -> f64 {
        let centre = Vector2::new(self.x, self.y) - origin;
        let (nearest, beside) = (ray.dot(&centre), ray.perp(&centre));
        let half_chord_squared = self.radius * self.radius - beside * beside;
        if nearest >= 0.0 && half_chord_squared >= 0.0 { nearest - half_chord_squared.sqrt() } else { f64::INFINITY }
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

/// By how much of an edge a ray may miss it, so that none passes between two edges.
const ROUNDING: f64 = 1e-12;
