//! Obstacles in files and from Python: a triple of numbers, or a mapping of fields.

use std::fmt;
use std::sync::Arc;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::config::{GROUND_FRICTION, ROLLING_FRICTION};
use super::{GroundFriction, Heights, Obstacle, Peg, Shape, Spring};

/// The fields of an obstacle in a mapping: which of them it takes depends on its shape.
#[derive(Serialize, Deserialize, Default)]
#[serde(rename = "Obstacle", deny_unknown_fields)]
struct ObstacleFields {
    shape: ShapeName,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    end: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    z: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "given")]
    angle: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    vertices: Option<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    spacing: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    origin: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    inside: Option<bool>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "given")]
    friction: Option<NumberOrGrid>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mass: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "given")]
    ground_friction: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "given")]
    rolling_friction: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stiffness: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "given")]
    damping: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    travel: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    height: Option<NumberOrGrid>,
}

/// What is one number for most obstacles, and a grid of them for a height field.
#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "a number or an array of rows of numbers")]
enum NumberOrGrid {
    Number(f64),
    Grid(Vec<Vec<f64>>),
}

/// Seen from above, or in space.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged, expecting = "2 or 3 coordinates")]
enum Point {
    Plane([f64; 2]),
    Space([f64; 3]),
}

impl Point {
    fn coordinates(&self) -> &[f64] {
        match self {
            Point::Plane(point) => point,
            Point::Space(point) => point,
        }
    }
}

/// None is no value, although it may be left out.
fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ShapeName {
    #[default]
    Circle,
    Segment,
    Box,
    Polygon,
    HeightField,
    Polyhedron,
    Cylinder,
    Sphere,
}

impl ShapeName {
    /// In messages, with its fields: those it needs, and those that may be left out.
    fn fields(self) -> (&'static str, &'static [&'static str], &'static [&'static str]) {
        match self {
            ShapeName::Circle => ("circle", &["radius", "x", "y"], &DISC),
            ShapeName::Segment => ("segment", &["start", "end"], &[]),
            ShapeName::Box => ("box", &["size", "x", "y"], &["angle", "ground_friction"]),
            ShapeName::Polygon => ("polygon", &["vertices"], &["ground_friction"]),
            ShapeName::HeightField => ("height_field", &["spacing"], &["origin"]),
            ShapeName::Polyhedron => ("polyhedron", &["vertices"], &[]),
            ShapeName::Cylinder => ("cylinder", &["start", "end", "radius"], &["inside"]),
            ShapeName::Sphere => ("sphere", &["radius", "x", "y"], &["z", "ground_friction", "rolling_friction"]),
        }
    }
}

/// What a disc that can be pushed may have.
const DISC: [&str; 4] = ["ground_friction", "stiffness", "damping", "travel"];

impl ObstacleFields {
    /// Field by name, and whether it has a value.
    fn given(&self) -> [(&'static str, bool); 17] {
        [
            ("radius", self.radius.is_some()),
            ("start", self.start.is_some()),
            ("end", self.end.is_some()),
            ("size", self.size.is_some()),
            ("x", self.x.is_some()),
            ("y", self.y.is_some()),
            ("z", self.z.is_some()),
            ("angle", self.angle.is_some()),
            ("vertices", self.vertices.is_some()),
            ("spacing", self.spacing.is_some()),
            ("origin", self.origin.is_some()),
            ("inside", self.inside.is_some()),
            ("ground_friction", self.ground_friction.is_some()),
            ("rolling_friction", self.rolling_friction.is_some()),
            ("stiffness", self.stiffness.is_some()),
            ("damping", self.damping.is_some()),
            ("travel", self.travel.is_some()),
        ]
    }

    /// The obstacle; the error is about fields that are missing or do not belong to the shape.
    fn obstacle(self) -> Result<Obstacle, String> {
        let (name, needed, optional) = self.shape.fields();
        let fits = |(field, has): (&str, bool)| needed.contains(&field) == has || (has && optional.contains(&field));
        let expected = || format!("a {name} with {}, its friction and height", [needed, optional].concat().join(", "));
        let is_complete = self.given().into_iter().all(fits);
        self.checked().filter(|_| is_complete).ok_or_else(expected)
    }

    /// None where a field is missing, or has another form than the shape takes.
    fn checked(self) -> Option<Obstacle> {
        let Self { radius, start, end, x, y, vertices, friction, mass, height, .. } = self;
        let shape = match self.shape {
            ShapeName::HeightField => {
                let Some(NumberOrGrid::Grid(height)) = height else { return None };
                let friction = match friction {
                    None => GroundFriction::OfGround,
                    Some(NumberOrGrid::Number(coefficient)) => GroundFriction::Coefficient(coefficient),
                    Some(NumberOrGrid::Grid(cells)) => GroundFriction::Cells(cells),
                };
                let (spacing, origin) = (self.spacing?, self.origin.unwrap_or_default());
                let heights = Heights { height, spacing, origin, friction };
                return Some(Obstacle { mass, ..Obstacle::endless(Shape::HeightField(Arc::new(heights))) });
            }
            ShapeName::Circle => Shape::Circle(Peg { radius: radius?, x: x?, y: y? }),
            ShapeName::Segment => Shape::Segment { start: array(&start?)?, end: array(&end?)? },
            ShapeName::Box => Shape::Box { size: self.size?, x: x?, y: y?, angle: self.angle.unwrap_or(0.0) },
            ShapeName::Polygon => Shape::Polygon { vertices: arrays(&vertices?)? },
            ShapeName::Polyhedron => Shape::Polyhedron { vertices: arrays(&vertices?)? },
            ShapeName::Cylinder => Shape::Cylinder {
                start: array(&start?)?,
                end: array(&end?)?,
                radius: radius?,
                inside: self.inside.unwrap_or(false),
            },
            ShapeName::Sphere => Shape::Sphere {
                radius: radius?,
                centre: [x?, y?, self.z.or(radius)?],
                rolling_friction: self.rolling_friction.unwrap_or(ROLLING_FRICTION),
            },
        };
        let number = |value: Option<NumberOrGrid>| match value {
            None => Some(None),
            Some(NumberOrGrid::Number(number)) => Some(Some(number)),
            Some(NumberOrGrid::Grid(_)) => None,
        };
        let (friction, height) = (number(friction)?.unwrap_or(0.0), number(height)?);
        let is_vertical = !matches!(shape, Shape::Polyhedron { .. } | Shape::Cylinder { .. });
        let spring = match self.stiffness {
            Some(stiffness) => Some(Spring { stiffness, damping: self.damping.unwrap_or(0.0), travel: self.travel }),
            None if self.damping.is_none() && self.travel.is_none() => None,
            None => return None,
        };
        let ground_friction = self.ground_friction.unwrap_or(if spring.is_some() { 0.0 } else { GROUND_FRICTION });
        (is_vertical || height.is_none()).then_some(Obstacle { shape, friction, mass, ground_friction, spring, height })
    }
}

/// A point of as many coordinates as the shape has dimensions.
fn array<const N: usize>(point: &Point) -> Option<[f64; N]> {
    point.coordinates().try_into().ok()
}

fn arrays<const N: usize>(points: &[Point]) -> Option<Vec<[f64; N]>> {
    points.iter().map(array).collect()
}

impl From<&Obstacle> for ObstacleFields {
    fn from(obstacle: &Obstacle) -> Self {
        let Obstacle { friction, mass, height, spring, .. } = *obstacle;
        let number = |value: f64| Some(NumberOrGrid::Number(value));
        let (friction, height) = (number(friction), height.and_then(number));
        let ground_friction = mass.map(|_| obstacle.ground_friction);
        let common = Self { friction, mass, ground_friction, height, ..Self::default() };
        match obstacle.shape.clone() {
            Shape::Circle(Peg { radius, x, y }) => {
                let [radius, x, y] = [radius, x, y].map(Some);
                let (stiffness, damping) = (spring.map(|one| one.stiffness), spring.map(|one| one.damping));
                let travel = spring.and_then(|one| one.travel);
                Self { shape: ShapeName::Circle, radius, x, y, stiffness, damping, travel, ..common }
            }
            Shape::Segment { start, end } => {
                let [start, end] = [start, end].map(|point| Some(Point::Plane(point)));
                Self { shape: ShapeName::Segment, start, end, ..common }
            }
            Shape::Box { size, x, y, angle } => {
                let (size, [x, y, angle]) = (Some(size), [x, y, angle].map(Some));
                Self { shape: ShapeName::Box, size, x, y, angle, ..common }
            }
            Shape::Polygon { vertices } => {
                let vertices = Some(vertices.into_iter().map(Point::Plane).collect());
                Self { shape: ShapeName::Polygon, vertices, ..common }
            }
            Shape::Polyhedron { vertices } => {
                let vertices = Some(vertices.into_iter().map(Point::Space).collect());
                Self { shape: ShapeName::Polyhedron, vertices, ..common }
            }
            Shape::Cylinder { start, end, radius, inside } => {
                let [start, end] = [start, end].map(|point| Some(Point::Space(point)));
                let (radius, inside) = (Some(radius), Some(inside));
                Self { shape: ShapeName::Cylinder, start, end, radius, inside, ..common }
            }
            Shape::Sphere { radius, centre: [x, y, z], rolling_friction } => {
                let [radius, x, y, z, rolling_friction] = [radius, x, y, z, rolling_friction].map(Some);
                Self { shape: ShapeName::Sphere, friction: None, radius, x, y, z, rolling_friction, ..common }
            }
            Shape::HeightField(heights) => {
                let Heights { height, spacing, origin, friction } = Heights::clone(&heights);
                let friction = match friction {
                    GroundFriction::OfGround => None,
                    GroundFriction::Coefficient(coefficient) => number(coefficient),
                    GroundFriction::Cells(cells) => Some(NumberOrGrid::Grid(cells)),
                };
                let (spacing, origin, height) = (Some(spacing), Some(origin), Some(NumberOrGrid::Grid(height)));
                Self { shape: ShapeName::HeightField, spacing, origin, friction, height, ..common }
            }
        }
    }
}

impl Serialize for Obstacle {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Obstacle { shape: Shape::Circle(peg), friction: 0.0, mass: None, height: None, .. } => {
                peg.serialize(serializer)
            }
            _ => ObstacleFields::from(self).serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Obstacle {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TripleOrFields;

        impl<'de> Visitor<'de> for TripleOrFields {
            type Value = Obstacle;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("(radius, x, y), or an obstacle of snake_env.obstacles")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Obstacle, A::Error> {
                let mut circle = [0.0; 3];
                for (i, number) in circle.iter_mut().enumerate() {
                    *number = items.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
                }
                match items.next_element::<f64>()? {
                    None => Ok(circle.into()),
                    Some(_) => Err(A::Error::invalid_length(4, &self)),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, fields: A) -> Result<Obstacle, A::Error> {
                let fields = ObstacleFields::deserialize(MapAccessDeserializer::new(fields))?;
                fields.obstacle().map_err(A::Error::custom)
            }
        }

        deserializer.deserialize_any(TripleOrFields)
    }
}
