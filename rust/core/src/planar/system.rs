use nalgebra::{Vector2, Vector3};

use crate::control::{AxisGains, ControllerConfig};
use crate::error::ConfigError;
use crate::laws::{Skin, Stribeck, spin_coefficient};
use crate::obstacles::{Nodes, ObstacleGrid, Patches};
use crate::robot::{Link, Robot};
use crate::scene::Scene;

/// Robot, ground and controller: what all robots of a fleet share and no step changes.
#[derive(Debug, Clone)]
pub struct PlanarSystem {
    pub robot: Robot,
    pub controller: ControllerConfig,
    gains: Vec<[AxisGains; 2]>,
    /// mu_Tx, mu_Ty; with a skin the larger mu_Tx.
    friction: Vector2<f64>,
    pub skin: Option<Skin>,
    /// Of the discs under the CGs \[m\].
    spin_radius: f64,
    pub stribeck: Stribeck,
    pub patches: Patches,
    /// In the frame of the ground \[m/s^2\].
    pub gravity: Vector3<f64>,
    /// Of the thinnest link \[m\].
    pub smallest_radius: f64,
}

impl PlanarSystem {
    /// # Errors
    /// Names the gain that is not admissible.
    pub fn new(robot: Robot, scene: &Scene, controller: ControllerConfig) -> Result<Self, ConfigError> {
        controller.validate()?;
        let (friction, skin) = scene.sliding();
        Ok(Self {
            gravity: scene.slope.acceleration(robot.gravity),
            smallest_radius: robot.links.iter().map(|link| link.radius).fold(f64::INFINITY, f64::min),
            gains: controller.gains(&robot),
            robot,
            controller,
            friction,
            skin,
            spin_radius: scene.spin_friction,
            stribeck: scene.stribeck,
            patches: Patches::new(&scene.patches),
        })
    }

    /// Acceleration that pulls the links along the ground \[m/s^2\].
    pub fn pull(&self) -> Vector2<f64> {
        self.gravity.xy()
    }

    /// Of each joint; the first of the two is that of the plane.
    pub fn gains(&self) -> &[[AxisGains; 2]] {
        &self.gains
    }

    /// The links, and behind them what can be pushed.
    pub fn nodes<'a>(&'a self, obstacles: &'a ObstacleGrid) -> Nodes<'a> {
        obstacles.nodes(&self.robot.links)
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
