//! The arithmetic of a stage over lanes: all but the solver.

use nalgebra::Vector2;

use crate::contact::recovery::{RECOVERY_SPEED, RECOVERY_TIME};
use crate::math::{Mask, Real, select_into};
use crate::spatial::energy::work_of;
use crate::spatial::spatial_vector::scaled;
use crate::spatial::{Frame, StageDrive, StageLink, StageSolution, Twist, certify, stopping};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};
use crate::stepping::{ClosingRow, MovedAxis, SolvedMotion, SolvedStage, StageKernels};

use super::{GroundForces, Kept, Workspace};

impl<T: Real> StageKernels<T> for Workspace<T> {
    /// Base, guess and reference momenta of a stage that starts with the step.
    #[inline(always)]
    fn begin(&mut self) {
        self.motion.base.copy_from(&self.motion.start);
        self.motion.guess.copy_from(&self.motion.start_velocity);
        self.motion.momentum.copy_from_slice(&self.motion.start_momentum);
        self.motion.moved.copy_from_slice(&self.motion.start_velocity.moved);
        self.motion.start.place_links(&self.motion.shape, &mut self.motion.start_frames);
        self.motion.base_frames.copy_from_slice(&self.motion.start_frames);
        for (i, frame) in self.motion.start_frames.iter().enumerate() {
            let link = &self.stage.links[i];
            self.motion.start_gap[i] = [frame.ground_gap(link, 0), frame.ground_gap(link, 1)];
        }
        self.closings.begin_part();
        self.self_contacts.begin_step();
        self.drives.backlash.begin_step();
        self.motors.begin_step(self.motion.start_velocity.rate.iter().flatten().copied());
        if self.shares.is_any {
            self.motion.start_velocity.twists(&self.motion.start_frames, &self.motion.shape, &mut self.motion.expected);
            self.shares.begin_step(
                #[inline(always)]
                |contact| slip(&self.stage.links, &self.motion.start_frames, &self.motion.expected, contact),
            );
        }
    }

    /// The robot moves on to the base of the second stage with the velocity of the first one, whose changes of momentum
    /// and velocity are extrapolated.
    #[inline(always)]
    fn extrapolate(&mut self, h: T) {
        let elapsed = T::splat(1.0 - GAMMA) * h;
        let Kept { end, momentum, .. } = &self.result.kept;
        self.motion.base.travel(&self.motion.start, end, elapsed);
        self.motion.base.place_links(&self.motion.shape, &mut self.motion.base_frames);
        if self.drives.backlash.is_any {
            self.drives.backlash.extrapolate(T::splat(EXTRAPOLATION));
        }
        self.motors.extrapolate(end.rate.iter().flatten().copied());
        if self.shares.is_any {
            end.twists(&self.motion.frames, &self.motion.shape, &mut self.motion.expected);
            self.shares.extrapolate(
                #[inline(always)]
                |contact| slip(&self.stage.links, &self.motion.frames, &self.motion.expected, contact),
            );
        }
        self.motion.guess.blend(&self.motion.start_velocity, end, T::splat(1.0 / GAMMA));
        for (reference, (start, end)) in
            self.motion.momentum.iter_mut().zip(self.motion.start_momentum.iter().zip(momentum))
        {
            let change = end.plus_scaled(start, -T::splat(1.0));
            *reference = start.plus_scaled(&change, T::splat(EXTRAPOLATION));
        }
        for (k, reference) in self.motion.moved.iter_mut().enumerate() {
            let (start, end) = (&self.motion.start_velocity.moved[k], &end.moved[k]);
            *reference = start.plus_scaled(&end.plus_scaled(start, -T::splat(1.0)), T::splat(EXTRAPOLATION));
        }
    }

    /// Predicts the end configuration of a stage of coefficient `c` and builds its links and joints there; `elapsed` is
    /// the time from the start of the step to there.
    #[inline(always)]
    fn predict(&mut self, c: T, elapsed: T, _: T::Mask) {
        self.stage.coefficient = c;
        self.motion.elapsed = elapsed;
        self.motion.predicted.travel(&self.motion.base, &self.motion.guess, c);
        self.motion.predicted.place_links(&self.motion.shape, &mut self.motion.frames);
        self.motion.measure_way();
        self.motion.guess.twists(&self.motion.frames, &self.motion.shape, &mut self.motion.expected);
        self.self_contacts.predict(&self.motion.frames);
        self.joint_stops.predict(self.bend(&self.motion.guess.rate));
        self.fill_links(elapsed);
        self.fill_movables();
        self.fill_joints();
    }

    /// Solves the stage from the guess and the last forces, without the solver where the robot stays at rest, and
    /// certifies the solution; one that meets the solver's rule and not the certificate's is polished, where that helps.
    #[inline(always)]
    fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> SolvedStage<T> {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.motion.expected);
        let StageSolution { normal, friction, rolling, .. } = &mut self.solution;
        for (i, forces) in self.forces.normal.iter().enumerate() {
            normal[i] = [c * forces[0], c * forces[1]];
            let [front, rear] = &self.forces.friction[i];
            friction[i] = [times(c, front), times(c, rear)];
            rolling[i] = times(c, &self.forces.rolling[i]);
        }
        for (impulse, force) in self.solution.surface.iter_mut().zip(&self.surface_force) {
            *impulse = scaled(force, c);
        }
        self.motors.fill(c, &mut self.stage.motors, &mut self.solution.gear);
        let angles = self.motion.start.angle.iter().flatten().zip(self.motion.base.angle.iter().flatten());
        let angles = angles.map(|(start, base)| (*start, *base));
        self.joint_stops.fill(angles, c, self.motion.elapsed, &mut self.stage.stops, &mut self.solution.stop);
        let stopping = stopping(tolerance);
        let stands = self.rest.holds(lanes & self.began_at_rest, &self.stage, &self.solution, stopping);
        let mut outcome = self.newton.solve(&self.stage, &mut self.solution, stopping, max_iterations, lanes & !stands);
        outcome.converged = outcome.converged | stands;
        self.rest.write(stands, &mut self.solution);
        let mut residual = certify(&self.stage, &self.solution).residual();
        let rough = outcome.converged & !stands & T::splat(tolerance).lt(residual);
        if rough.any() {
            self.polished.copy_from(&self.solution);
            self.newton.polish(&mut self.polished, &mut outcome, stopping, rough);
            let after = certify(&self.stage, &self.polished).residual();
            let better = rough & after.lt(residual);
            self.solution.select_into(better, &self.polished);
            residual = T::select(better, after, residual);
        }
        SolvedStage { outcome, residual, gap: T::zero() }
    }

    /// What follows from the solution: forces in the given lanes, work and deviation.
    #[inline(always)]
    fn evaluate(&mut self, lanes: T::Mask) {
        self.closings.begin_stage();
        let per_second = T::splat(1.0) / self.stage.coefficient;
        let GroundForces { normal, friction, rolling } = &mut self.forces;
        for (i, impulse) in self.solution.normal.iter().enumerate() {
            for end in 0..2 {
                normal[i][end] = T::select(lanes, impulse[end] * per_second, normal[i][end]);
                select_into(&mut friction[i][end], lanes, &times(per_second, &self.solution.friction[i][end]));
            }
            select_into(&mut rolling[i], lanes, &times(per_second, &self.solution.rolling[i]));
        }
        for (force, impulse) in self.surface_force.iter_mut().zip(&self.solution.surface) {
            select_into(force, lanes, &scaled(impulse, per_second));
        }
        self.motors.store(self.stage.coefficient, &self.solution.gear, lanes);
        self.joint_stops.arrive(self.bend(&self.solution.rate));
        let rates = self.motion.guess.rate.iter().flatten().zip(self.solution.rate.iter().flatten());
        let rates = rates.map(|(expected, rate)| (*expected, *rate));
        let times = [self.stage.coefficient, self.motion.elapsed];
        self.joint_stops.store(&self.solution.stop, rates, times, lanes, &mut self.closings);
        self.result.energy = work_of(&self.stage, &self.solution);
        for (movable, x) in self.movables.iter().zip(&self.solution.twist[self.motion.frames.len()..]) {
            self.result.energy.friction += movable.spring.work_of_damper(self.stage.coefficient, &x.in_plane());
        }
        self.measure_deviation();
        self.find_closings();
    }

    /// Keeps the solution in the lanes where it is accepted; in others it becomes the next guess.
    #[inline(always)]
    fn keep(&mut self, solved: T::Mask, again: T::Mask) {
        let StageSolution { twist, rate, actuator, .. } = &self.solution;
        let Kept { end, momentum, actuator: kept_actuator, energy } = &mut self.result.kept;
        end.head.select_into(solved, &twist[0]);
        self.motion.guess.head.select_into(again, &twist[0]);
        for (j, rates) in rate.iter().enumerate() {
            for axis in 0..2 {
                end.rate[j][axis] = T::select(solved, rates[axis], end.rate[j][axis]);
                self.motion.guess.rate[j][axis] = T::select(again, rates[axis], self.motion.guess.rate[j][axis]);
                kept_actuator[j][axis] = T::select(solved, actuator[j][axis], kept_actuator[j][axis]);
            }
        }
        for (momentum, (link, x)) in momentum.iter_mut().zip(self.stage.links.iter().zip(twist)) {
            momentum.select_into(solved, &link.momentum_of(x));
        }
        for (k, x) in twist[self.motion.frames.len()..].iter().enumerate() {
            end.moved[k].select_into(solved, x);
            self.motion.guess.moved[k].select_into(again, x);
        }
        energy.select_into(solved, &self.result.energy);
        self.closings.keep_stage(solved);
        if self.drives.backlash.is_any {
            let rates = self.result.kept.end.rate.iter().flatten();
            let axes = self.stage.joints.iter().flatten().zip(rates).map(|(axis, rate)| {
                let StageDrive { drive, stiffness, slack, .. } = *axis;
                MovedAxis { drive, stiffness, slack, rate: *rate }
            });
            self.drives.backlash.end_stage(self.stage.coefficient, axes);
        }
    }

    /// End configuration of the last stage, and whether spheres sink there: a link that turns fast leaves its
    /// linearised gap.
    #[inline(always)]
    fn arrive(&mut self) {
        self.result.arrival.travel(&self.motion.base, &self.result.kept.end, self.stage.coefficient);
        self.result.arrival.place_links(&self.motion.shape, &mut self.motion.frames);
        self.motion.measure_way();
        self.result.sinking_into_ground = T::zero();
        for (i, frame) in self.motion.frames.iter().enumerate() {
            for end in 0..2 {
                let gap = frame.ground_gap(&self.stage.links[i], end);
                let sunk = gap.lt(T::splat(-SUNK));
                self.result.sinking_into_ground = self.result.sinking_into_ground.max(T::select(
                    sunk,
                    self.motion.start_gap[i][end] - gap,
                    T::zero(),
                ));
            }
        }
    }
}

impl<T: Real> Workspace<T> {
    /// How far joints are bent at the end of the stage by these rates, as [`crate::stepping::JointStops`] counts it.
    #[inline(always)]
    fn bend(&self, rates: &[[T; 2]]) -> T {
        let (base, c) = (&self.motion.base.angle, self.stage.coefficient);
        if !self.joint_stops.has_own_bounds() {
            return largest_angle(base, rates, c);
        }
        let axes = base.iter().flatten().zip(rates.iter().flatten());
        self.joint_stops.excess(axes.map(|(angle, rate)| *angle + c * *rate))
    }

    #[inline(always)]
    fn measure_deviation(&mut self) {
        let mut fastest = T::zero();
        let reaches = self.reach.iter().chain(self.movables.iter().map(|movable| &movable.reach));
        for (reach, (u, guess)) in reaches.zip(self.solution.twist.iter().zip(&self.motion.expected)) {
            let change = u.plus_scaled(guess, -T::splat(1.0));
            let (v, w) = (change.linear, change.angular);
            let linear = (v.x * v.x + v.y * v.y + v.z * v.z).sqrt();
            let angular = (w.x * w.x + w.y * w.y + w.z * w.z).sqrt();
            fastest = fastest.max(linear + *reach * angular);
        }
        self.result.deviation = fastest * self.stage.coefficient;
    }

    /// When contacts close, and when spheres touch down.
    #[inline(always)]
    fn find_closings(&mut self) {
        let Self { contacts, self_contacts, closings, stage, solution, motion, stood, .. } = self;
        let (coefficient, elapsed, links) = (stage.coefficient, motion.elapsed, motion.frames.len());
        let motion = SolvedMotion { coefficient, elapsed, expected: &motion.expected, twist: &solution.twist };
        contacts.rows.add_closings((&stage.contacts, &solution.contact), &motion, closings);
        self_contacts.rows.add_closings((&stage.pairs, &solution.pair), &motion, closings);
        for ((i, link), stood) in stage.links[..links].iter().enumerate().zip(stood) {
            for (end, stood) in stood.iter().enumerate() {
                let arm = link.ground_arm(end);
                let row = ClosingRow {
                    offset: link.ground[end],
                    expected_rate: motion.expected[i].velocity_at(&arm).z,
                    rate: motion.twist[i].velocity_at(&arm).z,
                    presses: T::zero().lt(solution.normal[i][end]),
                    touched: *stood,
                };
                closings.add(row.times(coefficient, elapsed, T::Mask::of(|_| true)));
            }
        }
    }

    #[inline(always)]
    fn fill_links(&mut self, elapsed: T) {
        let c = self.stage.coefficient;
        for (i, frame) in self.motion.frames.iter().enumerate() {
            let link = &mut self.stage.links[i];
            link.axes = frame.axes;
            link.tangent = tangent(frame);
            link.momentum = self.motion.momentum[i];
            for axis in 0..3 {
                link.momentum.linear[axis] += link.mass * self.gravity[axis] * c;
            }
            for end in 0..2 {
                let closing = self.motion.expected[i].velocity_at(&link.ground_arm(end)).z;
                let still = frame.ground_gap(link, end) - c * closing;
                link.ground[end] = opening(still, self.motion.start_gap[i][end], c, elapsed);
            }
            let factor = self.friction_factor[i];
            link.share = [factor; 2];
            if self.shares.is_any {
                link.share = [factor * self.shares.share(2 * i), factor * self.shares.share(2 * i + 1)];
            }
        }
    }

    #[inline(always)]
    fn fill_joints(&mut self) {
        let Self { motion, target, drives, stage, .. } = self;
        stage.joints.resize(target.len(), [StageDrive::none(); 2]);
        let (target, base) = (target.as_flattened(), motion.base.angle.as_flattened());
        drives.fill(
            stage.coefficient,
            #[inline(always)]
            |axis| [target[axis][0] - base[axis], target[axis][1]],
            stage.joints.as_flattened_mut(),
        );
    }
}

/// The largest magnitude of any joint angle at the end of a stage of coefficient `c`.
#[inline(always)]
fn largest_angle<T: Real>(base: &[[T; 2]], rates: &[[T; 2]], c: T) -> T {
    // A fold would be compiled as a function without the instructions of the kernel.
    let mut largest = T::zero();
    for (angle, rate) in base.iter().zip(rates) {
        for axis in 0..2 {
            largest = largest.max((angle[axis] + c * rate[axis]).abs());
        }
    }
    largest
}

/// Horizontal velocity of the lowest point of a sphere, the front one of each link first.
#[inline(always)]
fn slip<T: Real>(links: &[StageLink<T>], frames: &[Frame<T>], twists: &[Twist<T>], contact: usize) -> Vector2<T> {
    let (i, end) = (contact / 2, contact % 2);
    let mut arm = scaled(&frames[i].axes[2], links[i].spheres()[end]);
    arm.z -= links[i].radius;
    let v = twists[i].velocity_at(&arm);
    Vector2::new(v.x, v.y)
}

#[inline(always)]
fn times<T: Real>(c: T, v: &Vector2<T>) -> Vector2<T> {
    Vector2::new(c * v.x, c * v.y)
}

/// Direction along which friction has mu_x: the shadow of the centre line (T 4.36), of an upright link that of e_x^B.
#[inline(always)]
fn tangent<T: Real>(frame: &Frame<T>) -> Vector2<T> {
    let [x, _, z] = &frame.axes;
    let squared = z.x * z.x + z.y * z.y;
    let upright = squared.lt(T::splat(UPRIGHT));
    // e_y^Pi is then the shadow of e_x^B.
    let shadow = Vector2::new(T::select(upright, x.y, z.x), T::select(upright, -x.x, z.y));
    let inverse = T::splat(1.0) / (shadow.x * shadow.x + shadow.y * shadow.y).sqrt();
    Vector2::new(shadow.x * inverse, shadow.y * inverse)
}

/// Offset of a ground contact (T 4.106 != D42): the gap at the end of the stage, over c, if the sphere did not move
/// vertically.
///
/// `still` is that gap, linearised at the predicted end. A contact that is neither open nor penetrating counts as
/// touching exactly: gaps of round-off would otherwise decide which of many contacts bears a load. A penetration from
/// before the step is undone slowly.
#[inline(always)]
pub fn opening<T: Real>(still: T, at_start: T, c: T, elapsed: T) -> T {
    let zero = T::zero();
    let touches = still.abs().lt(T::splat(TOUCHING));
    let mut floor = zero;
    if at_start.lt(zero).any() {
        floor = at_start.min(zero) * (T::splat(1.0) - elapsed / T::splat(RECOVERY_TIME)).max(zero);
    }
    let offset = ((still - floor) / c).max(T::splat(-RECOVERY_SPEED));
    T::select(touches, zero, offset)
}

/// Gap below which a sphere touches the ground \[m\].
const TOUCHING: f64 = 1e-6;

/// Depth from which on a sphere must not go deeper \[m\].
pub(super) const SUNK: f64 = 2e-4;

/// Squared length of the centre line's shadow below which a link is upright.
const UPRIGHT: f64 = 1e-18;
