//! Distances of links from walls and polygons against brute force, and their directions against finite differences.

use nalgebra::{Vector2, Vector3};
use snake_core::contact::{PlacedLink, link_obstacle_contact, wall_gap};
use snake_core::obstacles::{CentreLine, ConvexPolygon, Obstacle, ObstacleGrid, Shape, WallGrid};
use snake_core::planar::Pose;
use snake_test_support::planar::Random;
use snake_test_support::spatial_random::random_link;

/// A wall, or corners on a circle in order: convex whatever they are.
fn random_polygon(random: &mut Random) -> ConvexPolygon {
    let corners = 2 + random.below(5);
    let first = random.angle();
    let at = |k: usize| first + std::f64::consts::TAU * (k as f64 + 0.8 * random_fraction(k)) / corners as f64;
    ConvexPolygon::new((0..corners).map(|k| Vector2::new(at(k).cos(), at(k).sin()) * 0.15).collect())
}

fn random_fraction(k: usize) -> f64 {
    ((k + 1) as f64 * 0.618_033_988_75).fract()
}

fn random_line(random: &mut Random) -> CentreLine {
    let angle = random.angle();
    CentreLine {
        middle: Vector2::new(random.between(-0.4, 0.4), random.between(-0.4, 0.4)),
        half: Vector2::new(angle.cos(), angle.sin()) * random.between(0.0, 0.2),
    }
}

/// Least distance over a grid of points of the line and of the outline; zero or less where the line meets the inside.
fn distance_on_a_grid(polygon: &ConvexPolygon, line: &CentreLine) -> f64 {
    let vertices = polygon.vertices();
    let on_line = || (-200..=200).map(|k| line.point(f64::from(k) / 200.0));
    let outline = (0..vertices.len()).flat_map(|i| {
        let (start, end) = (vertices[i], vertices[(i + 1) % vertices.len()]);
        (0..=200).map(move |k| start + (end - start) * (f64::from(k) / 200.0))
    });
    outline.flat_map(|a| on_line().map(move |b| (a - b).norm())).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_least_place_is_the_distance_of_a_centre_line_that_does_not_cross() {
    let mut random = Random::new(1);
    let mut apart = 0;
    for _ in 0..600 {
        let (polygon, line) = (random_polygon(&mut random), random_line(&mut random));
        let distance = polygon.distance(&line);
        if distance > 0.0 {
            apart += 1;
            let brute = distance_on_a_grid(&polygon, &line);
            assert!(
                (distance - brute).abs() < 2e-3 && distance < brute + 1e-12,
                "{distance} {brute} {polygon:?} {line:?}"
            );
        }
    }
    assert!(apart > 200);
}

/// Moved by its depth along the normal of the deepest place, a crossing line just leaves the polygon; by less it does not,
/// in whatever direction.
#[test]
fn the_depth_of_a_crossing_line_is_its_shortest_way_out() {
    let mut random = Random::new(2);
    let mut crossing = 0;
    for _ in 0..3000 {
        let (polygon, line) = (random_polygon(&mut random), random_line(&mut random));
        let depth = -polygon.distance(&line);
        if depth <= 1e-6 {
            continue;
        }
        crossing += 1;
        let places = (0..polygon.features()).map(|place| polygon.separation(&line, place));
        let deepest = places.filter(|at| !at.is_redundant).min_by(|a, b| a.distance.total_cmp(&b.distance)).unwrap();
        let moved = |by: Vector2<f64>| polygon.distance(&CentreLine { middle: line.middle + by, ..line });
        assert!(moved(deepest.normal * (depth + 1e-9)) >= -1e-12, "{polygon:?} {line:?}");
        for k in 0..90 {
            let angle = f64::from(k) * std::f64::consts::TAU / 90.0;
            let by = Vector2::new(angle.cos(), angle.sin()) * (0.98 * depth);
            assert!(moved(by) < 1e-12, "{polygon:?} {line:?}: out after {} of {depth}", 0.98 * depth);
        }
    }
    assert!(crossing > 100);
}

/// Convex functions of the translation: the tangent plane never lies above them.
#[test]
fn tangent_planes_never_overestimate_the_distance_of_a_translated_line() {
    let mut random = Random::new(3);
    for _ in 0..2000 {
        let (polygon, line) = (random_polygon(&mut random), random_line(&mut random));
        let by = Vector2::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3));
        let moved = CentreLine { middle: line.middle + by, ..line };
        if polygon.distance(&line) < 0.0 || polygon.distance(&moved) < 0.0 {
            continue;
        }
        for place in 0..polygon.features() {
            let (from, to) = (polygon.separation(&line, place), polygon.separation(&moved, place));
            assert!(from.distance + from.normal.dot(&by) <= to.distance + 1e-12, "{polygon:?} {line:?} {place}");
        }
    }
}

#[test]
fn directions_are_the_gradients_of_the_gaps() {
    let mut random = Random::new(4);
    let mut checked = 0;
    for _ in 0..500 {
        let link = random_link(&mut random);
        let vertices = random_polygon(&mut random).vertices().iter().map(|v| [v.x, v.y]).collect::<Vec<_>>();
        let shape = match vertices[..] {
            [start, end] => Shape::Segment { start, end },
            _ => Shape::Polygon { vertices },
        };
        let scene = ObstacleGrid::of(&[Obstacle::endless(shape)]);
        let pose = Pose::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), random.angle());
        let at = |pose: &Pose, place| link_obstacle_contact(&PlacedLink::new(&link, *pose), &scene, (0, place));
        if wall_gap(&pose, &link, &scene) < -link.radius + 1e-3 {
            continue;
        }
        for place in 0..scene.walls().walls()[0].polygon.features() {
            let here = at(&pose, place);
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-6);
                let (ahead, behind) = (at(&(pose + step), place), at(&(pose - step), place));
                if [here, ahead, behind].iter().any(|contact| contact.is_redundant) {
                    continue;
                }
                let slope = (ahead.gap - behind.gap) / 2e-6;
                assert!((slope - here.direction[axis]).abs() < 1e-3, "{slope} {here:?}");
                checked += 1;
            }
        }
    }
    assert!(checked > 1000);
}

#[test]
fn the_grid_finds_each_near_wall_once() {
    let mut random = Random::new(5);
    for count in [1, 3, 60] {
        let polygons: Vec<ConvexPolygon> = (0..count)
            .map(|_| {
                let start = Vector2::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0));
                let length = if random.below(3) == 0 { 4.0 } else { 0.2 };
                let angle = random.angle();
                ConvexPolygon::new(vec![start, start + Vector2::new(angle.cos(), angle.sin()) * length])
            })
            .collect();
        let grid = WallGrid::new(polygons.iter().cloned());
        for _ in 0..300 {
            let point = Vector2::new(random.between(-5.0, 5.0), random.between(-5.0, 5.0));
            let distance = random.between(0.0, 1.5);
            let mut found: Vec<_> = grid.near(point, distance).collect();
            found.sort_unstable();
            assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "a wall is visited once");
            let at_point = CentreLine { middle: point, half: Vector2::zeros() };
            for (index, polygon) in polygons.iter().enumerate() {
                if polygon.distance(&at_point) <= distance {
                    assert!(found.contains(&index));
                }
            }
        }
    }
}
