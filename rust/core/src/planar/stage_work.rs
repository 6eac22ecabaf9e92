//! The current stage over lanes: its data, how it is built, and what follows from its solution.

use nalgebra::{Vector2, Vector3};

use crate::contact::PAIRS_PER_LINK;
use crate::control::ControlLaw;
use crate::gait::{Jet, JointTarget, WaveJets, turned};
use crate::math::{Mask, Real, add_scaled, select_into};
use crate::planar::{Heading, Newton, Stage, StageJoint, StageLink, StageSolution, certify, is_plausible, travel};
use crate::robot::Link;

use crate::stepping::lanes::{Lanes, NO_LANES, mask, read_lane, set_vector};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};
use crate::stepping::{
    self, ContactImpulse, Driven, EnergyLedger, FallbackResult, Members, PlantParameters, SolvedStage,
};

use super::backlash::Backlash;
use super::contact_detection::MARGIN;
use super::contacts::Contacts;
use super::energy::work_of;
use super::io_drive::{IoDrive, Situation};
use super::lane_fallback::LaneFallback;
use super::self_contact::SelfContactDetection;
use super::stribeck::StribeckBounds;
use super::{Body, Planar, PlanarSystem};

/// Data of the current stage, for as many robots as `T` has lanes.
#[derive(Debug, Clone)]
pub struct StageWork<T: Real> {
    /// Constants of the links, in every lane.
    pub constants: Vec<LinkConstants<T>>,
    pub half_length: Vec<T>,
    /// Zero for each link.
    at_rest: Vec<Vector3<T>>,
    /// State at the start of the step.
    pub start_pose: Vec<Vector3<T>>,
    pub start_twist: Vec<Vector3<T>>,
    /// q_B, u_R and the expected end velocity of the stage.
    pub base: Vec<Vector3<T>>,
    pub reference: Vec<Vector3<T>>,
    pub guess: Vec<Vector3<T>>,
    /// Expected end configuration.
    pub predicted: Vec<Vector3<T>>,
    pub heading: Vec<Heading<T>>,
    /// The wave that the joints follow at the end of the stage, where they follow one.
    pub wave: WaveJets<T>,
    /// Joint references at the end of the stage, and gains k_P, k_D.
    pub target: Vec<Jet<T>>,
    pub gains: [T; 2],
    pub torque_limit: T,
    /// Whether any robot's scene has pegs; without them it does not matter how far a robot moves.
    pub has_pegs: bool,
    /// The lanes whose robots have pegs around them; for the others a coarse bound on their motion does.
    pub among_pegs: T::Mask,
    pub near_pegs: Lanes,
    pub contacts: Contacts,
    pub self_contacts: SelfContactDetection<T>,
    /// Lanes in which a contact has closed during the step that was open after the last accepted one.
    pub closing: Lanes,
    /// How far away pegs may matter to the stage.
    pub motion_bound: MotionBound<T>,
    /// Input-output linearisation instead of PD.
    pub io: Option<IoDrive<T>>,
    pub backlash: Backlash<T>,
    pub stribeck: StribeckBounds<T>,
    /// Whether the lanes' robots differ from the system's.
    is_varied: bool,
    /// References of one robot.
    targets: Vec<JointTarget>,
    /// Forces of the last stage.
    pub friction_force: Vec<Vector2<T>>,
    pub contact_force: Vec<T>,
    pub drive_torque: Vec<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    pub newton: Newton<T>,
    fallback: LaneFallback,
    /// End configuration.
    pub end: Vec<Vector3<T>>,
    /// Work of the solved stage.
    energy: EnergyLedger<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    /// Solution lane by lane, once it is accepted; some lanes may need another prediction.
    pub kept_twist: Vec<Vector3<T>>,
    pub kept_drive: Vec<T>,
    kept_energy: EnergyLedger<T>,
    /// Bound on the distance of any point of the robot from the predicted end of the step \[m\].
    misprediction: T,
    /// Whether the end of the step is the state of a robot rather than of a diverged computation.
    plausible: T::Mask,
}

#[derive(Debug, Clone, Copy)]
pub struct LinkConstants<T> {
    pub mass: T,
    pub inertia: T,
    pub reach: T,
    /// mu m g \[N\].
    pub friction: Vector2<T>,
}

/// How far away pegs may matter to a stage.
#[derive(Debug, Clone, Copy)]
pub struct MotionBound<T> {
    /// Largest speed of any point of the robot, at the start of the stage or expected at its end \[m/s\].
    pub fastest: T,
    /// Largest displacement of any point of the robot from the start of the step to the predicted end \[m\].
    pub displacement: T,
}

impl<T: Real> LinkConstants<T> {
    fn of(system: &PlanarSystem, link: &Link) -> Self {
        Self {
            mass: T::splat(link.mass),
            inertia: T::splat(link.inertia),
            reach: T::splat(link.reach()),
            friction: system.friction_force(link).map(T::splat),
        }
    }

    /// Bound on how far a point of the link moves between two poses, or on how much faster it is at one of
    /// two twists.
    #[inline(always)]
    pub fn farthest(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        let (x, y) = (to.x - from.x, to.y - from.y);
        (x * x + y * y).sqrt() + self.reach * (to.z - from.z).abs()
    }

    /// A coarser bound that takes no root.
    #[inline(always)]
    fn farther(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        (to.x - from.x).abs() + (to.y - from.y).abs() + self.reach * (to.z - from.z).abs()
    }
}

impl<T: Real> StageWork<T> {
    #[inline(always)]
    fn fill_links(&mut self) {
        let c = self.stage.coefficient;
        self.stage.links.clear();
        for (i, link) in self.constants.iter().enumerate() {
            self.stage.links.push(StageLink {
                heading: self.heading[i],
                reference: self.reference[i],
                mass: link.mass,
                inertia: link.inertia,
                half_length: self.half_length[i],
                friction: Vector2::new(link.friction.x * c, link.friction.y * c),
            });
        }
        if self.stribeck.is_any {
            self.stribeck.lower(&mut self.stage.links);
        }
    }

    #[inline(always)]
    fn fill_joints(&mut self) {
        let Some(io) = &mut self.io else { return self.fill_pd() };
        let situation = Situation {
            heading: &self.heading,
            base: &self.base,
            reference: &self.reference,
            guess: &self.guess,
            target: &self.target,
            gains: self.gains,
            torque_limit: self.torque_limit,
            coefficient: self.stage.coefficient,
        };
        io.fill(&situation, &mut self.stage.joints);
    }

    /// The PD torque (T 3.51 != D3) at the end of the stage, where phi = phi_base + c omega_J, is linear in
    /// omega_J.
    #[inline(always)]
    fn fill_pd(&mut self) {
        let c = self.stage.coefficient;
        let [kp, kd] = self.gains;
        self.stage.joints.clear();
        for (j, target) in self.target.iter().enumerate() {
            let error = target.value - (self.base[j + 1].z - self.base[j].z);
            self.stage.joints.push(StageJoint {
                drive: c * (kp * error + kd * target.rate),
                stiffness: c * (c * kp + kd),
                limit: c * self.torque_limit,
                slack: T::zero(),
            });
        }
        if self.backlash.is_any {
            self.backlash.apply(c, kd, &mut self.stage.joints);
        }
    }

    #[inline(always)]
    fn load_forces(&mut self) {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.guess);
        for (impulse, force) in self.solution.friction.iter_mut().zip(&self.friction_force) {
            *impulse = Vector2::new(force.x * c, force.y * c);
        }
        for (impulse, torque) in self.solution.drive.iter_mut().zip(&self.drive_torque) {
            *impulse = *torque * c;
        }
        self.solution.contact.clear();
        for force in &self.contact_force {
            self.solution.contact.push(*force * c);
        }
        self.self_contacts.load_forces(&self.stage, &mut self.solution.pair);
    }

    /// Whether a lane's robot may touch a peg or itself.
    fn is_near_contact(&self, lane: usize) -> bool {
        self.near_pegs[lane] || self.self_contacts.is_near(lane)
    }

    #[inline(always)]
    fn measure_deviation(&mut self) {
        let fastest = self.farthest::<true>(&self.solution.twist, &self.guess);
        self.deviation = fastest * self.stage.coefficient;
    }

    /// Bound on how far a point of the robot moves between poses, or on how much faster it is at one of two twists.
    #[inline(always)]
    fn bound(&self, to: &[Vector3<T>], from: &[Vector3<T>]) -> T {
        let (near, mut bound) = (self.among_pegs, T::zero());
        if near.any() {
            bound = self.farthest::<true>(to, from);
        }
        if (!near).any() {
            bound = T::select(near, bound, self.farthest::<false>(to, from));
        }
        bound
    }

    /// Bound on the speed of any point of the robot at a twist \[m/s\].
    #[inline(always)]
    fn fastest(&self, twist: &[Vector3<T>]) -> T {
        self.bound(twist, &self.at_rest)
    }

    /// The largest of a bound over the links, sharp or coarse.
    #[inline(always)]
    fn farthest<const SHARP: bool>(&self, to: &[Vector3<T>], from: &[Vector3<T>]) -> T {
        let mut farthest = T::zero();
        for (link, (to, from)) in self.constants.iter().zip(to.iter().zip(from)) {
            farthest = farthest.max(if SHARP { link.farthest(to, from) } else { link.farther(to, from) });
        }
        farthest
    }

    #[inline(always)]
    fn store_forces(&mut self) {
        let per_second = T::splat(1.0) / self.stage.coefficient;
        for (force, impulse) in self.friction_force.iter_mut().zip(&self.solution.friction) {
            *force = Vector2::new(impulse.x * per_second, impulse.y * per_second);
        }
        for (force, impulse) in self.contact_force.iter_mut().zip(&self.solution.contact) {
            *force = *impulse * per_second;
        }
        self.self_contacts.store_forces(&self.solution.pair, per_second);
    }

    /// Constants of the lanes' own robots; nothing to do where all are as the system's.
    fn load_variations<D: Driven<Model = Planar>>(&mut self, members: &Members<D>) {
        let was_varied = self.is_varied;
        self.is_varied = members.any(|body| body.parameters != PlantParameters::default());
        if !self.is_varied && !was_varied {
            return;
        }
        for lane in 0..T::LANES {
            let PlantParameters { mass, friction, .. } = members.body(lane).parameters;
            for (constants, link) in self.constants.iter_mut().zip(&members.system.robot.links) {
                let bound = members.system.friction_force(link).component_mul(&friction) * mass;
                constants.mass.set_lane(lane, link.mass * mass);
                constants.inertia.set_lane(lane, link.inertia * mass);
                constants.friction.x.set_lane(lane, bound.x);
                constants.friction.y.set_lane(lane, bound.y);
            }
        }
    }

    /// Friction forces of the last stage.
    fn load_friction<D: Driven<Model = Planar>>(&mut self, members: &Members<D>) {
        for lane in 0..T::LANES {
            for (lanes, force) in self.friction_force.iter_mut().zip(&members.body(lane).warm_start.friction) {
                lanes.x.set_lane(lane, force.x);
                lanes.y.set_lane(lane, force.y);
            }
        }
    }
}

impl<T: Real> stepping::StageWork<T> for StageWork<T> {
    type Model = Planar;

    #[inline(always)]
    fn begin(&mut self) {
        self.base.copy_from_slice(&self.start_pose);
        self.reference.copy_from_slice(&self.start_twist);
        self.guess.copy_from_slice(&self.start_twist);
        self.backlash.begin_step();
        self.stribeck.begin_step(&self.start_twist);
        self.closing = NO_LANES;
        self.self_contacts.begin_step();
    }

    /// Joint references along the wave, whose phase is turned from joint to joint.
    #[inline(always)]
    fn follow_waves(&mut self) {
        let Self { wave, target, .. } = self;
        let (mut phase, phase_shift) = (wave.phase.sin_cos(), wave.phase_shift.value.sin_cos());
        for (joint, target) in target.iter_mut().enumerate() {
            *target = wave.joint(joint, phase);
            phase = turned(phase, phase_shift);
        }
    }

    #[inline(always)]
    fn extrapolate(&mut self, h: T) {
        let (to_reference, to_guess) = (T::splat(EXTRAPOLATION), T::splat(1.0 / GAMMA));
        for (i, u) in self.start_twist.iter().enumerate() {
            let end = &self.kept_twist[i];
            let change = Vector3::new(end.x - u.x, end.y - u.y, end.z - u.z);
            self.reference[i] = add_scaled(u, &change, to_reference);
            self.guess[i] = add_scaled(u, &change, to_guess);
        }
        if self.backlash.is_any {
            self.backlash.extrapolate(to_reference);
        }
        if self.stribeck.is_any {
            self.stribeck.extrapolate(&self.start_twist, &self.kept_twist, T::splat(0.5 / (GAMMA * GAMMA)));
        }
        let per_second = T::splat(1.0) / self.stage.coefficient;
        for (torque, impulse) in self.drive_torque.iter_mut().zip(&self.kept_drive) {
            *torque = *impulse * per_second;
        }
        let elapsed = h - T::splat(GAMMA) * h;
        let Self { half_length, kept_twist, base, heading, start_pose, .. } = self;
        travel(half_length, start_pose, kept_twist, elapsed, base, heading);
    }

    #[inline(always)]
    fn predict(&mut self, c: T, _: T, pending: T::Mask) {
        self.stage.coefficient = c;
        travel(&self.half_length, &self.base, &self.guess, c, &mut self.predicted, &mut self.heading);
        self.self_contacts.predict(&self.predicted);
        if self.has_pegs || self.self_contacts.is_any_folded() {
            let fastest = self.fastest(&self.guess).max(self.fastest(&self.reference));
            let displacement = self.bound(&self.predicted, &self.start_pose);
            let MotionBound { fastest: last_fastest, displacement: last_displacement } = self.motion_bound;
            self.motion_bound = MotionBound {
                fastest: T::select(pending, fastest, last_fastest),
                displacement: T::select(pending, displacement, last_displacement),
            };
        }
    }

    #[inline(always)]
    fn solve(&mut self, tolerance: f64, max_iterations: u32, lanes: T::Mask) -> SolvedStage<T> {
        self.fill_links();
        self.fill_joints();
        self.load_forces();
        let Self { stage, solution, newton, .. } = self;
        let outcome = newton.solve(stage, solution, tolerance, max_iterations, lanes);
        let certificate = certify(stage, solution);
        SolvedStage { outcome, residual: certificate.residual(), gap: certificate.gap }
    }

    #[inline(always)]
    fn evaluate(&mut self, _: T::Mask) {
        self.energy = work_of(&self.stage, &self.solution);
        self.store_forces();
        if self.among_pegs.any() || self.self_contacts.is_any_near() {
            self.measure_deviation();
        }
    }

    #[inline(always)]
    fn keep(&mut self, solved: T::Mask, again: T::Mask) {
        for (i, u) in self.solution.twist.iter().enumerate() {
            select_into(&mut self.kept_twist[i], solved, u);
            select_into(&mut self.guess[i], again, u);
        }
        for (kept, drive) in self.kept_drive.iter_mut().zip(&self.solution.drive) {
            *kept = T::select(solved, *drive, *kept);
        }
        self.kept_energy.select_into(solved, &self.energy);
        if self.backlash.is_any {
            self.backlash.end_stage(self.stage.coefficient, &self.stage.joints, &self.kept_twist);
        }
    }

    /// End configuration q_B + c u of the solved stage.
    #[inline(always)]
    fn arrive(&mut self) {
        let c = self.stage.coefficient;
        travel(&self.half_length, &self.base, &self.kept_twist, c, &mut self.end, &mut self.heading);
        self.misprediction = if self.has_pegs { self.bound(&self.end, &self.predicted) } else { T::zero() };
        self.plausible = is_plausible(&self.end, &self.kept_twist);
    }

    fn new(system: &PlanarSystem) -> Self {
        let links = system.robot.link_count();
        let zero = T::zero();
        let rest = vec![Vector3::new(zero, zero, zero); links];
        Self {
            constants: system.robot.links.iter().map(|link| LinkConstants::of(system, link)).collect(),
            half_length: system.robot.links.iter().map(|link| T::splat(0.5 * link.length)).collect(),
            at_rest: rest.clone(),
            start_pose: rest.clone(),
            start_twist: rest.clone(),
            base: rest.clone(),
            reference: rest.clone(),
            guess: rest.clone(),
            predicted: rest.clone(),
            heading: vec![Heading { cos: T::splat(1.0), sin: zero }; links],
            wave: WaveJets::still(),
            target: vec![Jet { value: zero, rate: zero, acceleration: zero }; links - 1],
            gains: [system.controller.kp, system.controller.kd].map(T::splat),
            torque_limit: T::splat(f64::INFINITY),
            io: (system.controller.law == ControlLaw::Io).then(|| IoDrive::new(&system.robot, system.friction())),
            backlash: Backlash::new(links - 1),
            stribeck: StribeckBounds::new(links, system.stribeck().speed),
            is_varied: false,
            targets: vec![JointTarget::default(); links - 1],
            has_pegs: false,
            among_pegs: T::Mask::of(|_| false),
            near_pegs: NO_LANES,
            contacts: Contacts::with_capacity(links, T::LANES),
            self_contacts: SelfContactDetection::new(&system.robot.links, system.robot.self_contact),
            closing: NO_LANES,
            motion_bound: MotionBound { fastest: zero, displacement: zero },
            friction_force: vec![Vector2::new(zero, zero); links],
            deviation: zero,
            kept_twist: rest.clone(),
            kept_drive: vec![zero; links - 1],
            kept_energy: EnergyLedger::zero(),
            misprediction: zero,
            plausible: T::Mask::of(|_| true),
            drive_torque: vec![zero; links - 1],
            contact_force: Vec::with_capacity(PAIRS_PER_LINK * links),
            stage: Stage::with_capacity(links),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            fallback: LaneFallback::new(links),
            end: rest.clone(),
            energy: EnergyLedger::zero(),
        }
    }

    fn load<D: Driven<Model = Planar>>(&mut self, members: &Members<D>) {
        self.load_variations(members);
        self.backlash.load(members);
        self.stribeck.load(members);
        self.self_contacts.load(members);
        self.has_pegs = members.any(|body| !body.pegs.pegs().is_empty());
        self.near_pegs =
            std::array::from_fn(|lane| lane < T::LANES && !members.body(lane).warm_start.near.pairs().is_empty());
        self.among_pegs = mask::<T>(self.near_pegs);
        for lane in 0..T::LANES {
            let Body { state, warm_start, .. } = members.body(lane);
            for (lanes, torque) in self.drive_torque.iter_mut().zip(&warm_start.joint_torque) {
                lanes.set_lane(lane, -torque);
            }
            for (i, (q, u)) in state.pose.iter().zip(&state.twist).enumerate() {
                set_vector(&mut self.start_pose[i], lane, q);
                set_vector(&mut self.start_twist[i], lane, u);
            }
        }
    }

    fn read_waves<D: Driven<Model = Planar>>(&mut self, members: &Members<D>, end: T) -> Lanes {
        let mut waving = NO_LANES;
        for (lane, waving) in waving.iter_mut().enumerate().take(T::LANES) {
            let robot = members.robot(lane);
            if let Some(wave) = robot.travelling_wave(robot.body().state.time + end.lane(lane)) {
                self.wave.set_lane(lane, &wave);
                *waving = true;
            }
        }
        waving
    }

    fn read_references<D: Driven<Model = Planar>>(&mut self, members: &Members<D>, end: T, waving: Lanes) {
        for (lane, is_waving) in waving.into_iter().enumerate().take(T::LANES) {
            let robot = members.robot(lane);
            let time = robot.body().state.time + end.lane(lane);
            let share = robot.body().parameters.torque_limit;
            self.torque_limit.set_lane(lane, share * members.system.controller.limit_until(time));
            if is_waving {
                continue;
            }
            robot.targets(time, &mut self.targets);
            for (lanes, target) in self.target.iter_mut().zip(&self.targets) {
                lanes.value.set_lane(lane, target.angle);
                lanes.rate.set_lane(lane, target.rate);
                lanes.acceleration.set_lane(lane, target.acceleration);
            }
        }
        self.load_friction(members);
    }

    fn find_contacts<D: Driven<Model = Planar>>(&mut self, members: &mut Members<D>, pending: Lanes, elapsed: T) {
        self.detect_contacts(members, pending, elapsed);
    }

    fn fall_back(&mut self, lane: usize, tolerance: f64) -> Option<FallbackResult> {
        self.fallback.solve_lane(&self.stage, &mut self.solution, lane, tolerance)
    }

    fn deviation(&self) -> T {
        self.deviation
    }

    /// Gaps linearised at the prediction may then be wrong, or contacts missing.
    fn is_mispredicted(&self, lane: usize) -> bool {
        self.is_near_contact(lane) && self.deviation.lane(lane) > MARGIN
    }

    fn collect_contact_impulses<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        self.keep_forces(members, solved, contact_impulses);
        self.keep_self_contacts(members, solved, contact_impulses);
    }

    fn kept_energy(&self) -> &EnergyLedger<T> {
        &self.kept_energy
    }

    /// Away from contacts deviations do not count: friction is bounded and the schemes keep their stability.
    fn deviation_share(&self, lane: usize, _: impl Fn() -> bool) -> f64 {
        match (self.is_near_contact(lane), self.closing[lane]) {
            (true, true) => CLOSING,
            (true, false) => 1.0,
            (false, _) => f64::INFINITY,
        }
    }

    fn sinks(&self, lane: usize) -> bool {
        self.sinks_into_itself(lane)
    }

    fn accept(&mut self, system: &PlanarSystem, lane: usize, body: &mut Body) {
        read_lane(&self.end, lane, &mut body.state.pose);
        read_lane(&self.kept_twist, lane, &mut body.state.twist);
        self.backlash.save(lane, &mut body.warm_start.backlash);
        body.is_plausible = self.plausible.lane(lane);
        body.warm_start.near.arrive(self.motion_bound.displacement.lane(lane), self.misprediction.lane(lane));
        body.warm_start.near.end_step(|pair| self.end_gap(lane, pair, system, &body.pegs));
        self.end_self_contacts(&system.robot.links, lane, &mut body.warm_start.self_contacts);
        for (torque, drive) in body.warm_start.joint_torque.iter_mut().zip(&self.kept_drive) {
            *torque = -drive.lane(lane) / self.stage.coefficient.lane(lane);
        }
    }
}

/// What remains of the tolerance for a deviation if a contact closes: an impact's impulse is extrapolated with the
/// forces'.
const CLOSING: f64 = 0.5;
