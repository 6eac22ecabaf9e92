//! What programs outside of the core may read of a robot of the spatial model.

use crate::environment::Environment;
use crate::environment::quantity::{Quantity, write_rows};
use crate::robot::Robot;
use crate::spatial::{SpatialState, turning};

use super::RobotModel;
use super::spatial::SpatialRobot;

pub const STATE: &[Quantity<SpatialRobot>] = &[
    Quantity {
        name: "link_position",
        unit: "m",
        description: "CG of each link",
        shape: |robot| vec![robot.link_count(), 3],
        read: |environment, value| write_rows(value, state(environment).pose.iter().map(|q| q.position.into())),
    },
    Quantity {
        name: "link_quaternion",
        unit: "1",
        description: "orientation of each link, w first; its centre line is e_z^B and points to the next link",
        shape: |robot| vec![robot.link_count(), 4],
        read: |environment, value| {
            let orientations = state(environment).pose.iter().map(|q| q.orientation);
            write_rows(value, orientations.map(|p| [p.w, p.i, p.j, p.k]));
        },
    },
    Quantity {
        name: "link_velocity",
        unit: "m/s",
        description: "velocity of each link's CG",
        shape: |robot| vec![robot.link_count(), 3],
        read: |environment, value| write_rows(value, state(environment).twist.iter().map(|u| [u.x, u.y, u.z])),
    },
    Quantity {
        name: "link_angular_velocity",
        unit: "rad/s",
        description: "angular velocity of each link in the world frame",
        shape: |robot| vec![robot.link_count(), 3],
        read: |environment, value| {
            let links = state(environment).pose.iter().zip(&state(environment).twist);
            write_rows(value, links.map(|(q, u)| (q.orientation * turning(u)).into()));
        },
    },
    Quantity {
        name: "joint_angle",
        unit: "rad",
        description: "yaw and pitch of each joint, or its angles about the `axes` of the robot",
        shape: Robot::joint_shape,
        read: |environment, value| {
            write_axes(environment, value, environment.model().joint_angles());
        },
    },
    Quantity {
        name: "joint_rate",
        unit: "rad/s",
        description: "angular velocities of each joint",
        shape: Robot::joint_shape,
        read: |environment, value| {
            write_axes(environment, value, environment.model().joint_rates());
        },
    },
    Quantity {
        name: "joint_torque",
        unit: "N m",
        description: "torques of each actuator about these axes in the last integration step, thesis sign",
        shape: Robot::joint_shape,
        read: |environment, value| {
            let torques = environment.model().simulation.joint_torque();
            write_axes(environment, value, torques.iter().map(|torque| (*torque).into()));
        },
    },
    Quantity {
        name: "contact_force",
        unit: "N",
        description: "force of the obstacles on each link, averaged over the last control period",
        shape: |robot| vec![robot.link_count(), 3],
        read: |environment, value| write_rows(value, environment.model().contact_force().map(Into::into)),
    },
    Quantity {
        name: "self_contact_force",
        unit: "N",
        description: "force of the robot's other links on each link, averaged over the last control period",
        shape: |robot| vec![robot.link_count(), 3],
        read: |environment, value| {
            write_rows(value, environment.model().self_contact_force().map(Into::into));
        },
    },
    Quantity {
        name: "normal_force",
        unit: "N",
        description: "normal force of the ground on each link, averaged over the last control period",
        shape: |robot| vec![robot.link_count()],
        read: |environment, value| {
            value.iter_mut().zip(environment.model().normal_force()).for_each(|(value, force)| *value = force);
        },
    },
];

fn write_axes(environment: &Environment<SpatialRobot>, value: &mut [f64], joints: impl Iterator<Item = [f64; 2]>) {
    value.iter_mut().zip(environment.robot().of_axes(joints)).for_each(|(value, of_axis)| *value = of_axis);
}

fn state(environment: &Environment<SpatialRobot>) -> &SpatialState {
    environment.model().simulation.state()
}
