//! What a picture of an environment shows.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use snake_core::task::Environment;
use snake_core::task::goal::{Goal, Target};
use snake_core::task::motion::Motion;

use crate::numbers::set_array;

/// Poses (n, 3), link shapes (n, 2), pegs (p, 3), mean contact forces (n, 2) of the last control period,
/// and the numbers of the text line.
pub fn of<'py>(py: Python<'py>, environment: &Environment) -> PyResult<Bound<'py, PyDict>> {
    let (robot, state, rules) = (environment.robot(), environment.state(), environment.rules());
    let links = robot.link_count();
    let pose = state.pose.iter().flat_map(|pose| [pose.x, pose.y, pose.z]).collect();
    let shape = robot.links.iter().flat_map(|link| [link.contact_half_length, link.radius]).collect();
    let pegs: Vec<f64> = environment.pegs().iter().flat_map(|peg| [peg.radius, peg.x, peg.y]).collect();
    let force = environment.obstacle_force().flat_map(|force| [force.x, force.y]).collect();
    let centre = Motion::of(robot, state).position;
    let dict = PyDict::new(py);
    set_array(&dict, "pose", pose, &[links, 3])?;
    set_array(&dict, "shape", shape, &[links, 2])?;
    set_array(&dict, "pegs", pegs, &[environment.pegs().len(), 3])?;
    set_array(&dict, "contact_force", force, &[links, 2])?;
    dict.set_item("centre", (centre.x, centre.y))?;
    set_goal(&dict, environment.goal(), rules.corridor_half_width)?;
    dict.set_item("push_points", environment.push_points())?;
    dict.set_item("time", environment.summary().time)?;
    dict.set_item("distance", environment.summary().distance)?;
    dict.set_item("speed", environment.summary().speed)?;
    Ok(dict)
}

/// "goal_line", "centre_line" and "corridor_half_width" \[m\], or "goal_disc" (x, y, radius).
fn set_goal(dict: &Bound<'_, PyDict>, goal: &Goal, half_width: f64) -> PyResult<()> {
    match goal.target {
        Target::Disc { centre, radius } => dict.set_item("goal_disc", (centre.x, centre.y, radius)),
        Target::Line { distance, centre_line } => {
            dict.set_item("goal_line", goal.origin.x + distance)?;
            dict.set_item("centre_line", centre_line)?;
            dict.set_item("corridor_half_width", half_width)
        }
    }
}
