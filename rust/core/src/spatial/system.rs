use nalgebra::{Vector2, Vector3};

use crate::control::{AxisGains, ControlLaw, ControllerConfig};
use crate::error::{ConfigError, require};
use crate::laws::{Skin, Stribeck};
use crate::obstacles::Patches;
use crate::robot::Robot;
use crate::scene::Scene;

use super::ChainShape;

/// Robot, ground and controller: what no step changes.
#[derive(Debug, Clone)]
pub struct SpatialSystem {
    pub robot: Robot,
    pub controller: ControllerConfig,
    gains: Vec<[AxisGains; 2]>,
    /// mu_Tx, mu_Ty; with a skin the larger mu_Tx.
    pub friction: Vector2<f64>,
    pub skin: Option<Skin>,
    /// mu_V.
    pub rolling_friction: f64,
    pub stribeck: Stribeck,
    pub patches: Patches,
    /// Acceleration of gravity in frame I, whose z axis is the ground's normal \[m/s^2\].
    pub gravity: Vector3<f64>,
    pub(super) shape: ChainShape,
}

impl SpatialSystem {
    /// # Errors
    /// Names the gain that is not admissible, or a control law other than PD.
    pub fn new(robot: Robot, scene: &Scene, controller: ControllerConfig) -> Result<Self, ConfigError> {
        controller.validate()?;
        let expected = "\"pd\": the spatial model has no input-output linearisation";
        require(controller.law == ControlLaw::Pd, "law", "io", expected)?;
        let (friction, skin) = scene.sliding();
        Ok(Self {
            gravity: scene.slope.acceleration(robot.gravity),
            shape: ChainShape::new(&robot),
            gains: controller.gains(&robot),
            robot,
            controller,
            friction,
            skin,
            rolling_friction: scene.rolling_friction,
            stribeck: scene.stribeck,
            patches: Patches::new(&scene.patches),
        })
    }

    /// Of yaw and pitch of each joint.
    pub fn gains(&self) -> &[[AxisGains; 2]] {
        &self.gains
    }
}
