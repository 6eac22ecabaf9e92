//! What a robot in space sensors of itself and its contacts.

use std::f64::consts::{FRAC_PI_2, SQRT_2};

use nalgebra::{Vector2, Vector3};

use crate::robot::Robot;
use crate::spatial::turning;

use super::spatial::SpatialRobot;
use crate::environment::config::{ActionMode, EnvConfig, Task};
use crate::environment::observation::{ObservationBlock, View, block, joint_angle, joint_rate, named, numbered};

type Block = ObservationBlock<SpatialRobot>;
type Spatial<'a> = View<'a, SpatialRobot>;

/// The blocks before and after those that every environment has.
pub fn blocks(config: &EnvConfig, robot: &Robot) -> [Vec<Block>; 2] {
    let mut contact = vec![normal_force_block(robot)];
    if config.task != Task::Free {
        contact
            .push(block("contact_force", along_links(robot, &["forward", "left"]), "N", 20.0, 4.0, contact_force).says(
            "force of the pegs on each link, forward and to its left seen from above, averaged over the control period",
        ));
    }
    contact.push(command_block(config, robot.joint_count()));
    [posture_blocks(robot), contact]
}

fn posture_blocks(robot: &Robot) -> Vec<Block> {
    let joints = robot.joint_count();
    let radius = robot.links.iter().map(|link| link.radius).fold(0.0, f64::max);
    vec![
        block("joint_angle", cardan(joints), "rad", FRAC_PI_2, 2.0, joint_angle)
            .says("yaw and pitch of each joint; going forward, a positive yaw bends the body to the right, a positive pitch \
                   lowers the link behind"),
        block("joint_rate", cardan(joints), "rad/s", 2.5, 4.0, joint_rate).says("angular velocities of each joint"),
        block("height", numbered("link", robot.link_count()), "m", 2.0 * radius, 8.0, heights)
            .says("height of each link's CG above that of a link that lies on the ground"),
        block("attitude", named(&["sin_roll", "cos_roll", "pitch"]), "1", 1.0, FRAC_PI_2, attitude).says(
            "mean turn of the links about their axes, positive where the left side comes up, and angle by which the body \
             direction points up",
        ),
        block("gravity", named(&["forward", "left", "up"]), "1", 1.0, SQRT_2, gravity)
            .says("direction of gravity in the frame of link 1, opposite to what an accelerometer at rest reads"),
        block("gyro", named(&["forward", "left", "up"]), "rad/s", 2.5, 4.0, gyro)
            .says("angular velocity of link 1 about its own axes"),
    ]
}

fn normal_force_block(robot: &Robot) -> Block {
    let weight = robot.total_mass() * robot.gravity / robot.link_count() as f64;
    block("normal_force", numbered("link", robot.link_count()), "N", 4.0 * weight, 4.0, normal_force)
        .says("normal force of the ground on each link, averaged over the control period")
}

fn command_block(config: &EnvConfig, joints: usize) -> Block {
    if config.action_mode == ActionMode::Joints {
        return block("reference", cardan(joints), "rad", FRAC_PI_2, 1.0, reference)
            .says("smoothed reference angles of each joint");
    }
    let names = ["sin_phase", "cos_phase", "amplitude", "frequency", "phase_shift", "offset", "lift", "lift_phase"];
    block("wave", named(&names), "1", 1.0, 1.0, wave)
        .says("phase of the waves, and their smoothed parameters as actions that would hold them")
}

fn cardan(joints: usize) -> Vec<String> {
    (1..=joints).flat_map(|joint| ["yaw", "pitch"].map(|axis| format!("{axis}_{joint}"))).collect()
}

fn along_links(robot: &Robot, names: &[&str]) -> Vec<String> {
    (1..=robot.link_count()).flat_map(|link| names.iter().map(move |name| format!("link_{link}_{name}"))).collect()
}

fn heights(view: &Spatial, values: &mut [f64]) {
    let links = view.model.simulation.robot().links.iter().zip(&view.model.simulation.state().pose);
    values.iter_mut().zip(links).for_each(|(value, (link, pose))| *value = pose.position.z - link.radius);
}

fn attitude(view: &Spatial, values: &mut [f64]) {
    let attitude = view.model.attitude();
    (values[0], values[1]) = attitude.roll.sin_cos();
    values[2] = attitude.pitch;
}

/// A vector of frame B as (forward, left, up): -e_z^B, -e_x^B and, of an unrolled link, e_y^B.
fn as_seen(vector: &Vector3<f64>) -> [f64; 3] {
    [-vector.z, -vector.x, vector.y]
}

fn gravity(view: &Spatial, values: &mut [f64]) {
    let pose = &view.model.simulation.state().pose[0];
    values.copy_from_slice(&as_seen(&pose.orientation.inverse_transform_vector(&-Vector3::z())));
}

fn gyro(view: &Spatial, values: &mut [f64]) {
    values.copy_from_slice(&as_seen(&turning(&view.model.simulation.state().twist[0])));
}

fn normal_force(view: &Spatial, values: &mut [f64]) {
    values.copy_from_slice(view.model.normal_force());
}

fn contact_force(view: &Spatial, values: &mut [f64]) {
    let links = view.model.peg_force().iter().zip(&view.model.simulation.state().pose);
    for (values, (force, pose)) in values.chunks_exact_mut(2).zip(links) {
        let axis = pose.axis();
        let ahead = (-axis.xy()).try_normalize(0.0).unwrap_or_else(Vector2::x);
        values.copy_from_slice(&[ahead.dot(force), ahead.perp(force)]);
    }
}

fn reference(view: &Spatial, values: &mut [f64]) {
    view.model.reference.angles(values);
}

fn wave(view: &Spatial, values: &mut [f64]) {
    view.model.reference.describe_wave(values);
}
