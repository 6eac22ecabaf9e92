//! What a robot keeps of its contacts from stage to stage.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::obstacles::ObstacleGrid;

use super::pair_features;

/// What a link is in contact with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Source {
    /// The side or an edge of an obstacle, by its number in the grid.
    Obstacle(usize),
    /// The top face of an obstacle, which lies below the robot as the ground does.
    Top(usize),
    /// Another link of the robot, or an obstacle that can be pushed: these are numbered behind the links.
    Link(usize),
    /// Something else that no robot moves, by a number of its own.
    Fixture(usize),
}

/// Which contact of a robot it is: the same from stage to stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ContactId {
    /// The first of two links.
    pub link: usize,
    pub with: Source,
    /// Which of the features that describe the pair.
    pub feature: usize,
}

impl ContactId {
    /// Of two links that are not neighbours.
    pub fn of_pair([first, second]: [usize; 2], feature: usize) -> Self {
        Self { link: first, with: Source::Link(second), feature }
    }

    /// The links of a contact of the robot with itself.
    pub fn pair(&self) -> Option<[usize; 2]> {
        match self.with {
            Source::Link(second) => Some([self.link, second]),
            _ => None,
        }
    }

    /// Whether it is of a robot of `links` links among these obstacles, with what it can push of them; `features` describe
    /// two links.
    pub fn fits(&self, links: usize, obstacles: &ObstacleGrid, features: usize) -> bool {
        let nodes = links + obstacles.movables().len();
        match self.with {
            Source::Obstacle(obstacle) | Source::Top(obstacle) => self.link < nodes && obstacle < obstacles.total(),
            Source::Link(second) => {
                let is_pair = self.link < if second < links { second.saturating_sub(1) } else { second };
                second < nodes
                    && is_pair
                    && self.feature < pair_features([self.link, second], links, obstacles, features)
            }
            Source::Fixture(_) => self.link < nodes,
        }
    }
}

/// What the last stage found at a contact, and the last step left there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct KnownContact {
    /// Normal force \[N\]: the warm start of the next stage.
    pub force: f64,
    /// Friction on the link, frame I \[N\].
    pub friction: Vector3<f64>,
    /// Penetration left at the end of the last accepted step, at least zero; in 3D it is measured anew \[m\].
    pub depth: f64,
    /// Whether the contact carried force at the end of the last accepted step.
    pub touches: bool,
}

impl KnownContact {
    pub const NEW: Self = Self { force: 0.0, friction: Vector3::new(0.0, 0.0, 0.0), depth: 0.0, touches: false };
}

/// The contacts of the last stage, those of two links one after the other.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactMemory {
    known: Vec<(ContactId, KnownContact)>,
}

impl ContactMemory {
    pub fn with_capacity(contacts: usize) -> Self {
        Self { known: Vec::with_capacity(contacts) }
    }

    /// What is known of a contact.
    pub fn of(&self, id: ContactId) -> KnownContact {
        self.known.iter().find(|(known, _)| *known == id).map_or(KnownContact::NEW, |(_, known)| *known)
    }

    pub fn clear(&mut self) {
        self.known.clear();
    }

    /// Forgets all contacts but these.
    pub fn retain(&mut self, is_kept: impl Fn(ContactId) -> bool) {
        self.known.retain(|(id, _)| is_kept(*id));
    }

    /// Takes friction on the first link of a contact that there is, frame I \[N\].
    pub fn set_friction(&mut self, id: ContactId, friction: Vector3<f64>) {
        if let Some((_, known)) = self.known.iter_mut().find(|(known, _)| *known == id) {
            known.friction = friction;
        }
    }

    pub fn add(&mut self, id: ContactId, known: KnownContact) {
        self.known.push((id, known));
    }

    /// Number of pairs of the first `links` links that press on each other; a pair may touch at several points.
    pub fn pressed_pairs(&self, links: usize) -> usize {
        let mut before = None;
        let pressed = self.known.iter().filter(|(_, known)| known.force > 0.0).filter_map(|(id, _)| id.pair());
        let pressed = pressed.filter(|[_, second]| *second < links);
        pressed.filter(|links| before.replace(*links) != Some(*links)).count()
    }

    /// Copies without freeing memory.
    pub fn copy_from(&mut self, other: &Self) {
        self.known.clone_from(&other.known);
    }

    /// Ends a step: records which contacts carry force, and what penetration is left, which `gap` measures \[m\].
    pub fn end_step(&mut self, gap: impl Fn(ContactId) -> f64) {
        for (id, known) in &mut self.known {
            known.touches = known.force > 0.0;
            known.depth = (-gap(*id)).max(0.0);
        }
    }

    /// Whether all contacts fit, see [`ContactId::fits`].
    pub fn fits(&self, links: usize, obstacles: &ObstacleGrid, features: usize) -> bool {
        self.known.iter().all(|(id, _)| id.fits(links, obstacles, features))
    }
}
