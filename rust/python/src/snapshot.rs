//! What a picture of an environment shows.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use snake_core::task::Environment;
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
    dict.set_item("goal_line", environment.goal_line())?;
    dict.set_item("centre_line", rules.centre_line)?;
    dict.set_item("corridor_half_width", rules.corridor_half_width)?;
    dict.set_item("time", environment.summary().time)?;
    dict.set_item("distance", environment.summary().distance)?;
    dict.set_item("speed", environment.summary().speed)?;
    Ok(dict)
}
