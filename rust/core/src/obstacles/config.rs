//! Obstacles as users write them.

use std::sync::Arc;

use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, coordinate, length, non_negative, positive, require};

use super::{Body, ConvexPolygon, Cylinder, GroundFriction, HeightField, Movable, Polyhedron, Spring, outline};

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
    /// A ball that rolls, with its centre at its start \[m\].
    Sphere {
        radius: f64,
        centre: [f64; 3],
        /// Coefficient of its rolling friction, as of the links.
        rolling_friction: f64,
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct Obstacle {
    pub shape: Shape,
    /// Coulomb coefficient between links and the obstacle.
    pub friction: f64,
    /// `None` for an obstacle that is fixed \[kg\].
    pub mass: Option<f64>,
    /// Coulomb coefficient between the ground and an obstacle that is not fixed.
    pub ground_friction: f64,
    /// `None` for an obstacle that nothing holds where it starts.
    pub spring: Option<Spring>,
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
pub struct SavedObstacle(#[serde(with = "Obstacle")] pub Obstacle);

impl Obstacle {
    /// Fixed, without friction and without end.
    pub fn endless(shape: Shape) -> Self {
        Self { shape, friction: 0.0, mass: None, ground_friction: GROUND_FRICTION, spring: None, height: None }
    }

    /// Whether it is a fixed vertical body of another outline than a circle.
    pub fn is_wall(&self) -> bool {
        self.mass.is_none() && matches!(self.shape, Shape::Segment { .. } | Shape::Box { .. } | Shape::Polygon { .. })
    }

    /// What can be pushed; `None` of an obstacle that is fixed.
    pub fn movable(&self) -> Option<Movable> {
        let mass = self.mass?;
        Some(match &self.shape {
            Shape::Circle(peg) => Movable::disc(*peg, mass, self.ground_friction, self.spring),
            Shape::Sphere { radius, centre, rolling_friction } => {
                Movable::ball(*radius, *centre, mass, [self.ground_friction, *rolling_friction])
            }
            shape => Movable::polygon(&shape.polygon()?, mass, self.ground_friction),
        })
    }

    /// Whether it is a circle without friction and without end, like the obstacles of the thesis.
    pub fn is_plain_peg(&self) -> bool {
        matches!(self.shape, Shape::Circle(_)) && self.friction == 0.0 && self.mass.is_none() && self.height.is_none()
    }

    /// # Errors
    /// Names the field that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        non_negative("friction", self.friction)?;
        non_negative("ground_friction", self.ground_friction)?;
        let is_ball = matches!(self.shape, Shape::Sphere { .. });
        require(!is_ball || self.mass.is_some(), "mass", "None", "> 0: a sphere can be pushed")?;
        if let Some(mass) = self.mass {
            positive("mass", mass)?;
            let is_flat = matches!(self.shape, Shape::Circle(_) | Shape::Box { .. } | Shape::Polygon { .. });
            require(
                is_flat || is_ball,
                "mass",
                mass,
                "None: only circles, boxes, polygons and spheres can be pushed, other obstacles are fixed",
            )?;
            let smooth = "0 with a mass: links slide along what they push without friction";
            require(self.friction == 0.0, "friction", self.friction, smooth)?;
            let height = self.height.unwrap_or_default();
            require(self.height.is_none(), "height", height, "None with a mass: what can be pushed has no end above")?;
        }
        if let Some(spring) = &self.spring {
            spring.validate()?;
            let is_disc = self.mass.is_some() && matches!(self.shape, Shape::Circle(_));
            require(
                is_disc,
                "stiffness",
                spring.stiffness,
                "None without a mass, and of other obstacles than circles",
            )?;
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
            Shape::Sphere { radius, centre, rolling_friction } => {
                length("radius", *radius)?;
                for (field, value) in ["x", "y", "z"].into_iter().zip(centre) {
                    coordinate(field, *value)?;
                }
                non_negative("rolling_friction", *rolling_friction)?;
            }
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
            _ => None,
        }
    }
}

fn finite_point(field: &str, point: &[f64; 2]) -> Result<(), ConfigError> {
    for (axis, &value) in point.iter().enumerate() {
        coordinate(&format!("{field}[{axis}]"), value)?;
    }
    Ok(())
}

pub(super) fn validate_outline(vertices: &[[f64; 2]]) -> Result<(), ConfigError> {
    for (i, vertex) in vertices.iter().enumerate() {
        finite_point(&format!("vertices[{i}]"), vertex)?;
    }
    outline::validate(vertices)
}

/// Coulomb coefficient of the ground, as of links (T Table 7.2).
pub const GROUND_FRICTION: f64 = 0.2;

/// Coefficient of rolling friction, as of links (T 7.2).
pub const ROLLING_FRICTION: f64 = 0.02;

/// Shortest wall \[m\].
const SHORTEST: f64 = 1e-9;
