//! Obstacles as users write them.

use std::fmt;
use std::sync::Arc;

use nalgebra::{Rotation2, Vector2};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::{ConfigError, coordinate, length, non_negative, require};

use super::{Body, ConvexPolygon, Cylinder, GroundFriction, HeightField, Polyhedron, outline};

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

/// Shape of an obstacle: the outline of a vertical body, seen from above, or another body of the spatial model.
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
    /// Uneven ground.
    HeightField(Arc<Heights>),
    /// The convex hull of some points \[m\].
    Polyhedron {
        vertices: Vec<[f64; 3]>,
    },
    /// A pole, or a pipe, between the centres of its ends \[m\].
    Cylinder {
        start: [f64; 3],
        end: [f64; 3],
        radius: f64,
        /// Whether it is a pipe, which links touch inside too.
        inside: bool,
    },
}

/// Heights on a grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heights {
    /// Rows along x, of heights along y \[m\].
    pub height: Vec<Vec<f64>>,
    /// Between neighbours along either axis \[m\].
    pub spacing: f64,
    /// Where the first height is \[m\].
    pub origin: [f64; 2],
    pub friction: GroundFriction,
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

    /// Whether it is a vertical body of another outline than a circle.
    pub fn is_wall(&self) -> bool {
        matches!(self.shape, Shape::Segment { .. } | Shape::Box { .. } | Shape::Polygon { .. })
    }

    /// Whether it is a circle without friction and without end, like the obstacles of the thesis.
    pub fn is_plain_peg(&self) -> bool {
        matches!(self.shape, Shape::Circle(_)) && self.friction == 0.0 && self.mass.is_none() && self.height.is_none()
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
    /// Whether it is no vertical body.
    pub fn is_body(&self) -> bool {
        matches!(self, Shape::HeightField(_) | Shape::Polyhedron { .. } | Shape::Cylinder { .. })
    }

    /// Whether it is uneven ground with the friction of the ground around it.
    pub fn has_friction_of_ground(&self) -> bool {
        matches!(self, Shape::HeightField(heights) if heights.friction == GroundFriction::OfGround)
    }

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
            Shape::HeightField(_) | Shape::Polyhedron { .. } | Shape::Cylinder { .. } => {
                self.body()?;
            }
        }
        Ok(())
    }

    /// What is no vertical body.
    ///
    /// # Errors
    /// Names the field that is not admissible.
    pub fn body(&self) -> Result<Option<Body>, ConfigError> {
        Ok(Some(match self {
            Shape::HeightField(heights) => Body::HeightField(Arc::new(HeightField::new(heights)?)),
            Shape::Polyhedron { vertices } => Body::Polyhedron(Arc::new(Polyhedron::hull_of(vertices)?)),
            Shape::Cylinder { start, end, radius, inside } => {
                Body::Cylinder(Cylinder::new(*start, *end, *radius, *inside)?)
            }
            _ => return Ok(None),
        }))
    }

    /// The outline of a wall.
    pub fn polygon(&self) -> Option<ConvexPolygon> {
        match self {
            Shape::Circle(_) | Shape::HeightField(_) | Shape::Polyhedron { .. } | Shape::Cylinder { .. } => None,
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
    start: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    end: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
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
}

impl ShapeName {
    /// In messages, with its fields: those it needs, and those that may be left out.
    fn fields(self) -> (&'static str, &'static [&'static str], &'static [&'static str]) {
        match self {
            ShapeName::Circle => ("circle", &["radius", "x", "y"], &[]),
            ShapeName::Segment => ("segment", &["start", "end"], &[]),
            ShapeName::Box => ("box", &["size", "x", "y"], &["angle"]),
            ShapeName::Polygon => ("polygon", &["vertices"], &[]),
            ShapeName::HeightField => ("height_field", &["spacing"], &["origin"]),
            ShapeName::Polyhedron => ("polyhedron", &["vertices"], &[]),
            ShapeName::Cylinder => ("cylinder", &["start", "end", "radius"], &["inside"]),
        }
    }
}

impl ObstacleFields {
    /// Field by name, and whether it has a value.
    fn given(&self) -> [(&'static str, bool); 11] {
        [
            ("radius", self.radius.is_some()),
            ("start", self.start.is_some()),
            ("end", self.end.is_some()),
            ("size", self.size.is_some()),
            ("x", self.x.is_some()),
            ("y", self.y.is_some()),
            ("angle", self.angle.is_some()),
            ("vertices", self.vertices.is_some()),
            ("spacing", self.spacing.is_some()),
            ("origin", self.origin.is_some()),
            ("inside", self.inside.is_some()),
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
        };
        let number = |value: Option<NumberOrGrid>| match value {
            None => Some(None),
            Some(NumberOrGrid::Number(number)) => Some(Some(number)),
            Some(NumberOrGrid::Grid(_)) => None,
        };
        let (friction, height) = (number(friction)?.unwrap_or(0.0), number(height)?);
        let is_vertical = !matches!(shape, Shape::Polyhedron { .. } | Shape::Cylinder { .. });
        (is_vertical || height.is_none()).then_some(Obstacle { shape, friction, mass, height })
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
        let Obstacle { friction, mass, height, .. } = *obstacle;
        let number = |value: f64| Some(NumberOrGrid::Number(value));
        let common = Self { friction: number(friction), mass, height: height.and_then(number), ..Self::default() };
        match &obstacle.shape {
            Shape::Circle(Peg { radius, x, y }) => {
                Self { shape: ShapeName::Circle, radius: Some(*radius), x: Some(*x), y: Some(*y), ..common }
            }
            Shape::Segment { start, end } => Self {
                shape: ShapeName::Segment,
                start: Some(Point::Plane(*start)),
                end: Some(Point::Plane(*end)),
                ..common
            },
            Shape::Box { size, x, y, angle } => Self {
                shape: ShapeName::Box,
                size: Some(*size),
                x: Some(*x),
                y: Some(*y),
                angle: Some(*angle),
                ..common
            },
            Shape::Polygon { vertices } => Self {
                shape: ShapeName::Polygon,
                vertices: Some(vertices.iter().copied().map(Point::Plane).collect()),
                ..common
            },
            Shape::Polyhedron { vertices } => {
                let vertices = vertices.iter().copied().map(Point::Space).collect();
                Self { shape: ShapeName::Polyhedron, vertices: Some(vertices), ..common }
            }
            Shape::Cylinder { start, end, radius, inside } => Self {
                shape: ShapeName::Cylinder,
                start: Some(Point::Space(*start)),
                end: Some(Point::Space(*end)),
                radius: Some(*radius),
                inside: Some(*inside),
                ..common
            },
            Shape::HeightField(heights) => {
                let Heights { height, spacing, origin, friction } = &**heights;
                let friction = match friction {
                    GroundFriction::OfGround => None,
                    GroundFriction::Coefficient(coefficient) => number(*coefficient),
                    GroundFriction::Cells(cells) => Some(NumberOrGrid::Grid(cells.clone())),
                };
                Self {
                    shape: ShapeName::HeightField,
                    spacing: Some(*spacing),
                    origin: Some(*origin),
                    friction,
                    height: Some(NumberOrGrid::Grid(height.clone())),
                    ..common
                }
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
