//! Obstacles that can be pushed, and their place behind the links of a robot.

use std::iter::{Chain, Map};
use std::slice::Iter;

use crate::robot::Link;

use super::Peg;

/// A disc that lies on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Movable {
    /// Mass, moment of inertia and outline: those of a link without straight sides and joints.
    pub link: Link,
    /// Where it lies before anything moves it \[m\].
    pub start: [f64; 2],
    /// Coulomb coefficient of the ground.
    pub ground_friction: f64,
}

impl Movable {
    /// A homogeneous disc.
    pub fn disc(Peg { radius, x, y }: Peg, mass: f64, ground_friction: f64) -> Self {
        let inertia = 0.5 * mass * radius * radius;
        let link = Link {
            length: 2.0 * radius,
            contact_half_length: 0.0,
            radius,
            mass,
            cg_offset: 0.0,
            inertia,
            roll_inertia: inertia,
        };
        Self { link, start: [x, y], ground_friction }
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
