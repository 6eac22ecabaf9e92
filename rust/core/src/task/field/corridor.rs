//! A corridor whose walls are rows of pegs, straight at first, then bent along an arc.
//!
//! Pegs stand in pairs, one in each wall, where the body of the gait crosses the centre line: there both
//! push it forward (T 5.5). Between the pegs of a wall the body does not fit.

use nalgebra::Vector2;

use crate::scene::Peg;

use super::{Route, Site};
use crate::task::random::Stream;

/// Gap between body and pegs at a crossing, at difficulty zero and one \[m\].
const SLACK: [f64; 2] = [0.006, 0.03];

/// Share of the body's width that is open between neighbouring pegs of a wall.
const OPENING: f64 = 0.9;

/// Jitter of a peg along the corridor at difficulty one, as a share of the distance between pegs.
const JITTER: f64 = 0.1;

/// Builds the walls; returns the goal, on the centre line `route.length` from the start.
pub fn corridor(difficulty: f64, route: &Route, site: &Site, stream: &mut Stream, pegs: &mut Vec<Peg>) -> Vector2<f64> {
    let turn = difficulty * stream.around_zero(route.turn);
    let centre_line = CentreLine::new(route, site, turn);
    let pitch = site.path.half_wave();
    let slack = SLACK[0] + difficulty * (SLACK[1] - SLACK[0]);
    let first_crossing = site.head[0] + site.path.displacement(0.0, site.path.crossing()).x - route.start.x;
    let first = ((site.x[0] - route.start.x - first_crossing) / pitch).ceil() as i32;
    let last = ((site.x[1] - route.start.x - first_crossing) / pitch).floor() as i32;
    pegs.clear();
    for station in first..=last {
        for side in [-1.0, 1.0] {
            let jitter = stream.around_zero(difficulty * JITTER);
            let along = first_crossing + (f64::from(station) + jitter) * pitch;
            let wall = centre_line.wall(along, side, pitch, slack * site.scale(), site);
            let centre = centre_line.at(along) + side * wall.offset * centre_line.left(along);
            pegs.push(Peg { radius: wall.radius, x: centre.x, y: centre.y });
        }
    }
    centre_line.at(route.length)
}

/// A straight line along +x, an arc, and a straight line again, by the distance from the start.
struct CentreLine {
    start: Vector2<f64>,
    /// Where the arc begins and ends \[m\].
    arc: [f64; 2],
    /// Positive to the left \[1/m\].
    curvature: f64,
}

/// One wall where a peg stands: distance of its pegs from the centre line, and their radius \[m\].
struct Wall {
    offset: f64,
    radius: f64,
}

impl CentreLine {
    /// Bent by `turn` \[rad\] between the head at the start and the goal.
    fn new(route: &Route, site: &Site, turn: f64) -> Self {
        let begin = (site.head[0] - route.start.x).min(0.5 * route.length);
        Self { start: route.start, arc: [begin, route.length], curvature: turn / (route.length - begin) }
    }

    /// Direction \[rad\].
    fn angle(&self, along: f64) -> f64 {
        self.curvature * (along.clamp(self.arc[0], self.arc[1]) - self.arc[0])
    }

    fn left(&self, along: f64) -> Vector2<f64> {
        let (sin, cos) = self.angle(along).sin_cos();
        Vector2::new(-sin, cos)
    }

    fn at(&self, along: f64) -> Vector2<f64> {
        let on_arc = (along.clamp(self.arc[0], self.arc[1]) - self.arc[0]).max(0.0);
        // The chord of an arc points half way between the directions of its ends.
        let half = 0.5 * self.curvature * on_arc;
        let chord = if half == 0.0 { on_arc } else { on_arc * half.sin() / half };
        let (sin, cos) = half.sin_cos();
        let (end_sin, end_cos) = self.angle(along).sin_cos();
        let beyond = (along - self.arc[1]).max(0.0);
        self.start
            + Vector2::new(along.min(self.arc[0]), 0.0)
            + chord * Vector2::new(cos, sin)
            + beyond * Vector2::new(end_cos, end_sin)
    }

    /// The wall to the left (`side` = 1) or right (-1). A body that crosses the centre line at the gait's
    /// largest angle K clears both pegs of a pair by `slack`, and the opening to the next peg is [`OPENING`].
    ///
    /// With o the offset, r the radius, c the curvature and p the pitch: o cos K = r + body + slack, and
    /// 2 r + opening = p (1 - side c o).
    fn wall(&self, along: f64, side: f64, pitch: f64, slack: f64, site: &Site) -> Wall {
        let bent = (self.arc[0]..self.arc[1]).contains(&along);
        let curvature = if bent { side * self.curvature } else { 0.0 };
        let cos = site.path.direction(site.path.crossing()).cos();
        let opening = OPENING * 2.0 * site.body_radius;
        let offset =
            (0.5 * (pitch - opening) + site.body_radius + slack) / (cos + 0.5 * pitch * curvature);
        Wall { offset, radius: offset * cos - site.body_radius - slack }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::field::tests::{aiko_route, aiko_site};

    #[test]
    fn no_body_leaves_a_regular_corridor_between_two_pegs_of_a_wall() {
        let (site, route) = (aiko_site(), aiko_route());
        for turn in [-1.5, 0.0, 1.0] {
            let line = CentreLine::new(&route, &site, turn);
            for side in [-1.0, 1.0] {
                for along in [0.0, 1.0, 1.5] {
                    let wall = line.wall(along, side, 0.3673, 0.01, &site);
                    let pegs = [along, along + 0.3673].map(|s| line.at(s) + side * wall.offset * line.left(s));
                    let opening = (pegs[1] - pegs[0]).norm() - 2.0 * wall.radius;
                    // A chord is shorter than its arc, by 2 % at most here.
                    assert!(opening < 0.105 && opening > 0.08, "{opening} at {along}, turn {turn}");
                }
            }
        }
    }

    #[test]
    fn the_centre_line_has_the_length_and_direction_of_its_parts() {
        let (site, route) = (aiko_site(), aiko_route());
        let line = CentreLine::new(&route, &site, 1.2);
        let mut length = 0.0;
        let points: Vec<Vector2<f64>> = (0..=3000).map(|k| line.at(0.001 * f64::from(k))).collect();
        for pair in points.windows(2) {
            length += (pair[1] - pair[0]).norm();
        }
        assert!((length - 3.0).abs() < 1e-6);
        assert!((line.angle(2.0) - 1.2).abs() < 1e-15 && line.angle(3.0) == line.angle(2.0));
        let last = points[3000] - points[2999];
        assert!((last.y.atan2(last.x) - 1.2).abs() < 1e-9);
    }
}
