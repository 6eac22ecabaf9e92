//! What a robot cannot sense, exactly and at once: for critics that see more than the policy.

use crate::environment::robot_model::RobotModel;

use super::common::write_located;
use super::{BlockRow, each, even, named, odd};

impl<M: RobotModel> BlockRow<M> {
    pub(super) const PRIVILEGED: &'static [Self] = &[
        BlockRow {
            name: "privileged_friction",
            description: "coefficients of friction along and across a link, as drawn for the episode",
            elements: |_| named(&[even("along"), even("across")]),
            scale: |_| 0.5,
            read: |view, values| {
                let factor = view.model.simulation().body().parameters.friction;
                values.copy_from_slice(&[view.friction[0] * factor.x, view.friction[1] * factor.y]);
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "privileged_robot",
            description: "what the episode has drawn about the robot: factors on the mass and on the largest torque, minus \
                          1, and the backlash and Stribeck drop in addition to the configured ones",
            elements: |_| named(&[even("mass"), even("torque_limit"), even("backlash"), even("stribeck")]),
            bound: 10.0,
            read: |view, values| {
                let drawn = &view.model.simulation().body().parameters;
                values.copy_from_slice(&[drawn.mass - 1.0, drawn.torque_limit - 1.0, drawn.backlash, drawn.stribeck]);
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "privileged_motion",
            unit: "m/s",
            description: "true velocity of the centre of gravity along the goal direction and to its left",
            elements: |_| named(&[even("x"), odd("y")]),
            scale: |_| 0.4,
            read: |view, values| {
                let (sin, cos) = view.bearing.sin_cos();
                let velocity = view.model.motion().velocity;
                values.copy_from_slice(&[velocity.x * cos + velocity.y * sin, velocity.y * cos - velocity.x * sin]);
            },
            ..BlockRow::DEFAULT
        },
        BlockRow {
            name: "privileged_contact_force",
            unit: "N",
            description: "force of the pegs on each link, forward and to its left seen from above, averaged over the \
                          control period",
            present: |setup| setup.has_pegs(),
            elements: |setup| each(setup.links(), &[even("link_#_forward"), odd("link_#_left")]),
            scale: |_| 20.0,
            bound: 16.0,
            memory: false,
            read: |view, values| {
                for (i, (values, force)) in values.chunks_exact_mut(2).zip(view.model.contact_force()).enumerate() {
                    // Link 1 leads: forward is against the axis of the link, and the left is a quarter turn on.
                    let (sin, cos) = view.model.link(i).angle.sin_cos();
                    values.copy_from_slice(&[-(cos * force.x + sin * force.y), sin * force.x - cos * force.y]);
                }
            },
        },
        BlockRow {
            name: "privileged_pegs",
            unit: "m",
            description: "nearest pegs from the leading link's CG, as `pegs` has them, without error and whatever the \
                          perception",
            present: |setup| setup.has_pegs(),
            elements: |setup| {
                let count = setup.config.nearest_pegs;
                each(count, &[even("peg_#_forward"), odd("peg_#_left"), even("peg_#_proximity")])
            },
            scale: |setup| setup.robot.total_length(),
            bound: 1.5,
            memory: false,
            read: |view, values| write_located(&view.true_pegs.ahead, values),
        },
    ];
}
