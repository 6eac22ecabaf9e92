//! Obstacles as users write them.

use std::fmt;

use nalgebra::{Rotation2, Vector2};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::{ConfigError, coordinate, length, non_negative, require};

use super::{ConvexPolygon, outline};

/// A circular obstacle; configured as the triple `[radius, x, y]` of the thesis's tables.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct Peg {
    /// Radius L_Hj \[m\].
    pub radius: f64,
    /// Centre H_j \[m\].
    pub x: f64,
    pub y: f64,
}

impl From<[f64; 3]> for Peg {
    fn from([radius, x, y]: [f64; 3]) -> Self {
        Self { radius, x, y }
    }
}

impl From<Peg> for [f64; 3] {
    fn from(peg: Peg) -> Self {
        [peg.radius, peg.x, peg.y]
    }
}

/// Outline of an obstacle, seen from above.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    Circle(Peg),
    /// A wall without thickness between two points \[m\].
    Segment {
        start: [f64; 2],
        end: [f64; 2],
    },
    /// A rectangle with its centre and the angle of its first side \[m\], \[rad\].
    Box {
        size: [f64; 2],
        x: f64,
        y: f64,
        angle: f64,
    },
    /// A convex polygon; its vertices in either order \[m\].
    Polygon {
        vertices: Vec<[f64; 2]>,
    },
}

/// An obstacle; a circle without friction is configured as the triple of its [`Peg`].
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    pub shape: Shape,
    /// Coulomb coefficient between links and the obstacle.
    pub friction: f64,
    /// `None` for an obstacle that is fixed \[kg\].
    pub mass: Option<f64>,
    /// Height of its top face above the ground, `None` for an obstacle without end; the spatial model only \[m\].
    pub height: Option<f64>,
}

impl From<Peg> for Obstacle {
    fn from(peg: Peg) -> Self {
        Self::endless(Shape::Circle(peg))
    }
}

impl From<[f64; 3]> for Obstacle {
    fn from(circle: [f64; 3]) -> Self {
        Peg::from(circle).into()
    }
}

/// An obstacle in a saved state: all fields in order, for formats without names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedObstacle {
    shape: Shape,
    friction: f64,
    height: Option<f64>,
}

impl SavedObstacle {
    /// Whether it can be in a scene.
    pub fn is_valid(&self) -> bool {
        Obstacle::from(self.clone()).validate().is_ok()
    }
}

impl From<&Obstacle> for SavedObstacle {
    fn from(obstacle: &Obstacle) -> Self {
        Self { shape: obstacle.shape.clone(), friction: obstacle.friction, height: obstacle.height }
    }
}

impl From<SavedObstacle> for Obstacle {
    fn from(SavedObstacle { shape, friction, height }: SavedObstacle) -> Self {
        Self { friction, height, ..Self::endless(shape) }
    }
}

impl Obstacle {
    /// Fixed, without friction and without end.
    pub fn endless(shape: Shape) -> Self {
        Self { shape, friction: 0.0, mass: None, height: None }
    }

    /// Whether it has another outline than a circle.
    pub fn is_wall(&self) -> bool {
        !matches!(self.shape, Shape::Circle(_))
    }

    /// Whether it is a circle without friction and without end, like the obstacles of the thesis.
    pub fn is_plain_peg(&self) -> bool {
        !self.is_wall() && self.friction == 0.0 && self.mass.is_none() && self.height.is_none()
    }

    /// # Errors
    /// Names the field that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        non_negative("friction", self.friction)?;
        if let Some(mass) = self.mass {
            return Err(ConfigError::new("mass", mass, "None: all obstacles are fixed"));
        }
        if let Some(height) = self.height {
            length("height", height)?;
        }
        self.shape.validate()
    }
}

impl Shape {
    fn validate(&self) -> Result<(), ConfigError> {
        match self {
            Shape::Circle(Peg { radius, x, y }) => {
                length("radius", *radius)?;
                coordinate("x", *x)?;
                coordinate("y", *y)?;
            }
            Shape::Segment { start, end } => {
                finite_point("start", start)?;
                finite_point("end", end)?;
                let length = (Vector2::from(*end) - Vector2::from(*start)).norm();
                require(length > SHORTEST, "end", format!("{end:?}"), "another point than the start")?;
            }
            Shape::Box { size, x, y, angle } => {
                length("size[0]", size[0])?;
                length("size[1]", size[1])?;
                coordinate("x", *x)?;
                coordinate("y", *y)?;
                coordinate("angle", *angle)?;
            }
            Shape::Polygon { vertices } => validate_outline(vertices)?,
        }
        Ok(())
    }

    /// The outline of whatever is not a circle.
    pub fn polygon(&self) -> Option<ConvexPolygon> {
        match self {
            Shape::Circle(_) => None,
            Shape::Segment { start, end } => Some(ConvexPolygon::new([*start, *end].map(Vector2::from).to_vec())),
            Shape::Box { size: [length, width], x, y, angle } => {
                let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
                let (turn, centre) = (Rotation2::new(*angle), Vector2::new(*x, *y));
                let corner = |[a, b]: [f64; 2]| centre + turn * Vector2::new(0.5 * a * length, 0.5 * b * width);
                Some(ConvexPolygon::new(corners.map(corner).to_vec()))
            }
            Shape::Polygon { vertices } => {
                let mut corners: Vec<_> = outline::corners(vertices).into_iter().map(|(_, corner)| corner).collect();
                if outline::turning(&corners) < 0.0 {
                    corners.reverse();
                }
                Some(ConvexPolygon::new(corners))
            }
        }
    }
}

fn finite_point(field: &str, point: &[f64; 2]) -> Result<(), ConfigError> {
    for (axis, &value) in point.iter().enumerate() {
        coordinate(&format!("{field}[{axis}]"), value)?;
    }
    Ok(())
}

fn validate_outline(vertices: &[[f64; 2]]) -> Result<(), ConfigError> {
    for (i, vertex) in vertices.iter().enumerate() {
        finite_point(&format!("vertices[{i}]"), vertex)?;
    }
    outline::validate(vertices)
}

/// Shortest wall \[m\].
const SHORTEST: f64 = 1e-9;

/// The fields of an obstacle in a mapping: which of them it takes depends on its shape.
#[derive(Serialize, Deserialize, Default)]
#[serde(rename = "Obstacle", deny_unknown_fields)]
struct ObstacleFields {
    shape: ShapeName,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    end: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "number")]
    angle: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    vertices: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    friction: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mass: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    height: Option<f64>,
}

/// None is no number, although it may be left out.
fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    f64::deserialize(deserializer).map(Some)
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ShapeName {
    #[default]
    Circle,
    Segment,
    Box,
    Polygon,
}

impl ObstacleFields {
    /// Field by name, whether it has a value, and the shapes that take it.
    fn given(&self) -> [(&'static str, bool); 8] {
        [
            ("radius", self.radius.is_some()),
            ("start", self.start.is_some()),
            ("end", self.end.is_some()),
            ("size", self.size.is_some()),
            ("x", self.x.is_some()),
            ("y", self.y.is_some()),
            ("angle", self.angle.is_some()),
            ("vertices", self.vertices.is_some()),
        ]
    }

    /// The obstacle; the error is about fields that are missing or do not belong to the shape.
    fn obstacle(self) -> Result<Obstacle, String> {
        let (name, fields): (_, &[&str]) = match self.shape {
            ShapeName::Circle => ("circle", &["radius", "x", "y"]),
            ShapeName::Segment => ("segment", &["start", "end"]),
            ShapeName::Box => ("box", &["size", "x", "y", "angle"]),
            ShapeName::Polygon => ("polygon", &["vertices"]),
        };
        let optional = "angle";
        let fits = |(field, has): (&str, bool)| {
            if has { fields.contains(&field) } else { !fields.contains(&field) || field == optional }
        };
        let expected = || format!("a {name} with {}, its friction and height", fields.join(", "));
        if !self.given().into_iter().all(fits) {
            return Err(expected());
        }
        let Self { shape, radius, start, end, size, x, y, angle, vertices, friction, mass, height } = self;
        let shape = match shape {
            ShapeName::Circle => radius.zip(x).zip(y).map(|((radius, x), y)| Shape::Circle(Peg { radius, x, y })),
            ShapeName::Segment => start.zip(end).map(|(start, end)| Shape::Segment { start, end }),
            ShapeName::Box => {
                size.zip(x).zip(y).map(|((size, x), y)| Shape::Box { size, x, y, angle: angle.unwrap_or(0.0) })
            }
            ShapeName::Polygon => vertices.map(|vertices| Shape::Polygon { vertices }),
        };
        shape.map(|shape| Obstacle { shape, friction, mass, height }).ok_or_else(expected)
    }
}

impl From<&Obstacle> for ObstacleFields {
    fn from(obstacle: &Obstacle) -> Self {
        let Obstacle { friction, mass, height, .. } = *obstacle;
        let common = Self { friction, mass, height, ..Self::default() };
        match &obstacle.shape {
            Shape::Circle(Peg { radius, x, y }) => {
                Self { shape: ShapeName::Circle, radius: Some(*radius), x: Some(*x), y: Some(*y), ..common }
            }
            Shape::Segment { start, end } => {
                Self { shape: ShapeName::Segment, start: Some(*start), end: Some(*end), ..common }
            }
            Shape::Box { size, x, y, angle } => Self {
                shape: ShapeName::Box,
                size: Some(*size),
                x: Some(*x),
                y: Some(*y),
                angle: Some(*angle),
                ..common
            },
            Shape::Polygon { vertices } => {
                Self { shape: ShapeName::Polygon, vertices: Some(vertices.clone()), ..common }
            }
        }
    }
}

impl Serialize for Obstacle {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Obstacle { shape: Shape::Circle(peg), friction: 0.0, mass: None, height: None } => {
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
