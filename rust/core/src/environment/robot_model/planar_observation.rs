//! What a planar robot observes of itself and its contacts.

use std::f64::consts::FRAC_PI_2;

use crate::environment::action::YAW;
use crate::environment::observation::{
    ACCELEROMETER, BlockRow, MOTOR_TORQUE, always, each, even, joint_angle, joint_rate, motor_scale, named, odd,
};

use crate::planar::Heading;

use super::planar::PlanarRobot;

pub const BODY: &[BlockRow<PlanarRobot>] = &[
    BlockRow {
        name: "joint_angle",
        unit: "rad",
        description: "angle of each joint; positive bends the body to the right, going forward",
        present: always,
        elements: |setup| each(setup.joints(), &[odd("joint_#")]),
        scale: |_| FRAC_PI_2,
        bound: 2.0,
        memory: true,
        read: joint_angle,
    },
    BlockRow {
        name: "joint_rate",
        unit: "rad/s",
        description: "angular velocity of each joint",
        elements: |setup| each(setup.joints(), &[odd("joint_#")]),
        scale: |_| 2.5,
        read: joint_rate,
        ..BlockRow::DEFAULT
    },
];

pub const CONTACT_AND_REFERENCE: &[BlockRow<PlanarRobot>] = &[
    BlockRow {
        name: "contact_force",
        unit: "N",
        description: "force of the pegs to the left of each link, averaged over the control period",
        present: |setup| setup.has_pegs(),
        elements: |setup| each(setup.links(), &[odd("link_#")]),
        scale: |_| 20.0,
        bound: 4.0,
        memory: true,
        read: |view, values| {
            values.iter_mut().zip(view.model.lateral_force()).for_each(|(value, force)| *value = force);
        },
    },
    BlockRow {
        name: "reference",
        unit: "rad",
        description: "smoothed reference angle of each joint",
        present: |setup| setup.config.action_mode.has_references(),
        elements: |setup| each(setup.joints(), &[odd("joint_#")]),
        scale: |_| FRAC_PI_2,
        bound: 1.0,
        memory: false,
        read: |view, values| {
            view.model.reference.angles((0..values.len()).map(|joint| (joint, YAW)), values);
        },
    },
    BlockRow {
        name: "wave",
        description: "phase of the wave, and its smoothed parameters as actions that would hold them",
        present: |setup| setup.config.action_mode.has_wave(),
        elements: |_| {
            let parameters = [even("amplitude"), even("frequency"), even("phase_shift"), odd("offset")];
            named(&[[odd("sin_phase"), odd("cos_phase")].as_slice(), &parameters].concat())
        },
        bound: 1.0,
        read: |view, values| view.model.reference.describe_wave(values),
        ..BlockRow::DEFAULT
    },
];

pub const SENSING: &[BlockRow<PlanarRobot>] = &[
    BlockRow {
        name: "accelerometer",
        unit: "m/s^2",
        description: ACCELEROMETER,
        elements: |_| named(&[even("forward"), odd("left")]),
        scale: |_| 9.81,
        read: |view, values| {
            let force = Heading::of(view.model.simulation.state().pose[view.model.imu_link].z)
                .to_link(view.model.specific_force());
            values.copy_from_slice(&[-force.x, -force.y]);
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "gyro",
        unit: "rad/s",
        description: "angular velocity of link 1, or of `imu_link`",
        elements: |_| named(&[odd("up")]),
        scale: |_| 2.5,
        read: |view, values| values[0] = view.model.simulation.state().twist[view.model.imu_link].z,
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "motor_torque",
        unit: "N m",
        description: MOTOR_TORQUE,
        elements: |setup| each(setup.joints(), &[odd("joint_#")]),
        scale: motor_scale,
        bound: 2.0,
        read: |view, values| {
            let torques = values.iter_mut().zip(view.model.simulation.joint_torque());
            torques.for_each(|(value, torque)| *value = -torque);
        },
        ..BlockRow::DEFAULT
    },
];
