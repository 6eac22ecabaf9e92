//! Where a scripted run starts, as the user writes it.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use snake_core::ConfigError;
use snake_core::capabilities::{Feature, Method, ModelName};
use snake_core::environment::{OwnStart, Raised};
use snake_core::error::{FARTHEST, coordinate, require, within};
use snake_core::gait::{CardanGait, Gait, Reference};
use snake_core::robot::{Axes, Robot};
use snake_core::simulation::{Scheme, Simulation};
use snake_core::spatial::{Pose, Spatial, orientation_of};

/// Position and heading of link 1, and the posture of the robot, which is at rest.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StartConfig {
    /// (x, y); in 3D also (x, y, z) \[m\].
    position: Vec<f64>,
    /// \[rad\]
    heading: f64,
    posture: Posture,
    /// Of the chain about link 1; the spatial model only \[rad\].
    pitch: f64,
    /// About the centre line of link 1; the spatial model only \[rad\].
    roll: Option<f64>,
}

impl Default for StartConfig {
    fn default() -> Self {
        Self { position: vec![0.0; 2], heading: PI, posture: Posture::Named("gait".to_owned()), pitch: 0.0, roll: None }
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged, expecting = "\"gait\", \"straight\" or a joint angle for each joint, in 3D also (yaw, pitch)")]
enum Posture {
    Named(String),
    Pairs(Vec<[f64; 2]>),
    Angles(Vec<f64>),
}

impl StartConfig {
    /// (x, y, heading) of link 1 in the plane.
    pub fn in_plane(&self, on: (ModelName, Method)) -> Result<[f64; 3], ConfigError> {
        Feature::Inclination.require(on, self.pitch != 0.0, "start.pitch", self.pitch)?;
        let roll = self.roll.unwrap_or(0.0);
        Feature::Inclination.require(on, roll != 0.0, "start.roll", roll)?;
        let Ok([x, y]) = <[f64; 2]>::try_from(self.position.as_slice()) else {
            return Err(ConfigError::new("start.position", format!("{:?}", self.position), "2 numbers"));
        };
        Ok([
            coordinate("start.position[0]", x)?,
            coordinate("start.position[1]", y)?,
            coordinate("start.heading", self.heading)?,
        ])
    }

    /// The joint angles of a posture other than the gait's.
    pub fn own_posture(&self, robot: &Robot) -> Result<Option<Vec<f64>>, ConfigError> {
        let (joints, largest) = (robot.joint_count(), largest_bend(robot));
        let angle = written(largest_reference(robot.joint_limit()));
        match &self.posture {
            Posture::Named(name) if name == "gait" => Ok(None),
            Posture::Named(name) if name == "straight" => Ok(Some(vec![0.0; joints])),
            Posture::Angles(angles) if angles.len() == joints && angles.iter().all(|a| a.abs() <= largest) => {
                Ok(Some(angles.clone()))
            }
            other => {
                let expected = format!("\"gait\", \"straight\" or {joints} joint angles in [-{angle}, {angle}]");
                Err(ConfigError::new("start.posture", other.written(), expected))
            }
        }
    }

    /// The joint angles of the posture in the plane.
    pub fn joint_angle(&self, joints: usize, gait: &Gait) -> Result<Vec<f64>, ConfigError> {
        let expected = format!("\"gait\", \"straight\" or {joints} finite joint angles");
        match &self.posture {
            Posture::Named(name) if name == "gait" => Ok((0..joints).map(|j| gait.target(j, 0.0).angle).collect()),
            Posture::Named(name) if name == "straight" => Ok(vec![0.0; joints]),
            Posture::Angles(angles) if angles.len() == joints && angles.iter().all(|angle| angle.abs() <= FARTHEST) => {
                Ok(angles.clone())
            }
            other => Err(ConfigError::new("start.posture", other.written(), expected)),
        }
    }

    /// The start of an episode of the spatial model.
    pub fn own_in_space(&self, robot: &Robot) -> Result<OwnStart, ConfigError> {
        self.check_in_space()?;
        let roll = coordinate("start.roll", self.roll.unwrap_or(0.0))?;
        let own = self.own_pairs(robot)?;
        let of_axis =
            |axis: usize| own.as_ref().map(|angles| angles.iter().map(|angle| angle[axis]).collect::<Vec<_>>());
        let (joint_angle, joint_pitch) = (of_axis(0), of_axis(1).unwrap_or_default());
        let height = self.position.get(2).copied();
        let is_flat = height.is_none() && self.pitch == 0.0 && roll == 0.0 && joint_pitch.iter().all(|p| *p == 0.0);
        let raised = (!is_flat).then_some(Raised { height, pitch: self.pitch, roll, joint_pitch });
        Ok(OwnStart {
            position: Vector2::new(self.position[0], self.position[1]),
            angle: self.heading,
            joint_angle,
            raised,
        })
    }

    fn check_in_space(&self) -> Result<(), ConfigError> {
        let expected = "(x, y) or (x, y, z)";
        require((2..=3).contains(&self.position.len()), "start.position", format!("{:?}", self.position), expected)?;
        for (k, &value) in self.position.iter().enumerate() {
            coordinate(&format!("start.position[{k}]"), value)?;
        }
        coordinate("start.heading", self.heading)?;
        within("start.pitch", self.pitch, -FRAC_PI_2, FRAC_PI_2)?;
        Ok(())
    }

    /// Places a robot in 3D; it rests on the ground unless the position has a third coordinate.
    pub fn place(
        &self,
        simulation: &mut Simulation<Spatial, impl Scheme<Spatial>>,
        gait: &CardanGait,
    ) -> Result<(), ConfigError> {
        self.check_in_space()?;
        let posture = self.joint_angles(simulation.robot(), gait)?;
        let roll = coordinate("start.roll", self.roll.unwrap_or_else(|| self.natural_roll(&posture, gait)))?;
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
    fn joint_angles(&self, robot: &Robot, gait: &CardanGait) -> Result<Vec<Vector2<f64>>, ConfigError> {
        let of_gait = || robot.axes.iter().enumerate().map(|(joint, axes)| at_start(gait, joint, *axes)).collect();
        let angles: Vec<Vector2<f64>> = self.own_pairs(robot)?.unwrap_or_else(of_gait);
        require_bends(&angles, robot, &self.posture)?;
        Ok(angles)
    }

    /// The joint angles (yaw, pitch) of a posture other than the gait's.
    fn own_pairs(&self, robot: &Robot) -> Result<Option<Vec<Vector2<f64>>>, ConfigError> {
        let angles: Vec<Vector2<f64>> = match &self.posture {
            Posture::Named(name) if name == "gait" => return Ok(None),
            Posture::Named(name) if name == "straight" => vec![Vector2::zeros(); robot.joint_count()],
            Posture::Named(_) => Vec::new(),
            Posture::Pairs(angles) => angles.iter().map(|&angle| angle.into()).collect(),
            Posture::Angles(angles) if robot.lists_axes => {
                robot.by_joint(angles, &0.0).unwrap_or_default().into_iter().map(Vector2::from).collect()
            }
            Posture::Angles(angles) => angles.iter().map(|&yaw| Vector2::new(yaw, 0.0)).collect(),
        };
        require_bends(&angles, robot, &self.posture)?;
        Ok(Some(angles))
    }

    /// A gait that bends the robot both ways and starts with a bend up and down alone starts lying on its side
    /// (T 7.3.2 != D46).
    fn natural_roll(&self, posture: &[Vector2<f64>], gait: &CardanGait) -> f64 {
        let bent = |axis: usize| posture.iter().any(|angle| angle[axis].abs() > FLAT);
        let yaws = gait.yaw.amplitude() != 0.0;
        let named = matches!(&self.posture, Posture::Named(name) if name == "gait");
        if named && yaws && !bent(0) && bent(1) { -FRAC_PI_2 } else { 0.0 }
    }
}

impl Posture {
    /// As the user writes it.
    fn written(&self) -> String {
        match self {
            Posture::Named(name) => format!("{name:?}"),
            Posture::Pairs(angles) => format!("{angles:?}"),
            Posture::Angles(angles) => format!("{angles:?}"),
        }
    }
}

/// The angles (yaw, pitch) are those of all joints, and admissible.
fn require_bends(angles: &[Vector2<f64>], robot: &Robot, posture: &Posture) -> Result<(), ConfigError> {
    let (joints, largest) = (robot.joint_count(), largest_bend(robot));
    let angle = written(largest_reference(robot.joint_limit()));
    let list = match robot.lists_axes {
        true => format!("{} angles, one per axis", robot.axis_list().count()),
        false => format!("{joints} yaw angles"),
    };
    let expected = format!("\"gait\", \"straight\", {list} or {joints} pairs (yaw, pitch), in [-{angle}, {angle}]");
    let admissible = angles.len() == joints && angles.iter().flatten().all(|angle| angle.abs() <= largest);
    require(admissible, "start.posture", posture.written(), &expected)?;
    for (j, (angle, axes)) in angles.iter().zip(&robot.axes).enumerate() {
        let expected = ["(yaw, 0)", "(0, pitch)"][axes.only().unwrap_or(0)];
        let has_no_other = [0, 1].into_iter().all(|axis| axes.has(axis) || angle[axis] == 0.0);
        let value = format!("{:?}", angle.as_slice());
        let expected = format!("{expected}, of the axis that the joint has");
        require(has_no_other, &format!("start.posture[{j}]"), value, &expected)?;
    }
    require_own_bends(robot, angles.iter().map(|angle| angle.as_slice()))
}

/// Joints with limits of their own are within these, or as far beyond as a run may press them.
fn require_own_bends<'a>(robot: &Robot, angles: impl Iterator<Item = &'a [f64]>) -> Result<(), ConfigError> {
    let least = largest_reference(0.0);
    for (j, (angles, [lower, upper])) in angles.zip(&robot.joint_bounds).enumerate() {
        let beyond = angles.iter().find(|angle| !(lower - OVERRUN..=upper + OVERRUN).contains(*angle));
        // Of symmetric limits a right angle at least is admissible, see [`largest_reference`].
        if let Some(angle) = beyond.filter(|angle| *lower != -upper || angle.abs() > least.max(*upper)) {
            let expected = format!("an angle in [{lower}, {upper}], the joint's limits");
            return Err(ConfigError::new(format!("start.posture[{j}]"), *angle, expected));
        }
    }
    Ok(())
}

/// Largest joint angle of a posture, that of a joint pressed beyond its stop included \[rad\].
fn largest_bend(robot: &Robot) -> f64 {
    (largest_reference(robot.joint_limit()) + OVERRUN).min(PI)
}

/// Largest joint angle of a reference: the joint limit, but a right angle at least, beyond which stops hold joints
/// anyway, and half a turn at most \[rad\].
pub fn largest_reference(joint_limit: f64) -> f64 {
    joint_limit.clamp(FRAC_PI_2, PI)
}

/// A largest angle as messages have it.
pub fn written(largest: f64) -> String {
    match largest {
        FRAC_PI_2 => "pi/2".to_owned(),
        PI => "pi".to_owned(),
        _ => format!("{largest:.4}"),
    }
}

/// How far a run may press a joint beyond its stop: a millimetre at the end of a link of Aiko \[rad\].
const OVERRUN: f64 = 0.02;

/// Joint angles below which a joint counts as straight \[rad\].
const FLAT: f64 = 1e-9;

fn at_start(gait: &CardanGait, joint: usize, axes: Axes) -> Vector2<f64> {
    let (target, sampled) = (gait.target(joint, 0.0), matches!(gait.yaw, Gait::Sampled(_)));
    let follows = axes.has(0) && (sampled || !axes.only_twists());
    Vector2::new(if follows { target.yaw.angle } else { 0.0 }, if axes.has(1) { target.pitch.angle } else { 0.0 })
}
