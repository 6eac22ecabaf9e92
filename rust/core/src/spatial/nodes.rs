//! The nodes of a robot in 3D, its links and behind them what it can push: where they are, and how they move in a stage.

use nalgebra::{Vector2, Vector3};

use crate::math::{Laned, Real};
use crate::obstacles::Nodes;

use super::workspace::{Motion, StageKinematics};
use super::{Frame, LinkAxis, SpatialState, SpatialVector, Twist, place_and_twist};

/// Where the links of a robot are, and what it can push.
pub(crate) trait Places {
    fn link(&self, link: usize) -> LinkAxis;
    /// (x, y, theta).
    fn moved(&self, movable: usize) -> Vector3<f64>;
    /// Centre.
    fn centre(&self, movable: usize) -> Vector3<f64>;

    /// The centre line of a link; of what can be pushed, which has none, its centre as a line without a length.
    fn line(&self, links: usize, node: usize) -> LinkAxis {
        if node < links { self.link(node) } else { LinkAxis::at(&self.centre(node - links)) }
    }

    /// CG of a node from above: the search for neighbours asks for that of every pair.
    fn place(&self, links: usize, node: usize) -> Vector2<f64> {
        self.line(links, node).position.xy()
    }
}

/// Those of a lane.
#[derive(Clone, Copy)]
pub(super) struct InLane<'a, T> {
    pub frames: &'a [Frame<T>],
    pub moved: &'a [SpatialVector<T>],
    pub lane: usize,
}

impl<T: Real> Places for InLane<'_, T> {
    fn link(&self, link: usize) -> LinkAxis {
        self.frames[link].axis_of(self.lane)
    }

    fn moved(&self, movable: usize) -> Vector3<f64> {
        self.moved[movable].in_plane().lane(self.lane)
    }

    fn centre(&self, movable: usize) -> Vector3<f64> {
        self.moved[movable].linear.lane(self.lane)
    }
}

impl Places for SpatialState {
    fn link(&self, link: usize) -> LinkAxis {
        LinkAxis::of(&self.pose[link])
    }

    fn moved(&self, movable: usize) -> Vector3<f64> {
        self.movables[movable].pose
    }

    fn centre(&self, movable: usize) -> Vector3<f64> {
        place_and_twist(&self.movables[movable])[0].linear
    }
}

/// One robot with what it can push in a stage.
pub(super) struct NodesInStage<'a, T> {
    pub nodes: Nodes<'a>,
    pub start: InLane<'a, T>,
    pub base: InLane<'a, T>,
    pub end: InLane<'a, T>,
    expected: &'a [Twist<T>],
    /// c \[s\].
    pub coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
}

impl<'a, T: Real> NodesInStage<'a, T> {
    pub fn of(motion: &'a Motion<T>, coefficient: T, nodes: Nodes<'a>, lane: usize) -> Self {
        let places = |frames: &'a [Frame<T>], moved: &'a [SpatialVector<T>]| InLane { frames, moved, lane };
        Self {
            nodes,
            start: places(&motion.start_frames, &motion.start.moved),
            base: places(&motion.base_frames, &motion.base.moved),
            end: places(&motion.frames, &motion.predicted.moved),
            expected: &motion.expected,
            coefficient: coefficient.lane(lane),
            elapsed: motion.elapsed.lane(lane),
        }
    }

    pub fn expected(&self, node: usize) -> Twist {
        self.expected[node].lane(self.end.lane)
    }

    /// Of a link, or of a ball.
    pub fn kinematics(&self, node: usize) -> StageKinematics<'_> {
        let (links, expected) = (self.nodes.links.len(), self.expected(node));
        let [start, base, end] = [&self.start, &self.base, &self.end].map(|places| places.line(links, node));
        StageKinematics { link: self.nodes.get(node).link, start, base, end, expected }
    }
}
