//! How the robots of a register move during a stage.

use nalgebra::{Vector2, Vector3};

use crate::contact::PlacedLink;
use crate::math::{Laned, Real};
use crate::obstacles::{Moved, Nodes};
use crate::planar::{Heading, PlanarSystem};

use super::motion_bound::MotionBound;

/// Configurations and velocities of a stage.
pub struct Motion<T> {
    /// Distances of each CG from the joints in front of the link and behind it, for the links of the robot only \[m\].
    pub arms: Vec<[T; 2]>,
    /// Of all links and of what can be pushed \[m\].
    pub smallest_radius: T,
    /// State at the start of the step.
    pub start_pose: Vec<Vector3<T>>,
    pub start_twist: Vec<Vector3<T>>,
    /// q_B, u_R and the expected end velocity of the stage.
    pub base: Vec<Vector3<T>>,
    pub reference: Vec<Vector3<T>>,
    pub guess: Vec<Vector3<T>>,
    /// Expected end configuration, and the mean velocities on the way there.
    pub predicted: Vec<Vector3<T>>,
    pub travel: Vec<Vector3<T>>,
    pub heading: Vec<Heading<T>>,
    /// How far away pegs may matter to the stage.
    pub bound: MotionBound<T>,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: T,
}

/// One robot of a register during a stage.
pub struct StageKinematics<'a, T> {
    /// What takes part, and where all that can be pushed lay before.
    pub nodes: Nodes<'a>,
    pub lying: &'a [Moved],
    pub lane: usize,
    pub motion: &'a Motion<T>,
    /// c \[s\].
    pub coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
    pub bound: MotionBound<f64>,
}

impl<T: Real> Motion<T> {
    pub fn new(system: &PlanarSystem, movables: usize) -> Self {
        let (links, zero) = (&system.robot.links, T::zero());
        let rest = vec![Vector3::new(zero, zero, zero); links.len() + movables];
        Self {
            arms: links.iter().map(|link| link.arms().map(T::splat)).collect(),
            smallest_radius: T::splat(system.smallest_radius),
            start_pose: rest.clone(),
            start_twist: rest.clone(),
            base: rest.clone(),
            reference: rest.clone(),
            guess: rest.clone(),
            predicted: rest.clone(),
            travel: rest,
            heading: vec![Heading { cos: T::splat(1.0), sin: zero }; links.len() + movables],
            bound: MotionBound { fastest: zero, displacement: zero },
            elapsed: zero,
        }
    }

    /// See [`StageKinematics::margin`].
    pub fn margin(&self, coefficient: f64, lane: usize, moving: f64) -> f64 {
        self.bound.lane(lane).contact_margin(coefficient, moving, self.smallest_radius.lane(lane))
    }

    /// The robot of a lane in a stage of this coefficient \[s\].
    pub fn of_lane<'a>(
        &'a self,
        (nodes, lying): (Nodes<'a>, &'a [Moved]),
        lane: usize,
        coefficient: f64,
    ) -> StageKinematics<'a, T> {
        let (elapsed, bound) = (self.elapsed.lane(lane), self.bound.lane(lane));
        StageKinematics { nodes, lying, lane, motion: self, coefficient, elapsed, bound }
    }
}

impl<T: Real> StageKinematics<'_, T> {
    /// Pose of a link at the start of the step.
    pub fn start(&self, link: usize) -> Vector3<f64> {
        self.motion.start_pose[link].lane(self.lane)
    }

    /// Pose at the base of the stage.
    pub fn base(&self, link: usize) -> Vector3<f64> {
        self.motion.base[link].lane(self.lane)
    }

    /// Pose at the predicted end.
    pub fn end(&self, link: usize) -> Vector3<f64> {
        self.motion.predicted[link].lane(self.lane)
    }

    /// Heading at the predicted end.
    pub fn heading(&self, link: usize) -> Heading {
        self.motion.heading[link].lane(self.lane)
    }

    /// Mean velocity on the way there.
    pub fn travel(&self, link: usize) -> Vector3<f64> {
        self.motion.travel[link].lane(self.lane)
    }

    /// A link at the predicted end.
    pub fn placed(&self, link: usize) -> PlacedLink<'_> {
        let Heading { cos, sin } = self.heading(link);
        PlacedLink { link: self.nodes.get(link), pose: self.end(link), axis: Vector2::new(cos, sin) }
    }

    /// A link at the start of the step.
    pub fn placed_at_start(&self, link: usize) -> PlacedLink<'_> {
        PlacedLink::new(self.nodes.get(link), self.start(link))
    }

    /// Predicted gap up to which a pair takes part if `moving` of its two bodies are links \[m\].
    pub fn margin(&self, moving: f64) -> f64 {
        self.motion.margin(self.coefficient, self.lane, moving)
    }
}
