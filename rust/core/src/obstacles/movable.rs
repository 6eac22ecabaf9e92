//! Obstacles that can be pushed, and their place behind the links of a robot.

use std::ops::Deref;
use std::sync::Arc;

use nalgebra::{Rotation2, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, non_negative, positive};
use crate::robot::Link;

use super::plate::Plate;
use super::{ConvexPolygon, Peg};

/// What holds a disc at the place where it starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spring {
    /// \[N/m\]
    pub stiffness: f64,
    /// \[N s/m\]
    pub damping: f64,
    /// How far the disc gives way, `None` without a stop \[m\].
    pub travel: Option<f64>,
}

impl Spring {
    /// # Errors
    /// Names the field that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        non_negative("stiffness", self.stiffness)?;
        non_negative("damping", self.damping)?;
        self.travel.map_or(Ok(0.0), |travel| positive("travel", travel)).map(|_| ())
    }
}

/// How a ball meets the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Height of its centre before anything moves it \[m\].
    pub start_height: f64,
    /// Coulomb coefficient of the ground where it slides.
    pub sliding_friction: f64,
}

/// A disc or a convex polygon that lies on the ground, or a ball that rolls there.
#[derive(Debug, Clone, PartialEq)]
pub struct Movable {
    /// Mass and moment of inertia, and the outline of a disc or a ball: that of a link without straight sides and joints. A
    /// polygon lies around the disc of its `radius` and within its `reach`.
    pub link: Link,
    /// Of a polygon, about its centroid, as it lies at its start.
    pub outline: Option<Arc<ConvexPolygon>>,
    /// Where its centre lies before anything moves it \[m\].
    pub start: [f64; 2],
    /// Coulomb coefficient of the ground; of a ball that of its rolling friction, which acts at its centre: where it rolls, this
    /// is the same as the moment at the contact.
    pub ground_friction: f64,
    /// Lever at which the ground's friction resists spin: the mean distance from the centre of a body that presses on the
    /// ground evenly \[m\].
    pub spin_lever: f64,
    pub spring: Option<Spring>,
    /// Of a ball.
    pub ball: Option<Ball>,
}

impl Movable {
    /// A homogeneous disc.
    pub fn disc(Peg { radius, x, y }: Peg, mass: f64, ground_friction: f64, spring: Option<Spring>) -> Self {
        let link = body([radius; 2], mass, 0.5 * mass * radius * radius);
        Self { link, outline: None, start: [x, y], ground_friction, spin_lever: 2.0 / 3.0 * radius, spring, ball: None }
    }

    /// A homogeneous ball with its centre there at its start, and coefficients of sliding and rolling friction.
    pub fn ball(radius: f64, [x, y, start_height]: [f64; 3], mass: f64, [sliding, rolling]: [f64; 2]) -> Self {
        Self {
            link: body([radius; 2], mass, 0.4 * mass * radius * radius),
            outline: None,
            start: [x, y],
            ground_friction: rolling,
            spin_lever: radius,
            spring: None,
            ball: Some(Ball { start_height, sliding_friction: sliding }),
        }
    }

    /// A homogeneous polygon.
    pub fn polygon(polygon: &ConvexPolygon, mass: f64, ground_friction: f64) -> Self {
        let Plate { centroid, squared_gyration, mean_distance, .. } = Plate::of(polygon);
        let corners: Vec<_> = polygon.vertices().iter().map(|vertex| vertex - centroid).collect();
        let reach = corners.iter().map(Vector2::norm).fold(0.0, f64::max);
        let outline = ConvexPolygon::new(corners);
        let inside = -outline.signed_distance(&Vector2::zeros()).0;
        Self {
            link: body([inside, reach], mass, mass * squared_gyration),
            outline: Some(Arc::new(outline)),
            start: centroid.into(),
            ground_friction,
            spin_lever: mean_distance,
            spring: None,
            ball: None,
        }
    }

    /// Semi-axes of the [limit surface](crate::laws::LimitSurface) of its friction where gravity presses it on the ground:
    /// force along and across it, and moment \[N\], \[N m\].
    pub fn friction(&self, normal_gravity: f64) -> Vector3<f64> {
        let force = self.ground_friction * self.link.mass * normal_gravity;
        Vector3::new(force, force, force * self.spin_lever)
    }

    /// Farthest point of its outline that turning takes elsewhere: none of a disc \[m\].
    pub fn turning_reach(&self) -> f64 {
        self.outline.as_ref().map_or(0.0, |_| self.link.reach())
    }

    /// How far it may be from its start; infinitely far without a stop \[m\].
    pub fn travel(&self) -> f64 {
        self.spring.and_then(|spring| spring.travel).unwrap_or(f64::INFINITY)
    }

    /// From its start to a place \[m\].
    pub fn deflection(&self, place: &Vector2<f64>) -> Vector2<f64> {
        place - Vector2::from(self.start)
    }

    /// Energy of the spring at a place \[J\].
    pub fn spring_energy(&self, place: &Vector2<f64>) -> f64 {
        self.spring.map_or(0.0, |spring| 0.5 * spring.stiffness * self.deflection(place).norm_squared())
    }
}

/// Where something that can be pushed is, and how it moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// (x, y, theta) of its centre, the angle from its start \[m\], \[rad\].
    pub pose: Vector3<f64>,
    /// \[m/s\], \[rad/s\]
    pub twist: Vector3<f64>,
    /// The rest of the motion of a ball; zero of all else.
    #[serde(default)]
    pub out_of_plane: OutOfPlane,
}

/// What the plane leaves out of the motion of a ball, whose orientation nothing depends on.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct OutOfPlane {
    /// Of its centre \[m\].
    pub height: f64,
    /// \[m/s\]
    pub rise: f64,
    /// Angular velocity about the horizontal axes x and y \[rad/s\].
    pub roll: [f64; 2],
}

impl Moved {
    /// In the plane.
    pub fn flat(pose: Vector3<f64>, twist: Vector3<f64>) -> Self {
        Self { pose, twist, out_of_plane: OutOfPlane::default() }
    }

    /// At rest where it lies at first.
    pub fn at_start(movable: &Movable) -> Self {
        let height = movable.ball.map_or(0.0, |ball| ball.start_height);
        let out_of_plane = OutOfPlane { height, ..OutOfPlane::default() };
        Self { out_of_plane, ..Self::flat(Vector2::from(movable.start).push(0.0), Vector3::zeros()) }
    }

    /// The same without any motion.
    pub fn stopped(&self) -> Self {
        let out_of_plane = OutOfPlane { height: self.out_of_plane.height, ..OutOfPlane::default() };
        Self { pose: self.pose, twist: Vector3::zeros(), out_of_plane }
    }

    /// \[J\]
    pub fn kinetic_energy(&self, movable: &Movable) -> f64 {
        let (Link { mass, inertia, .. }, OutOfPlane { rise, roll: [x, y], .. }) = (&movable.link, &self.out_of_plane);
        movable.link.energy_in_plane(&self.twist) + 0.5 * (mass * rise * rise + inertia * (x * x + y * y))
    }
}

/// A link without joints, around the disc of the first radius and within that of the second.
fn body([radius, reach]: [f64; 2], mass: f64, inertia: f64) -> Link {
    Link {
        length: 2.0 * reach,
        contact_half_length: reach - radius,
        radius,
        mass,
        cg_offset: 0.0,
        inertia,
        roll_inertia: inertia,
        friction_factor: 1.0,
    }
}

/// A link of a robot, or something that can be pushed.
#[derive(Debug, Clone, Copy)]
pub struct Node<'a> {
    pub link: &'a Link,
    /// Of a polygon, about its centre; `None` of a link or a disc.
    pub outline: Option<&'a ConvexPolygon>,
}

impl Deref for Node<'_> {
    type Target = Link;

    fn deref(&self) -> &Link {
        self.link
    }
}

impl<'a> From<&'a Link> for Node<'a> {
    fn from(link: &'a Link) -> Self {
        Self { link, outline: None }
    }
}

impl<'a> From<&'a Movable> for Node<'a> {
    fn from(movable: &'a Movable) -> Self {
        Self { link: &movable.link, outline: movable.outline.as_deref() }
    }
}

/// Something that can be pushed, where it is.
#[derive(Debug, Clone, Copy)]
pub struct PlacedMovable<'a> {
    pub node: Node<'a>,
    /// (x, y, theta) of its centre, the angle from its start.
    pub pose: Vector3<f64>,
    /// Of the centre of a ball; 0 of all else, which is upright \[m\].
    pub height: f64,
    pub is_ball: bool,
}

impl<'a> PlacedMovable<'a> {
    pub fn new((movable, moved): (&'a Movable, &Moved)) -> Self {
        let (height, is_ball) = (moved.out_of_plane.height, movable.ball.is_some());
        Self { node: movable.into(), pose: moved.pose, height, is_ball }
    }

    /// Where it is, of a disc.
    pub fn disc(&self) -> Option<Peg> {
        self.node.outline.is_none().then(|| Peg { radius: self.node.radius, x: self.pose.x, y: self.pose.y })
    }

    /// The outline of a polygon about its centre, and the turn from that frame to the world's.
    pub fn outline(&self) -> Option<(&'a ConvexPolygon, Rotation2<f64>)> {
        Some((self.node.outline?, Rotation2::new(self.pose.z)))
    }
}

/// The links of a robot and, numbered behind them, the obstacles around it that can be pushed.
#[derive(Debug, Clone, Copy)]
pub struct Nodes<'a> {
    pub links: &'a [Link],
    movables: &'a [Movable],
    /// The numbers of those of them that are meant, in their order here; `None` where all are.
    chosen: Option<&'a [usize]>,
}

impl<'a> Nodes<'a> {
    pub fn new(links: &'a [Link], movables: &'a [Movable]) -> Self {
        Self { links, movables, chosen: None }
    }

    /// Those of the obstacles only that have these numbers.
    pub fn among(self, chosen: &'a [usize]) -> Self {
        Self { chosen: Some(chosen), ..self }
    }

    pub fn count(&self) -> usize {
        self.links.len() + self.chosen.map_or(self.movables.len(), <[usize]>::len)
    }

    /// The number of a node where none is left out.
    pub fn number(&self, node: usize) -> usize {
        let links = self.links.len();
        self.chosen.filter(|_| node >= links).map_or(node, |chosen| links + chosen[node - links])
    }

    /// The node with this number, unless it is left out.
    #[inline]
    pub fn place_of(&self, number: usize) -> Option<usize> {
        let links = self.links.len();
        if number < links {
            return Some(number);
        }
        let Some(chosen) = self.chosen else { return Some(number) };
        chosen.iter().position(|one| links + one == number).map(|place| links + place)
    }

    /// Of all obstacles.
    pub fn all(self) -> Self {
        Self { chosen: None, ..self }
    }

    /// What can be pushed at a node behind the links.
    pub fn movable(&self, node: usize) -> &'a Movable {
        &self.movables[self.number(node) - self.links.len()]
    }

    pub fn get(&self, node: usize) -> Node<'a> {
        self.links.get(node).map_or_else(|| self.movable(node).into(), Node::from)
    }
}
