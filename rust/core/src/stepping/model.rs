//! What a robot model provides to the stepper: its data and its stage.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::math::Real;
use crate::obstacles::ObstacleGrid;
use crate::robot::Robot;

use super::body::Body;
use super::group::AnyGroup;
use super::stage::{StageInput, StageKernels, StageOutput};
use super::state::{Coordinates, LinkPose};
use super::{Accuracy, ImplicitConfig};

/// A robot model in stages: `planar::Planar` or `spatial::Spatial`. Everything but references and the width of a group is
/// monomorphised.
pub trait Model: Debug + Clone + Copy + PartialEq + 'static {
    /// Robot, ground and controller: what no step changes.
    type System: Debug + Clone;
    type Pose: LinkPose<Self::Twist>;
    type Twist: Coordinates;
    type WarmStart: WarmStart;
    /// Reference of one joint.
    type Target: Debug + Clone + Copy + Default + Send;
    /// The current stage of as many robots as `T` has lanes.
    type Workspace<T: Real>: StageKernels<T> + StageInput<T, Model = Self> + StageOutput<T, Model = Self>;

    /// Accuracy at the default precision.
    const ACCURACY: Accuracy;

    /// Calls `group_for`. Not a default method: that of a model compiles its steps with the core, instead of every crate that
    /// steps robots.
    fn group(config: &ImplicitConfig, system: &Self::System, lanes: usize) -> Box<dyn AnyGroup<Self>>;

    fn robot(system: &Self::System) -> &Robot;

    /// Whether all joints move with their references: a robot placed in such motion has no start to resolve.
    fn follows(system: &Self::System, body: &Body<Self>, targets: &[Self::Target]) -> bool;

    /// Computes the reduced coordinates of the stages from the state, before an interval.
    fn to_reduced(_system: &Self::System, _body: &mut Body<Self>) {}

    /// Computes the state from the reduced coordinates of the stages, after an interval.
    fn from_reduced(_system: &Self::System, _body: &mut Body<Self>) {}
}

/// Data that one step passes to the next besides the state.
pub trait WarmStart: Debug + Clone + Send {
    /// The part of it that continues a run elsewhere.
    type Saved: Debug + Clone + PartialEq + Serialize + DeserializeOwned;

    fn new(links: usize) -> Self;
    /// The robot was placed: no earlier forces.
    fn clear(&mut self);
    fn save(&self) -> Self::Saved;
    fn resume(&mut self, saved: &Self::Saved);
    /// Whether `saved` is of a robot of `links` links among these obstacles.
    fn fits(saved: &Self::Saved, links: usize, obstacles: &ObstacleGrid) -> bool;
}
