//! The scene: obstacles and the ground's friction (T 3.3.1, T Tables 7.3 and 7.5).

use std::ops::Deref;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, length_or_zero, non_negative, positive, require};
use crate::laws::{Skin, Stribeck};
use crate::obstacles::{Obstacle, Patch};
use crate::slope::Slope;

pub use crate::obstacles::Peg;

/// Laws of dry friction by the names that users write; the smooth ones are the minimal model's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLawName {
    #[default]
    SetValued,
    Arctan,
    Ellipse,
}

impl FrictionLawName {
    /// As users write it.
    pub fn name(self) -> &'static str {
        match self {
            FrictionLawName::SetValued => "set-valued",
            FrictionLawName::Arctan => "arctan",
            FrictionLawName::Ellipse => "ellipse",
        }
    }
}

/// What a user may choose about the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneConfig {
    pub obstacles: Vec<Obstacle>,
    /// Coulomb friction coefficients along and across a link, (mu_Tx, mu_Ty).
    pub friction: [f64; 2],
    /// Coulomb coefficient along a link that slides backward; where it is given, the first of `friction` is that of one that
    /// slides forward. Not the minimal model.
    pub friction_backward: Option<f64>,
    /// Rolling friction coefficient mu_V (T 4.87); the spatial model only.
    pub rolling_friction: f64,
    /// Radius of the disc under each CG that resists turning, zero for a point; the planar model only \[m\].
    pub spin_friction: f64,
    /// How friction falls in sliding (T 7.5.4); not the minimal model.
    pub stribeck: Stribeck,
    /// Where the friction of the ground differs; not the minimal model.
    pub patches: Vec<Patch>,
    /// Viscous coefficients along and across a link, (mu_Vx, mu_Vy) \[s/m\]; the minimal model only.
    pub viscous: [f64; 2],
    pub friction_law: FrictionLawName,
    /// Parameter of the smooth laws.
    pub smoothing: f64,
    /// Inclination of the ground, and the direction in which it rises.
    pub slope: Slope,
}

impl Default for SceneConfig {
    fn default() -> Self {
        Self {
            obstacles: Vec::new(),
            friction: [0.2, 0.2],
            friction_backward: None,
            rolling_friction: 0.02,
            spin_friction: 0.0,
            stribeck: Stribeck::default(),
            patches: Vec::new(),
            viscous: [0.0; 2],
            friction_law: FrictionLawName::SetValued,
            smoothing: SMOOTHING,
            slope: Slope::default(),
        }
    }
}

/// eps_C of (T Table 7.2) \[m/s\].
pub const SMOOTHING: f64 = 1e-3;

/// A validated scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene(SceneConfig);

impl Deref for Scene {
    type Target = SceneConfig;

    fn deref(&self) -> &SceneConfig {
        &self.0
    }
}

impl Scene {
    /// # Errors
    /// Names the peg or the coefficient that is not admissible.
    pub fn new(config: &SceneConfig) -> Result<Self, ConfigError> {
        for (j, obstacle) in config.obstacles.iter().enumerate() {
            obstacle.validate().map_err(|e| e.inside(&format!("obstacles[{j}]")))?;
        }
        non_negative("friction[0]", config.friction[0])?;
        non_negative("friction[1]", config.friction[1])?;
        let has_slopes = config.obstacles.iter().any(|obstacle| obstacle.shape.has_friction_of_ground());
        config.friction_backward.map_or(Ok(0.0), |backward| non_negative("friction_backward", backward))?;
        if let Some(backward) = config.friction_backward.filter(|&backward| backward != config.friction[0]) {
            let expected = "None with a height field that has the friction of the ground";
            require(!has_slopes, "friction_backward", backward, expected)?;
            let has_movables = config.obstacles.iter().any(|obstacle| obstacle.mass.is_some());
            let expected = "None among obstacles that can be pushed";
            require(!has_movables, "friction_backward", backward, expected)?;
        }
        for (j, patch) in config.patches.iter().enumerate() {
            patch.validate().map_err(|e| e.inside(&format!("patches[{j}]")))?;
            let expected = "no patches with a height field that has the friction of the ground: give its cells theirs";
            require(!has_slopes, &format!("patches[{j}]"), "a patch", expected)?;
        }
        non_negative("rolling_friction", config.rolling_friction)?;
        length_or_zero("spin_friction", config.spin_friction)?;
        config.slope.validate()?;
        config.stribeck.validate().map_err(|e| e.inside("stribeck"))?;
        non_negative("viscous[0]", config.viscous[0])?;
        non_negative("viscous[1]", config.viscous[1])?;
        positive("smoothing", config.smoothing)?;
        Ok(Self(config.clone()))
    }

    /// Coefficients of sliding friction along and across a link, the larger ones along, and the skin.
    pub fn sliding(&self) -> (Vector2<f64>, Option<Skin>) {
        Skin::of(self.friction, self.friction_backward)
    }
}

/// The course of (T Table 7.3): nine small pegs, `(radius, x, y)`.
pub const TABLE_7_3: [[f64; 3]; 9] = [
    [0.02, 0.087, 0.077],
    [0.03, 0.474, 0.082],
    [0.01, 0.882, 0.101],
    [0.02, 1.201, 0.097],
    [0.03, 1.671, 0.178],
    [0.01, 1.927, 0.110],
    [0.02, 2.394, 0.153],
    [0.03, 2.705, 0.061],
    [0.01, 3.119, 0.128],
];

/// The course of (T Table 7.5): seven pegs of 12.5 cm radius, `(radius, x, y)`.
pub const TABLE_7_5: [[f64; 3]; 7] = [
    [0.125, 0.051, 0.176],
    [0.125, 0.422, 0.003],
    [0.125, 0.804, 0.185],
    [0.125, 1.153, 0.003],
    [0.125, 1.530, 0.178],
    [0.125, 1.888, 0.002],
    [0.125, 2.259, 0.175],
];

/// CG of link 1 and its absolute angle, `(x, y, theta)`, at which the robot in the posture of the
/// gait (T 7.3) at t = 0 threads the course of (T Table 7.3), ready to move to +x.
pub const START_7_3: [f64; 3] = [1.061490513305, 0.156612371861, 3.930049541055];

/// The same for (T Table 7.5).
pub const START_7_5: [f64; 3] = [1.023858752053, 0.129063935158, 3.895142956015];

/// Free ground: the posture of the gait (T 7.3) whose body axis lies along x.
pub const START_FREE: [f64; 3] = [0.507175344325, -0.011634455967, 3.755516615855];

/// The same for the spatial model, in which friction acts at both ends of a link: CG of link 1, (x, y), and its yaw.
pub const START_SPATIAL_7_3: [f64; 3] = [1.0577, 0.1491, 3.9193288215709865];
pub const START_SPATIAL_7_5: [f64; 3] = [1.0247, 0.1416, 3.90285291343216];
