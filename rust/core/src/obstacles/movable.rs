//! Obstacles that can be pushed, and their place behind the links of a robot.

use std::iter::{Chain, Map};
use std::slice::Iter;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, non_negative, positive};
use crate::robot::Link;

use super::Peg;

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

/// A disc that lies on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Movable {
    /// Mass, moment of inertia and outline: those of a link without straight sides and joints.
    pub link: Link,
    /// Where it lies before anything moves it \[m\].
    pub start: [f64; 2],
    /// Coulomb coefficient of the ground.
    pub ground_friction: f64,
    pub spring: Option<Spring>,
}

impl Movable {
    /// A homogeneous disc.
    pub fn disc(Peg { radius, x, y }: Peg, mass: f64, ground_friction: f64, spring: Option<Spring>) -> Self {
        let inertia = 0.5 * mass * radius * radius;
        let link = Link {
            length: 2.0 * radius,
            contact_half_length: 0.0,
            radius,
            mass,
            cg_offset: 0.0,
            inertia,
            roll_inertia: inertia,
            friction_factor: 1.0,
        };
        Self { link, start: [x, y], ground_friction, spring }
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

    /// Lever at which the ground's friction resists spin: the mean distance from the centre of a disc that presses on the
    /// ground evenly \[m\].
    pub fn spin_lever(&self) -> f64 {
        2.0 / 3.0 * self.link.radius
    }
}

/// The links of a robot and, numbered behind them, the obstacles around it that can be pushed.
#[derive(Debug, Clone, Copy)]
pub struct Nodes<'a> {
    pub links: &'a [Link],
    pub movables: &'a [Movable],
}

impl<'a> Nodes<'a> {
    pub fn count(&self) -> usize {
        self.links.len() + self.movables.len()
    }

    pub fn get(&self, node: usize) -> &'a Link {
        self.links.get(node).unwrap_or_else(|| &self.movables[node - self.links.len()].link)
    }
}

impl<'a> IntoIterator for Nodes<'a> {
    type Item = &'a Link;
    type IntoIter = Chain<Iter<'a, Link>, Map<Iter<'a, Movable>, fn(&'a Movable) -> &'a Link>>;

    fn into_iter(self) -> Self::IntoIter {
        let link: fn(&'a Movable) -> &'a Link = |movable| &movable.link;
        self.links.iter().chain(self.movables.iter().map(link))
    }
}
