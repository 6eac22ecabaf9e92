//! What a policy observes: named blocks with fixed scaling.
//!
//! Each element of the observation is `clamp(value / scale, -bound, bound)`; the scales are chosen so that a robot in
//! motion keeps most of them in [-1, 1]. A block is one row of a table: of [`common`] or of
//! [`RobotModel::OBSERVATION`]. Layout, mirror signs, memories and documentation follow from the rows.

mod common;
mod element;

use super::action::ActionEntry;
use super::config::EnvConfig;
use super::perception::PegView;
use super::robot_model::RobotModel;
use super::sensors::Sensors;
use crate::robot::Robot;

pub use common::{always, joint_angle, joint_rate};
pub use element::{Element, each, even, named, odd};

/// Everything that may be observed at a control instant.
pub struct View<'a, M> {
    pub model: &'a M,
    pub sensors: &'a Sensors,
    /// Angle from +x to the goal direction \[rad\].
    pub bearing: f64,
    pub previous_action: &'a [f64],
    pub peg_view: &'a PegView,
}

/// What presence, elements and scale of a block may depend on.
pub struct Setup<'a> {
    pub config: &'a EnvConfig,
    pub robot: &'a Robot,
    pub actions: &'a [ActionEntry],
    pub peg_view: &'a PegView,
}

/// A run of elements of one kind: one row of a table.
#[derive(Debug)]
pub struct BlockRow<M> {
    pub name: &'static str,
    /// Unit of the values before scaling.
    pub unit: &'static str,
    pub description: &'static str,
    /// Whether an environment has the block; blocks that its task or action mode leaves constant are absent.
    pub present: fn(&Setup) -> bool,
    /// Name and parity of each element.
    pub elements: fn(&Setup) -> Vec<Element>,
    /// Value that is scaled to one.
    pub scale: fn(&Setup) -> f64,
    /// Largest magnitude after scaling.
    pub bound: f64,
    /// Whether policies with a memory keep running means of it.
    pub memory: bool,
    /// Writes the values, one for each element.
    pub read: fn(&View<M>, &mut [f64]),
}

/// A block in the observation of one environment.
#[derive(Debug)]
pub struct ObservationBlock<M: 'static> {
    pub row: &'static BlockRow<M>,
    /// Index of the first element.
    pub start: usize,
    pub elements: Vec<Element>,
    pub scale: f64,
}

impl<M> ObservationBlock<M> {
    pub fn size(&self) -> usize {
        self.elements.len()
    }
}

/// The blocks of an environment's observation, in order.
#[derive(Debug)]
pub struct ObservationLayout<M: 'static> {
    blocks: Vec<ObservationBlock<M>>,
    size: usize,
}

impl<M: RobotModel> ObservationLayout<M> {
    pub fn new(setup: &Setup) -> Self {
        let [body, contact] = M::OBSERVATION;
        let rows = [body, BlockRow::TASK, contact, BlockRow::ACTION_AND_PEGS].into_iter().flatten();
        let (mut blocks, mut size) = (Vec::new(), 0);
        for row in rows.filter(|row| (row.present)(setup)) {
            let elements = (row.elements)(setup);
            let start = size;
            size += elements.len();
            blocks.push(ObservationBlock { row, start, elements, scale: (row.scale)(setup) });
        }
        Self { blocks, size }
    }

    pub fn blocks(&self) -> &[ObservationBlock<M>] {
        &self.blocks
    }

    /// Number of elements.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Writes the observation; every element is finite and inside its bounds. `values` is room for as
    /// many unscaled values.
    pub fn write(&self, view: &View<M>, values: &mut [f64], observation: &mut [f32]) {
        for block in &self.blocks {
            let range = block.start..block.start + block.size();
            let values = &mut values[range.clone()];
            (block.row.read)(view, values);
            let bound = block.row.bound;
            for (element, value) in observation[range].iter_mut().zip(values) {
                let scaled = (*value / block.scale).clamp(-bound, bound);
                *element = if scaled.is_finite() { scaled as f32 } else { 0.0 };
            }
        }
    }
}
