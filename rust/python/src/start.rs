//! Where a scripted run starts, as the user writes it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::error::{finite, require, within};
use snake_core::gait::{CardanGait, CardanReference, Gait, JointReference};
use snake_core::spatial::SpatialSimulation;
use snake_core::spatial::{Pose, orientation_of};

/// In the plane.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneStart {
    position: [f64; 2],
    heading: f64,
    posture: PlanePosture,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "\"gait\", \"straight\" or a joint angle for each joint")]
enum PlanePosture {
    Named(String),
    Angles(Vec<f64>),
}

impl PlaneStart {
    /// (x, y, heading) of link 1.
    pub fn head(&self) -> Result<[f64; 3], ConfigError> {
        let [x, y] = self.position;
        Ok([finite("start.position[0]", x)?, finite("start.position[1]", y)?, finite("start.heading", self.heading)?])
    }

    /// The joint angles of the posture.
    pub fn joint_angle(&self, joints: usize, gait: &Gait) -> Result<Vec<f64>, ConfigError> {
        let expected = format!("\"gait\", \"straight\" or {joints} finite joint angles");
        match &self.posture {
            PlanePosture::Named(name) if name == "gait" => Ok((0..joints).map(|j| gait.target(j, 0.0).angle).collect()),
            PlanePosture::Named(name) if name == "straight" => Ok(vec![0.0; joints]),
            PlanePosture::Named(name) => Err(ConfigError::new("start.posture", format!("{name:?}"), expected)),
            PlanePosture::Angles(angles) => {
                let admissible = angles.len() == joints && angles.iter().all(|angle| angle.is_finite());
                require(admissible, "start.posture", format!("{angles:?}"), &expected).map(|()| angles.clone())
            }
        }
    }
}

/// In space.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpatialStart {
    position: Vec<f64>,
    heading: f64,
    pitch: f64,
    roll: Option<f64>,
    posture: SpatialPosture,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "\"gait\", \"straight\", or a yaw angle or a pair (yaw, pitch) for each joint")]
enum SpatialPosture {
    Named(String),
    Angles(Vec<[f64; 2]>),
    Yaws(Vec<f64>),
}

impl SpatialStart {
    /// Places the robot; it rests on the ground unless the position has a third coordinate.
    pub fn place(&self, simulation: &mut SpatialSimulation, gait: &CardanGait) -> Result<(), ConfigError> {
        let expected = "(x, y) or (x, y, z)";
        require((2..=3).contains(&self.position.len()), "start.position", format!("{:?}", self.position), expected)?;
        for (k, &coordinate) in self.position.iter().enumerate() {
            finite(&format!("start.position[{k}]"), coordinate)?;
        }
        finite("start.heading", self.heading)?;
        within("start.pitch", self.pitch, -FRAC_PI_2, FRAC_PI_2)?;
        let posture = self.joint_angle(simulation.robot().joint_count(), gait)?;
        let roll = finite("start.roll", self.roll.unwrap_or_else(|| self.natural_roll(&posture, gait)))?;
        let height = self.position.get(2).copied();
        let position = Vector3::new(self.position[0], self.position[1], height.unwrap_or(0.0));
        let orientation = orientation_of(self.heading, self.pitch, roll);
        simulation.place_chain(Pose { position, orientation }, &posture);
        if height.is_none() {
            simulation.rest_on_ground();
        }
        Ok(())
    }

    /// The joint angles (yaw, pitch) of the posture.
    fn joint_angle(&self, joints: usize, gait: &CardanGait) -> Result<Vec<Vector2<f64>>, ConfigError> {
        let expected =
            format!("\"gait\", \"straight\", {joints} yaw angles or {joints} pairs (yaw, pitch), all finite");
        let angles: Vec<Vector2<f64>> = match &self.posture {
            SpatialPosture::Named(name) if name == "gait" => (0..joints).map(|joint| at_start(gait, joint)).collect(),
            SpatialPosture::Named(name) if name == "straight" => vec![Vector2::zeros(); joints],
            SpatialPosture::Named(name) => {
                return Err(ConfigError::new("start.posture", format!("{name:?}"), expected));
            }
            SpatialPosture::Angles(angles) => angles.iter().map(|&angle| angle.into()).collect(),
            SpatialPosture::Yaws(angles) => angles.iter().map(|&yaw| Vector2::new(yaw, 0.0)).collect(),
        };
        let admissible = angles.len() == joints && angles.iter().flatten().all(|angle| angle.abs() < FRAC_PI_2);
        let shown: Vec<_> = angles.iter().map(|angle| (angle.x, angle.y)).collect();
        require(admissible, "start.posture", format!("{shown:?}"), &expected)?;
        Ok(angles)
    }

    /// A gait that bends the robot both ways and starts with a bend up and down alone starts lying on its side
    /// (T 7.3.2 != D46).
    fn natural_roll(&self, posture: &[Vector2<f64>], gait: &CardanGait) -> f64 {
        let bent = |axis: usize| posture.iter().any(|angle| angle[axis].abs() > FLAT);
        let yaws = gait.yaw.amplitude() != 0.0;
        let named = matches!(&self.posture, SpatialPosture::Named(name) if name == "gait");
        if named && yaws && !bent(0) && bent(1) { -FRAC_PI_2 } else { 0.0 }
    }
}

/// Joint angles below which a joint counts as straight \[rad\].
const FLAT: f64 = 1e-9;

fn at_start(gait: &CardanGait, joint: usize) -> Vector2<f64> {
    let target = gait.target(joint, 0.0);
    Vector2::new(target.yaw.angle, target.pitch.angle)
}
