use nalgebra::{Vector2, Vector3};

use crate::control::{AxisGains, ControllerConfig};
use crate::error::ConfigError;
use crate::laws::{Skin, Stribeck, spin_coefficient};
use crate::obstacles::{Nodes, ObstacleGrid, Patches};
use crate::robot::{Link, Robot};
use crate::slope::Slope;

/// Robot, ground and controller: what all robots of a fleet share and no step changes.
#[derive(Debug, Clone)]
pub struct PlanarSystem {
    pub robot: Robot,
    pub controller: ControllerConfig,
    gains: Vec<[AxisGains; 2]>,
    /// mu_Tx, mu_Ty; with a skin the larger mu_Tx.
    friction: Vector2<f64>,
    skin: Option<Skin>,
    /// Of the discs under the CGs \[m\].
    spin_radius: f64,
    stribeck: Stribeck,
    patches: Patches,
    /// In the frame of the ground \[m/s^2\].
    gravity: Vector3<f64>,
    smallest_radius: f64,
}

impl PlanarSystem {
    /// # Errors
    /// Names the gain that is not admissible.
    pub fn new(robot: Robot, friction: [f64; 2], controller: ControllerConfig) -> Result<Self, ConfigError> {
        controller.validate()?;
        let smallest_radius = robot.links.iter().map(|link| link.radius).fold(f64::INFINITY, f64::min);
        let (friction, stribeck) = (Vector2::from(friction), Stribeck::default());
        let gravity = Slope::default().acceleration(robot.gravity);
        Ok(Self {
            gains: controller.gains(&robot),
            robot,
            controller,
            friction,
            skin: None,
            spin_radius: 0.0,
            stribeck,
            patches: Patches::default(),
            gravity,
            smallest_radius,
        })
    }

    /// The same on ground with this Stribeck effect.
    #[must_use]
    pub fn on_ground_with(self, stribeck: Stribeck) -> Self {
        Self { stribeck, ..self }
    }

    /// The same on ground with these patches.
    #[must_use]
    pub fn with_patches(self, patches: Patches) -> Self {
        Self { patches, ..self }
    }

    /// The same with these coefficients of friction, and a skin.
    #[must_use]
    pub fn covered_with(self, (friction, skin): (Vector2<f64>, Option<Skin>)) -> Self {
        Self { friction, skin, ..self }
    }

    /// The same with discs of this radius under the CGs \[m\].
    #[must_use]
    pub fn resisting_spin(self, spin_radius: f64) -> Self {
        Self { spin_radius, ..self }
    }

    /// The same on inclined ground.
    #[must_use]
    pub fn on_slope(self, slope: Slope) -> Self {
        Self { gravity: slope.acceleration(self.robot.gravity), ..self }
    }

    /// Acceleration that pulls the links along the ground \[m/s^2\].
    pub fn pull(&self) -> Vector2<f64> {
        self.gravity.xy()
    }

    /// Of each joint; the first of the two is that of the plane.
    pub fn gains(&self) -> &[[AxisGains; 2]] {
        &self.gains
    }

    pub fn stribeck(&self) -> Stribeck {
        self.stribeck
    }

    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// The links, and behind them what can be pushed.
    pub fn nodes<'a>(&'a self, obstacles: &'a ObstacleGrid) -> Nodes<'a> {
        obstacles.nodes(&self.robot.links)
    }

    /// Radius of the thinnest link \[m\].
    pub fn smallest_radius(&self) -> f64 {
        self.smallest_radius
    }

    pub fn skin(&self) -> Option<Skin> {
        self.skin
    }

    /// mu_Tx, mu_Ty.
    pub fn friction(&self) -> Vector2<f64> {
        self.friction
    }

    /// In the frame of the ground \[m/s^2\].
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// Acceleration of gravity against the ground \[m/s^2\].
    pub fn normal_gravity(&self) -> f64 {
        -self.gravity.z
    }

    /// Friction bound of a link along and across it, mu m g on level ground \[N\].
    pub fn friction_force(&self, link: &Link) -> Vector2<f64> {
        self.friction * (link.friction_factor * link.mass * self.normal_gravity())
    }

    /// Whether the ground resists turning.
    pub fn resists_spin(&self) -> bool {
        self.spin_radius > 0.0
    }

    /// Largest moment of the ground against the spin of a link, with these shares of the coefficients of friction \[N m\].
    pub fn spin_torque(&self, link: &Link, shares: &Vector2<f64>) -> f64 {
        let load = link.friction_factor * link.mass * self.normal_gravity();
        spin_coefficient(&self.friction.component_mul(shares), self.skin) * (self.spin_radius * load)
    }

    /// Largest Coulomb force of one of two contact points of a link, along and across it, in the model of input-output
    /// linearisation \[N\].
    pub fn point_friction(&self, link: &Link) -> Vector2<f64> {
        self.model_friction() * (0.5 * link.mass * self.robot.gravity)
    }

    /// Coulomb coefficients of that model, whose ground is level.
    pub fn model_friction(&self) -> Vector2<f64> {
        self.friction * (self.normal_gravity() / self.robot.gravity)
    }
}
