//! Distances of centre lines from uneven ground, convex bodies and cylinders against points strewn over their surfaces.

use nalgebra::Vector3;
use snake_core::environment::rng::Rng;
use snake_core::obstacles::{Body, GroundFriction, Heights, Shape, SolidLine};

type Point = Vector3<f64>;

/// Points of a triangle, at most `SPACING` apart for those of this file.
fn strew(corners: [Point; 3], points: &mut Vec<Point>) {
    for i in 0..=DIVISIONS {
        for j in 0..=DIVISIONS - i {
            let [a, b] = [i, j].map(|k| k as f64 / DIVISIONS as f64);
            points.push(corners[0] * (1.0 - a - b) + corners[1] * a + corners[2] * b);
        }
    }
}

const DIVISIONS: usize = 24;

fn field(rng: &mut Rng) -> (Body, Vec<Point>) {
    let heights: Vec<Vec<f64>> =
        (0..6).map(|_| (0..6).map(|_| if rng.chance(0.3) { 0.1 } else { rng.uniform(0.01, 0.3) }).collect()).collect();
    let at = |i: usize, j: usize| Point::new(0.2 * i as f64 - 0.5, 0.2 * j as f64 - 0.5, heights[i][j]);
    let mut points = Vec::new();
    for i in 0..5 {
        for j in 0..5 {
            strew([at(i, j), at(i + 1, j), at(i + 1, j + 1)], &mut points);
            strew([at(i, j), at(i + 1, j + 1), at(i, j + 1)], &mut points);
        }
    }
    let mut wall = |from: Point, to: Point| {
        for k in 0..6 {
            let down = |point: Point, k: i32| Point::new(point.x, point.y, point.z - 0.2 * f64::from(k));
            strew([down(from, k), down(to, k), down(to, k + 1)], &mut points);
            strew([down(from, k), down(to, k + 1), down(from, k + 1)], &mut points);
        }
    };
    for k in 0..5 {
        wall(at(k, 0), at(k + 1, 0));
        wall(at(k, 5), at(k + 1, 5));
        wall(at(0, k), at(0, k + 1));
        wall(at(5, k), at(5, k + 1));
    }
    let friction = GroundFriction::Coefficient(0.3);
    let shape = Shape::HeightField(Heights { height: heights, spacing: 0.2, origin: [-0.5, -0.5], friction }.into());
    (shape.body().unwrap().unwrap(), points)
}

/// A hexahedron: a sheared box, of which every side has two triangles.
fn wedge(rng: &mut Rng) -> (Body, Vec<Point>) {
    let [along, across, up] = [0, 1, 2].map(|axis| {
        let mut edge = Point::new(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2));
        edge[axis] += 0.5;
        edge
    });
    let corner = |k: usize| {
        let part = |bit: usize, edge: Point| edge * if k & bit == 0 { -0.5 } else { 0.5 };
        part(1, along) + part(2, across) + part(4, up)
    };
    let mut points = Vec::new();
    for side in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
        let [a, b, c, d] = side.map(corner);
        strew([a, b, c], &mut points);
        strew([a, c, d], &mut points);
    }
    // A point inside, and one on a face, are no corners.
    let mut vertices: Vec<[f64; 3]> = (0..8).map(|k| corner(k).into()).collect();
    vertices.extend([[0.0; 3], (0.5 * (corner(0) + corner(3))).into()]);
    (Shape::Polyhedron { vertices }.body().unwrap().unwrap(), points)
}

fn cylinder(rng: &mut Rng, inside: bool) -> (Body, Vec<Point>) {
    let axis = Point::new(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalize();
    let side = axis.cross(&Point::x()).normalize();
    let (half, radius) = (rng.uniform(0.2, 0.5), rng.uniform(0.15, 0.3));
    let mut points = Vec::new();
    for k in 0..200 {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 200.0).sin_cos();
        let out = side * cos + axis.cross(&side) * sin;
        points.extend((-50..=50).map(|j| axis * (half * f64::from(j) / 50.0) + out * radius));
        if !inside {
            let discs =
                (0..20).flat_map(|j| [-half, half].map(|end| axis * end + out * (radius * f64::from(j) / 20.0)));
            points.extend(discs);
        }
    }
    let shape = Shape::Cylinder { start: (-axis * half).into(), end: (axis * half).into(), radius, inside };
    (shape.body().unwrap().unwrap(), points)
}

fn random_line(rng: &mut Rng) -> SolidLine {
    let mut vector =
        |reach: f64| Point::new(rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(-reach, reach));
    SolidLine { middle: vector(0.6), half: vector(0.15) }
}

/// The smallest distance of points of the line from strewn points: never less than the true one.
fn strewn_distance(line: &SolidLine, points: &[Point]) -> f64 {
    let along = (-20..=20).map(|k| line.point(f64::from(k) / 20.0));
    along
        .map(|on| points.iter().map(|point| (point - on).norm()).fold(f64::INFINITY, f64::min))
        .fold(f64::INFINITY, f64::min)
}

fn check(seed: u64, body: fn(&mut Rng) -> (Body, Vec<Point>)) {
    let mut rng = Rng::new(seed, 0);
    let mut outside = 0;
    for _ in 0..6 {
        let (body, points) = body(&mut rng);
        for _ in 0..60 {
            let line = random_line(&mut rng);
            let distance = body.distance(&line, 10.0);
            if !(distance > 1e-3 && distance < 10.0) {
                continue;
            }
            outside += 1;
            let strewn = strewn_distance(&line, &points);
            assert!(distance <= strewn + 1e-9, "{distance} m is more than {strewn} m: {line:?}");
            let spacing = 0.02;
            assert!(distance * distance >= strewn * strewn - spacing * spacing, "{distance} m, {strewn} m: {line:?}");
            let mut nearest: Option<(usize, f64, Point, f64)> = None;
            body.visit_contacts(&line, 10.0, |feature, at| {
                if nearest.is_none_or(|(_, least, ..)| at.distance < least) {
                    nearest = Some((feature, at.distance, at.normal, at.along));
                }
            });
            let (feature, _, normal, _) = nearest.unwrap();
            assert!((normal.norm() - 1.0).abs() < 1e-9);
            let moved = SolidLine { middle: line.middle + normal * 1e-6, ..line };
            let gained = body.contact_at(&moved, 10.0, feature).distance - distance;
            assert!((gained - 1e-6).abs() < 1e-9, "the normal leads away: {gained} at feature {feature}");
        }
    }
    assert!(outside > 100, "{outside} lines outside");
}

#[test]
fn distances_from_uneven_ground() {
    check(1, field);
}

#[test]
fn distances_from_convex_bodies() {
    check(2, wedge);
}

#[test]
fn distances_from_poles_and_pipes() {
    check(3, |rng| cylinder(rng, false));
    check(4, |rng| cylinder(rng, true));
}

#[test]
fn smooth_ground_has_no_contacts_at_its_inner_edges() {
    let plane = |x: f64, y: f64| 0.2 * x - 0.1 * y;
    let row = |i: i32| (0..9).map(move |j| plane(0.25 * f64::from(i) - 1.0, 0.25 * f64::from(j) - 1.0)).collect();
    let height: Vec<Vec<f64>> = (0..9).map(row).collect();
    let friction = GroundFriction::OfGround;
    let heights = Heights { height, spacing: 0.25, origin: [-1.0, -1.0], friction };
    let body = Shape::HeightField(heights.into()).body().unwrap().unwrap();
    let normal = Point::new(-0.2, 0.1, 1.0).normalize();
    let mut rng = Rng::new(5, 0);
    for k in 0..500 {
        // On a line of the grid every other time.
        let x = if k % 2 == 0 { 0.25 } else { rng.uniform(-0.5, 0.5) };
        let foot = Point::new(x, rng.uniform(-0.5, 0.5), 0.0);
        let half = Point::new(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), 0.0);
        let on_plane = |point: Point| Point::new(point.x, point.y, plane(point.x, point.y)) + normal * 0.05;
        let [from, to] = [-1.0, 1.0].map(|along| on_plane(foot + half * along));
        let line = SolidLine { middle: 0.5 * (from + to), half: 0.5 * (to - from) };
        let mut count = 0;
        body.visit_contacts(&line, 0.1, |_, contact| {
            count += 1;
            assert!((contact.distance - 0.05).abs() < 1e-12 && (contact.normal - normal).norm() < 1e-9);
        });
        assert_eq!(count, 2, "one at either end: {line:?}");
    }
}
