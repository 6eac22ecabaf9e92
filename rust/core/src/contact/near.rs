//! The link-peg pairs worth looking at, kept while the robot moves little.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::pegs::PegGrid;
use crate::robot::Link;

use super::gap;

/// A link-peg pair near contact and what the last stage found there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NearPair {
    pub link: usize,
    pub peg: usize,
    /// Contact force of the last stage \[N\]: the warm start of the next one.
    pub force: f64,
    /// Whether the contact carried force at the end of the last accepted step.
    pub touches: bool,
    /// Whether it did so twice running: an impact takes two steps, one that closes the gap and one that
    /// ends the approach.
    pub closed: bool,
}

/// All pairs whose gap may be below a margin; recomputed only after the robot moved by [`SKIN`].
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NearPegs {
    pairs: Vec<NearPair>,
    #[serde(skip)]
    previous: Vec<NearPair>,
    /// Poses at which the list was made, and the margin it was made for.
    anchor: Vec<Vector3<f64>>,
    margin: f64,
}

impl NearPegs {
    pub fn with_capacity(links: usize) -> Self {
        Self {
            pairs: Vec::with_capacity(PAIRS_PER_LINK * links),
            previous: Vec::with_capacity(PAIRS_PER_LINK * links),
            anchor: Vec::with_capacity(links),
            margin: 0.0,
        }
    }

    pub fn pairs(&self) -> &[NearPair] {
        &self.pairs
    }

    pub fn pairs_mut(&mut self) -> &mut [NearPair] {
        &mut self.pairs
    }

    /// Whether all pairs are of a robot of `links` links among `pegs` pegs.
    pub fn fits(&self, links: usize, pegs: usize) -> bool {
        (self.anchor.is_empty() || self.anchor.len() == links)
            && self.pairs.iter().all(|pair| pair.link < links && pair.peg < pegs)
    }

    /// Forgets pairs and warm starts.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.anchor.clear();
    }

    /// Makes sure that every pair with a gap below `margin` at `poses` is listed.
    pub fn update(&mut self, poses: &[Vector3<f64>], links: &[Link], pegs: &PegGrid, margin: f64) {
        if !pegs.pegs().is_empty() && self.is_stale(poses, links, margin) {
            self.rebuild(poses, links, pegs, margin);
        }
    }

    fn is_stale(&self, poses: &[Vector3<f64>], links: &[Link], margin: f64) -> bool {
        if self.anchor.len() != poses.len() || margin > self.margin {
            return true;
        }
        // No point of a link has moved farther than its CG plus its reach times its rotation.
        let moved = |(i, pose): (usize, &Vector3<f64>)| {
            let step = pose - self.anchor[i];
            step.xy().norm() + links[i].reach() * step.z.abs() > SKIN
        };
        poses.iter().enumerate().any(moved)
    }

    fn rebuild(&mut self, poses: &[Vector3<f64>], links: &[Link], pegs: &PegGrid, margin: f64) {
        self.anchor.clear();
        self.anchor.extend_from_slice(poses);
        self.margin = margin;
        std::mem::swap(&mut self.pairs, &mut self.previous);
        self.pairs.clear();
        for (i, (pose, link)) in poses.iter().zip(links).enumerate() {
            pegs.visit_near(pose.x, pose.y, link.reach() + margin + SKIN, |peg| {
                if gap(pose, link, &pegs.pegs()[peg]) < margin + SKIN {
                    self.pairs.push(NearPair { link: i, peg, force: 0.0, touches: false, closed: false });
                }
            });
        }
        for pair in &mut self.pairs {
            if let Some(old) = self.previous.iter().find(|old| old.link == pair.link && old.peg == pair.peg) {
                *pair = *old;
            }
        }
    }
}

/// How far a point of the robot may move before the list is made anew \[m\].
const SKIN: f64 = 0.04;

/// Pairs reserved for each link; a denser field grows the list once.
pub const PAIRS_PER_LINK: usize = 8;
