//! What the tests of the spatial model need: random links, poses, twists, and matrices as the thesis prints them.
use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3, Vector6};
use snake_core::robot::{Axes, Link, Robot};
use snake_core::scene::Peg;
use snake_core::spatial::{Pose, StackedTwist, assemble_chain, peg_gap};

use crate::planar::Random;

pub fn random_vector(random: &mut Random, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.between(-size, size))
}

pub fn random_link(random: &mut Random) -> Link {
    let length = random.between(0.05, 0.3);
    Link {
        length,
        contact_half_length: random.between(0.0, 0.15),
        radius: random.between(0.01, 0.1),
        mass: random.between(0.1, 2.0),
        inertia: random.magnitude(1e-4, 1e-2),
        roll_inertia: random.magnitude(1e-4, 1e-2),
        cg_offset: random.between(-0.45, 0.45) * length,
        friction_factor: 1.0,
    }
}

/// A random link with its CG in the middle, the only one that the thesis has.
pub fn random_even_link(random: &mut Random) -> Link {
    Link { cg_offset: 0.0, ..random_link(random) }
}

pub fn random_pose(random: &mut Random) -> Pose {
    Pose {
        position: random_vector(random, 1.0),
        orientation: UnitQuaternion::from_scaled_axis(random_vector(random, 3.0)),
    }
}

pub fn random_twist(random: &mut Random) -> StackedTwist {
    StackedTwist::from_fn(|_, _| random.between(-1.0, 1.0))
}

/// Yaw and pitch of one joint, each within `limit`.
pub fn random_angle(random: &mut Random, limit: f64) -> Vector2<f64> {
    Vector2::from_fn(|_, _| random.between(-limit, limit))
}

/// Two of the links that `random_link` draws, their joint closed up to a small random error.
pub fn random_joint(random: &mut Random, random_link: fn(&mut Random) -> Link) -> [(Link, Pose); 2] {
    let (near, far) = (random_link(random), random_link(random));
    let robot = Robot {
        links: vec![near, far],
        gravity: 9.81,
        backlash: vec![[0.0; 2]],
        own_gains: [None, None, None],
        self_contact: false,
        link_friction: 0.0,
        joint_bounds: vec![[f64::NEG_INFINITY, f64::INFINITY]],
        axes: vec![Axes::Both],
        lists_axes: false,
        motors: None,
        broken: Vec::new(),
    };
    let mut pose = [random_pose(random), Pose::identity()];
    assemble_chain(&robot, pose[0], &[random_angle(random, 1.4)], &mut pose);
    [(near, pose[0]), (far, pose[1])]
}

/// A peg whose axis stays clear of the link's centre line.
pub fn random_peg(random: &mut Random, link: &Link, pose: &Pose) -> Peg {
    loop {
        let peg = Peg {
            radius: random.between(0.005, 0.15),
            x: pose.position.x + random.between(-0.5, 0.5),
            y: pose.position.y + random.between(-0.5, 0.5),
        };
        if peg_gap(link, pose, &peg) > -link.radius - 0.8 * peg.radius {
            return peg;
        }
    }
}

/// The skew-symmetric form of a vector (T 4.5).
pub fn tilde(e: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -e.z, e.y, e.z, 0.0, -e.x, -e.y, e.x, 0.0)
}

/// The orientation turned by a vector in frame B \[rad\].
pub fn turned(pose: &Pose, by: Vector3<f64>) -> Pose {
    Pose { orientation: pose.orientation * UnitQuaternion::from_scaled_axis(by), ..*pose }
}

/// The pose moved by a small twist, component by component of frames I and B.
pub fn nudged(pose: &Pose, by: &StackedTwist) -> Pose {
    let shifted = Pose { position: pose.position + by.fixed_rows::<3>(0), ..*pose };
    turned(&shifted, by.fixed_rows::<3>(3).into_owned())
}

/// Step of central differences: they err by its square times a third derivative, and by round-off over the step.
pub const D: f64 = 1e-6;

/// Derivative of `f` along each of the six directions of a twist.
pub fn gradient(pose: &Pose, f: impl Fn(&Pose) -> f64) -> Vector6<f64> {
    Vector6::from_fn(|k, _| {
        let mut step = StackedTwist::zeros();
        step[k] = D;
        (f(&nudged(pose, &step)) - f(&nudged(pose, &-step))) / (2.0 * D)
    })
}
