//! The arithmetic of a stage over lanes: all but the solver.

use nalgebra::Vector2;

use crate::contact::recovery::{RECOVERY_SPEED, RECOVERY_TIME};
use crate::gait::CardanTarget;
use crate::math::{Mask, Real};
use crate::spatial::{
    Configuration, Frame, Momentum, Newton, SpatialVector, Speed, Stage, StageDrive, StageFriction, StageLink,
    StageSolution, Twist, certify, read_lane, write_lane,
};
use crate::stepping::lanes::{Lanes, active};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};
use crate::stepping::{self, ContactImpulse, Driven, EnergyLedger, FallbackResult, Members, SolvedStage};

use super::chain_state::GroundForces;
use super::contact_map::ContactMap;
use super::energy::work_of;
use super::lane_fallback::LaneFallback;
use super::standing::{Standing, is_at_rest};
use super::{Spatial, SpatialBody, SpatialSystem};

/// Data of the current stage, for as many robots as `T` has lanes.
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
    pub start: Configuration<T>,
    pub start_speed: Speed<T>,
    pub start_momentum: Vec<Momentum<T>>,
    pub start_frames: Vec<Frame<T>>,
    /// Heights of the spheres' lowest points there \[m\].
    start_gap: Vec<[T; 2]>,
    /// q_B and the expected end velocity of the stage.
    base: Configuration<T>,
    pub base_frames: Vec<Frame<T>>,
    guess: Speed<T>,
    /// Reference momenta p_R, without gravity.
    momentum: Vec<Momentum<T>>,
    /// Expected end configuration, and the twists of the guess there.
    predicted: Configuration<T>,
    pub frames: Vec<Frame<T>>,
    pub expected: Vec<Twist<T>>,
    /// Forces of the last stage.
    pub forces: GroundForces<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    newton: Newton<T>,
    standing: Standing<T>,
    /// Lanes whose robots' last steps began at rest.
    began_at_rest: T::Mask,
    contacts: ContactMap,
    fallback: LaneFallback,
    /// Normal impulses of the ground in the first stage of a step.
    first_ground: Vec<T>,
    /// References of one robot.
    targets: Vec<CardanTarget>,
    energy: EnergyLedger<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    pub kept: Kept<T>,
    /// Configuration at the end of the step.
    pub arrival: Configuration<T>,
    /// How much deeper the step takes a sphere that has sunk, at most \[m\].
    pub sinking: T,
}

/// What is kept of a stage, lane by lane, once its solution is accepted; some lanes may need another prediction.
#[derive(Debug, Clone)]
pub struct Kept<T> {
    /// The stage's end velocity and momenta.
    pub end: Speed<T>,
    pub momentum: Vec<Momentum<T>>,
    pub drive: Vec<[T; 2]>,
    pub energy: EnergyLedger<T>,
}

impl<T: Real> StageWork<T> {
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

impl<T: Real> stepping::StageWork<T> for StageWork<T> {
    type Model = Spatial;

    /// Base, guess and reference momenta of a stage that starts with the step.
    #[inline(always)]
    fn begin(&mut self) {
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

    /// The robot moves on to the base of the second stage with the velocity of the first one, whose changes of momentum
    /// and velocity are extrapolated.
    #[inline(always)]
    fn extrapolate(&mut self, h: T) {
        let elapsed = T::splat(1.0 - GAMMA) * h;
        let Kept { end, momentum, .. } = &self.kept;
        self.base.travel(&self.start, end, elapsed);
        self.base.place_links(&self.half_length, &mut self.base_frames);
        self.guess.blend(&self.start_speed, end, T::splat(1.0 / GAMMA));
        for (reference, (start, end)) in self.momentum.iter_mut().zip(self.start_momentum.iter().zip(momentum)) {
            let change = end.plus_scaled(start, -T::splat(1.0));
            *reference = start.plus_scaled(&change, T::splat(EXTRAPOLATION));
        }
    }

    /// Predicts the end configuration of a stage of coefficient `c` and builds its links and joints there; `elapsed` is
    /// the time from the start of the step to there.
    #[inline(always)]
    fn predict(&mut self, c: T, elapsed: T, _: T::Mask) {
        self.stage.coefficient = c;
        self.predicted.travel(&self.base, &self.guess, c);
        self.predicted.place_links(&self.half_length, &mut self.frames);
        self.guess.twists(&self.frames, &self.half_length, &mut self.expected);
        self.fill_links(elapsed);
        self.fill_joints();
    }

    /// Solves the stage from the guess and the last forces, without the solver where the robot stays at rest, and
    /// certifies the solution.
    #[inline(always)]
    fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> SolvedStage<T> {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.expected);
        let StageSolution { normal, friction, rolling, .. } = &mut self.solution;
        for (i, forces) in self.forces.normal.iter().enumerate() {
            normal[i] = [c * forces[0], c * forces[1]];
            let [front, rear] = &self.forces.friction[i];
            friction[i] = [impulse(front, c), impulse(rear, c)];
            rolling[i] = impulse(&self.forces.rolling[i], c);
        }
        let stands = self.standing.holds(lanes & self.began_at_rest, &self.stage, &self.solution, tolerance);
        let mut outcome =
            self.newton.solve(&self.stage, &mut self.solution, tolerance, max_iterations, lanes & !stands);
        outcome.converged = outcome.converged | stands;
        self.standing.write(stands, &mut self.solution);
        let residual = certify(&self.stage, &self.solution).residual();
        SolvedStage { outcome, residual, gap: T::zero() }
    }

    /// What follows from the solution: forces in the given lanes, work and deviation.
    #[inline(always)]
    fn evaluate(&mut self, lanes: T::Mask) {
        let per_second = T::splat(1.0) / self.stage.coefficient;
        let GroundForces { normal, friction, rolling } = &mut self.forces;
        for (i, impulse) in self.solution.normal.iter().enumerate() {
            for end in 0..2 {
                normal[i][end] = T::select(lanes, impulse[end] * per_second, normal[i][end]);
                select_force(&mut friction[i][end], lanes, &self.solution.friction[i][end], per_second);
            }
            select_force(&mut rolling[i], lanes, &self.solution.rolling[i], per_second);
        }
        self.energy = work_of(&self.stage, &self.solution);
        self.measure_deviation();
    }

    /// Keeps the solution in the lanes where it is accepted; in others it becomes the next guess.
    #[inline(always)]
    fn keep(&mut self, solved: T::Mask, again: T::Mask) {
        let StageSolution { twist, rate, drive, .. } = &self.solution;
        let Kept { end, momentum, drive: kept_drive, energy } = &mut self.kept;
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
        energy.select_into(solved, &self.energy);
    }

    /// End configuration of the last stage, and whether spheres sink there: a link that turns fast leaves its
    /// linearised gap.
    #[inline(always)]
    fn arrive(&mut self) {
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

    fn new(system: &SpatialSystem) -> Self {
        let links = system.robot.link_count();
        let zero = T::zero();
        let none = || vec![SpatialVector::zero(); links];
        let frames = || vec![Frame::origin(); links];
        Self {
            reach: system.robot.links.iter().map(|link| T::splat(link.reach().max(0.5 * link.length))).collect(),
            half_length: system.robot.links.iter().map(|link| T::splat(0.5 * link.length)).collect(),
            gravity: T::splat(system.robot.gravity),
            gains: [system.controller.kp, system.controller.kd].map(T::splat),
            torque_limit: T::splat(f64::INFINITY),
            target: vec![[[zero; 2]; 2]; links - 1],
            start: Configuration::straight(links),
            start_speed: Speed::rest(links),
            start_momentum: none(),
            start_frames: frames(),
            start_gap: vec![[zero; 2]; links],
            base: Configuration::straight(links),
            base_frames: frames(),
            guess: Speed::rest(links),
            momentum: none(),
            predicted: Configuration::straight(links),
            frames: frames(),
            expected: none(),
            forces: GroundForces::none(links),
            stage: empty_stage(system),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            standing: Standing::new(&system.robot),
            began_at_rest: T::Mask::of(|_| false),
            contacts: ContactMap::new(links),
            fallback: LaneFallback::new(links),
            first_ground: vec![zero; links],
            targets: vec![CardanTarget::default(); links - 1],
            energy: EnergyLedger::zero(),
            deviation: zero,
            kept: Kept {
                end: Speed::rest(links),
                momentum: none(),
                drive: vec![[zero; 2]; links - 1],
                energy: EnergyLedger::zero(),
            },
            arrival: Configuration::straight(links),
            sinking: zero,
        }
    }

    fn load<D: Driven<Model = Spatial>>(&mut self, members: &Members<D>) {
        for lane in 0..T::LANES {
            let state = &members.body(lane).warm_start;
            self.start.set_lane(lane, &state.configuration);
            self.start_speed.set_lane(lane, &state.speed);
            write_lane::<T, _>(&mut self.start_momentum, lane, &state.momentum);
            self.forces.set_lane(lane, &state.forces);
            self.contacts.recall(lane, &state.pairs);
        }
        self.began_at_rest = T::Mask::of(|lane| members.body(lane).warm_start.began_at_rest);
    }

    fn read_references<D: Driven<Model = Spatial>>(&mut self, members: &Members<D>, end: T, _: Lanes) {
        for lane in 0..T::LANES {
            let robot = members.robot(lane);
            let time = robot.body().state.time + end.lane(lane);
            robot.targets(time, &mut self.targets);
            for (lanes, CardanTarget { yaw, pitch }) in self.target.iter_mut().zip(&self.targets) {
                for (lanes, target) in lanes.iter_mut().zip([yaw, pitch]) {
                    lanes[0].set_lane(lane, target.angle);
                    lanes[1].set_lane(lane, target.rate);
                }
            }
            self.torque_limit.set_lane(lane, members.system.controller.limit_until(time));
        }
    }

    fn find_contacts<D: Driven<Model = Spatial>>(&mut self, members: &mut Members<D>, pending: Lanes, elapsed: T) {
        let mut contacts = std::mem::take(&mut self.contacts);
        contacts.clear(self);
        for (i, link) in members.system.robot.links.iter().enumerate() {
            let bodies = active(pending).map(|lane| (lane, members.body(lane)));
            let among_pegs = bodies.filter(|(_, body)| !body.pegs.pegs().is_empty());
            contacts.add(self, i, link, among_pegs, elapsed);
        }
        self.contacts = contacts;
    }

    fn fall_back(&mut self, lane: usize, tolerance: f64) -> Option<FallbackResult> {
        self.fallback.solve_lane(&self.stage, &mut self.solution, &self.contacts, lane, tolerance)
    }

    fn remember(&mut self, lane: usize) {
        self.contacts.remember(&self.stage, &self.solution, lane);
    }

    fn deviation(&self) -> T {
        self.deviation
    }

    fn is_mispredicted(&self, lane: usize) -> bool {
        // Also where the deviation is not a number.
        !matches!(self.deviation.lane(lane), deviation if deviation < MISPREDICTED)
    }

    fn collect_contact_impulses<D: Driven<Model = Spatial>>(
        &mut self,
        _: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        for lane in active(solved) {
            contact_impulses.extend(self.contacts.contact_impulses(&self.stage, &self.solution, lane));
        }
    }

    fn kept_energy(&self) -> &EnergyLedger<T> {
        &self.kept.energy
    }

    fn deviation_share(&self, _: usize, is_pushed: impl Fn() -> bool) -> f64 {
        if is_pushed() { PUSHED } else { 1.0 }
    }

    fn sinks(&self, lane: usize) -> bool {
        self.sinking.lane(lane) > SINKING
    }

    fn keep_first_stage(&mut self) {
        let c = self.stage.coefficient;
        for (sum, ends) in self.first_ground.iter_mut().zip(&self.forces.normal) {
            *sum = ends[0] * c + ends[1] * c;
        }
    }

    fn add_first_stage(&self, lane: usize, weight: f64, body: &mut SpatialBody) {
        for (sum, impulse) in body.ground_impulse.iter_mut().zip(&self.first_ground) {
            *sum += impulse.lane(lane) * weight;
        }
    }

    fn accept(&mut self, _: &SpatialSystem, lane: usize, body: &mut SpatialBody) {
        let c = self.stage.coefficient.lane(lane);
        let SpatialBody { warm_start: state, ground_impulse, .. } = body;
        state.began_at_rest = is_at_rest(&state.speed);
        self.arrival.read_lane(lane, &mut state.configuration);
        self.kept.end.read_lane(lane, &mut state.speed);
        read_lane::<T, _>(&self.kept.momentum, lane, &mut state.momentum);
        self.forces.read_lane(lane, &mut state.forces);
        state.pairs.clear();
        state.pairs.extend_from_slice(self.contacts.pairs(lane));
        for (sum, ends) in ground_impulse.iter_mut().zip(&state.forces.normal) {
            *sum += ends[0] * c + ends[1] * c;
        }
        for (torque, drive) in state.joint_torque.iter_mut().zip(&self.kept.drive) {
            *torque = -Vector2::new(drive[0].lane(lane), drive[1].lane(lane)) / c;
        }
        body.is_plausible = state.speed.is_plausible();
    }
}

/// A stage with the constants of the system's robot.
fn empty_stage<T: Real>(system: &SpatialSystem) -> Stage<T> {
    let mut stage = Stage::with_capacity(system.robot.link_count());
    let zero = T::zero();
    let sliding = system.friction.map(T::splat);
    stage.friction = StageFriction { sliding, rolling: T::splat(system.rolling_friction) };
    stage.links.extend(system.robot.links.iter().map(|link| StageLink {
        axes: Frame::origin().axes,
        momentum: Momentum::zero(),
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

/// Depth from which on a sphere must not go deeper \[m\].
const SUNK: f64 = 2e-4;

/// Squared length of the centre line's shadow below which a link is upright.
const UPRIGHT: f64 = 1e-18;

/// What remains of the tolerance for a deviation where a peg pushes: links that touch down or lift off gain little from
/// shorter steps, a robot that hits a peg gains much.
const PUSHED: f64 = 0.25;

/// A step that takes a sunk sphere deeper by more is divided \[m\].
const SINKING: f64 = 2e-5;

/// Distance between prediction and end of a stage from which on it is predicted again \[m\].
const MISPREDICTED: f64 = 2e-3;
