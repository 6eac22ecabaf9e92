//! What a policy sensors: named blocks with fixed scaling.
//!
//! Each element of the observation is `clamp(value / scale, low, high)`; the scales are chosen so that
//! a robot in motion keeps most of them in [-1, 1]. A block is one row here or in a model's
//! [`RobotModel::observation_blocks`], and the function named there that reads its values.

use super::config::{EnvConfig, Perception, Task};
use super::perception::{PegSensor, PegView};
use super::robot_model::RobotModel;
use super::sensors::Sensors;

/// Everything that may be sensed at a control instant.
pub struct View<'a, M> {
    pub model: &'a M,
    pub sensors: &'a Sensors,
    /// Angle from +x to the goal direction \[rad\].
    pub bearing: f64,
    pub previous_action: &'a [f64],
    pub peg_view: &'a PegView,
}

/// A run of elements of one kind.
#[derive(Debug)]
pub struct ObservationBlock<M> {
    pub name: &'static str,
    /// Index of the first element.
    pub start: usize,
    /// One name for each element.
    pub elements: Vec<String>,
    /// Unit of the values before scaling.
    pub unit: &'static str,
    /// Value that is scaled to one.
    pub scale: f64,
    /// Bounds after scaling.
    pub low: f64,
    pub high: f64,
    pub description: &'static str,
    read: fn(&View<M>, &mut [f64]),
}

impl<M> ObservationBlock<M> {
    pub fn size(&self) -> usize {
        self.elements.len()
    }
}

/// The blocks of an environment's observation, in order.
#[derive(Debug)]
pub struct ObservationLayout<M> {
    blocks: Vec<ObservationBlock<M>>,
    size: usize,
}

impl<M: RobotModel> ObservationLayout<M> {
    /// The layout for a model, a corridor and a peg_view as given; blocks that the task or the action mode leaves
    /// constant are absent.
    pub fn new(config: &EnvConfig, model: &M, peg_view: &PegView) -> Self {
        let [mut blocks, more] = model.observation_blocks(config);
        blocks.extend(task_blocks(config));
        blocks.extend(more);
        let actions = model.action_entries().iter().map(|entry| entry.name.clone()).collect();
        blocks.push(
            block("previous_action", actions, "1", 1.0, 1.0, previous_action)
                .says("the last action, clipped; zero after a reset"),
        );
        if config.task != Task::Free && config.perception != Perception::Blind {
            let elements = peg_elements("peg", peg_view.ahead.count());
            blocks.push(block("pegs", elements, "m", peg_view.ahead.range(), 1.5, pegs).says(
                "nearest pegs from the leading link's CG: centre forward and left, and sensing range minus the \
                 distance to the rim; all zero where fewer pegs are in range",
            ));
            if let Some(first) = peg_view.along.first() {
                let elements = peg_elements("link", peg_view.along.len());
                blocks.push(
                    block("link_pegs", elements, "m", first.range(), 1.5, link_pegs)
                        .says("the nearest peg from each link's CG, likewise, within a quarter of the robot's length"),
                );
            }
        }
        let mut start = 0;
        for block in &mut blocks {
            block.start = start;
            start += block.size();
        }
        Self { blocks, size: start }
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
            (block.read)(view, values);
            for (element, value) in observation[range].iter_mut().zip(values) {
                let scaled = (*value / block.scale).clamp(block.low, block.high);
                *element = if scaled.is_finite() { scaled as f32 } else { 0.0 };
            }
        }
    }
}

/// What every robot sensors of its task.
fn task_blocks<M>(config: &EnvConfig) -> [ObservationBlock<M>; 5] {
    [
        block("heading", named(&["sin", "cos"]), "1", 1.0, 1.0, heading)
            .says("mean direction of the body relative to the goal direction"),
        block("velocity", named(&["x", "y"]), "m/s", 0.4, 4.0, velocity)
            .says("velocity of the centre of gravity along the goal direction and to its left"),
        block("yaw_rate", named(&["yaw_rate"]), "rad/s", 1.0, 4.0, yaw_rate).says("mean angular velocity of the links"),
        block("lateral_offset", named(&["y"]), "m", config.corridor_half_width, 1.5, lateral_offset).says(
            "position of the centre of gravity to the left of the corridor's centre line, or of the straight way from \
             the start to the goal point",
        ),
        block("goal", named(&["remaining"]), "1", 1.0, 1.5, goal)
            .says("distance left to the goal line or the rim of the goal disc, relative to that at the start"),
    ]
}

/// A block with symmetric bounds `[-bound, bound]`.
pub(super) fn block<M>(
    name: &'static str,
    elements: Vec<String>,
    unit: &'static str,
    scale: f64,
    bound: f64,
    read: fn(&View<M>, &mut [f64]),
) -> ObservationBlock<M> {
    ObservationBlock { name, start: 0, elements, unit, scale, low: -bound, high: bound, description: "", read }
}

impl<M> ObservationBlock<M> {
    pub(super) fn says(mut self, description: &'static str) -> Self {
        self.description = description;
        self
    }
}

pub(super) fn named(names: &[&str]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

pub(super) fn numbered(name: &str, count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("{name}_{i}")).collect()
}

fn peg_elements(name: &str, count: usize) -> Vec<String> {
    let quantities = ["forward", "left", "proximity"];
    (1..=count).flat_map(|k| quantities.map(|quantity| format!("{name}_{k}_{quantity}"))).collect()
}

pub(super) fn joint_angle<M>(view: &View<M>, values: &mut [f64]) {
    values.copy_from_slice(&view.sensors.joint_angle);
}

pub(super) fn joint_rate<M>(view: &View<M>, values: &mut [f64]) {
    values.copy_from_slice(&view.sensors.joint_rate);
}

fn heading<M>(view: &View<M>, values: &mut [f64]) {
    values.copy_from_slice(&<[f64; 2]>::from((view.sensors.motion.heading - view.bearing).sin_cos()));
}

fn velocity<M>(view: &View<M>, values: &mut [f64]) {
    let (sin, cos) = view.bearing.sin_cos();
    let velocity = &view.sensors.motion.velocity;
    values.copy_from_slice(&[velocity.x * cos + velocity.y * sin, velocity.y * cos - velocity.x * sin]);
}

fn yaw_rate<M>(view: &View<M>, values: &mut [f64]) {
    values[0] = view.sensors.motion.yaw_rate;
}

fn lateral_offset<M>(view: &View<M>, values: &mut [f64]) {
    values[0] = view.sensors.lateral_offset;
}

fn goal<M>(view: &View<M>, values: &mut [f64]) {
    values[0] = view.sensors.remaining;
}

fn previous_action<M>(view: &View<M>, values: &mut [f64]) {
    values.copy_from_slice(view.previous_action);
}

fn pegs<M>(view: &View<M>, values: &mut [f64]) {
    locate(&view.peg_view.ahead, values);
}

fn link_pegs<M>(view: &View<M>, values: &mut [f64]) {
    for (sensor, values) in view.peg_view.along.iter().zip(values.chunks_exact_mut(3)) {
        locate(sensor, values);
    }
}

/// Three values for each peg that the sensor locates at most.
fn locate(sensor: &PegSensor, values: &mut [f64]) {
    values.fill(0.0);
    for (values, peg) in values.chunks_exact_mut(3).zip(sensor.located()) {
        values.copy_from_slice(&[peg.forward, peg.left, sensor.range() - peg.distance]);
    }
}
