//! What a robot model provides to the stepper: its data and its stage.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::gait::WaveJets;
use crate::math::Real;
use crate::obstacles::{Movable, Moved, ObstacleGrid, OutOfPlane};
use crate::robot::Robot;

use super::Accuracy;
use super::body::Body;
use super::stage::{StageInput, StageKernels, StageOutput};

/// A robot model in stages: `planar::Planar` or `spatial::Spatial`. Everything is monomorphised.
pub trait Model: Debug + Clone + Copy + PartialEq + 'static {
    /// Robot, ground and controller: what no step changes.
    type System: Debug + Clone;
    type State: RobotState;
    type WarmStart: WarmStart;
    /// Reference of one joint.
    type Target: Debug + Clone + Copy + Default + Send;
    /// The current stage of as many robots as `T` has lanes.
    type Workspace<T: Real>: StageKernels<T> + StageInput<T, Model = Self> + StageOutput<T, Model = Self>;

    /// Accuracy at the default precision.
    const ACCURACY: Accuracy;
    /// Largest certified residual of a solved stage over its tolerance; see [`super::verdict`].
    const RESIDUAL_FACTOR: f64;
    /// Whether robots share registers by the linear solves of their last stage, instead of their last accepted step:
    /// whichever predicts better how many the next stage takes.
    const SORTED_BY_STAGE: bool;

    fn robot(system: &Self::System) -> &Robot;

    /// Whether all joints move with their references: a robot placed in such motion has no start to resolve.
    fn follows(system: &Self::System, body: &Body<Self>, targets: &[Self::Target]) -> bool;

    /// Computes the reduced coordinates of the stages from the state, before an interval.
    fn to_reduced(_system: &Self::System, _body: &mut Body<Self>) {}

    /// Computes the state from the reduced coordinates of the stages, after an interval.
    fn from_reduced(_system: &Self::System, _body: &mut Body<Self>) {}
}

/// Configuration, velocity and time of one robot: plain data.
pub trait RobotState: Debug + Clone + PartialEq + Serialize + DeserializeOwned {
    /// A robot of `links` links at the origin, straight and at rest.
    fn zero(links: usize) -> Self;
    /// Copies without allocating.
    fn copy_from(&mut self, other: &Self);
    /// \[s\]
    fn time(&self) -> f64;
    fn set_time(&mut self, time: f64);
    /// All velocities become zero.
    fn stop(&mut self);
    /// The obstacles that can be pushed, in the order of the scene.
    fn movables(&self) -> &[Moved];
    fn movables_mut(&mut self) -> &mut Vec<Moved>;
    /// Places obstacles that can be pushed where they lie at first, at rest.
    fn place_movables(&mut self, movables: &[Movable]) {
        let places = self.movables_mut();
        places.clear();
        places.extend(movables.iter().map(Moved::at_start));
    }
    /// Whether it is of a robot of `links` links among so many obstacles that can be pushed.
    fn fits(&self, links: usize, movables: usize) -> bool;
    /// Whether it is finite, and slow enough to be that of a robot rather than of a diverged computation.
    fn is_plausible(&self) -> bool;
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

/// Data that one step passes to the next besides the state.
pub trait WarmStart: Debug + Clone {
    /// The part of it that continues a run elsewhere.
    type Saved: Debug + Clone + PartialEq + Serialize + DeserializeOwned;

    fn new(links: usize) -> Self;
    /// The robot was placed, among so many obstacles that can be pushed: no earlier forces.
    fn clear(&mut self, movables: usize);
    fn save(&self) -> Self::Saved;
    fn resume(&mut self, saved: &Self::Saved);
    /// Whether `saved` is of a robot of `links` links among these obstacles.
    fn fits(saved: &Self::Saved, links: usize, obstacles: &ObstacleGrid) -> bool;
}

/// A body with a reference for its joints: what a [`super::Fleet`] advances.
pub trait Driven {
    type Model: Model;

    fn body(&self) -> &Body<Self::Model>;
    fn body_mut(&mut self) -> &mut Body<Self::Model>;
    /// The reference of all joints at `time` \[s\].
    fn targets(&self, time: f64, targets: &mut [<Self::Model as Model>::Target]);
    /// The wave that all joints follow at `time` \[s\], if it is all they follow.
    fn travelling_wave(&self, _time: f64) -> Option<WaveJets> {
        None
    }
    /// Torques beside those of the controller, see [`crate::gait::Reference::torques`].
    fn torques(&self, time: f64, torques: &mut [f64]) -> bool;
    /// The first time after `time` at which the reference jumps \[s\]; infinite if it never does.
    fn next_jump(&self, _time: f64) -> f64 {
        f64::INFINITY
    }
}
