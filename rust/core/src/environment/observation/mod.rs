//! What a policy observes: named blocks with fixed scaling.
//!
//! Each element of the observation is `clamp(value / scale, -bound, bound)`; the scales are chosen so that a robot in
//! motion keeps most of them in [-1, 1]. A block is one row of a table: of [`common`], [`sensing`],
//! [`privileged`] or [`RobotModel::OBSERVATION`]. Layout, mirror signs, memories and documentation follow from the rows.

mod common;
mod delay;
mod element;
mod privileged;
mod sensing;

use std::collections::BTreeMap;

use super::action::ActionEntry;
use super::config::EnvConfig;
use super::perception::PegView;
use super::rng::Rng;
use super::robot_model::RobotModel;
use super::sensors::Sensors;
use crate::error::{ConfigError, non_negative, require, within};
use crate::robot::Robot;

pub use common::{always, joint_angle, joint_rate};
pub use delay::Delay;
pub use element::{Element, each, even, named, odd};
pub use sensing::{ACCELEROMETER, MOTOR_TORQUE, motor_scale};

/// Everything that may be observed at a control instant.
pub struct View<'a, M> {
    pub model: &'a M,
    pub sensors: &'a Sensors,
    /// Angle from +x to the goal direction \[rad\].
    pub bearing: f64,
    /// Commanded speed along it; zero without a command \[m/s\].
    pub speed: f64,
    pub previous_action: &'a [f64],
    pub peg_view: &'a PegView,
    /// The pegs as they are, where they are observed by critics.
    pub true_pegs: &'a PegView,
    /// Friction coefficients along and across a link.
    pub friction: [f64; 2],
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

impl<M> BlockRow<M> {
    /// What most rows have in common; each has a name, a description, elements and values of its own.
    pub const DEFAULT: Self = Self {
        name: "",
        unit: "1",
        description: "",
        present: always,
        elements: |_| Vec::new(),
        scale: |_| 1.0,
        bound: 4.0,
        memory: false,
        read: |_, _| (),
    };
}

/// A block in the observation of one environment.
#[derive(Debug)]
pub struct ObservationBlock<M: 'static> {
    pub row: &'static BlockRow<M>,
    /// Index of the first element.
    pub start: usize,
    pub elements: Vec<Element>,
    pub scale: f64,
    /// Amplitude of the noise, in the unit of the values.
    pub noise: f64,
    /// Control periods after which it is observed.
    pub delay: u32,
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
    /// Scale and bound of each element.
    ranges: Vec<[f64; 2]>,
    has_noise: bool,
    on_request: Vec<&'static str>,
}

impl<M: RobotModel> ObservationLayout<M> {
    /// # Errors
    /// Names a block that the environment does not have.
    pub fn new(setup: &Setup) -> Result<Self, ConfigError> {
        let EnvConfig { observation_blocks, privileged, observation_noise, observation_delay, .. } = setup.config;
        let chosen = observation_blocks.as_deref();
        let [body, contact, sensing] = M::OBSERVATION;
        // Tables of rows, and whether an observation has them unless they are named.
        let of_task = chosen.is_none();
        let tables = [
            (body, of_task),
            (BlockRow::TASK, of_task),
            (contact, of_task),
            (BlockRow::ACTION_AND_PEGS, of_task),
            (sensing, false),
            (BlockRow::SENSING, false),
            (BlockRow::PRIVILEGED, *privileged),
        ];
        let rows = tables.into_iter().flat_map(|(rows, is_usual)| rows.iter().map(move |row| (row, is_usual)));
        let requested = setup.config.task.family().on_request;
        let is_usual = |row: &BlockRow<M>, is_usual: bool| is_usual || (of_task && requested.contains(&row.name));
        let rows = rows.map(|(row, of_table)| (row, is_usual(row, of_table)));
        let rows: Vec<_> = rows.filter(|(row, _)| (row.present)(setup)).collect();
        for (k, name) in chosen.unwrap_or_default().iter().enumerate() {
            require_known(&format!("observation_blocks[{k}]"), name, &rows)?;
        }
        for (name, amplitude) in observation_noise {
            require_known("observation_noise", name, &rows)?;
            non_negative(&format!("observation_noise.{name}"), *amplitude)?;
        }
        for (name, delay) in observation_delay {
            require_known("observation_delay", name, &rows)?;
            within(&format!("observation_delay.{name}"), *delay, 0.0, MOST_PERIODS * setup.config.control_period)?;
        }
        let is_chosen = |(row, is_usual): &(&BlockRow<M>, bool)| {
            *is_usual || chosen.is_some_and(|names| names.iter().any(|name| name == row.name))
        };
        let sensing = sensing.iter().chain(BlockRow::SENSING).filter(|row| (row.present)(setup));
        let on_request = sensing.map(|row| row.name).collect();
        let (mut blocks, mut size) = (Vec::new(), 0);
        for (row, _) in rows.into_iter().filter(is_chosen) {
            let elements = (row.elements)(setup);
            let start = size;
            size += elements.len();
            let of_block = |values: &BTreeMap<String, f64>| values.get(row.name).copied().unwrap_or(0.0);
            let noise = of_block(observation_noise);
            let delay = (of_block(observation_delay) / setup.config.control_period).round() as u32;
            blocks.push(ObservationBlock { row, start, elements, scale: (row.scale)(setup), noise, delay });
        }
        require(size > 0, "observation_blocks", "[]", "at least one block")?;
        let range = |block: &ObservationBlock<M>| vec![[block.scale, block.row.bound]; block.size()];
        let ranges = blocks.iter().flat_map(range).collect();
        Ok(Self { has_noise: blocks.iter().any(|block| block.noise > 0.0), blocks, ranges, on_request })
    }

    pub fn blocks(&self) -> &[ObservationBlock<M>] {
        &self.blocks
    }

    /// Names of the blocks that only `observation_blocks` adds.
    pub fn on_request(&self) -> &[&'static str] {
        &self.on_request
    }

    /// Number of elements.
    pub fn size(&self) -> usize {
        self.ranges.len()
    }

    /// Writes the observation; every element is finite and inside its bounds. `values` is room for as
    /// many unscaled values; noise is drawn from `rng` if there is any.
    pub fn write(&self, view: &View<M>, values: &mut [f64], observation: &mut [f32], rng: impl FnOnce() -> Rng) {
        let mut rng = self.has_noise.then(rng);
        for block in &self.blocks {
            let values = &mut values[block.start..block.start + block.size()];
            (block.row.read)(view, values);
            if let (Some(rng), true) = (&mut rng, block.noise > 0.0) {
                values.iter_mut().for_each(|value| *value += rng.around_zero(block.noise));
            }
        }
        for ((element, value), [scale, bound]) in observation.iter_mut().zip(values).zip(&self.ranges) {
            let scaled = *value / scale;
            *element = if scaled.is_nan() { 0.0 } else { scaled.clamp(-bound, *bound) as f32 };
        }
    }
}

/// The name is that of a row.
fn require_known<M>(field: &str, name: &str, rows: &[(&BlockRow<M>, bool)]) -> Result<(), ConfigError> {
    let known: Vec<_> = rows.iter().map(|(row, _)| row.name).collect();
    require(known.contains(&name), field, name, &format!("one of {}", known.join(", ")))
}

/// Most control periods by which a block may be late.
const MOST_PERIODS: f64 = 100.0;
