//! Integrals over the area of a convex polygon.

use nalgebra::Vector2;

use super::ConvexPolygon;

/// A homogeneous plate in the outline of a convex polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// \[m^2\]
    pub area: f64,
    /// \[m\]
    pub centroid: Vector2<f64>,
    /// Moment of inertia about the centroid over mass \[m^2\].
    pub squared_gyration: f64,
    /// Mean distance of its points from the centroid \[m\].
    pub mean_distance: f64,
}

impl Plate {
    /// Sums over the triangles between the centroid and the edges.
    ///
    /// Of such a triangle, whose edge lies at the height d and reaches from the place s_a along it to s_b, the integral of
    /// the distance is `d^3 / 6 [t sqrt(1 + t^2) + asinh t]` between t = s_a / d and s_b / d.
    pub fn of(polygon: &ConvexPolygon) -> Self {
        let vertices = polygon.vertices();
        let edges = |origin: Vector2<f64>| {
            let next = vertices.iter().cycle().skip(1);
            vertices.iter().zip(next).map(move |(a, b)| (a - origin, b - origin))
        };
        // From a vertex rather than from the origin of the scene, which may be far away.
        let (mut area, mut first) = (0.0, Vector2::zeros());
        for (a, b) in edges(vertices[0]) {
            let twice = a.perp(&b);
            area += 0.5 * twice;
            first += (a + b) * (twice / 6.0);
        }
        let centroid = vertices[0] + first / area;
        let (mut second, mut distance) = (0.0, 0.0);
        for (a, b) in edges(centroid) {
            let twice = a.perp(&b);
            second += twice * (a.norm_squared() + a.dot(&b) + b.norm_squared()) / 12.0;
            let along = (b - a).normalize();
            let height = twice / (b - a).norm();
            let primitive = |place: f64| {
                let t = place / height;
                t * t.hypot(1.0) + t.asinh()
            };
            distance += height.powi(3) / 6.0 * (primitive(b.dot(&along)) - primitive(a.dot(&along)));
        }
        Self { area, centroid, squared_gyration: second / area, mean_distance: distance / area }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn regular(corners: u32, radius: f64, centre: Vector2<f64>) -> ConvexPolygon {
        let corner = |k: u32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(corners)).sin_cos();
            centre + Vector2::new(cos, sin) * radius
        };
        ConvexPolygon::new((0..corners).map(corner).collect())
    }

    #[test]
    fn a_square_and_a_disc_have_the_integrals_of_the_textbook() {
        let centre = Vector2::new(3.0, -2.0);
        let square = Plate::of(&regular(4, 0.5_f64.sqrt(), centre));
        assert!((square.area - 1.0).abs() < 1e-14 && (square.centroid - centre).norm() < 1e-14);
        assert!((square.squared_gyration - 1.0 / 6.0).abs() < 1e-14);
        assert!((square.mean_distance - (2.0_f64.sqrt() + 1.0_f64.asinh()) / 6.0).abs() < 1e-14);
        let disc = Plate::of(&regular(4000, 0.3, centre));
        assert!((disc.mean_distance - 0.2).abs() < 1e-6 && (disc.squared_gyration - 0.045).abs() < 1e-6);
    }

    /// Against a sum over small cells.
    #[test]
    fn a_triangle_has_the_integrals_of_a_quadrature() {
        let [a, b, c] = [[0.1, 0.2], [0.9, 0.1], [0.3, 0.6]].map(Vector2::from);
        let plate = Plate::of(&ConvexPolygon::new(vec![a, b, c]));
        assert!((plate.centroid - (a + b + c) / 3.0).norm() < 1e-15);
        let cells = 400;
        let (mut count, mut squares, mut distances) = (0.0, 0.0, 0.0);
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(cells));
            if u + v < 1.0 {
                let from = a + (b - a) * u + (c - a) * v - plate.centroid;
                (count, squares, distances) = (count + 1.0, squares + from.norm_squared(), distances + from.norm());
            }
        }
        assert!((plate.squared_gyration - squares / count).abs() < 5e-3 * squares / count);
        assert!((plate.mean_distance - distances / count).abs() < 5e-3 * distances / count);
    }
}
