//! Inertia and potential energy of a link (T 4.4.1).

use nalgebra::{Vector3, Vector6};

use crate::robot::Link;

use super::{Pose, twist_of};

/// Moments of inertia about the axes of frame B, (Theta_psi, Theta_psi, Theta_rho) \[kg m^2\].
pub fn inertia(link: &Link) -> Vector3<f64> {
    Vector3::new(link.inertia, link.inertia, link.roll_inertia)
}

/// The diagonal of M_i (T 4.70) \[kg, kg m^2\].
pub fn mass_diagonal(link: &Link) -> Vector6<f64> {
    twist_of(Vector3::repeat(link.mass), inertia(link))
}

/// m g z on level ground \[J\].
pub fn potential_energy(link: &Link, gravity: &Vector3<f64>, pose: &Pose) -> f64 {
    -(gravity * link.mass).dot(&pose.position)
}
