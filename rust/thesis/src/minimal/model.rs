use nalgebra::{Vector2, Vector3};
use snake_core::error::{ConfigError, non_negative};
use snake_core::planar::{LinkInertia, own_inertia};
use snake_core::robot::{Breakage, Robot};
use snake_core::scene::SceneConfig;
use snake_core::slope::Slope;

use super::SmoothLaw;
use super::friction::Friction;
use super::motion::{LinkMotion, quarter_turn};

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
        LinkInertia { mass: self.mass, inertia: self.inertia, front: self.half_length, rear_ratio: 1.0 }
    }

    /// Slip velocity of the contact point `lever` before G_i, in the link's frame (T 6.10), (T 6.13).
    fn slip(at: &LinkMotion, lever: f64) -> Vector2<f64> {
        let (v, e) = (&at.twist, &at.axial);
        Vector2::new(e.x * v.x + e.y * v.y, e.x * v.y - e.y * v.x + lever * v.z)
    }

    /// Friction of both contact points: force in the frame of the motion, and moment about G_i.
    pub fn friction_force(&self, at: &LinkMotion, law: SmoothLaw) -> Vector3<f64> {
        let front = self.friction.force(law, Self::slip(at, self.lever));
        let rear = self.friction.force(law, Self::slip(at, -self.lever));
        let force = front + rear;
        let world = at.axial * force.x + quarter_turn(at.axial) * force.y;
        world.push(self.lever * (front.y - rear.y))
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
        own_inertia(&self.links.iter().map(ModelLink::inertia).collect::<Vec<_>>())
    }

    /// n: two virtual prismatic joints, one virtual revolute joint and the real joints (T 6.3).
    pub fn degrees(&self) -> usize {
        self.links.len() + 2
    }
}
