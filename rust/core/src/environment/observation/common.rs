//! The blocks that every robot model has.

use crate::environment::config::Perception;
use crate::environment::perception::PegSensor;
use crate::environment::robot_model::RobotModel;
use crate::environment::scenarios::GoalKind;

use super::{BlockRow, Element, Setup, View, each, even, named, odd};

impl<M: RobotModel> BlockRow<M> {
    /// Motion of the whole robot relative to its goal.
    pub(super) const TASK: &'static [Self] = &[
        BlockRow {
            name: "heading",
            description: "mean direction of the body relative to the goal direction",
            elements: |_| named(&[odd("sin"), even("cos")]),
            bound: 1.0,
            memory: true,
            read: |view, values| {
                let (sin, cos) = (view.sensors.motion.heading - view.bearing).sin_cos();
                values.copy_from_slice(&[sin, cos]);
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "velocity",
            unit: "m/s",
            description: "velocity of the centre of gravity along the goal direction and to its left",
            elements: |_| named(&[even("x"), odd("y")]),
            scale: |_| 0.4,
            memory: true,
            read: |view, values| {
                let (sin, cos) = view.bearing.sin_cos();
                let velocity = &view.sensors.motion.velocity;
                values.copy_from_slice(&[velocity.x * cos + velocity.y * sin, velocity.y * cos - velocity.x * sin]);
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "yaw_rate",
            unit: "rad/s",
            description: "mean angular velocity of the links",
            elements: |_| named(&[odd("yaw_rate")]),
            memory: true,
            read: |view, values| values[0] = view.sensors.motion.yaw_rate,
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "lateral_offset",
            unit: "m",
            description: "how far the CG is to the left of the corridor's centre line, or of the straight way from start to \
                          goal point",
            present: always,
            elements: |_| named(&[odd("y")]),
            scale: |setup| setup.config.corridor_half_width,
            bound: 1.5,
            memory: true,
            read: |view, values| values[0] = view.sensors.lateral_offset,
        },
        BlockRow {
            name: "goal",
            description: "distance left to the goal line, to the rim of the goal disc or along the path, relative to that at the \
                          start",
            present: |setup| setup.config.task.family().goal != GoalKind::Direction,
            elements: |_| named(&[even("remaining")]),
            bound: 1.5,
            memory: true,
            read: |view, values| values[0] = view.sensors.remaining,
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "command",
            unit: "m/s",
            description: "commanded speed of the centre of gravity along the goal direction",
            present: |setup| setup.config.task.family().goal == GoalKind::Direction,
            elements: |_| named(&[even("speed")]),
            scale: |_| 0.4,
            read: |view, values| values[0] = view.speed,
            ..BlockRow::DEFAULT
        },
    ];

    pub(super) const ACTION_AND_PEGS: &'static [Self] = &[
        BlockRow {
            name: "previous_action",
            description: "the last action, clipped; zero after a reset",
            elements: |setup| {
                let entries = setup.actions.iter();
                entries.map(|entry| Element { name: entry.name.clone(), parity: entry.parameter.parity() }).collect()
            },
            bound: 1.0,
            read: |view, values| values.copy_from_slice(view.previous_action),
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "pegs",
            unit: "m",
            description: "nearest pegs from the leading link's CG: centre forward and left, and sensing range minus \
                          the distance to the rim; all zero where fewer are in range; a wall appears as a peg without \
                          size at its nearest point",
            present: locates_pegs,
            elements: |setup| {
                let count = setup.peg_view.ahead.count();
                each(count, &[even("peg_#_forward"), odd("peg_#_left"), even("peg_#_proximity")])
            },
            scale: |setup| setup.peg_view.ahead.range(),
            bound: 1.5,
            memory: false,
            read: |view, values| write_located(&view.peg_view.ahead, values),
        },
        BlockRow {
            name: "link_pegs",
            unit: "m",
            description: "the nearest peg from each link's CG, likewise, within a quarter of the robot's length",
            present: |setup| locates_pegs(setup) && !setup.peg_view.along.is_empty(),
            elements: |setup| {
                let links = setup.peg_view.along.len();
                each(links, &[even("link_#_forward"), odd("link_#_left"), even("link_#_proximity")])
            },
            scale: |setup| setup.peg_view.along[0].range(),
            bound: 1.5,
            memory: false,
            read: |view, values| {
                for (sensor, values) in view.peg_view.along.iter().zip(values.chunks_exact_mut(3)) {
                    write_located(sensor, values);
                }
            },
        },
    ];
}

impl Setup<'_> {
    /// Number of links.
    pub fn links(&self) -> usize {
        self.robot.link_count()
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.robot.joint_count()
    }

    pub fn has_pegs(&self) -> bool {
        self.config.has_pegs()
    }
}

/// A block that every environment has.
pub fn always(_: &Setup) -> bool {
    true
}

fn locates_pegs(setup: &Setup) -> bool {
    setup.has_pegs() && setup.config.perception != Perception::Blind
}

pub fn joint_angle<M>(view: &View<M>, values: &mut [f64]) {
    values.copy_from_slice(&view.sensors.joint_angle);
}

pub fn joint_rate<M>(view: &View<M>, values: &mut [f64]) {
    values.copy_from_slice(&view.sensors.joint_rate);
}

/// Three values for each peg that the sensor locates at most.
pub(super) fn write_located(sensor: &PegSensor, values: &mut [f64]) {
    values.fill(0.0);
    for (values, peg) in values.chunks_exact_mut(3).zip(sensor.located()) {
        values.copy_from_slice(&[peg.forward, peg.left, sensor.range() - peg.distance]);
    }
}
