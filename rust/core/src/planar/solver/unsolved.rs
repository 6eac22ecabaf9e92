use nalgebra::{Vector2, Vector3};

use crate::math::Real;

use super::sweep::Segment;

/// What a linear solve of the chain leaves out of balance, link by link from the first: next to nothing, unless a pivot was.
///
/// The gradient of the chain's unknowns follows from those of its links: all forces together move the head, and link i
/// turns all that lies behind it, of which the sum of the forces before it tells.
pub(super) struct Unsolved<T> {
    /// Sum of the forces on the links so far, in the frame of the last \[N s\].
    force: Vector2<T>,
    /// Imbalance of the last link, without the moment of the joint behind it \[N m s\].
    moment: T,
    /// Squares of all forces and of all moments.
    squares: [T; 2],
}

impl<T: Real> Unsolved<T> {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = T::zero();
        Self { force: Vector2::new(zero, zero), moment: zero, squares: [zero; 2] }
    }

    /// The next link, with what is left of its own balance after the step and the moment of the joint before it.
    #[inline(always)]
    pub fn add(&mut self, segment: &Segment<T>, own: &Vector3<T>, joint_moment: T) {
        self.end_link(joint_moment);
        let [near, far] = segment.arms;
        let before = segment.turn.to_link(self.force);
        let moment = (near + far).subtract_from(before.y, far.subtract_from(own.y, own.z - joint_moment));
        (self.force, self.moment) = (Vector2::new(before.x + own.x, before.y + own.y), moment);
    }

    /// What no joint holds.
    #[inline(always)]
    pub fn add_free(&mut self, own: &Vector3<T>) {
        let [forces, moments] = &mut self.squares;
        (*forces, *moments) = (own.x.mul_add(own.x, own.y.mul_add(own.y, *forces)), own.z.mul_add(own.z, *moments));
    }

    #[inline(always)]
    fn end_link(&mut self, moment_behind: T) {
        let moment = self.moment + moment_behind;
        self.squares[1] = moment.mul_add(moment, self.squares[1]);
    }

    /// Sums of the squares of forces \[(N s)^2\] and of moments \[(N m s)^2\].
    #[inline(always)]
    pub fn squares(mut self) -> [T; 2] {
        self.end_link(T::zero());
        let [x, y] = [self.force.x, self.force.y];
        [x.mul_add(x, y.mul_add(y, self.squares[0])), self.squares[1]]
    }
}
