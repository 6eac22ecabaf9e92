//! Distances of links from obstacles of finite height against brute force, and their normals against finite differences.

use std::f64::consts::TAU;

use nalgebra::{Vector2, Vector3};
use snake_core::obstacles::{ConvexPolygon, Outline, Peg, Solid, SolidLine};
use snake_test_support::planar::Random;

/// An outline with what it borrows.
enum Shape {
    Circle(Peg),
    Polygon(ConvexPolygon),
}

impl Shape {
    fn solid(&self, height: f64) -> Solid<'_> {
        let outline = match self {
            Shape::Circle(peg) => Outline::Circle(peg),
            Shape::Polygon(polygon) => Outline::Polygon(polygon),
        };
        Solid { outline, height }
    }

    /// Distance of a point from the outline, zero inside.
    fn beside(&self, point: &Vector2<f64>) -> f64 {
        match self {
            Shape::Circle(peg) => ((point - Vector2::new(peg.x, peg.y)).norm() - peg.radius).max(0.0),
            Shape::Polygon(polygon) => polygon.signed_distance(point).0.max(0.0),
        }
    }

    /// Distance of a point from the body, zero inside.
    fn distance(&self, height: f64, point: &Vector3<f64>) -> f64 {
        self.beside(&point.xy()).hypot((point.z - height).max(0.0))
    }

    /// Least distance of a line: that of a point to a convex body is a convex function along it.
    fn least_distance(&self, height: f64, line: &SolidLine) -> f64 {
        let at = |feature: f64| self.distance(height, &line.point(feature));
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..200 {
            let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if at(a) < at(b) { high = b } else { low = a }
        }
        at(0.5 * (low + high)).min(at(-1.0)).min(at(1.0))
    }
}

fn random_shape(random: &mut Random) -> Shape {
    let corners = random.below(7);
    if corners < 2 {
        return Shape::Circle(Peg { radius: random.between(0.02, 0.2), x: 0.0, y: 0.0 });
    }
    let first = random.angle();
    let at = |k: usize| first + TAU * k as f64 / corners as f64;
    Shape::Polygon(ConvexPolygon::new((0..corners).map(|k| Vector2::new(at(k).cos(), at(k).sin()) * 0.15).collect()))
}

/// Every third one lies flat.
fn random_line(random: &mut Random, count: usize) -> SolidLine {
    let (angle, rise) = (random.angle(), if count.is_multiple_of(3) { 0.0 } else { random.between(-1.5, 1.5) });
    let axis = Vector3::new(angle.cos() * rise.cos(), angle.sin() * rise.cos(), rise.sin());
    SolidLine {
        middle: Vector3::from_fn(|axis, _| if axis < 2 { random.between(-0.3, 0.3) } else { random.between(0.0, 0.3) }),
        half: axis * random.between(0.02, 0.2),
    }
}

const HEIGHT: f64 = 0.1;

#[test]
fn the_least_place_is_the_distance_of_the_pair() {
    let mut random = Random::new(1);
    let mut apart = 0;
    for count in 0..4000 {
        let (shape, line) = (random_shape(&mut random), random_line(&mut random, count));
        let (distance, brute) = (shape.solid(HEIGHT).distance(&line), shape.least_distance(HEIGHT, &line));
        if brute > 1e-6 {
            apart += 1;
            assert!((distance - brute).abs() < 1e-7, "{distance} instead of {brute}: {line:?}");
        } else {
            assert!(distance < 1e-6, "{distance} of a line that has entered: {line:?}");
        }
    }
    assert!((1500..3900).contains(&apart), "{apart}");
}

/// No place is nearer than the pair is, and each is the distance of points of the line and the body.
#[test]
fn no_place_is_nearer_than_the_pair() {
    let mut random = Random::new(2);
    for count in 0..4000 {
        let (shape, line) = (random_shape(&mut random), random_line(&mut random, count));
        let brute = shape.least_distance(HEIGHT, &line);
        if brute > 1e-6 {
            shape.solid(HEIGHT).visit_contacts(&line, |feature, at| {
                assert!(at.is_redundant || at.distance > brute - 1e-7, "feature {feature}: {} {brute}", at.distance);
                if !at.is_redundant {
                    let nearest = line.point(at.along) - at.normal * at.distance;
                    assert!(
                        shape.distance(HEIGHT, &nearest) < 1e-7,
                        "feature {feature}: {nearest:?} is not of the body"
                    );
                }
            });
        }
    }
}

#[test]
fn the_normal_is_the_gradient_of_the_distance() {
    let mut random = Random::new(3);
    let mut compared = 0;
    for count in 0..2000 {
        let (shape, line) = (random_shape(&mut random), random_line(&mut random, count));
        let (solid, h) = (shape.solid(HEIGHT), 1e-6);
        if shape.least_distance(HEIGHT, &line) < 1e-3 {
            continue;
        }
        let distance = |shift: Vector3<f64>, turn: Vector3<f64>, feature: usize| {
            let turned = SolidLine { middle: line.middle + shift, half: line.half + turn.cross(&line.half) };
            solid.contact_at(&turned, feature)
        };
        for feature in 0..solid.features() {
            let here = solid.contact_at(&line, feature);
            for axis in 0..6 {
                let unit = Vector3::ith(axis % 3, h);
                let (shift, turn) = if axis < 3 { (unit, Vector3::zeros()) } else { (Vector3::zeros(), unit) };
                let [back, ahead] = [-1.0, 1.0].map(|sign| distance(shift * sign, turn * sign, feature));
                let moved = shift + turn.cross(&(line.half * here.along));
                // Where a part stops or begins to be nearest there is no derivative.
                if !(here.is_redundant || back.is_redundant || ahead.is_redundant) {
                    let slope = (ahead.distance - back.distance) / 2.0;
                    let expected = here.normal.dot(&moved);
                    assert!((slope - expected).abs() < 1e-4 * h, "feature {feature}, axis {axis}: {slope} {expected}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 10_000, "{compared}");
}

/// From above a top face over its edge and down beside it, the normal of the nearest place turns by as little as the
/// link moves.
#[test]
fn normals_turn_continuously_over_an_edge() {
    let peg = Shape::Circle(Peg { radius: 0.15, x: 0.0, y: 0.0 });
    let corners = [[-0.15, -0.15], [0.15, -0.15], [0.15, 0.15], [-0.15, 0.15]].map(Vector2::from);
    let box_ = Shape::Polygon(ConvexPolygon::new(corners.to_vec()));
    for shape in [peg, box_] {
        for half in [Vector3::zeros(), Vector3::new(0.05, 0.02, 0.01), Vector3::new(0.0, 0.05, 0.0)] {
            let solid = shape.solid(HEIGHT);
            let at = |t: f64| {
                let middle = Vector3::new(0.12, 0.03, 0.0) + Vector3::new(t.sin(), 0.0, t.cos()) * 0.12;
                let line = SolidLine { middle: middle + Vector3::z() * (HEIGHT - 0.05), half };
                let mut nearest = (f64::INFINITY, Vector3::zeros());
                solid.visit_contacts(&line, |feature, at| {
                    let is_carried = feature < 2 && solid.carries(&line.point(at.along));
                    if (!at.is_redundant || is_carried) && at.distance < nearest.0 {
                        nearest = (at.distance, at.normal);
                    }
                });
                nearest.1
            };
            let steps = 4000;
            let normals: Vec<_> = (0..=steps).map(|k| at(1.5 * f64::from(k) / f64::from(steps))).collect();
            let turn = normals.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
            assert!(turn < 0.02, "turns by {turn} in a step of {} m", 0.12 * 1.5 / f64::from(steps));
            assert!((normals[0] - Vector3::z()).norm() < 1e-9 && normals[steps as usize].z < 0.3, "{normals:?}");
        }
    }
}
