//! What each model of the robot has: one table, from which error messages and the table of the docs follow. The minimal
//! model and the method of the thesis are in the crate `snake-thesis`.

use serde::Deserialize;

use crate::control::{ControlLaw, ControllerConfig, Treatment};
use crate::error::{ConfigError, require};
use crate::obstacles::{Obstacle, Shape};
use crate::robot::{Axes, PerAxis, RobotConfig};
use crate::scene::{FrictionLawName, SceneConfig};

/// The models of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelName {
    /// Links that slide in the plane (T ch. 3).
    Planar,
    /// Links in 3D on cardan joints (T ch. 4).
    Spatial,
    /// Minimal coordinates in the plane (T ch. 6).
    Minimal,
}

impl ModelName {
    pub const ALL: [ModelName; 3] = [ModelName::Planar, ModelName::Spatial, ModelName::Minimal];

    /// The name that users write.
    pub fn name(self) -> &'static str {
        match self {
            ModelName::Planar => "planar",
            ModelName::Spatial => "spatial",
            ModelName::Minimal => "minimal",
        }
    }
}

/// The methods of time stepping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Midpoint time stepping, Algorithm 3.1 and explicit PD, as printed.
    Thesis,
    /// Implicit stages with exactly eliminated joints and certified contacts.
    #[default]
    Implicit,
}

impl Method {
    /// Name in configurations.
    pub fn name(self) -> &'static str {
        match self {
            Method::Thesis => "thesis",
            Method::Implicit => "implicit",
        }
    }
}

/// Whether a model has a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    Never,
    /// With the integrator's method `implicit` only.
    Implicit,
    Always,
}

/// What not every model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    Pegs,
    Walls,
    ObstacleFriction,
    ObstacleHeight,
    Bodies,
    Movables,
    StribeckEffect,
    Patches,
    Skin,
    LinkFriction,
    SpinFriction,
    Backlash,
    JointGains,
    SelfContact,
    FrictionBetweenLinks,
    JointLimits,
    BrokenJoints,
    Motors,
    Hinges,
    CgOffset,
    IoLinearization,
    HeldTorques,
    MeasurementNoise,
    ViscousFriction,
    SmoothFriction,
    RollingFriction,
    VerticalWave,
    Inclination,
    Environments,
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Capability {
    pub feature: Feature,
    /// The feature in messages and docs.
    pub name: &'static str,
    /// The value that switches it off, as users write it.
    pub off: &'static str,
    /// By the planar, the spatial and the minimal model.
    pub support: [Support; 3],
}

/// All features that not every model has.
pub const CAPABILITIES: [Capability; 29] = {
    use Support::{Always, Implicit, Never};
    const fn row(feature: Feature, name: &'static str, off: &'static str, support: [Support; 3]) -> Capability {
        Capability { feature, name, off, support }
    }
    [
        row(Feature::Pegs, "contact with pegs", "no obstacles", [Always, Always, Never]),
        row(Feature::Walls, "contact with segments, boxes and polygons", "circles only", [Implicit, Implicit, Never]),
        row(Feature::ObstacleFriction, "friction at obstacles", "0", [Implicit, Implicit, Never]),
        row(Feature::ObstacleHeight, "obstacles of finite height", "None", [Never, Implicit, Never]),
        row(
            Feature::Bodies,
            "contact with height fields, polyhedra, cylinders and spheres",
            "vertical bodies",
            [Never, Implicit, Never],
        ),
        row(Feature::Movables, "obstacles that can be pushed", "None", [Implicit, Implicit, Never]),
        row(Feature::StribeckEffect, "the Stribeck effect", "0", [Always, Implicit, Never]),
        row(Feature::Patches, "patches of other friction", "()", [Implicit, Implicit, Never]),
        row(Feature::Skin, "friction that differs forward and backward", "None", [Implicit, Implicit, Never]),
        row(Feature::LinkFriction, "friction that differs from link to link", "1", [Implicit, Implicit, Never]),
        row(Feature::SpinFriction, "friction of the ground against spin of a link", "0", [Implicit, Never, Never]),
        row(Feature::Backlash, "backlash of the joints", "0", [Implicit, Implicit, Never]),
        row(Feature::JointGains, "gains and torque limits of each joint", "None", [Implicit, Implicit, Never]),
        row(Feature::SelfContact, "contact of the robot with itself", "False", [Implicit, Implicit, Never]),
        row(Feature::FrictionBetweenLinks, "friction between links of the robot", "0", [Implicit, Never, Never]),
        row(Feature::JointLimits, "limits of the joint angles", "inf", [Implicit, Implicit, Never]),
        row(Feature::BrokenJoints, "locked and limp joints", "()", [Implicit, Implicit, Implicit]),
        row(Feature::Motors, "a motor with rotor and gear", "None", [Implicit, Implicit, Never]),
        row(Feature::Hinges, "a hinge instead of a cardan joint", "\"both\"", [Never, Implicit, Never]),
        row(Feature::CgOffset, "a CG off the middle of its link", "0", [Implicit, Implicit, Never]),
        row(Feature::IoLinearization, "input-output linearisation", "\"pd\"", [Always, Never, Always]),
        row(Feature::HeldTorques, "a torque held over steps or periods", "\"implicit\"", [Never, Never, Always]),
        row(Feature::MeasurementNoise, "noise on the controller's measurements", "None", [Never, Never, Always]),
        row(Feature::ViscousFriction, "viscous friction", "(0, 0)", [Never, Never, Always]),
        row(Feature::SmoothFriction, "a smooth friction law", "\"set-valued\"", [Never, Never, Implicit]),
        row(Feature::RollingFriction, "rolling friction", "0", [Never, Always, Never]),
        row(Feature::VerticalWave, "a vertical wave", "0", [Never, Always, Never]),
        row(Feature::Inclination, "pitch and roll at the start", "0", [Never, Always, Never]),
        row(Feature::Environments, "reinforcement learning", "\"implicit\"", [Implicit, Implicit, Never]),
    ]
};

impl Capability {
    pub fn of(&self, model: ModelName) -> Support {
        self.support[model as usize]
    }

    /// What the feature needs, such as `model="planar" and method="implicit"`.
    fn needs(&self) -> String {
        let has = |model: &ModelName| self.of(*model) != Support::Never;
        let models: Vec<String> =
            ModelName::ALL.into_iter().filter(has).map(|model| format!("model=\"{}\"", model.name())).collect();
        let implicit = self.support.contains(&Support::Implicit);
        format!("{}{}", models.join(" or "), if implicit { " and method=\"implicit\"" } else { "" })
    }
}

impl Feature {
    /// The row of the table.
    pub fn capability(self) -> &'static Capability {
        &CAPABILITIES[self as usize]
    }

    /// Whether a model has it under a method.
    pub fn is_in(self, model: ModelName, method: Method) -> bool {
        match self.capability().of(model) {
            Support::Never => false,
            Support::Implicit => method == Method::Implicit,
            Support::Always => true,
        }
    }

    /// Rejects the feature where it is `used` and the model does not have it.
    ///
    /// # Errors
    /// Names `field`, its value, and what the feature needs.
    pub fn require(
        self,
        (model, method): (ModelName, Method),
        used: bool,
        field: &str,
        value: impl ToString,
    ) -> Result<(), ConfigError> {
        let row = self.capability();
        let expected = || format!("{}: {} needs {}", row.off, row.name, row.needs());
        if !used || self.is_in(model, method) { Ok(()) } else { Err(ConfigError::new(field, value, expected())) }
    }
}

/// Rejects features that a scripted run uses and its model does not have.
///
/// # Errors
/// Names section, field, value, and what the feature needs.
pub fn require_supported(
    model: ModelName,
    method: Method,
    robot: &RobotConfig,
    scene: &SceneConfig,
    controller: &ControllerConfig,
) -> Result<(), ConfigError> {
    let on = (model, method);
    let (all, walls) = (scene.obstacles.len(), scene.obstacles.iter().filter(|one| one.is_wall()).count());
    Feature::Pegs.require(on, all > 0, "scene.obstacles", format!("{all} obstacles"))?;
    Feature::Walls.require(on, walls > 0, "scene.obstacles", format!("{walls} segments, boxes or polygons"))?;
    for (j, obstacle) in scene.obstacles.iter().enumerate() {
        require_supported_obstacle(on, obstacle, &format!("scene.obstacles[{j}]"))?;
    }
    let drop = scene.stribeck.drop;
    Feature::StribeckEffect.require(on, drop != 0.0, "scene.stribeck.drop", drop)?;
    let (has_patches, patches) = (!scene.patches.is_empty(), format!("{} patches", scene.patches.len()));
    Feature::Patches.require(on, has_patches, "scene.patches", &patches)?;
    let expected = "() with an input-output linearising controller, whose model has one friction";
    require(!has_patches || controller.law == ControlLaw::Pd, "scene.patches", patches, expected)?;
    if let Some(backward) = scene.friction_backward {
        let differs = backward != scene.friction[0];
        Feature::Skin.require(on, differs, "scene.friction_backward", backward)?;
        let expected = "None with an input-output linearising controller, whose model is symmetric";
        require(!differs || controller.law == ControlLaw::Pd, "scene.friction_backward", backward, expected)?;
    }
    Feature::SpinFriction.require(on, scene.spin_friction != 0.0, "scene.spin_friction", scene.spin_friction)?;
    let viscous = scene.viscous;
    Feature::ViscousFriction.require(on, viscous != [0.0; 2], "scene.viscous", format!("{viscous:?}"))?;
    let law = scene.friction_law;
    let smooth = law != FrictionLawName::SetValued;
    Feature::SmoothFriction.require(on, smooth, "scene.friction_law", format!("\"{}\"", law.name()))?;
    let is_io = controller.law == ControlLaw::Io;
    Feature::IoLinearization.require(on, is_io, "controller.law", "\"io\"")?;
    let held = controller.treatment != Treatment::Implicit;
    Feature::HeldTorques.require(on, held, "controller.treatment", controller.treatment)?;
    let play = robot.backlash.largest();
    Feature::Backlash.require(on, play != 0.0, "robot.backlash", play)?;
    for (field, values) in [("kp", &robot.kp), ("kd", &robot.kd), ("torque_limit", &robot.torque_limit)] {
        let Some(values) = values else { continue };
        let (field, value) = (format!("robot.{field}"), values.largest());
        Feature::JointGains.require(on, true, &field, value)?;
        require(!is_io, &field, value, "None unless the controller is PD")?;
    }
    let factor = robot.friction_factor.values().iter().copied().find(|factor| *factor != 1.0);
    Feature::LinkFriction.require(on, factor.is_some(), "robot.friction_factor", factor.unwrap_or(1.0))?;
    let expected = "1 with an input-output linearising controller, whose model has one friction";
    require(factor.is_none() || !is_io, "robot.friction_factor", factor.unwrap_or(1.0), expected)?;
    Feature::Motors.require(on, robot.motor.is_some(), "robot.motor", "Motor(...)")?;
    let offset = robot.cg_offset.values().iter().copied().find(|offset| *offset != 0.0);
    Feature::CgOffset.require(on, offset.is_some(), "robot.cg_offset", offset.unwrap_or_default())?;
    Feature::SelfContact.require(on, robot.self_contact == Some(true), "robot.self_contact", "True")?;
    let (rubs, value) = (robot.link_friction > 0.0, robot.link_friction);
    Feature::FrictionBetweenLinks.require(on, rubs, "robot.link_friction", value)?;
    let is_limited = robot.joint_limit.as_ref().is_some_and(PerAxis::is_limit);
    let value = match robot.joint_limit {
        Some(PerAxis::Same(limit)) => limit.to_string(),
        _ => "a list".to_owned(),
    };
    Feature::JointLimits.require(on, is_limited, "robot.joint_limit", value)?;
    require_limits_within_a_turn(on.0, robot)?;
    require_driven_joints(on, robot, scene, controller)?;
    require_axes(on, robot)?;
    let expected = "0 with an input-output linearising controller";
    require(!is_io || play == 0.0, "robot.backlash", play, expected)
}

/// Rejects friction and height of an obstacle, named `field`, where the model does not have them.
///
/// # Errors
/// Names the field, its value, and what it needs.
pub fn require_supported_obstacle(
    on: (ModelName, Method),
    obstacle: &Obstacle,
    field: &str,
) -> Result<(), ConfigError> {
    let Obstacle { friction, height, .. } = *obstacle;
    Feature::ObstacleFriction.require(on, friction > 0.0, &format!("{field}.friction"), friction)?;
    let mass = obstacle.mass.unwrap_or_default();
    Feature::Movables.require(on, obstacle.mass.is_some(), &format!("{field}.mass"), mass)?;
    let is_body = obstacle.shape.is_body() || matches!(obstacle.shape, Shape::Sphere { .. });
    Feature::Bodies.require(on, is_body, field, "no vertical body")?;
    let value = height.unwrap_or(f64::INFINITY);
    Feature::ObstacleHeight.require(on, height.is_some(), &format!("{field}.height"), value)
}

/// Rejects axes of joints that the model does not have. In the plane joints turn by yaw, cardan joints too.
fn require_axes(on: (ModelName, Method), robot: &RobotConfig) -> Result<(), ConfigError> {
    let axes = robot.axes.expand(robot.links - 1).map_err(|e| e.inside("robot"))?;
    for (j, axes) in axes.into_iter().enumerate() {
        let is_other = axes != Axes::Both && (on.0 == ModelName::Spatial || axes != Axes::Yaw);
        Feature::Hinges.require(on, is_other, &format!("robot.axes[{j}]"), axes)?;
    }
    Ok(())
}

/// Rejects limits that a joint of the spatial model would jump over: its angles lie in (-pi, pi].
fn require_limits_within_a_turn(model: ModelName, robot: &RobotConfig) -> Result<(), ConfigError> {
    let Some(limit) = robot.joint_limit.as_ref().filter(|_| model == ModelName::Spatial) else { return Ok(()) };
    for (j, bounds) in limit.bounds(robot.links - 1).map_err(|e| e.inside("robot"))?.into_iter().enumerate() {
        let is_within = bounds.iter().all(|bound| bound.abs() <= LARGEST_LIMIT);
        let is_free = bounds.iter().all(|bound| bound.is_infinite());
        let expected = format!("within [-{LARGEST_LIMIT}, {LARGEST_LIMIT}] in the spatial model, or inf to both sides");
        let field = if let PerAxis::Same(_) = limit {
            "robot.joint_limit".to_owned()
        } else {
            format!("robot.joint_limit[{j}]")
        };
        require(is_within || is_free, &field, format!("{bounds:?}"), &expected)?;
    }
    Ok(())
}

/// Largest finite limit of a joint in 3D \[rad\]: pi, less what a link sinks into a stop.
const LARGEST_LIMIT: f64 = 3.13;

/// Rejects broken joints where the method, the controller or the friction law cannot have them.
fn require_driven_joints(
    on: (ModelName, Method),
    robot: &RobotConfig,
    scene: &SceneConfig,
    controller: &ControllerConfig,
) -> Result<(), ConfigError> {
    for (field, joints) in [("robot.locked", &robot.locked), ("robot.limp", &robot.limp)] {
        let (is_any, value) = (!joints.is_empty(), format!("{joints:?}"));
        Feature::BrokenJoints.require(on, is_any, field, &value)?;
        let is_smooth = scene.friction_law != FrictionLawName::SetValued;
        require(!is_any || !is_smooth, field, &value, "() with a smooth friction law")?;
        let is_pd = controller.law == ControlLaw::Pd;
        require(!is_any || is_pd, field, &value, "() unless the controller is PD")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_feature_has_its_row() {
        for (index, row) in CAPABILITIES.iter().enumerate() {
            assert_eq!(row.feature as usize, index);
            assert_eq!(row.feature.capability().name, row.name);
        }
    }

    #[test]
    fn a_refusal_names_models_and_method_that_have_the_feature() {
        let message = |feature: Feature, model, method| {
            feature.require((model, method), true, "field", 1.0).map_err(|e| e.expected).unwrap_err()
        };
        let play = "0: backlash of the joints needs model=\"planar\" or model=\"spatial\" and method=\"implicit\"";
        assert_eq!(message(Feature::Backlash, ModelName::Minimal, Method::Implicit), play);
        assert_eq!(message(Feature::Backlash, ModelName::Planar, Method::Thesis), play);
        let pegs = "no obstacles: contact with pegs needs model=\"planar\" or model=\"spatial\"";
        assert_eq!(message(Feature::Pegs, ModelName::Minimal, Method::Implicit), pegs);
        assert!(Feature::Backlash.require((ModelName::Spatial, Method::Thesis), false, "field", 0.0).is_ok());
    }
}
