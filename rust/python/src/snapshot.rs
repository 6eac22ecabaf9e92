//! What a picture of an environment shows.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use snake_core::environment::goal::{Goal, Target};
use snake_core::environment::{Environment, PlanarRobot, RobotModel, SpatialRobot};

use crate::numbers::set_array;

/// Poses (n, 3), link shapes (n, 2), pegs (p, 3), mean contact forces (n, 2) of the last control period,
/// and the numbers of the text line.
pub fn planar<'py>(py: Python<'py>, environment: &Environment<PlanarRobot>) -> PyResult<Bound<'py, PyDict>> {
    let pose = environment.state().pose.iter().flat_map(|pose| [pose.x, pose.y, pose.z]).collect();
    let force = environment.obstacle_force().flat_map(|force| [force.x, force.y]).collect();
    let dict = of(py, environment)?;
    let links = environment.robot().link_count();
    set_array(&dict, "pose", pose, &[links, 3])?;
    set_array(&dict, "contact_force", force, &[links, 2])?;
    Ok(dict)
}

/// The same, with the poses as seen from above; and "position" (n, 3) of the links' CGs, "axis" (n, 3), the directions
/// of their centre lines, and "normal_force" (n,), the ground's mean forces on them.
pub fn spatial<'py>(py: Python<'py>, environment: &Environment<SpatialRobot>) -> PyResult<Bound<'py, PyDict>> {
    let model = environment.model();
    let poses = &model.simulation.state().pose;
    let links = poses.len();
    let axes: Vec<_> = poses.iter().map(|pose| pose.axis()).collect();
    let seen = poses.iter().zip(&axes).flat_map(|(pose, e)| [pose.position.x, pose.position.y, e.y.atan2(e.x)]);
    let force = model.peg_force().iter().flat_map(|force| [force.x, force.y]).collect();
    let dict = of(py, environment)?;
    set_array(&dict, "pose", seen.collect(), &[links, 3])?;
    set_array(&dict, "contact_force", force, &[links, 2])?;
    set_array(&dict, "position", poses.iter().flat_map(|pose| pose.position.data.0[0]).collect(), &[links, 3])?;
    set_array(&dict, "axis", axes.iter().flat_map(|axis| axis.data.0[0]).collect(), &[links, 3])?;
    set_array(&dict, "normal_force", model.normal_force().to_vec(), &[links])?;
    Ok(dict)
}

fn of<'py, M: RobotModel>(py: Python<'py>, environment: &Environment<M>) -> PyResult<Bound<'py, PyDict>> {
    let (robot, rules) = (environment.robot(), environment.rules());
    let shape = robot.links.iter().flat_map(|link| [link.contact_half_length, link.radius]).collect();
    let pegs: Vec<f64> = environment.pegs().iter().flat_map(|peg| [peg.radius, peg.x, peg.y]).collect();
    let centre = environment.model().motion().position;
    let dict = PyDict::new(py);
    set_array(&dict, "shape", shape, &[robot.link_count(), 2])?;
    set_array(&dict, "pegs", pegs, &[environment.pegs().len(), 3])?;
    dict.set_item("centre", (centre.x, centre.y))?;
    set_goal(&dict, environment.goal(), rules.corridor_half_width)?;
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
