use nalgebra::{Vector2, Vector3};

use crate::math::Real;

use super::{Mobility, norm, worse};

/// One link of a chain in the plane.
#[derive(Debug, Clone, Copy)]
pub struct BalancedLink<T> {
    pub mass: T,
    /// About the CG \[kg m^2\].
    pub inertia: T,
    /// L_i / 2 \[m\].
    pub half_length: T,
    /// How far the CG lies in front of the middle \[m\].
    pub cg_offset: T,
    pub mobility: Mobility<T>,
    /// Unit vector across the link.
    pub lateral: Vector2<T>,
    /// u - u_ref, (x, y, angular).
    pub change: Vector3<T>,
    /// Impulses of everything but the joints, as (x, y, moment about the CG).
    pub applied: Vector3<T>,
}

/// Balance of momentum of a chain in the plane, accumulated link by link from the head.
///
/// The joint impulses that balance the linear momentum of links 1..i in turn leave, on each link, a moment that must
/// vanish, and on the last one a force that must vanish.
#[derive(Debug, Clone, Copy)]
pub struct ChainBalance<T> {
    /// Impulse of the joint before the next link.
    from_before: Vector2<T>,
    /// Worst imbalance, as a velocity \[m/s\].
    pub worst: T,
    /// Half the squared imbalance in the norm of M^-1, added to what it began with \[J\].
    pub energy: T,
}

impl<T: Real> ChainBalance<T> {
    #[inline(always)]
    pub fn new(energy: T) -> Self {
        Self { from_before: Vector2::new(T::zero(), T::zero()), worst: T::zero(), energy }
    }

    /// Adds the next link; there is no joint behind the last one.
    #[inline(always)]
    pub fn add(&mut self, link: &BalancedLink<T>, is_last: bool) {
        let BalancedLink { mobility, lateral, change, applied, .. } = link;
        let (zero, half, from_before) = (T::zero(), T::splat(0.5), self.from_before);
        let left = Vector2::new(
            applied.x + from_before.x - link.mass * change.x,
            applied.y + from_before.y - link.mass * change.y,
        );
        let to_next = if is_last { Vector2::new(zero, zero) } else { left };
        // The impulses at both ends turn the link about its middle, and their sum about the CG.
        let pull = lateral.x * (from_before.x + to_next.x) + lateral.y * (from_before.y + to_next.y);
        let push = lateral.x * (from_before.x - to_next.x) + lateral.y * (from_before.y - to_next.y);
        let moment = applied.z - link.half_length * pull + link.cg_offset * push - link.inertia * change.z;
        self.worst = worse(self.worst, moment.abs() * mobility.end);
        self.energy += half * moment * moment * mobility.moment;
        if is_last {
            self.worst = worse(self.worst, norm(left.x, left.y) * mobility.force);
            self.energy += half * (left.x * left.x + left.y * left.y) * mobility.force;
        }
        self.from_before = to_next;
    }
}
