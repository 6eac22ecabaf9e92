//! Torques that give the joints desired accelerations, the virtual joints being free: (T 6.58) in O(n).
//!
//! (T 6.58) takes M_22 - M_21 M_11^-1 M_12 apart into two steps that need no matrix: the base balance
//! (T 6.53), three equations for the acceleration of the virtual joints, and the moments about each
//! joint of all that lies behind it. Written for one robot or for several in the lanes of a register.

use nalgebra::Vector3;

use crate::math::Real;

use super::motion::{Composite, LinkMotion, Motion};
use super::{Model, ModelLink};
use crate::laws::SmoothLaw;

/// Inertia of one link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia<T = f64> {
    pub mass: T,
    /// About the CG \[kg m^2\].
    pub inertia: T,
    /// L_i / 2 \[m\].
    pub half_length: T,
}

impl LinkInertia {
    /// The same in every lane.
    pub fn splat<T: Real>(&self) -> LinkInertia<T> {
        let Self { mass, inertia, half_length } = *self;
        LinkInertia { mass: T::splat(mass), inertia: T::splat(inertia), half_length: T::splat(half_length) }
    }
}

/// Workspace: forces on each link as (x, y, moment about G_i).
#[derive(Debug, Clone)]
pub struct InverseDynamics<T = f64> {
    links: Vec<LinkInertia<T>>,
    /// Applied forces, to be written before [`Self::solve`].
    pub applied: Vec<Vector3<T>>,
    /// Inertia minus applied forces.
    force: Vec<Vector3<T>>,
}

impl InverseDynamics {
    pub fn new(model: &Model) -> Self {
        Self::with(model.links.iter().map(ModelLink::inertia).collect())
    }

    /// tau for joint accelerations `u` under the smooth friction `law`; returns the acceleration of the
    /// virtual joints, of O_2 and of theta, in the frame of `motion`.
    ///
    /// With `law` none there is no friction, and with a motion at rest tau is `M_22_bar u`.
    pub fn torques(
        &mut self,
        model: &Model,
        motion: &Motion,
        law: Option<SmoothLaw>,
        u: &[f64],
        tau: &mut [f64],
    ) -> Vector3<f64> {
        for ((applied, link), at) in self.applied.iter_mut().zip(&model.links).zip(&motion.links) {
            *applied = law.map_or_else(Vector3::zeros, |law| at.friction(link, law));
        }
        self.solve(&motion.links, u, tau)
    }
}

impl<T: Real> InverseDynamics<T> {
    pub fn with(links: Vec<LinkInertia<T>>) -> Self {
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        Self { applied: vec![zero; links.len()], force: vec![zero; links.len()], links }
    }

    /// tau for joint accelerations `u` under the applied forces; returns the acceleration of the virtual joints.
    #[inline(always)]
    pub fn solve(&mut self, motion: &[LinkMotion<T>], u: &[T], tau: &mut [T]) -> Vector3<T> {
        let base = self.base_acceleration(motion, u);
        self.moments(motion, &base, tau);
        base
    }

    /// Forces with the acceleration of the virtual joints left out, then that acceleration (T 6.53).
    #[inline(always)]
    fn base_acceleration(&mut self, motion: &[LinkMotion<T>], u: &[T]) -> Vector3<T> {
        let zero = T::zero();
        let (mut alpha, mut joint_x, mut joint_y) = (zero, zero, zero);
        let (mut x, mut y, mut moment) = (zero, zero, zero);
        for (i, (link, at)) in self.links.iter().zip(motion).enumerate() {
            if i > 0 {
                alpha += u[i - 1];
            }
            let (half_x, half_y) = (at.axial.x * link.half_length, at.axial.y * link.half_length);
            // Tangential and centripetal acceleration over half the link.
            let square = at.twist.z * at.twist.z;
            let (along_x, along_y) = (-half_y * alpha - half_x * square, half_x * alpha - half_y * square);
            let applied = &self.applied[i];
            let force = Vector3::new(
                (joint_x + along_x) * link.mass - applied.x,
                (joint_y + along_y) * link.mass - applied.y,
                link.inertia * alpha - applied.z,
            );
            x += force.x;
            y += force.y;
            moment += force.z + at.arm.x * force.y - at.arm.y * force.x;
            self.force[i] = force;
            joint_x += along_x + along_x;
            joint_y += along_y + along_y;
        }
        let links = self.links.iter().zip(motion);
        let composite = Composite::of(links.map(|(link, at)| (link.mass, link.inertia, at.arm)));
        composite.rate_of(Vector3::new(-x, -y, -moment))
    }

    /// From tail to head: the moment about each joint of the forces behind it.
    #[inline(always)]
    fn moments(&self, motion: &[LinkMotion<T>], base: &Vector3<T>, tau: &mut [T]) {
        let (mut x, mut y, mut moment) = (T::zero(), T::zero(), T::zero());
        for i in (1..self.force.len()).rev() {
            let (link, at, force) = (&self.links[i], &motion[i], &self.force[i]);
            let (half_x, half_y) = (at.axial.x * link.half_length, at.axial.y * link.half_length);
            let own_x = force.x + (base.x - at.arm.y * base.z) * link.mass;
            let own_y = force.y + (base.y + at.arm.x * base.z) * link.mass;
            moment += force.z + link.inertia * base.z;
            moment += half_x * (own_y + y + y) - half_y * (own_x + x + x);
            x += own_x;
            y += own_y;
            tau[i - 1] = moment;
        }
    }
}
