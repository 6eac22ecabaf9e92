//! State of one robot between steps.

use std::fmt::Debug;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::obstacles::{Movable, Moved, OutOfPlane};

use super::model::Model;

/// Configuration, velocity and time of one robot: plain data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotState<P, U> {
    /// \[s\]
    pub time: f64,
    pub pose: Vec<P>,
    pub twist: Vec<U>,
    /// Of the obstacles that can be pushed, in the order of the scene.
    #[serde(default)]
    pub movables: Vec<Moved>,
}

/// That of a robot of a model.
pub type StateOf<M> = RobotState<<M as Model>::Pose, <M as Model>::Twist>;

/// Pose or twist of a link.
pub trait Coordinates: Debug + Clone + Copy + Send + PartialEq + Serialize + DeserializeOwned {
    /// At the origin, or at rest.
    fn zero() -> Self;
}

/// Pose of a link that moves with twists `U`.
pub trait LinkPose<U>: Coordinates {
    /// Whether both are finite, and the link slow enough to be that of a robot rather than of a diverged computation.
    fn is_plausible(&self, twist: &U) -> bool;
}

impl<P: LinkPose<U>, U: Coordinates> RobotState<P, U> {
    /// A robot of `links` links at the origin, straight and at rest.
    pub fn zero(links: usize) -> Self {
        Self { time: 0.0, pose: vec![P::zero(); links], twist: vec![U::zero(); links], movables: Vec::new() }
    }

    /// Copies without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        self.time = other.time;
        self.pose.copy_from_slice(&other.pose);
        self.twist.copy_from_slice(&other.twist);
        self.movables.clone_from(&other.movables);
    }

    /// All velocities become zero.
    pub fn stop(&mut self) {
        self.twist.fill(U::zero());
        self.movables.iter_mut().for_each(|moved| *moved = moved.stopped());
    }

    /// Places obstacles that can be pushed where they lie at first, at rest.
    pub fn place_movables(&mut self, movables: &[Movable]) {
        self.movables.clear();
        self.movables.extend(movables.iter().map(Moved::at_start));
    }

    /// Whether it is of a robot of `links` links among so many obstacles that can be pushed.
    pub fn fits(&self, links: usize, movables: usize) -> bool {
        self.pose.len() == links && self.twist.len() == links && self.movables.len() == movables
    }

    /// Whether it is finite, and slow enough to be that of a robot rather than of a diverged computation.
    pub fn is_plausible(&self) -> bool {
        self.pose.iter().zip(&self.twist).all(|(pose, twist)| pose.is_plausible(twist))
            && self.movables.iter().all(Moved::is_plausible)
    }
}

impl Moved {
    /// Whether it is finite, and slow enough to be that of an obstacle rather than of a diverged computation.
    pub fn is_plausible(&self) -> bool {
        let Self { pose, twist, out_of_plane: OutOfPlane { height, rise, roll } } = self;
        let is_slow = twist.xy().amax() < MAX_SPEED && twist.z.abs() < MAX_RATE;
        let is_slow_out_of_plane = rise.abs() < MAX_SPEED && roll.iter().all(|rate| rate.abs() < MAX_RATE);
        is_slow && is_slow_out_of_plane && pose.iter().chain([height]).all(|number| number.is_finite())
    }
}

/// Speed beyond which a computation has diverged \[m/s\].
pub const MAX_SPEED: f64 = 1e4;

/// Angular velocity beyond which a computation has diverged \[rad/s\].
pub const MAX_RATE: f64 = 1e6;
