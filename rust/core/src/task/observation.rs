//! What a policy senses: named blocks with fixed scaling.
//!
//! Each element of the observation is `clamp(value / scale, low, high)`; the scales are chosen so that
//! a robot in motion keeps most of them in [-1, 1]. A block is one row in [`ObservationLayout::new`]
//! and the function named there that reads its values.

use std::f64::consts::FRAC_PI_2;

use super::action::ActionEntry;
use super::config::{ActionMode, EnvConfig, Perception, Task};
use super::perception::PegSensor;
use super::reference::ReferenceGenerator;
use super::senses::Senses;

/// Everything that may be sensed at a control instant.
pub struct View<'a> {
    pub senses: &'a Senses,
    /// Angle from +x to the goal direction \[rad\].
    pub bearing: f64,
    /// Mean obstacle force on each link over the last control period, to the link's left \[N\].
    pub contact_force: &'a [f64],
    pub reference: &'a ReferenceGenerator,
    pub previous_action: &'a [f64],
    pub sensor: &'a PegSensor,
}

/// A run of elements of one kind.
#[derive(Debug, Clone)]
pub struct ObservationBlock {
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
    read: fn(&View, &mut [f64]),
}

impl ObservationBlock {
    pub fn size(&self) -> usize {
        self.elements.len()
    }
}

/// The blocks of an environment's observation, in order.
#[derive(Debug, Clone)]
pub struct ObservationLayout {
    blocks: Vec<ObservationBlock>,
    size: usize,
}

impl ObservationLayout {
    /// The layout for `links` links and a corridor and sensor as given; blocks that the task or the
    /// action mode leaves constant are absent.
    pub fn new(config: &EnvConfig, links: usize, sensor: &PegSensor, action: &[ActionEntry]) -> Self {
        let joints = links - 1;
        let mut blocks = vec![
            block("joint_angle", numbered("joint", joints), "rad", FRAC_PI_2, 2.0, joint_angle)
                .says("angle of each joint; positive bends the body to the right, going forward"),
            block("joint_rate", numbered("joint", joints), "rad/s", 2.5, 4.0, joint_rate)
                .says("angular velocity of each joint"),
            block("heading", named(&["sin", "cos"]), "1", 1.0, 1.0, heading)
                .says("mean direction of the body relative to the goal direction"),
            block("velocity", named(&["x", "y"]), "m/s", 0.4, 4.0, velocity)
                .says("velocity of the centre of gravity along the goal direction and to its left"),
            block("yaw_rate", named(&["yaw_rate"]), "rad/s", 1.0, 4.0, yaw_rate)
                .says("mean angular velocity of the links"),
            block("lateral_offset", named(&["y"]), "m", config.corridor_half_width, 1.5, lateral_offset)
                .says("position of the centre of gravity to the left of the corridor's centre line, or of the straight way from \
                     the start to the goal point"),
            block("goal", named(&["remaining"]), "1", 1.0, 1.5, goal)
                .says("distance left to the goal line or the rim of the goal disc, relative to that at the start"),
        ];
        if config.task != Task::Free {
            blocks.push(
                block("contact_force", numbered("link", links), "N", 20.0, 4.0, contact_force)
                    .says("force of the pegs to the left of each link, averaged over the control period"),
            );
        }
        if config.action_mode == ActionMode::Joints {
            blocks.push(
                block("reference", numbered("joint", joints), "rad", FRAC_PI_2, 1.0, reference)
                    .says("smoothed reference angle of each joint"),
            );
        } else {
            let names = ["sin_phase", "cos_phase", "amplitude", "frequency", "phase_shift", "offset"];
            blocks.push(
                block("wave", named(&names), "1", 1.0, 1.0, wave)
                    .says("phase of the wave, and its smoothed parameters as actions that would hold them"),
            );
        }
        let actions = action.iter().map(|entry| entry.name.clone()).collect();
        blocks.push(
            block("previous_action", actions, "1", 1.0, 1.0, previous_action)
                .says("the last action, clipped; zero after a reset"),
        );
        if config.task != Task::Free && config.perception == Perception::Pegs {
            blocks.push(block("pegs", peg_elements(sensor.count()), "m", sensor.range(), 1.5, pegs).says(
                "nearest pegs from the leading link's CG: centre forward and left, and sensing range minus the \
                 distance to the rim; all zero where fewer pegs are in range",
            ));
        }
        let mut start = 0;
        for block in &mut blocks {
            block.start = start;
            start += block.size();
        }
        Self { blocks, size: start }
    }

    pub fn blocks(&self) -> &[ObservationBlock] {
        &self.blocks
    }

    /// Number of elements.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Writes the observation; every element is finite and inside its bounds. `values` is room for as
    /// many unscaled values.
    pub fn write(&self, view: &View, values: &mut [f64], observation: &mut [f32]) {
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

/// A block with symmetric bounds `[-bound, bound]`.
fn block(
    name: &'static str,
    elements: Vec<String>,
    unit: &'static str,
    scale: f64,
    bound: f64,
    read: fn(&View, &mut [f64]),
) -> ObservationBlock {
    ObservationBlock { name, start: 0, elements, unit, scale, low: -bound, high: bound, description: "", read }
}

impl ObservationBlock {
    fn says(mut self, description: &'static str) -> Self {
        self.description = description;
        self
    }
}

fn named(names: &[&str]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

fn numbered(name: &str, count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("{name}_{i}")).collect()
}

fn peg_elements(count: usize) -> Vec<String> {
    let quantities = ["forward", "left", "proximity"];
    (1..=count).flat_map(|peg| quantities.map(|quantity| format!("peg_{peg}_{quantity}"))).collect()
}

fn joint_angle(view: &View, values: &mut [f64]) {
    values.copy_from_slice(&view.senses.joint_angle);
}

fn joint_rate(view: &View, values: &mut [f64]) {
    values.copy_from_slice(&view.senses.joint_rate);
}

fn heading(view: &View, values: &mut [f64]) {
    values.copy_from_slice(&<[f64; 2]>::from((view.senses.motion.heading - view.bearing).sin_cos()));
}

fn velocity(view: &View, values: &mut [f64]) {
    let (sin, cos) = view.bearing.sin_cos();
    let velocity = &view.senses.motion.velocity;
    values.copy_from_slice(&[velocity.x * cos + velocity.y * sin, velocity.y * cos - velocity.x * sin]);
}

fn yaw_rate(view: &View, values: &mut [f64]) {
    values[0] = view.senses.motion.yaw_rate;
}

fn lateral_offset(view: &View, values: &mut [f64]) {
    values[0] = view.senses.lateral_offset;
}

fn goal(view: &View, values: &mut [f64]) {
    values[0] = view.senses.remaining;
}

fn contact_force(view: &View, values: &mut [f64]) {
    values.copy_from_slice(view.contact_force);
}

fn reference(view: &View, values: &mut [f64]) {
    values.iter_mut().enumerate().for_each(|(joint, value)| *value = view.reference.angle(joint));
}

fn wave(view: &View, values: &mut [f64]) {
    let (sin, cos) = view.reference.phase().sin_cos();
    (values[0], values[1]) = (sin, cos);
    let entries = view.reference.entries();
    for ((value, entry), parameter) in values[2..].iter_mut().zip(entries).zip(view.reference.wave()) {
        *value = entry.normalised(parameter);
    }
}

fn previous_action(view: &View, values: &mut [f64]) {
    values.copy_from_slice(view.previous_action);
}

fn pegs(view: &View, values: &mut [f64]) {
    values.fill(0.0);
    for (values, peg) in values.chunks_exact_mut(3).zip(view.sensor.located()) {
        values.copy_from_slice(&[peg.forward, peg.left, view.sensor.range() - peg.distance]);
    }
}
