//! Limits of the joint angles: unilateral laws on the axes of joints.
//!
//! `0 <= P  _|_  limit -+ phi >= 0` has half the length of the link before the joint as lever, so that gaps are in metres
//! and impulses in newton seconds. The angle at the end of a stage is linear in its rate, phi = phi_B + c phi': the end of
//! a stage obeys the limit exactly. An axis is one coordinate of the chain, for which its elimination has a term already.

use crate::contact::recovery::{RECOVERY_SPEED, remaining_gap};
use crate::math::{Mask, Real};
use crate::robot::Robot;

use super::{ClosingRow, Closings};

/// Both stops of an axis in a stage, that at the largest angle first: they close when `offset[0] - lever phi'` and
/// `offset[1] + lever phi'` reach zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageStop<T = f64> {
    /// \[m\]
    pub lever: T,
    /// Gaps without motion over the coefficient of the stage, [`Self::FAR`] in lanes far from the stops \[m/s\].
    pub offset: [T; 2],
}

impl<T: Real> StageStop<T> {
    /// Signs of the two stops: the rate of a gap is `-side lever phi'`.
    pub const SIDES: [f64; 2] = [1.0, -1.0];

    /// Offset of a stop that no joint can reach \[m/s\].
    pub const FAR: f64 = 1e6;

    /// Moment about the axis of impulses at the stops, positive where it drives phi upwards \[N m s\].
    #[inline(always)]
    pub fn moment(&self, impulse: &[T; 2]) -> T {
        self.lever * (impulse[1] - impulse[0])
    }

    /// Axis and side of those of some stops that a lane has.
    pub fn in_lane(stops: &[Self], lane: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let places = (0..stops.len()).flat_map(|axis| [(axis, 0), (axis, 1)]);
        places.filter(move |&(axis, side)| stops[axis].offset[side].lane(lane) < Self::FAR)
    }
}

/// The stops of all axes of a register's robots: of each joint, and in 3D yaw before pitch.
#[derive(Debug, Clone)]
pub struct JointStops<T: Real> {
    /// Largest angle \[rad\].
    limit: T,
    /// Of each axis \[m\].
    lever: Vec<T>,
    /// The lanes with a joint near its limit at the predicted end.
    near: T::Mask,
    /// Forces in the last stage, and at the end of the last accepted part \[N\].
    force: Vec<[T; 2]>,
    start_force: Vec<[T; 2]>,
}

impl<T: Real> JointStops<T> {
    /// Of joints with `axes` axes each.
    pub fn new(robot: &Robot, axes: usize) -> Self {
        let joints = &robot.links[..robot.link_count() - 1];
        let lever: Vec<_> =
            joints.iter().flat_map(|link| std::iter::repeat_n(T::splat(0.5 * link.length), axes)).collect();
        let none = vec![[T::zero(); 2]; lever.len()];
        Self {
            limit: T::splat(robot.joint_limit),
            lever,
            near: T::Mask::of(|_| false),
            force: none.clone(),
            start_force: none,
        }
    }

    /// Records the lanes whose largest joint angle `bend` is near the limit.
    #[inline(always)]
    pub fn predict(&mut self, bend: T) {
        self.near = (self.limit - T::splat(CLEARANCE)).lt(bend);
    }

    /// Takes over the forces at the end of a robot's last accepted part.
    pub fn load(&mut self, lane: usize, force: &[[f64; 2]]) {
        for ((lanes, start), force) in self.force.iter_mut().zip(&mut self.start_force).zip(force) {
            for side in 0..2 {
                lanes[side].set_lane(lane, force[side]);
                start[side].set_lane(lane, force[side]);
            }
        }
    }

    pub fn save(&self, lane: usize, force: &mut [[f64; 2]]) {
        for (force, lanes) in force.iter_mut().zip(&self.force) {
            *force = lanes.map(|lanes| lanes.lane(lane));
        }
    }

    /// Lists the stops of a stage of coefficient `c` that ends `elapsed` after the start of the part, given the angle of
    /// each axis at that start and at the base of the stage; none if no lane is near one.
    #[inline(always)]
    pub fn fill(
        &self,
        angles: impl Iterator<Item = [T; 2]>,
        c: T,
        elapsed: T,
        stops: &mut Vec<StageStop<T>>,
        impulses: &mut Vec<[T; 2]>,
    ) {
        stops.clear();
        impulses.clear();
        if !self.near.any() {
            return;
        }
        let (per_second, slowest) = (T::splat(1.0) / c, T::splat(-RECOVERY_SPEED));
        for ((lever, force), [start, base]) in self.lever.iter().zip(&self.force).zip(angles) {
            let offset = StageStop::<T>::SIDES.map(|side| {
                let gap = |angle: T| *lever * (self.limit - T::splat(side) * angle);
                let kept = remaining_gap((-gap(start)).max(T::zero()), elapsed);
                let offset = ((gap(base) - kept) * per_second).max(slowest);
                T::select(self.near, offset, T::splat(StageStop::<T>::FAR))
            });
            stops.push(StageStop { lever: *lever, offset });
            impulses.push(force.map(|force| force * c));
        }
    }

    /// Keeps the forces of a stage of coefficient `c` in the given lanes.
    #[inline(always)]
    pub fn store(&mut self, impulses: &[[T; 2]], c: T, lanes: T::Mask) {
        let per_second = T::splat(1.0) / c;
        for (i, force) in self.force.iter_mut().enumerate() {
            for (side, force) in force.iter_mut().enumerate() {
                let new = impulses.get(i).map_or(T::zero(), |impulse| impulse[side] * per_second);
                *force = T::select(lanes, new, *force);
            }
        }
    }

    /// Adds the closings in a lane's solved stage; `rates` gives the rate of an axis that was expected, and the solution's.
    pub fn add_closings(
        &self,
        lane: usize,
        stops: &[StageStop<T>],
        rates: impl Fn(usize) -> [T; 2],
        [c, elapsed]: [T; 2],
        closings: &mut Closings,
    ) {
        if !self.near.lane(lane) {
            return;
        }
        for (axis, stop) in stops.iter().enumerate() {
            let [expected, solved] = rates(axis).map(|rate| (stop.lever * rate).lane(lane));
            for (k, side) in StageStop::<T>::SIDES.into_iter().enumerate() {
                let row = ClosingRow {
                    offset: stop.offset[k].lane(lane),
                    expected_rate: -side * expected,
                    rate: -side * solved,
                    presses: self.force[axis][k].lane(lane) > 0.0,
                    touched: self.start_force[axis][k].lane(lane) > 0.0,
                };
                closings.add(lane, &row, c.lane(lane), elapsed.lane(lane));
            }
        }
    }
}

/// Distance of a joint from its limit below which stops take part \[rad\]: more than joints turn between a prediction and
/// the end of its stage.
const CLEARANCE: f64 = 0.1;
