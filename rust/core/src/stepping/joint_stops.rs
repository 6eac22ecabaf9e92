//! Limits of the joint angles: unilateral laws on the axes of joints.
//!
//! `0 <= P  _|_  limit -+ phi >= 0` has half the length of the link before the joint as lever, so that gaps are in metres
//! and impulses in newton seconds. The angle at the end of a stage is linear in its rate, phi = phi_B + c phi': the end of
//! a stage obeys the limit exactly. An axis is one coordinate of the chain, for which its elimination has a term already.

use serde::{Deserialize, Serialize};

use crate::contact::recovery::{RECOVERY_SPEED, remaining_gap};
use crate::math::{Mask, Real};
use crate::robot::Robot;

use super::{ClosingRow, Closings};

/// Both stops of an axis in a stage, that at the largest angle first: they close when `offset[0] - lever phi'` and
/// `offset[1] + lever phi'` reach zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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

    /// Axis and side of those of some stops that a lane's joints may reach.
    pub fn in_lane(stops: &[Self], lane: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let places = (0..stops.len()).flat_map(|axis| [(axis, 0), (axis, 1)]);
        places.filter(move |&(axis, side)| stops[axis].offset[side].lane(lane) < REACHABLE)
    }
}

/// The stops of all axes of a register's robots: of each joint, and in 3D yaw before pitch.
pub struct JointStops<T: Real> {
    /// Largest angle of all axes to either side, zero where they have limits of their own \[rad\].
    limit: T,
    /// Those: largest angle of each axis to both sides; empty where all are alike \[rad\].
    bounds: Vec<[T; 2]>,
    /// Of each axis \[m\].
    lever: Vec<T>,
    /// The lanes with a joint near its limit at the predicted end, those of them whose stage has stops, and those that ended
    /// beyond the limit without.
    near: T::Mask,
    within_reach: T::Mask,
    missed: T::Mask,
    /// Of all axes in the current stage; empty where no lane is near its limit.
    stops: Vec<StageStop<T>>,
    /// Forces in the last stage, and at the end of the last accepted part \[N\].
    force: Vec<[T; 2]>,
    start_force: Vec<[T; 2]>,
    /// Whether any of them may be other than zero.
    has_forces: bool,
}

impl<T: Real> JointStops<T> {
    /// Of joints with `axes` axes each.
    pub fn new(robot: &Robot, axes: usize) -> Self {
        let joints = &robot.links[..robot.link_count() - 1];
        let lever: Vec<_> =
            joints.iter().flat_map(|link| std::iter::repeat_n(T::splat(0.5 * link.length), axes)).collect();
        let none = vec![[T::zero(); 2]; lever.len()];
        let largest = robot.joint_limit();
        let alike = robot.joint_bounds.iter().all(|bounds| *bounds == [-largest, largest]);
        let (limit, bounds) = if alike { (largest, Vec::new()) } else { (0.0, own_bounds(robot, axes)) };
        Self {
            limit: T::splat(limit),
            bounds,
            lever,
            near: T::Mask::of(|_| false),
            within_reach: T::Mask::of(|_| false),
            missed: T::Mask::of(|_| false),
            stops: Vec::with_capacity(none.len()),
            force: none.clone(),
            start_force: none,
            has_forces: false,
        }
    }

    /// Whether joints have limits of their own.
    pub fn has_own_bounds(&self) -> bool {
        !self.bounds.is_empty()
    }

    /// How far the axis that is nearest to its limit, or farthest beyond, is beyond it; for joints with limits of their own
    /// the `bend` of [`Self::predict`] and [`Self::arrive`] \[rad\].
    #[inline(always)]
    pub fn excess(&self, angles: impl Iterator<Item = T>) -> T {
        let mut largest = T::splat(-StageStop::<T>::FAR);
        let mut bounds = self.bounds.iter();
        for angle in angles {
            let Some([upper, lower]) = bounds.next() else { break };
            largest = largest.max((angle - *upper).max(-angle - *lower));
        }
        largest
    }

    /// Records the lanes whose largest joint angle `bend` is near the limit.
    #[inline(always)]
    pub fn predict(&mut self, bend: T) {
        self.near = (self.limit - T::splat(CLEARANCE)).lt(bend);
        self.within_reach = (self.limit - T::splat(REACH)).lt(bend);
    }

    /// Records the lanes whose largest joint angle at the end of the solved stage is `bend`.
    #[inline(always)]
    pub fn arrive(&mut self, bend: T) {
        self.missed = !self.within_reach & self.limit.lt(bend);
    }

    /// Whether a lane's solved stage ended beyond a stop that it did not have, since its prediction was far from there.
    pub fn has_missed(&self, lane: usize) -> bool {
        self.missed.lane(lane)
    }

    /// Takes over the forces at the ends of the robots' last accepted parts, none from those without.
    pub fn load<'a>(&mut self, forces: impl Fn(usize) -> &'a [[f64; 2]]) {
        let presses = (0..T::LANES).any(|lane| !forces(lane).is_empty());
        if !presses && !self.has_forces {
            return;
        }
        self.has_forces = presses;
        for (axis, (force, start)) in self.force.iter_mut().zip(&mut self.start_force).enumerate() {
            for lane in 0..T::LANES {
                let [upper, lower] = forces(lane).get(axis).copied().unwrap_or_default();
                force[0].set_lane(lane, upper);
                force[1].set_lane(lane, lower);
            }
            *start = *force;
        }
    }

    /// Passes on the forces of a lane's robot, none if no stop presses.
    pub fn save(&self, lane: usize, forces: &mut Vec<[f64; 2]>) {
        forces.clear();
        let of_lane = |force: &[T; 2]| [force[0].lane(lane), force[1].lane(lane)];
        if self.has_forces && self.force.iter().any(|force| of_lane(force) != [0.0; 2]) {
            forces.extend(self.force.iter().map(of_lane));
        }
    }

    /// Lists the stops of a stage of coefficient `c` that ends `elapsed` after the start of the part, given the angle of
    /// each axis at that start and at the base of the stage; none if no lane is within reach of one.
    #[inline(always)]
    pub fn fill(
        &mut self,
        angles: impl Iterator<Item = (T, T)>,
        c: T,
        elapsed: T,
        stops: &mut Vec<StageStop<T>>,
        impulses: &mut Vec<[T; 2]>,
    ) {
        self.stops.clear();
        stops.clear();
        impulses.clear();
        if !self.near.any() {
            return;
        }
        let (per_c, mut levers) = (T::splat(1.0) / c, self.lever.iter().enumerate());
        for (start, base) in angles {
            let Some((axis, &lever)) = levers.next() else { break };
            let [upper, lower] = self.bounds.get(axis).copied().unwrap_or([self.limit; 2]);
            let offset = [
                offset(upper, lever, start, base, per_c, elapsed),
                offset(lower, lever, -start, -base, per_c, elapsed),
            ];
            self.stops.push(StageStop { lever, offset });
        }
        if !self.within_reach.any() {
            return;
        }
        // A stop that is out of reach does not press, whatever it did before: results must not depend on neighbours.
        let (reach, far, zero) = (self.within_reach, T::splat(StageStop::<T>::FAR), T::zero());
        for (StageStop { lever, offset: [upper, lower] }, force) in self.stops.iter().zip(&self.force) {
            let offset = [T::select(reach, *upper, far), T::select(reach, *lower, far)];
            stops.push(StageStop { lever: *lever, offset });
            impulses.push([T::select(reach, force[0] * c, zero), T::select(reach, force[1] * c, zero)]);
        }
    }

    /// Keeps the forces of a solved stage in the given lanes, and adds when stops close; `rates` are those of the axes that
    /// were expected, and the solution's. For `c` and `elapsed` see [`Self::fill`].
    #[inline(always)]
    pub fn store(
        &mut self,
        impulses: &[[T; 2]],
        rates: impl Iterator<Item = (T, T)>,
        [c, elapsed]: [T; 2],
        lanes: T::Mask,
        closings: &mut Closings<T>,
    ) {
        if impulses.is_empty() && self.has_forces {
            self.let_go(lanes);
        }
        self.has_forces |= !impulses.is_empty();
        let per_second = T::splat(1.0) / c;
        let clearance = T::splat(CLEARANCE) * per_second;
        let mut rows = self.stops.iter().zip(self.force.iter_mut().zip(&self.start_force)).enumerate();
        for (expected, rate) in rates {
            let Some((axis, (stop, (force, start_force)))) = rows.next() else { break };
            let impulse = impulses.get(axis).copied().unwrap_or([T::zero(); 2]);
            for side in 0..2 {
                if !impulses.is_empty() {
                    force[side] = T::select(lanes, impulse[side] * per_second, force[side]);
                }
                let lever = if side == 0 { -stop.lever } else { stop.lever };
                let is_near = (stop.offset[side] + lever * rate).lt(stop.lever * clearance);
                let row = ClosingRow {
                    offset: stop.offset[side],
                    expected_rate: lever * expected,
                    rate: lever * rate,
                    presses: T::zero().lt(impulse[side]),
                    touched: T::zero().lt(start_force[side]),
                };
                closings.add(row.times(c, elapsed, self.near & is_near));
            }
        }
    }

    /// No forces in the given lanes.
    #[inline(always)]
    fn let_go(&mut self, lanes: T::Mask) {
        for force in &mut self.force {
            force[0] = T::select(lanes, T::zero(), force[0]);
            force[1] = T::select(lanes, T::zero(), force[1]);
        }
    }
}

/// Offset of the stop at the largest angle of an axis with these angles, in a stage of coefficient 1 / `per_c`.
#[inline(always)]
fn offset<T: Real>(limit: T, lever: T, start: T, base: T, per_c: T, elapsed: T) -> T {
    let kept = remaining_gap((lever * (start - limit)).max(T::zero()), elapsed);
    ((lever * (limit - base) - kept) * per_c).max(T::splat(-RECOVERY_SPEED))
}

/// Largest angles of all axes to both sides, out of reach where a joint has no limit or not the axis.
fn own_bounds<T: Real>(robot: &Robot, axes: usize) -> Vec<[T; 2]> {
    let far = StageStop::<T>::FAR;
    let mut bounds = Vec::with_capacity(axes * robot.axes.len());
    for ([lower, upper], of_joint) in robot.joint_bounds.iter().zip(&robot.axes) {
        for axis in 0..axes {
            let has = axes == 1 || of_joint.has(axis);
            let [most, least] = if has { [upper.min(far), (-lower).min(far)] } else { [far; 2] };
            bounds.push([T::splat(most), T::splat(least)]);
        }
    }
    bounds
}

/// Distance of a joint from its limit below which the closing of its stops is forecast \[rad\].
const CLEARANCE: f64 = 0.1;

/// Distance below which the stops of its robot take part \[rad\]. A stage that ends beyond a limit without them is predicted
/// again.
const REACH: f64 = 0.03;

/// Offset from which on a fallback leaves a stop out \[m/s\].
const REACHABLE: f64 = 30.0;
