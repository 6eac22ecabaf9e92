//! Quantities of the state, as arrays that a program outside of the core may read.
//!
//! A quantity is one row of [`Quantity::COMMON`] or of [`RobotModel::STATE`]. The public state of the Python
//! environments and its documentation follow from the rows. Nothing here is read by a step.

use crate::robot::Robot;

use super::env::Environment;
use super::reward::TERM_COUNT;
use super::robot_model::RobotModel;

/// A number, vector or table that belongs to one robot at a control instant.
#[derive(Debug)]
pub struct Quantity<M: 'static> {
    pub name: &'static str,
    pub unit: &'static str,
    pub description: &'static str,
    /// Lengths of its axes; none for a number.
    pub shape: fn(&Robot) -> Vec<usize>,
    /// Writes the values, last axis fastest.
    pub read: fn(&Environment<M>, &mut [f64]),
}

/// All quantities of environments with a robot model, in order.
pub fn quantities_of<M: RobotModel>() -> impl Iterator<Item = &'static Quantity<M>> {
    Quantity::COMMON.iter().chain(M::STATE)
}

impl<M: RobotModel> Quantity<M> {
    /// Those of every robot model.
    const COMMON: &'static [Self] = &[
        Self {
            name: "time",
            unit: "s",
            description: "time since the start of the episode",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.summary().time,
        },
        Self {
            name: "position",
            unit: "m",
            description: "centre of gravity of the robot, seen from above",
            shape: |_| vec![2],
            read: |environment, value| value.copy_from_slice(environment.model().motion().position.as_slice()),
        },
        Self {
            name: "velocity",
            unit: "m/s",
            description: "velocity of the centre of gravity, seen from above",
            shape: |_| vec![2],
            read: |environment, value| value.copy_from_slice(environment.model().motion().velocity.as_slice()),
        },
        Self {
            name: "heading",
            unit: "rad",
            description: "angle from +x to the mean direction of the body, in [-pi, pi]",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.model().motion().heading,
        },
        Self {
            name: "energy",
            unit: "J",
            description: "kinetic and potential energy, the latter zero with every CG at the height of the origin",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.model().energy(),
        },
        Self {
            name: "distance",
            unit: "m",
            description: "distance of the centre of gravity towards the goal, gained since the start",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.summary().distance,
        },
        Self {
            name: "reward_terms",
            unit: "see the rewards",
            description: "value of each built-in reward term in the last step, without its weight",
            shape: |_| vec![TERM_COUNT],
            read: |environment, value| value.copy_from_slice(&environment.summary().term_values),
        },
        Self {
            name: "goal",
            unit: "m",
            description: "centre of the goal disc, end of the path, or the point where the corridor's centre line meets the goal \
                          line; not a number where the goal is a direction",
            shape: |_| vec![2],
            read: |environment, value| value.copy_from_slice(environment.goal().point().as_slice()),
        },
        Self {
            name: "goal_radius",
            unit: "m",
            description: "radius of the goal disc, or length at the end of a path that need not be covered; 0 for a goal line",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.goal().radius(),
        },
        Self {
            name: "goal_direction",
            unit: "rad",
            description: "angle from +x to the goal direction: to the goal point, along the corridor, as commanded, or to \
                          the point of the path ahead of the robot",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.goal_direction(),
        },
        Self {
            name: "goal_speed",
            unit: "m/s",
            description: "commanded speed along the goal direction; 0 without one",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.goal().speed.unwrap_or(0.0),
        },
        Self {
            name: "corridor_half_width",
            unit: "m",
            description: "distance from the centre line at which a robot with a goal line has left the corridor",
            shape: |_| vec![],
            read: |environment, value| value[0] = environment.rules().corridor_half_width,
        },
    ];
}

/// Fills a table of as many rows as there are items.
pub fn write_rows<const N: usize>(value: &mut [f64], rows: impl IntoIterator<Item = [f64; N]>) {
    value.chunks_exact_mut(N).zip(rows).for_each(|(value, row)| value.copy_from_slice(&row));
}
