//! The problem of one stage on the set-valued plant: data, without any algorithm.
//!
//! The unknown of a stage is the velocity u at its end, a motion of the chain, such that
//!
//! `M (u - u_ref) + c V u = W_T P_T + W_tau D`, `-W_T^T u in N_{C_T}(P_T)` at both contact points of each link,
//! `D = clamp(b - k omega_J - f M_22_bar omega_J, +-limit)`
//!
//! with all directions at the predicted end configuration. Viscous friction V is implicit (T 6.26); b, k and f hold
//! the controller: `k = c (k_D + c k_P)` for PD (T 7.8), `f = c (K_D + c K_P)` for input-output linearisation
//! (T 6.58 != D21). M_22_bar is the inertia that the joints feel when the virtual joints are free (T 6.55), so
//! `omega_J^T M_22_bar omega_J` is twice the kinetic energy of the motion relative to the rigid motion with the same
//! momenta. Hence u minimises a strongly convex function, exists and is unique.
//! With `f > 0` the limit must be infinite.

use nalgebra::{Vector2, Vector3};

use super::model::ModelLink;
use super::motion::{Composite, LinkMotion, Twist, cross, quarter_turn};

/// One link in a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageLink {
    /// e_x^Bi at the predicted end configuration.
    pub axial: Vector2<f64>,
    /// r_Gi - r_O2 there \[m\].
    pub arm: Vector2<f64>,
    /// u_ref: the velocity the link would have without any force in this stage.
    pub reference: Twist,
    pub mass: f64,
    pub inertia: f64,
    pub half_length: f64,
    /// L_GS \[m\].
    pub lever: f64,
    /// Semi-axes of C_T as impulses of one contact point (T 6.25) \[N s\].
    pub coulomb: Vector2<f64>,
    /// c times the viscous coefficients of one contact point \[kg\].
    pub viscous: Vector2<f64>,
}

impl StageLink {
    /// `link` where the predicted end configuration has it, in a stage of coefficient `c` \[s\] with the reference
    /// velocity `reference`.
    pub fn new(link: &ModelLink, at: &LinkMotion, reference: Twist, c: f64) -> Self {
        Self {
            axial: at.axial,
            arm: at.arm,
            reference,
            mass: link.mass,
            inertia: link.inertia,
            half_length: link.half_length,
            lever: link.lever,
            coulomb: link.friction.coulomb * c,
            viscous: link.friction.viscous * c,
        }
    }

    /// Slip along and across the link at F_i and R_i (T 6.10).
    pub fn slip(&self, u: &Twist) -> [Vector2<f64>; 2] {
        let along = self.axial.x * u.x + self.axial.y * u.y;
        let across = self.axial.x * u.y - self.axial.y * u.x;
        let swing = self.lever * u.z;
        [Vector2::new(along, across + swing), Vector2::new(along, across - swing)]
    }

    /// An impulse in the link's frame as one in the frame of the stage.
    pub fn to_world(&self, p: Vector2<f64>) -> Vector2<f64> {
        self.axial * p.x + quarter_turn(self.axial) * p.y
    }

    /// (L/2) e_y: velocity of the far end relative to the CG at omega = 1.
    pub fn swing(&self) -> Vector2<f64> {
        quarter_turn(self.axial) * self.half_length
    }
}

/// One joint in a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageJoint {
    /// b \[N m s\].
    pub drive: f64,
    /// k \[N m s^2\].
    pub stiffness: f64,
    /// c times the torque limit \[N m s\].
    pub limit: f64,
}

/// Data of one stage.
#[derive(Debug, Clone)]
pub struct Stage {
    /// c \[s\].
    pub coefficient: f64,
    pub links: Vec<StageLink>,
    pub joints: Vec<StageJoint>,
    /// f: weight of the relative momentum in the drives' laws, zero without input-output linearisation.
    pub momentum_feedforward: f64,
}

/// What a solver returns and the certificate verifies.
#[derive(Debug, Clone)]
pub struct StageSolution {
    pub twist: Vec<Twist>,
    /// P_T at F_i and R_i, in the link's frame \[N s\].
    pub friction: Vec<[Vector2<f64>; 2]>,
    /// D, positive driving phi up \[N m s\].
    pub actuator: Vec<f64>,
}

impl StageSolution {
    pub fn new(links: usize) -> Self {
        Self {
            twist: vec![Twist::zeros(); links],
            friction: vec![[Vector2::zeros(); 2]; links],
            actuator: vec![0.0; links - 1],
        }
    }
}

impl Stage {
    pub fn composite(&self) -> Composite {
        Composite::of(self.links.iter().map(|link| (link.mass, link.inertia, link.arm)))
    }

    /// The rigid motion with the momenta of `twist`: velocity of O_2, angular velocity.
    pub fn mean_motion(&self, composite: &Composite, twist: &[Twist]) -> Vector3<f64> {
        let mut momentum = Vector3::zeros();
        for (link, u) in self.links.iter().zip(twist) {
            let linear = u.xy() * link.mass;
            momentum += linear.push(cross(link.arm, linear) + link.inertia * u.z);
        }
        composite.rate_of(momentum)
    }

    /// Momentum of a link relative to a rigid motion.
    pub fn relative_momentum(link: &StageLink, u: &Twist, mean: &Vector3<f64>) -> Vector3<f64> {
        let linear = u.xy() - mean.xy() - quarter_turn(link.arm) * mean.z;
        (linear * link.mass).push(link.inertia * (u.z - mean.z))
    }

    /// Drives without any limit: b - k omega_J - f M_22_bar omega_J.
    pub fn wanted_drives(&self, twist: &[Twist], drive: &mut [f64]) {
        for (j, (wanted, joint)) in drive.iter_mut().zip(&self.joints).enumerate() {
            *wanted = joint.drive - joint.stiffness * (twist[j + 1].z - twist[j].z);
        }
        if self.momentum_feedforward > 0.0 {
            let mean = self.mean_motion(&self.composite(), twist);
            let (mut behind, mut moment) = (Vector2::zeros(), 0.0);
            for i in (1..self.links.len()).rev() {
                let link = &self.links[i];
                let half = link.axial * link.half_length;
                let momentum = Self::relative_momentum(link, &twist[i], &mean);
                moment += momentum.z + cross(half, momentum.xy()) + 2.0 * cross(half, behind);
                behind += momentum.xy();
                drive[i - 1] -= self.momentum_feedforward * moment;
            }
        }
    }
}
