//! Where a convex polygon that can be pushed is nearest to a link, a disc, or another polygon.
//!
//! A link, a disc or a peg is a centre line with a radius, and the pair that of [`ConvexPolygon::separation`], seen from the
//! polygon. Two polygons that do not cross are nearest to each other at a vertex of one of them, or, with parallel edges, at
//! two: the pair is described by the distances of all vertices of either to the other. Each is a convex function of the
//! relative translation of both, so that its tangent plane never overestimates it.

use std::ops::Range;

use nalgebra::{Vector2, Vector3};

use crate::obstacles::{CentreLine, ConvexPolygon, NearestPoint, ObstacleGrid, Peg};

use super::LinkContact;
use super::link_pair::{LinkPairContact, PlacedLink};

/// A polygon at a place.
#[derive(Debug, Clone, Copy)]
struct PlacedOutline<'a> {
    polygon: &'a ConvexPolygon,
    centre: Vector2<f64>,
    axis: Vector2<f64>,
}

/// Nearest points of two bodies at one of the features that describe the pair.
#[derive(Debug, Clone, Copy)]
struct Touch {
    /// Of centre lines and polygons, negative where they overlap \[m\].
    distance: f64,
    /// Unit vector from the second body to the first.
    normal: Vector2<f64>,
    /// Of the first, or of its centre line.
    point: Vector2<f64>,
    is_redundant: bool,
}

impl<'a> PlacedOutline<'a> {
    fn of(placed: &PlacedLink<'a>) -> Option<Self> {
        Some(Self { polygon: placed.link.outline?, centre: placed.pose.xy(), axis: placed.axis })
    }

    fn fixed(polygon: &'a ConvexPolygon) -> Self {
        Self { polygon, centre: Vector2::zeros(), axis: Vector2::x() }
    }

    fn vertices(&self) -> usize {
        self.polygon.vertices().len()
    }

    fn vertex(&self, vertex: usize) -> Vector2<f64> {
        self.centre + self.turned(&self.polygon.vertices()[vertex])
    }

    /// A vector of the polygon's frame in that of the world.
    fn turned(&self, v: &Vector2<f64>) -> Vector2<f64> {
        let (cos, sin) = (self.axis.x, self.axis.y);
        Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
    }

    fn turned_back(&self, v: &Vector2<f64>) -> Vector2<f64> {
        let (cos, sin) = (self.axis.x, self.axis.y);
        Vector2::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x)
    }

    /// The point of the outline nearest to a point of another polygon, with its normal in the world's frame.
    fn nearest_point(&self, other: &PlacedOutline, point: &Vector2<f64>) -> NearestPoint {
        let seen = |at: Vector2<f64>| self.turned_back(&(at - self.centre));
        let vertices = (0..other.vertices()).map(|vertex| seen(other.vertex(vertex)));
        let nearest = self.polygon.nearest_point_of(&seen(other.centre), vertices, &seen(*point));
        NearestPoint { normal: self.turned(&nearest.normal), ..nearest }
    }
}

/// A centre line at one of the features of a polygon; one without length has one end.
fn touch_line(line: &CentreLine, second: &PlacedOutline, feature: usize) -> Touch {
    let half = second.turned_back(&line.half);
    let seen = CentreLine { middle: second.turned_back(&(line.middle - second.centre)), half };
    let at = second.polygon.separation(&seen, feature);
    let is_redundant = at.is_redundant || (feature > 0 && half == Vector2::zeros());
    Touch { distance: at.distance, normal: second.turned(&at.normal), point: line.point(at.along), is_redundant }
}

/// Two polygons at a vertex: those of the first, then those of the second.
fn touch_polygon(first: &PlacedOutline, second: &PlacedOutline, feature: usize) -> Touch {
    let Some(vertex) = feature.checked_sub(first.vertices()) else {
        let point = first.vertex(feature);
        let NearestPoint { distance, normal, .. } = second.nearest_point(first, &point);
        return Touch { distance, normal, point, is_redundant: false };
    };
    let of_second = second.vertex(vertex);
    let NearestPoint { distance, normal, is_corner } = first.nearest_point(second, &of_second);
    // A vertex nearest to a vertex of the first is that one's contact.
    Touch { distance, normal: -normal, point: of_second - normal * distance, is_redundant: is_corner }
}

/// The features that describe a pair with a polygon.
pub fn features_of_pair([first, second]: [Option<&ConvexPolygon>; 2]) -> Option<Range<usize>> {
    let features = match (first, second) {
        (None, None) => return None,
        (Some(one), Some(other)) => one.vertices().len() + other.vertices().len(),
        (None, Some(one)) | (Some(one), None) => one.features(),
    };
    Some(0..features)
}

/// The contact of two nodes of which at least one is a polygon; `None` of two that are not. Infinitely far at a feature that
/// another one covers.
pub fn outline_pair_contact(links: [&PlacedLink; 2], feature: usize) -> Option<LinkPairContact> {
    let [first, second] = links;
    let touch = match links.map(PlacedOutline::of) {
        [None, None] => return None,
        [None, Some(outline)] => touch_line(&first.centre_line(), &outline, feature),
        [Some(_), None] => {
            let LinkPairContact { gap, normal, along: [b, a], direction: [v, w] } =
                outline_pair_contact([second, first], feature)?;
            return Some(LinkPairContact { gap, normal: -normal, along: [a, b], direction: [w, v] });
        }
        [Some(one), Some(other)] => touch_polygon(&one, &other, feature),
    };
    let radius = if first.link.outline.is_none() { first.link.radius } else { 0.0 };
    let arms = links.map(|link| touch.point - link.pose.xy());
    let row = |arm: &Vector2<f64>| Vector3::new(touch.normal.x, touch.normal.y, arm.perp(&touch.normal));
    Some(LinkPairContact {
        gap: if touch.is_redundant { f64::INFINITY } else { touch.distance - radius },
        normal: touch.normal,
        along: [arms[0].dot(&first.axis), arms[1].dot(&second.axis)],
        direction: [row(&arms[0]), -row(&arms[1])],
    })
}

/// Number of features that describe a polygon that can be pushed, and a fixed obstacle.
pub fn features_of_outline(outline: &ConvexPolygon, obstacles: &ObstacleGrid, obstacle: usize) -> usize {
    if obstacle < obstacles.pegs().len() {
        1
    } else {
        outline.vertices().len() + obstacles.polygon(obstacle).vertices().len()
    }
}

/// The contact of a polygon that can be pushed with a fixed obstacle at one of these features.
pub fn outline_obstacle_contact(
    placed: &PlacedLink,
    outline: &ConvexPolygon,
    obstacles: &ObstacleGrid,
    (obstacle, feature): (usize, usize),
) -> LinkContact {
    let own = PlacedOutline { polygon: outline, centre: placed.pose.xy(), axis: placed.axis };
    let (touch, radius) = match obstacles.pegs().get(obstacle) {
        Some(Peg { radius, x, y }) => {
            let peg = CentreLine { middle: Vector2::new(*x, *y), half: Vector2::zeros() };
            let Touch { distance, normal, point, .. } = touch_line(&peg, &own, 0);
            let point = point - normal * distance;
            (Touch { distance, normal: -normal, point, is_redundant: false }, *radius)
        }
        None => (touch_polygon(&own, &PlacedOutline::fixed(obstacles.polygon(obstacle)), feature), 0.0),
    };
    let arm = touch.point - own.centre;
    LinkContact {
        gap: touch.distance - radius,
        direction: Vector3::new(touch.normal.x, touch.normal.y, arm.perp(&touch.normal)),
        lever: arm.dot(&touch.normal),
        is_redundant: touch.is_redundant,
    }
}
