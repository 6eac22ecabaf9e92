//! What a robot of the spatial model observes of itself and its contacts.

use std::f64::consts::{FRAC_PI_2, SQRT_2};

use nalgebra::{Rotation2, Vector2, Vector3};

use crate::environment::action::YAW;
use crate::environment::observation::{
    ACCELEROMETER, BlockRow, Element, MOTOR_TORQUE, Setup, View, always, each, even, joint_angle, joint_rate,
    motor_scale, named, odd,
};
use crate::environment::symmetry::Parity;
use crate::spatial::turning;

use super::RobotModel;
use super::spatial::SpatialRobot;

pub const BODY: &[BlockRow<SpatialRobot>] = &[
    BlockRow {
        name: "joint_angle",
        unit: "rad",
        description: "yaw and pitch of each joint, or its angles about the `axes` of the robot; going forward, a positive yaw bends the body to the right, a \
                      positive pitch lowers the link behind",
        present: always,
        elements: each_axis,
        scale: |_| FRAC_PI_2,
        bound: 2.0,
        memory: true,
        read: joint_angle,
    },
    BlockRow {
        name: "joint_rate",
        unit: "rad/s",
        description: "angular velocities of each joint",
        elements: each_axis,
        scale: |_| 2.5,
        read: joint_rate,
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "height",
        unit: "m",
        description: "height of each link's CG above that of a link that lies on the ground below it",
        elements: |setup| each(setup.links(), &[even("link_#")]),
        scale: |setup| 2.0 * setup.robot.links.iter().map(|link| link.radius).fold(0.0, f64::max),
        bound: 8.0,
        read: |view, values| {
            let links = view.model.simulation.robot().links.iter().zip(&view.model.simulation.state().pose);
            let obstacles = &view.model.simulation.body().obstacles;
            values.iter_mut().zip(links).for_each(|(value, (link, pose))| {
                *value = pose.position.z - link.radius - obstacles.ground_height(&pose.position.xy());
            });
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "attitude",
        description: "mean turn of the links about their axes, positive where the left side comes up, and angle by \
                      which the body direction points up",
        elements: |_| named(&[odd("sin_roll"), even("cos_roll"), even("pitch")]),
        bound: FRAC_PI_2,
        read: |view, values| {
            let attitude = view.model.attitude();
            (values[0], values[1]) = attitude.roll.sin_cos();
            values[2] = attitude.pitch;
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "gravity",
        description: "direction of gravity in the frame of link 1, or of `imu_link`, opposite to what an accelerometer at rest reads",
        elements: |_| named(&[even("forward"), odd("left"), even("up")]),
        bound: SQRT_2,
        read: |view, values| {
            let simulation = &view.model.simulation;
            let direction = simulation.system().gravity / simulation.robot().gravity;
            let seen = simulation.state().pose[view.model.imu_link].orientation.inverse_transform_vector(&direction);
            values.copy_from_slice(&forward_left_up(&seen));
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "gyro",
        unit: "rad/s",
        description: "angular velocity of link 1, or of `imu_link`, about its own axes",
        // Angular velocities are axial: only that about the axis to the left survives the reflection.
        elements: |_| named(&[odd("forward"), even("left"), odd("up")]),
        scale: |_| 2.5,
        read: |view, values| {
            values
                .copy_from_slice(&forward_left_up(&turning(&view.model.simulation.state().twist[view.model.imu_link])));
        },
        ..BlockRow::DEFAULT
    },
];

pub const CONTACT_AND_REFERENCE: &[BlockRow<SpatialRobot>] = &[
    BlockRow {
        name: "normal_force",
        unit: "N",
        description: "normal force of the ground or a top face on each link, averaged over the control period",
        elements: |setup| each(setup.links(), &[even("link_#")]),
        scale: |setup| {
            let weight = setup.robot.total_mass() * setup.robot.gravity / setup.links() as f64;
            4.0 * weight
        },
        read: |view, values| {
            values.iter_mut().zip(view.model.force_from_below()).for_each(|(value, force)| *value = force);
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "contact_force",
        unit: "N",
        description: "force of the pegs on each link, forward and to its left seen from above, averaged over the \
                      control period",
        present: |setup| setup.has_pegs(),
        elements: |setup| each(setup.links(), &[even("link_#_forward"), odd("link_#_left")]),
        scale: |_| 20.0,
        bound: 4.0,
        memory: true,
        read: contact_force,
    },
    BlockRow {
        name: "reference",
        unit: "rad",
        description: "smoothed reference angles of each joint",
        present: |setup| setup.config.action_mode.has_references(),
        elements: each_axis,
        scale: |_| FRAC_PI_2,
        bound: 1.0,
        memory: false,
        read: |view, values| view.model.reference.angles(view.model.robot().axis_list(), values),
    },
    BlockRow {
        name: "wave",
        description: "phase of the waves, and their smoothed parameters as actions that would hold them",
        present: |setup| setup.config.action_mode.has_wave(),
        elements: |_| {
            let horizontal = [even("amplitude"), even("frequency"), even("phase_shift"), odd("offset")];
            let vertical = [odd("lift"), even("lift_phase")];
            named(&[[odd("sin_phase"), odd("cos_phase")].as_slice(), &horizontal, &vertical].concat())
        },
        bound: 1.0,
        read: |view, values| view.model.reference.describe_wave(values),
        ..BlockRow::DEFAULT
    },
];

pub const SENSING: &[BlockRow<SpatialRobot>] = &[
    BlockRow {
        name: "ground",
        unit: "m",
        description: "height of the ground at 20 places around the robot, over that below its CG. They lie 0.4, 0.2, 0, -0.2 \
                      and -0.4 of its length ahead in the body direction, and 0.1 and 0.3 to the right; then in \
                      reverse the same to the left",
        elements: |_| each(GROUND_PLACES, &[("height_#", Parity::Swapped)]),
        scale: |setup| 2.0 * setup.robot.links.iter().map(|link| link.radius).fold(0.0, f64::max),
        bound: 8.0,
        read: |view, values| {
            let obstacles = &view.model.simulation.body().obstacles;
            let (motion, length) = (view.model.motion(), view.model.robot().total_length());
            let height = |ahead: f64, left: f64| {
                let arm = Rotation2::new(motion.heading) * Vector2::new(ahead, left);
                obstacles.ground_height(&(motion.position + arm * length))
            };
            let below = height(0.0, 0.0);
            for k in 0..GROUND_PLACES / 2 {
                let (ahead, aside) = (0.4 - 0.2 * (k / 2) as f64, 0.1 + 0.2 * (k % 2) as f64);
                values[k] = height(ahead, -aside) - below;
                values[GROUND_PLACES - 1 - k] = height(ahead, aside) - below;
            }
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "ground_touch",
        description: "1 for each link that the ground or a top face carried in the control period, else 0",
        elements: |setup| each(setup.links(), &[even("link_#")]),
        bound: 1.0,
        memory: true,
        read: |view, values| {
            let links = values.iter_mut().zip(view.model.force_from_below());
            links.for_each(|(value, force)| *value = f64::from(u8::from(force > 0.0)));
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "accelerometer",
        unit: "m/s^2",
        description: ACCELEROMETER,
        elements: |_| named(&[even("forward"), odd("left"), even("up")]),
        scale: |_| 9.81,
        read: |view, values| {
            let orientation = &view.model.simulation.state().pose[view.model.imu_link].orientation;
            let force = orientation.inverse_transform_vector(&view.model.specific_force());
            values.copy_from_slice(&forward_left_up(&force));
        },
        ..BlockRow::DEFAULT
    },
    BlockRow {
        name: "motor_torque",
        unit: "N m",
        description: MOTOR_TORQUE,
        elements: each_axis,
        scale: motor_scale,
        bound: 2.0,
        read: |view, values| {
            let torques = view.model.simulation.joint_torque().iter().map(|torque| (-torque).into());
            values.iter_mut().zip(view.model.robot().of_axes(torques)).for_each(|(value, torque)| *value = torque);
        },
        ..BlockRow::DEFAULT
    },
];

/// An element for each axis of the joints. In a reflection angles about axes that are not across the robot change their
/// signs; a robot with oblique ones has no mirror image among its own motions.
fn each_axis(setup: &Setup) -> Vec<Element> {
    let axes = setup.robot.axis_list().map(|(joint, axis)| {
        let name = format!("{}_{}", setup.robot.axes[joint].name(axis), joint + 1);
        Element { name, parity: if axis == YAW { Parity::Odd } else { Parity::Even } }
    });
    axes.collect()
}

/// A vector of frame B as (forward, left, up): -e_z^B, -e_x^B and, of an unrolled link, e_y^B.
fn forward_left_up(vector: &Vector3<f64>) -> [f64; 3] {
    [-vector.z, -vector.x, vector.y]
}

fn contact_force(view: &View<SpatialRobot>, values: &mut [f64]) {
    let links = view.model.contact_force().zip(&view.model.simulation.state().pose);
    for (values, (force, pose)) in values.chunks_exact_mut(2).zip(links) {
        let axis = pose.axis();
        let ahead = (-axis.xy()).try_normalize(0.0).unwrap_or_else(Vector2::x);
        values.copy_from_slice(&[ahead.dot(&force.xy()), ahead.perp(&force.xy())]);
    }
}

/// Places where the ground is sampled.
const GROUND_PLACES: usize = 20;
