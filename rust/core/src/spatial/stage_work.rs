//! The arithmetic of a stage over lanes: what surrounds the solver.

use nalgebra::Vector2;

use crate::math::{Mask, Real};
use crate::solver::Outcome;
use crate::spatial::{
    Certificate, Frame, Newton, Posture, Screw, Speed, Stage, StageDrive, StageFriction, StageLink, StageSolution,
    certify,
};
use crate::stepping::energy::Works;

use super::SpatialPlant;
use super::energy::works_of;
use super::motion::GroundForces;
use super::standing::Standing;

/// Data of the stage at hand, for as many robots as `T` has lanes.
#[derive(Debug, Clone)]
pub struct StageWork<T: Real> {
    /// Farthest point of each link's surface from its CG \[m\].
    reach: Vec<T>,
    half_length: Vec<T>,
    gravity: T,
    /// Gains k_P, k_D.
    gains: [T; 2],
    pub torque_limit: T,
    /// Joint references at the end of the stage: yaw and pitch, angle and rate.
    pub target: Vec<[[T; 2]; 2]>,
    /// Robots at the start of the step.
    pub start: Posture<T>,
    pub start_speed: Speed<T>,
    pub start_momentum: Vec<Screw<T>>,
    pub start_frames: Vec<Frame<T>>,
    /// Heights of the spheres' lowest points there \[m\].
    start_gap: Vec<[T; 2]>,
    /// q_B and the expected end velocity of the stage.
    base: Posture<T>,
    pub base_frames: Vec<Frame<T>>,
    guess: Speed<T>,
    /// Reference momenta p_R, without gravity.
    momentum: Vec<Screw<T>>,
    /// Expected end configuration, and the twists of the guess there.
    predicted: Posture<T>,
    pub frames: Vec<Frame<T>>,
    pub expected: Vec<Screw<T>>,
    /// Forces of the last stage.
    pub forces: GroundForces<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    newton: Newton<T>,
    standing: Standing<T>,
    /// Lanes whose robots' last steps began at rest.
    pub settled: T::Mask,
    works: Works<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    pub kept: Kept<T>,
    /// Configuration at the end of the step.
    pub arrival: Posture<T>,
    /// How much deeper the step takes a sphere that has sunk, at most \[m\].
    pub sinking: T,
}

/// What is kept of a stage, lane by lane, once its solution stands: some lanes may need another prediction.
#[derive(Debug, Clone)]
pub struct Kept<T> {
    /// The stage's end velocity and momenta.
    pub end: Speed<T>,
    pub momentum: Vec<Screw<T>>,
    pub drive: Vec<[T; 2]>,
    pub works: Works<T>,
}

impl<T: Real> StageWork<T> {
    pub fn new(plant: &SpatialPlant) -> Self {
        let links = plant.robot.link_count();
        let zero = T::zero();
        let none = || vec![Screw::zero(); links];
        let frames = || vec![Frame::origin(); links];
        Self {
            reach: plant.robot.links.iter().map(|link| T::splat(link.reach().max(0.5 * link.length))).collect(),
            half_length: plant.robot.links.iter().map(|link| T::splat(0.5 * link.length)).collect(),
            gravity: T::splat(plant.robot.gravity),
            gains: [plant.controller.kp, plant.controller.kd].map(T::splat),
            torque_limit: T::splat(f64::INFINITY),
            target: vec![[[zero; 2]; 2]; links - 1],
            start: Posture::straight(links),
            start_speed: Speed::rest(links),
            start_momentum: none(),
            start_frames: frames(),
            start_gap: vec![[zero; 2]; links],
            base: Posture::straight(links),
            base_frames: frames(),
            guess: Speed::rest(links),
            momentum: none(),
            predicted: Posture::straight(links),
            frames: frames(),
            expected: none(),
            forces: GroundForces::none(links),
            stage: empty_stage(plant),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            standing: Standing::new(&plant.robot),
            settled: T::Mask::of(|_| false),
            works: Works::none(),
            deviation: zero,
            kept: Kept {
                end: Speed::rest(links),
                momentum: none(),
                drive: vec![[zero; 2]; links - 1],
                works: Works::none(),
            },
            arrival: Posture::straight(links),
            sinking: zero,
        }
    }

    /// Base, guess and reference momenta of a stage that starts with the step.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.base.copy_from(&self.start);
        self.guess.copy_from(&self.start_speed);
        self.momentum.copy_from_slice(&self.start_momentum);
        self.start.place_links(&self.half_length, &mut self.start_frames);
        self.base_frames.copy_from_slice(&self.start_frames);
        for (i, frame) in self.start_frames.iter().enumerate() {
            let link = &self.stage.links[i];
            self.start_gap[i] = [frame.ground_gap(link, 0), frame.ground_gap(link, 1)];
        }
    }

    /// Base, guess and reference momenta of the second stage: the robot moves on for `elapsed` with the velocity of the
    /// first one, whose changes of momentum and velocity count `share` and `lead` times.
    #[inline(always)]
    pub fn extrapolate(&mut self, elapsed: T, share: f64, lead: f64) {
        let Kept { end, momentum, .. } = &self.kept;
        self.base.travel(&self.start, end, elapsed);
        self.base.place_links(&self.half_length, &mut self.base_frames);
        self.guess.blend(&self.start_speed, end, T::splat(lead));
        for (reference, (start, end)) in self.momentum.iter_mut().zip(self.start_momentum.iter().zip(momentum)) {
            let change = end.plus_scaled(start, -T::splat(1.0));
            *reference = start.plus_scaled(&change, T::splat(share));
        }
    }

    /// Predicts the end configuration of a stage of coefficient `c` and builds its links and joints there; `elapsed` is
    /// the time from the start of the step to there.
    #[inline(always)]
    pub fn predict(&mut self, c: T, elapsed: T) {
        self.stage.coefficient = c;
        self.predicted.travel(&self.base, &self.guess, c);
        self.predicted.place_links(&self.half_length, &mut self.frames);
        self.guess.twists(&self.frames, &self.half_length, &mut self.expected);
        self.fill_links(elapsed);
        self.fill_joints();
    }

    /// Solves the stage from the guess and the last forces, without the solver where the robot stands, and judges the
    /// solution.
    #[inline(always)]
    pub fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> (Outcome<T>, Certificate<T>) {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.expected);
        let StageSolution { normal, friction, rolling, .. } = &mut self.solution;
        for (i, forces) in self.forces.normal.iter().enumerate() {
            normal[i] = [c * forces[0], c * forces[1]];
            let [front, rear] = &self.forces.friction[i];
            friction[i] = [impulse(front, c), impulse(rear, c)];
            rolling[i] = impulse(&self.forces.rolling[i], c);
        }
        let stands = self.standing.holds(lanes & self.settled, &self.stage, &self.solution, tolerance);
        let mut outcome =
            self.newton.solve(&self.stage, &mut self.solution, tolerance, max_iterations, lanes & !stands);
        outcome.converged = outcome.converged | stands;
        self.standing.write(stands, &mut self.solution);
        (outcome, certify(&self.stage, &self.solution))
    }

    /// What follows from the solution: forces, in the given lanes, works and deviation.
    #[inline(always)]
    pub fn evaluate(&mut self, lanes: T::Mask) {
        let per_second = T::splat(1.0) / self.stage.coefficient;
        let GroundForces { normal, friction, rolling } = &mut self.forces;
        for (i, impulse) in self.solution.normal.iter().enumerate() {
            for end in 0..2 {
                normal[i][end] = T::select(lanes, impulse[end] * per_second, normal[i][end]);
                select_force(&mut friction[i][end], lanes, &self.solution.friction[i][end], per_second);
            }
            select_force(&mut rolling[i], lanes, &self.solution.rolling[i], per_second);
        }
        self.works = works_of(&self.stage, &self.solution);
        self.measure_deviation();
    }

    #[inline(always)]
    fn measure_deviation(&mut self) {
        let mut fastest = T::zero();
        for (reach, (u, guess)) in self.reach.iter().zip(self.solution.twist.iter().zip(&self.expected)) {
            let change = u.plus_scaled(guess, -T::splat(1.0));
            let (v, w) = (change.linear, change.angular);
            let linear = (v.x * v.x + v.y * v.y + v.z * v.z).sqrt();
            let angular = (w.x * w.x + w.y * w.y + w.z * w.z).sqrt();
            fastest = fastest.max(linear + *reach * angular);
        }
        self.deviation = fastest * self.stage.coefficient;
    }

    /// Keeps the solution in the lanes where it stands; in others it becomes the next guess.
    #[inline(always)]
    pub fn keep(&mut self, solved: T::Mask, again: T::Mask) {
        let StageSolution { twist, rate, drive, .. } = &self.solution;
        let Kept { end, momentum, drive: kept_drive, works } = &mut self.kept;
        end.head.select_into(solved, &twist[0]);
        self.guess.head.select_into(again, &twist[0]);
        for (j, rates) in rate.iter().enumerate() {
            for axis in 0..2 {
                end.rate[j][axis] = T::select(solved, rates[axis], end.rate[j][axis]);
                self.guess.rate[j][axis] = T::select(again, rates[axis], self.guess.rate[j][axis]);
                kept_drive[j][axis] = T::select(solved, drive[j][axis], kept_drive[j][axis]);
            }
        }
        for (momentum, (link, x)) in momentum.iter_mut().zip(self.stage.links.iter().zip(twist)) {
            momentum.select_into(solved, &link.momentum_of(x));
        }
        works.select_into(solved, &self.works);
    }

    /// Where the last stage ends, and whether spheres sink there: a link that turns fast leaves its linearised gap.
    #[inline(always)]
    pub fn arrive(&mut self) {
        self.arrival.travel(&self.base, &self.kept.end, self.stage.coefficient);
        self.arrival.place_links(&self.half_length, &mut self.frames);
        self.sinking = T::zero();
        for (i, frame) in self.frames.iter().enumerate() {
            for end in 0..2 {
                let gap = frame.ground_gap(&self.stage.links[i], end);
                let sunk = gap.lt(T::splat(-SUNK));
                self.sinking = self.sinking.max(T::select(sunk, self.start_gap[i][end] - gap, T::zero()));
            }
        }
    }

    #[inline(always)]
    fn fill_links(&mut self, elapsed: T) {
        let c = self.stage.coefficient;
        for (i, frame) in self.frames.iter().enumerate() {
            let link = &mut self.stage.links[i];
            link.axes = frame.axes;
            link.tangent = tangent(frame);
            link.momentum = self.momentum[i];
            link.momentum.linear.z -= link.mass * self.gravity * c;
            for end in 0..2 {
                let closing = self.expected[i].velocity_at(&link.ground_arm(end)).z;
                let still = frame.ground_gap(link, end) - c * closing;
                link.ground[end] = opening(still, self.start_gap[i][end], c, elapsed);
            }
        }
    }

    /// The PD torque (T 4.101)-(T 4.102) at the end of the stage, where phi = phi_base + c phi', is linear in phi'.
    #[inline(always)]
    fn fill_joints(&mut self) {
        let c = self.stage.coefficient;
        let [kp, kd] = self.gains;
        self.stage.joints.clear();
        for (base, target) in self.base.angle.iter().zip(&self.target) {
            let [[yaw, yaw_rate], [pitch, pitch_rate]] = *target;
            let (stiffness, limit) = (c * (c * kp + kd), c * self.torque_limit);
            self.stage.joints.push([
                StageDrive { drive: c * (kp * (yaw - base[0]) + kd * yaw_rate), stiffness, limit },
                StageDrive { drive: c * (kp * (pitch - base[1]) + kd * pitch_rate), stiffness, limit },
            ]);
        }
    }
}

/// A stage with the constants of the plant's robot.
fn empty_stage<T: Real>(plant: &SpatialPlant) -> Stage<T> {
    let mut stage = Stage::with_capacity(plant.robot.link_count());
    let zero = T::zero();
    let sliding = plant.friction.map(T::splat);
    stage.friction = StageFriction { sliding, rolling: T::splat(plant.rolling_friction) };
    stage.links.extend(plant.robot.links.iter().map(|link| StageLink {
        axes: Frame::origin().axes,
        momentum: Screw::zero(),
        mass: T::splat(link.mass),
        inertia: T::splat(link.inertia),
        roll_inertia: T::splat(link.roll_inertia),
        half_length: T::splat(0.5 * link.length),
        sphere: T::splat(link.contact_half_length),
        radius: T::splat(link.radius),
        tangent: Vector2::new(T::splat(1.0), zero),
        ground: [zero; 2],
    }));
    stage
}

#[inline(always)]
fn impulse<T: Real>([x, y]: &[T; 2], c: T) -> Vector2<T> {
    Vector2::new(c * *x, c * *y)
}

/// Takes the force of an impulse over in the given lanes.
#[inline(always)]
fn select_force<T: Real>(force: &mut [T; 2], lanes: T::Mask, impulse: &Vector2<T>, per_second: T) {
    force[0] = T::select(lanes, impulse.x * per_second, force[0]);
    force[1] = T::select(lanes, impulse.y * per_second, force[1]);
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
/// `still` is that gap, linearised at the predicted end. A contact that neither gapes nor penetrates counts as
/// touching exactly: gaps of round-off would otherwise decide which of many contacts bears a load. A penetration from
/// before the step is undone slowly.
#[inline(always)]
fn opening<T: Real>(still: T, at_start: T, c: T, elapsed: T) -> T {
    let zero = T::zero();
    let touches = still.abs().lt(T::splat(TOUCHING));
    let remaining = (T::splat(1.0) - elapsed / T::splat(RECOVERY_TIME)).max(zero);
    let floor = at_start.min(zero) * remaining;
    let offset = ((still - floor) / c).max(T::splat(-RECOVERY_SPEED));
    T::select(touches, zero, offset)
}

/// Gap below which a sphere touches the ground \[m\].
const TOUCHING: f64 = 1e-6;

/// Time within which a penetration, as the linearisation of the gap leaves it, fades \[s\].
const RECOVERY_TIME: f64 = 0.05;

/// Fastest separation asked of a penetrating contact \[m/s\].
const RECOVERY_SPEED: f64 = 0.2;

/// Depth from which on a sphere must not go deeper \[m\].
const SUNK: f64 = 2e-4;

/// Squared length of the centre line's shadow below which a link is upright.
const UPRIGHT: f64 = 1e-18;
