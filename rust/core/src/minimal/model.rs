use nalgebra::{DMatrix, Vector2, Vector3};

use crate::error::{ConfigError, non_negative};
use crate::robot::{Breakage, Robot};
use crate::scene::SceneConfig;
use crate::slope::Slope;

use super::friction::Friction;
use super::inverse_dynamics::{InverseDynamics, LinkInertia};
use super::motion::{Base, Motion};

/// The ground under the minimal model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// mu_Cx, mu_Cy: Coulomb coefficients along and across a link.
    pub coulomb: [f64; 2],
    /// mu_Vx, mu_Vy: viscous coefficients along and across a link \[s/m\].
    pub viscous: [f64; 2],
    pub slope: Slope,
}

impl Default for Ground {
    /// (T Table 7.2), "robot model".
    fn default() -> Self {
        Self { coulomb: [0.2, 0.5], viscous: [0.1, 0.2], slope: Slope::default() }
    }
}

impl Ground {
    /// The ground of a scene.
    pub fn of(scene: &SceneConfig) -> Self {
        Self { coulomb: scene.friction, viscous: scene.viscous, slope: scene.slope }
    }

    /// # Errors
    /// Names the coefficient that is negative or not finite.
    pub fn validate(&self) -> Result<(), ConfigError> {
        for (field, value) in [
            ("friction[0]", self.coulomb[0]),
            ("friction[1]", self.coulomb[1]),
            ("viscous[0]", self.viscous[0]),
            ("viscous[1]", self.viscous[1]),
        ] {
            non_negative(field, value)?;
        }
        self.slope.validate()
    }
}

/// One link and its two contact points F_i and R_i with the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelLink {
    /// m_i \[kg\].
    pub mass: f64,
    /// Theta_psi,i \[kg m^2\].
    pub inertia: f64,
    /// L_i / 2 \[m\].
    pub half_length: f64,
    /// L_GS,i: F_i and R_i lie this far before and behind G_i (T 6.13) \[m\].
    pub lever: f64,
    /// Friction of one contact point, which carries half the link's normal force.
    pub friction: Friction,
}

impl ModelLink {
    pub fn inertia(&self) -> LinkInertia {
        LinkInertia { mass: self.mass, inertia: self.inertia, half_length: self.half_length }
    }
}

/// The chain of chapter 6: constants only. The thesis's n is `degrees()`.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    pub links: Vec<ModelLink>,
    /// Acceleration by which gravity pulls all links along inclined ground, in frame I \[m/s^2\].
    pub pull: Vector2<f64>,
    /// Joints that are locked or limp.
    pub broken: Vec<(usize, Breakage)>,
}

impl Model {
    pub fn new(robot: &Robot, ground: &Ground) -> Self {
        let gravity = ground.slope.acceleration(robot.gravity);
        let links = robot.links.iter().map(|link| ModelLink {
            mass: link.mass,
            inertia: link.inertia,
            half_length: 0.5 * link.length,
            lever: link.contact_half_length,
            friction: Friction::of_point(0.5 * link.mass * -gravity.z, ground),
        });
        Self { links: links.collect(), pull: gravity.xy(), broken: robot.broken.clone() }
    }

    pub fn link_count(&self) -> usize {
        self.links.len()
    }

    pub fn joint_count(&self) -> usize {
        self.links.len() - 1
    }

    /// 1 / (M_22_bar^-1)_jj of the straight robot: the inertia each joint feels when all others are free
    /// \[kg m^2\].
    pub fn own_inertia(&self) -> Vec<f64> {
        let joints = self.joint_count();
        let still = vec![0.0; joints];
        let mut motion = Motion::new(self.link_count());
        motion.set(self, Base { theta: 0.0, rate: Vector3::zeros() }, &still, &still);
        let mut dynamics = InverseDynamics::new(self);
        let mut mass = DMatrix::zeros(joints, joints);
        for j in 0..joints {
            let unit: Vec<f64> = (0..joints).map(|k| f64::from(u8::from(k == j))).collect();
            dynamics.torques(self, &motion, None, &unit, mass.column_mut(j).as_mut_slice());
        }
        let mobility = mass.cholesky().map(|factor| factor.inverse());
        (0..joints).map(|j| mobility.as_ref().map_or(0.0, |mobility| mobility[(j, j)].recip())).collect()
    }

    /// n: two virtual prismatic joints, one virtual revolute joint and the real joints (T 6.3).
    pub fn degrees(&self) -> usize {
        self.links.len() + 2
    }
}
