//! What programs outside of the core may read of a planar robot.

use crate::environment::quantity::{Quantity, write_rows};

use super::RobotModel;
use super::planar::PlanarRobot;

pub const STATE: &[Quantity<PlanarRobot>] = &[
    Quantity {
        name: "link_position",
        unit: "m",
        description: "CG of each link",
        shape: |robot| vec![robot.link_count(), 2],
        read: |environment, value| write_rows(value, environment.state().pose.iter().map(|q| [q.x, q.y])),
    },
    Quantity {
        name: "link_angle",
        unit: "rad",
        description: "absolute angle theta of each link; link 1 leads, so the body points backwards along it",
        shape: |robot| vec![robot.link_count()],
        read: |environment, value| write_rows(value, environment.state().pose.iter().map(|q| [q.z])),
    },
    Quantity {
        name: "link_velocity",
        unit: "m/s",
        description: "velocity of each link's CG",
        shape: |robot| vec![robot.link_count(), 2],
        read: |environment, value| write_rows(value, environment.state().twist.iter().map(|u| [u.x, u.y])),
    },
    Quantity {
        name: "link_angular_velocity",
        unit: "rad/s",
        description: "angular velocity of each link",
        shape: |robot| vec![robot.link_count()],
        read: |environment, value| write_rows(value, environment.state().twist.iter().map(|u| [u.z])),
    },
    Quantity {
        name: "joint_angle",
        unit: "rad",
        description: "angle of each joint; positive bends the body to the right, going forward",
        shape: |robot| vec![robot.joint_count()],
        read: |environment, value| {
            let state = environment.state();
            value.iter_mut().enumerate().for_each(|(joint, value)| *value = state.joint_angle(joint));
        },
    },
    Quantity {
        name: "joint_rate",
        unit: "rad/s",
        description: "angular velocity of each joint",
        shape: |robot| vec![robot.joint_count()],
        read: |environment, value| {
            let state = environment.state();
            value.iter_mut().enumerate().for_each(|(joint, value)| *value = state.joint_rate(joint));
        },
    },
    Quantity {
        name: "joint_torque",
        unit: "N m",
        description: "torque of each actuator in the last integration step, thesis sign",
        shape: |robot| vec![robot.joint_count()],
        read: |environment, value| value.copy_from_slice(environment.simulation().joint_torque()),
    },
    Quantity {
        name: "contact_force",
        unit: "N",
        description: "force of the obstacles on each link, averaged over the last control period",
        shape: |robot| vec![robot.link_count(), 2],
        read: |environment, value| write_rows(value, environment.model().contact_force().map(|f| [f.x, f.y])),
    },
    Quantity {
        name: "self_contact_force",
        unit: "N",
        description: "force of the robot's other links on each link, averaged over the last control period",
        shape: |robot| vec![robot.link_count(), 2],
        read: |environment, value| {
            write_rows(value, environment.model().self_contact_force().map(|f| [f.x, f.y]));
        },
    },
];
