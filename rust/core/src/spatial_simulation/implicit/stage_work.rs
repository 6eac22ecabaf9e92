//! The arithmetic of a stage: what surrounds the solver.

use nalgebra::Vector2;

use crate::gait::CardanTarget;
use crate::math::Real;
use crate::spatial::{
    Certificate, Frame, Newton, Outcome, Posture, Screw, Speed, Stage, StageDrive, StageFriction, StageLink,
    StageSolution, certify,
};

use super::super::SpatialPlant;

/// Data of the stage at hand.
#[derive(Debug, Clone)]
pub struct StageWork<T: Real = f64> {
    /// Farthest point of each link's surface from its CG \[m\].
    pub reach: Vec<T>,
    pub half_length: Vec<T>,
    pub gravity: T,
    /// Gains k_P, k_D.
    pub gains: [T; 2],
    pub torque_limit: T,
    /// Joint references at the end of the stage: yaw and pitch, angle and rate.
    pub target: Vec<[[T; 2]; 2]>,
    /// q_B and the expected end velocity of the stage.
    pub base: Posture<T>,
    pub guess: Speed<T>,
    /// Reference momenta p_R, without gravity.
    pub momentum: Vec<Screw<T>>,
    /// Expected end configuration.
    pub predicted: Posture<T>,
    pub frames: Vec<Frame<T>>,
    /// Twists of the guess.
    pub expected: Vec<Screw<T>>,
    /// Heights of the spheres' lowest points at the start of the step \[m\].
    pub start_gap: Vec<[T; 2]>,
    /// Normal forces of the last stage \[N\].
    pub normal_force: Vec<[T; 2]>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    pub newton: Newton<T>,
    /// The stage's end velocity.
    pub end: Speed<T>,
}

impl StageWork {
    pub fn new(plant: &SpatialPlant) -> Self {
        let links = plant.robot.link_count();
        let mut stage = Stage::with_capacity(links);
        stage.friction = StageFriction { sliding: plant.friction, rolling: plant.rolling_friction };
        stage.links.extend(plant.robot.links.iter().map(|link| StageLink {
            axes: Frame::origin().axes,
            momentum: Screw::zero(),
            mass: link.mass,
            inertia: link.inertia,
            roll_inertia: link.roll_inertia,
            half_length: 0.5 * link.length,
            sphere: link.contact_half_length,
            radius: link.radius,
            tangent: Vector2::x(),
            ground: [0.0; 2],
        }));
        Self {
            reach: plant.robot.links.iter().map(|link| link.reach().max(0.5 * link.length)).collect(),
            half_length: plant.robot.links.iter().map(|link| 0.5 * link.length).collect(),
            gravity: plant.robot.gravity,
            gains: [plant.controller.kp, plant.controller.kd],
            torque_limit: f64::INFINITY,
            target: vec![[[0.0; 2]; 2]; links - 1],
            base: Posture::straight(links),
            guess: Speed::rest(links),
            momentum: vec![Screw::zero(); links],
            predicted: Posture::straight(links),
            frames: vec![Frame::origin(); links],
            expected: vec![Screw::zero(); links],
            start_gap: vec![[0.0; 2]; links],
            normal_force: vec![[0.0; 2]; links],
            stage,
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            end: Speed::rest(links),
        }
    }

    /// Joint references and torque limit at the end of the stage.
    pub fn take_references(&mut self, targets: &[CardanTarget], torque_limit: f64) {
        for (mine, CardanTarget { yaw, pitch }) in self.target.iter_mut().zip(targets) {
            *mine = [[yaw.angle, yaw.rate], [pitch.angle, pitch.rate]];
        }
        self.torque_limit = torque_limit;
    }
}

impl<T: Real> StageWork<T> {
    /// Predicts the end configuration of a stage of coefficient `c`.
    pub fn predict(&mut self, c: f64) {
        self.stage.coefficient = c;
        self.predicted.travel(&self.base, &self.guess, T::splat(c));
        self.predicted.place_links(&self.half_length, &mut self.frames);
        self.guess.twists(&self.frames, &self.half_length, &mut self.expected);
    }

    /// Links and joints of the stage at its predicted end; `elapsed` is the time from the start of the step to there.
    pub fn fill(&mut self, elapsed: f64) {
        self.fill_links(elapsed);
        self.fill_joints();
    }

    /// Solves the filled stage from the guess and the last normal forces, and judges the solution.
    pub fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> (Outcome<T>, Certificate<T>) {
        let c = T::splat(self.stage.coefficient);
        self.solution.twist.copy_from_slice(&self.expected);
        for (impulse, force) in self.solution.normal.iter_mut().zip(&self.normal_force) {
            *impulse = [c * force[0], c * force[1]];
        }
        let outcome = self.newton.solve(&self.stage, &mut self.solution, tolerance, max_iterations, lanes);
        let certificate = certify(&self.stage, &self.solution);
        self.take_solution();
        (outcome, certificate)
    }

    /// End velocity and normal forces of the solved stage.
    pub fn take_solution(&mut self) {
        self.end.head = self.solution.twist[0];
        self.end.rate.copy_from_slice(&self.solution.rate);
        let per_second = T::splat(1.0) / T::splat(self.stage.coefficient);
        for (force, impulse) in self.normal_force.iter_mut().zip(&self.solution.normal) {
            *force = [impulse[0] * per_second, impulse[1] * per_second];
        }
    }

    /// Gaps of a step that starts at `posture` with `speed`; also the first stage's base, guess and reference momenta.
    pub fn begin_step(&mut self, posture: &Posture<T>, speed: &Speed<T>, momentum: &[Screw<T>]) {
        self.base.copy_from(posture);
        self.guess.copy_from(speed);
        self.momentum.copy_from_slice(momentum);
        self.base.place_links(&self.half_length, &mut self.frames);
        for (i, frame) in self.frames.iter().enumerate() {
            let link = &self.stage.links[i];
            self.start_gap[i] = [frame.ground_gap(link, 0), frame.ground_gap(link, 1)];
        }
    }

    /// Momenta at the end of the solved stage.
    pub fn end_momenta(&self, momentum: &mut [Screw<T>]) {
        for (momentum, (link, x)) in momentum.iter_mut().zip(self.stage.links.iter().zip(&self.solution.twist)) {
            *momentum = link.momentum_of(x);
        }
    }

    /// Reference momenta p + weight (p_1 - p), with p_1 those at the end of the solved stage.
    pub fn extrapolate_momenta(&mut self, weight: f64) {
        for (i, momentum) in self.momentum.iter_mut().enumerate() {
            let end = self.stage.links[i].momentum_of(&self.solution.twist[i]);
            let change = end.plus_scaled(momentum, -T::splat(1.0));
            *momentum = momentum.plus_scaled(&change, T::splat(weight));
        }
    }

    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub fn deviation(&self) -> T {
        let mut fastest = T::zero();
        for (reach, (u, guess)) in self.reach.iter().zip(self.solution.twist.iter().zip(&self.expected)) {
            let change = u.plus_scaled(guess, -T::splat(1.0));
            let (v, w) = (change.linear, change.angular);
            let linear = (v.x * v.x + v.y * v.y + v.z * v.z).sqrt();
            let angular = (w.x * w.x + w.y * w.y + w.z * w.z).sqrt();
            fastest = fastest.max(linear + *reach * angular);
        }
        fastest * T::splat(self.stage.coefficient)
    }

    fn fill_links(&mut self, elapsed: f64) {
        let c = T::splat(self.stage.coefficient);
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
    fn fill_joints(&mut self) {
        let c = T::splat(self.stage.coefficient);
        let [kp, kd] = self.gains;
        self.stage.joints.clear();
        for (base, target) in self.base.angle.iter().zip(&self.target) {
            self.stage.joints.push(std::array::from_fn(|axis| {
                let [angle, rate] = target[axis];
                StageDrive {
                    drive: c * (kp * (angle - base[axis]) + kd * rate),
                    stiffness: c * (c * kp + kd),
                    limit: c * self.torque_limit,
                }
            }));
        }
    }
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
fn opening<T: Real>(still: T, at_start: T, c: T, elapsed: f64) -> T {
    let zero = T::zero();
    let touches = still.abs().lt(T::splat(TOUCHING));
    let remaining = T::splat((1.0 - elapsed / RECOVERY_TIME).max(0.0));
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

/// Squared length of the centre line's shadow below which a link is upright.
const UPRIGHT: f64 = 1e-18;
