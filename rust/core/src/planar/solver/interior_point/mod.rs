//! Primal-dual interior point method for stages that Newton's method does not solve.
//!
//! Slip and friction impulse, opening and contact impulse, excess rate and actuator impulse are pairs of points of
//! self-dual cones whose product must vanish. Every iteration follows the central path, on which all
//! products equal the same mu, towards zero (Mehrotra's predictor and corrector with the scaling of
//! Nesterov and Todd); the linear systems are those of [`sweep`](super::sweep), with smooth stiffnesses in
//! place of stick and slip. The number of iterations hardly depends on the problem: 10 to 40.
//! Stiffnesses are kept in series with a small softness (proximal method of multipliers), so that jammed
//! stages, whose impulses are not unique or not bounded, leave the linear systems solvable.

mod actuator;
mod actuator_bounds;
mod contact;
mod limit_surface;
mod pair;

use nalgebra::Vector3;

use self::actuator::{
    BoundedActuator, Turning, actuator_impulse, is_bounded, list_bounded_actuators, turning_friction,
};
use self::actuator_bounds::ActuatorBounds;
use self::contact::Contact;
use self::limit_surface::{Ground, SurfaceCone};
use self::pair::Pair;
use crate::contact::{LINK_CONTACTS_PER_LINK, PAIRS_PER_LINK};
use crate::math::Real;
use crate::planar::solver::link_term::in_frame;
use crate::planar::solver::low_rank::{Coupling, LowRank, coupling_of, respond};
use crate::planar::solver::sweep::{Quadratic, Segment};
use crate::planar::{Stage, StageJoint, StageSolution};
use crate::rows::Row;
use crate::solver::EliminatedChain;
use crate::stepping::NEARBY;

/// How a solve ended.
#[derive(Debug, Clone, Copy)]
pub struct Descent {
    /// Linear solves.
    pub solves: u32,
    /// Velocity by which some contact is closed faster than it may be \[m/s\].
    pub violation: f64,
}

/// Workspace of the solver.
pub struct InteriorPoint {
    friction: Vec<SurfaceCone>,
    grounds: Vec<Ground>,
    contact: Vec<Contact>,
    /// Contacts of the robot with itself that are taken in, by their places in the stage, and their rows in the linear
    /// system.
    near: Vec<usize>,
    self_contact: Vec<Contact>,
    couplings: Vec<Coupling<f64>>,
    low_rank: LowRank<f64>,
    constant: Vec<f64>,
    actuators: Vec<BoundedActuator>,
    segments: Vec<Segment<f64>>,
    /// Values of the obstacles that can be pushed at their centres.
    movables: Vec<Quadratic<f64>>,
    models: Vec<Quadratic<f64>>,
    /// Stiffness of the joint before each link.
    stiffness: Vec<f64>,
    direction: Vec<Vector3<f64>>,
    /// Mass of the lightest link \[kg\].
    lightest: f64,
}

impl InteriorPoint {
    pub fn new(links: usize) -> Self {
        Self {
            friction: vec![SurfaceCone::new(); links],
            grounds: Vec::with_capacity(links),
            contact: Vec::with_capacity(PAIRS_PER_LINK * links),
            near: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            self_contact: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            couplings: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            low_rank: LowRank::new(links),
            constant: vec![0.0; links],
            actuators: Vec::with_capacity(2 * (links - 1)),
            segments: Vec::with_capacity(links),
            movables: Vec::with_capacity(links),
            models: vec![Quadratic::zero(); links],
            stiffness: vec![0.0; links],
            direction: vec![Vector3::zeros(); links],
            lightest: 0.0,
        }
    }

    /// Solves `stage` from the twists in `solution` until the duality gap is that of velocities within
    /// `tolerance` \[m/s\], or no longer falls. Contacts between links that are far apart are taken in where the solution
    /// without them would close them: each costs a substitution of the chain and corrections by all others.
    pub fn solve(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> Descent {
        self.near.clear();
        self.near.extend((0..stage.pairs.len()).filter(|k| stage.pairs[*k].offset < NEARBY));
        let mut descent = self.descend(stage, solution, tolerance);
        for _ in 1..MAX_ROUNDS {
            let taken = self.near.len();
            for (k, pair) in stage.pairs.iter().enumerate() {
                if pair.opening(&solution.twist) < -SMALL * tolerance && !self.near.contains(&k) {
                    self.near.push(k);
                }
            }
            if self.near.len() == taken {
                break;
            }
            let next = self.descend(stage, solution, tolerance);
            descent = Descent { solves: descent.solves + next.solves, ..next };
        }
        descent
    }

    fn descend(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> Descent {
        let energy = stage.energy();
        self.begin(stage, solution, energy);
        let mut descent = Descent { solves: 0, violation: f64::INFINITY };
        for _ in 0..MAX_CENTRES {
            self.spread(stage, solution, SPREAD * energy + f64::MIN_POSITIVE);
            let enough = (0.5 * self.lightest * tolerance * tolerance).min(TARGET_GAP * energy);
            descent.solves += self.follow_central_path(stage, solution, enough);
            descent.violation = self.recentre();
            // No better than before, or not finite: the contacts cannot all be kept open.
            if descent.violation.is_nan() || descent.violation <= SMALL * tolerance {
                break;
            }
        }
        self.write_impulses(stage, solution);
        descent
    }

    /// Brings gap and imbalance below `enough` \[J\]; returns the number of linear solves.
    fn follow_central_path(&mut self, stage: &Stage, solution: &mut StageSolution, enough: f64) -> u32 {
        let (mut best, mut stalled, mut solves) = (f64::INFINITY, 0, 0);
        // Imbalance of the linear equations, as an energy: a step of length alpha leaves 1 - alpha of it.
        let mut imbalance = stage.energy();
        while solves < 2 * MAX_ITERATIONS && stalled < PATIENCE {
            let gap = self.gap();
            // Not above, rather than below: NaN ends the search too.
            let left = gap + imbalance;
            if left.is_nan() || left <= enough {
                break;
            }
            stalled = if gap + imbalance < 0.5 * best { 0 } else { stalled + 1 };
            best = best.min(gap + imbalance);
            let alpha = self.iterate(stage, solution, gap / self.cones(stage));
            solves += 2;
            if alpha <= 0.0 {
                break;
            }
            imbalance *= 1.0 - alpha;
        }
        solves
    }

    fn begin(&mut self, stage: &Stage, solution: &mut StageSolution, energy: f64) {
        stage.follow_joints(&mut solution.twist);
        list_bounded_actuators(stage, energy, &mut self.actuators);
        self.segments.clear();
        let mut before = &stage.links[0].heading;
        for link in &stage.links[..stage.chain()] {
            self.segments.push(Segment::new(&link.heading, before, link.arms()));
            before = &link.heading;
        }
        let nodes = stage.links.len();
        self.segments
            .extend(stage.links[stage.chain()..].iter().map(|one| Segment::new(&one.heading, &one.heading, [0.0; 2])));
        self.movables.resize(nodes - stage.chain(), Quadratic::zero());
        self.friction.resize(nodes, SurfaceCone::new());
        self.grounds.clear();
        self.grounds.extend((0..nodes).map(|node| Ground::of(stage, node)));
        self.models.resize(nodes, Quadratic::zero());
        self.constant.resize(nodes, 0.0);
        self.stiffness.resize(nodes, 0.0);
        self.direction.resize(nodes, Vector3::zeros());
        self.lightest = stage.lightest_mass();
        self.contact.clear();
        self.contact.extend(stage.contacts.iter().map(|contact| Contact::new(stage.links[contact.link].mass)));
        self.self_contact.clear();
        self.couplings.clear();
        for pair in self.near.iter().map(|k| &stage.pairs[*k]) {
            self.self_contact.push(Contact::new(stage.links[pair.links[0]].mass));
            self.couplings.push(coupling_of(pair, stage));
        }
    }

    /// A point inside the cones at the twists of `solution`, with products of about `mu`.
    fn spread(&mut self, stage: &Stage, solution: &StageSolution, mu: f64) {
        let twist = &solution.twist;
        for ((cone, ground), u) in self.friction.iter_mut().zip(&self.grounds).zip(twist) {
            cone.begin(ground, u, mu);
        }
        for BoundedActuator { of, law, bounds, .. } in &mut self.actuators {
            *bounds = ActuatorBounds::begin(law, of.rate(twist), mu);
        }
        for (soft, contact) in self.contact.iter_mut().zip(&stage.contacts) {
            soft.begin(contact.opening(twist), stage.links[contact.link].mass, mu);
        }
        for (soft, k) in self.self_contact.iter_mut().zip(&self.near) {
            let pair = &stage.pairs[*k];
            soft.begin(pair.opening(twist), stage.links[pair.links[0]].mass, mu);
        }
    }

    /// One predictor and corrector from a point whose products are `mu` on average; returns the length of the step,
    /// zero where round-off leaves no direction.
    fn iterate(&mut self, stage: &Stage, solution: &mut StageSolution, mu: f64) -> f64 {
        self.friction.iter_mut().for_each(SurfaceCone::aim_affine);
        self.pairs(Pair::aim_affine);
        self.find_direction(stage, &solution.twist);
        let affine = self.longest_step().min(1.0);
        let left = self.gap_after(affine) / self.cones(stage) / mu;
        let centering = left.clamp(0.0, 1.0).powi(3).max(1e-6);
        self.friction.iter_mut().for_each(|cone| cone.aim_central(centering * mu));
        self.pairs(|pair| pair.aim_central(centering * mu));
        self.find_direction(stage, &solution.twist);
        let mut step = self.longest_step();
        if step < SHORT {
            self.friction.iter_mut().for_each(|cone| cone.aim_centre(mu));
            self.pairs(|pair| pair.aim_centre(mu));
            self.find_direction(stage, &solution.twist);
            step = self.longest_step();
        }
        if !self.direction.iter().all(|du| du.iter().all(|x| x.is_finite())) {
            return 0.0;
        }
        let alpha = (FRACTION * step).min(1.0);
        self.advance(stage, solution, alpha);
        alpha
    }

    /// Solves the linear system for the present right-hand sides and lets all pairs follow.
    fn find_direction(&mut self, stage: &Stage, twist: &[Vector3<f64>]) {
        f64::call(
            #[inline(always)]
            || self.linearise_and_follow(stage, twist),
        );
    }

    #[inline(always)]
    fn linearise_and_follow(&mut self, stage: &Stage, twist: &[Vector3<f64>]) {
        for (i, link) in stage.links.iter().enumerate() {
            let change = twist[i] - link.reference;
            let momentum = link.heading.to_link(change.xy()) * link.mass;
            let mut model = Quadratic { xx: link.mass, yy: link.mass, ww: link.inertia, ..Quadratic::zero() };
            (model.gx, model.gy, model.gw) = (momentum.x, momentum.y, link.inertia * change.z);
            if self.grounds[i].has_friction() {
                self.friction[i].condense(&self.grounds[i], &mut model);
            }
            self.models[i] = model;
        }
        self.stiffness.fill(0.0);
        for (j, joint) in stage.joints.iter().enumerate().filter(|(j, _)| !is_bounded(stage, *j)) {
            let rate = twist[j + 1].z - twist[j].z;
            let impulse = (joint.drive - joint.stiffness * rate).clamp(-joint.limit, joint.limit);
            self.add_actuator(Turning::Joint(j), impulse, joint.stiffness);
        }
        for (j, motor) in stage.motors.iter().enumerate() {
            let (impulse, stiffness) = motor.passive(twist[j + 1].z - twist[j].z);
            self.add_actuator(Turning::Joint(j), impulse, stiffness);
        }
        for k in 0..self.actuators.len() {
            let of = self.actuators[k].of;
            let (impulse, stiffness) = self.actuators[k].linearised(of.rate(twist));
            self.add_actuator(of, impulse, stiffness);
        }
        for (contact, soft) in stage.contacts.iter().zip(&self.contact) {
            let (impulse, stiffness) = soft.linearised(contact.opening(twist));
            let direction = in_frame(&stage.links[contact.link].heading, &contact.direction);
            self.models[contact.link].add_rank_one(&direction, stiffness, -impulse);
        }
        for ((k, soft), coupling) in self.near.iter().zip(&self.self_contact).zip(&mut self.couplings) {
            let (impulse, stiffness) = soft.linearised(stage.pairs[*k].opening(twist));
            coupling.stiffness = stiffness;
            for (link, w) in coupling.links.into_iter().zip(&coupling.direction) {
                self.models[link].subtract_force(&(w * impulse));
            }
        }
        self.solve_linear_system(stage);
        self.follow(stage, twist);
    }

    fn add_actuator(&mut self, of: Turning, impulse: f64, stiffness: f64) {
        match of {
            Turning::Joint(joint) => {
                self.models[joint].gw += impulse;
                self.models[joint + 1].gw -= impulse;
                self.stiffness[joint + 1] += stiffness;
            }
            Turning::Spin(link) => {
                self.models[link].gw -= impulse;
                self.models[link].ww += stiffness;
            }
        }
    }

    #[inline(always)]
    fn solve_linear_system(&mut self, stage: &Stage) {
        let mut behind = Quadratic::zero();
        let (chain, free) = self.segments.split_at_mut(stage.chain());
        for ((segment, own), &stiffness) in chain.iter_mut().zip(&self.models).zip(&self.stiffness).rev() {
            (behind, _) = segment.eliminate::<true>(behind, *own, stiffness);
        }
        let ((mut end, _), mut omega) = (behind.minimiser(), 0.0);
        for (segment, direction) in chain.iter().zip(&mut self.direction) {
            *direction = segment.substitute(&mut end, &mut omega);
        }
        let nodes = self.models.iter().zip(&mut self.direction).skip(stage.chain());
        for ((segment, value), (own, direction)) in free.iter_mut().zip(&mut self.movables).zip(nodes) {
            (*value, _) = segment.eliminate::<true>(Quadratic::zero(), *own, 0.0);
            *direction = segment.substitute(&mut value.minimiser().0, &mut 0.0);
        }
        if !self.couplings.is_empty() {
            let Self { segments, movables, direction: steps, constant, .. } = self;
            let mut chain = Chain { segments, steps, head: &behind, movables, constant };
            self.low_rank.correct(self.couplings.iter().copied(), &mut chain);
        }
        for (link, direction) in stage.links.iter().zip(&mut self.direction) {
            let velocity = link.heading.to_world(direction.xy());
            (direction.x, direction.y) = (velocity.x, velocity.y);
        }
    }

    fn follow(&mut self, stage: &Stage, twist: &[Vector3<f64>]) {
        let direction = &self.direction;
        for ((cone, ground), du) in self.friction.iter_mut().zip(&self.grounds).zip(direction) {
            if ground.has_friction() {
                cone.follow(ground, du);
            }
        }
        for actuator in &mut self.actuators {
            actuator.follow(actuator.of.rate(twist), actuator.of.rate(direction));
        }
        for (contact, soft) in stage.contacts.iter().zip(&mut self.contact) {
            soft.follow(contact.opening(twist), contact.rate(direction));
        }
        for (k, soft) in self.near.iter().zip(&mut self.self_contact) {
            let pair = &stage.pairs[*k];
            soft.follow(pair.opening(twist), pair.rate(direction));
        }
    }

    fn advance(&mut self, stage: &Stage, solution: &mut StageSolution, alpha: f64) {
        for (u, du) in solution.twist.iter_mut().zip(&self.direction) {
            *u += du * alpha;
        }
        stage.follow_joints(&mut solution.twist);
        for ((cone, ground), u) in self.friction.iter_mut().zip(&self.grounds).zip(&solution.twist) {
            if ground.has_friction() {
                cone.advance(ground, alpha, u);
            }
        }
        self.pairs(|pair| pair.advance(alpha));
    }

    /// Visits the pairs of contacts and bounded actuators.
    fn pairs(&mut self, mut visit: impl FnMut(&mut Pair)) {
        self.contact.iter_mut().chain(&mut self.self_contact).for_each(|contact| visit(&mut contact.pair));
        for BoundedActuator { bounds, .. } in &mut self.actuators {
            visit(&mut bounds.upper);
            visit(&mut bounds.lower);
        }
    }

    /// Folds a quantity of all pairs, from `start`.
    fn fold(
        &self,
        start: f64,
        of_cone: impl Fn(&SurfaceCone) -> f64,
        of_pair: impl Fn(&Pair) -> f64,
        with: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let cones = self.friction.iter().zip(&self.grounds).filter(|(_, ground)| ground.has_friction());
        let bounds = self.actuators.iter().map(|actuator| &actuator.bounds);
        let contacts = self.contact.iter().chain(&self.self_contact);
        let figures = cones.map(|(cone, _)| of_cone(cone)).chain(contacts.map(|contact| of_pair(&contact.pair)));
        figures.chain(bounds.flat_map(|bounds| [of_pair(&bounds.upper), of_pair(&bounds.lower)])).fold(start, with)
    }

    fn cones(&self, stage: &Stage) -> f64 {
        let cones = self.grounds.iter().filter(|ground| ground.has_friction()).count();
        (cones + stage.contacts.len() + self.near.len() + 2 * self.actuators.len()).max(1) as f64
    }

    fn gap(&self) -> f64 {
        self.fold(0.0, SurfaceCone::gap, Pair::gap, |a, b| a + b)
    }

    fn gap_after(&self, alpha: f64) -> f64 {
        self.fold(0.0, |cone| cone.gap_after(alpha), |pair| pair.gap_after(alpha), |a, b| a + b)
    }

    fn longest_step(&self) -> f64 {
        self.fold(f64::INFINITY, SurfaceCone::longest_step, Pair::longest_step, f64::min)
    }

    /// Largest violation of a contact \[m/s\]; the impulses become the new centres.
    fn recentre(&mut self) -> f64 {
        let mut fastest: f64 = 0.0;
        for contact in self.contact.iter_mut().chain(&mut self.self_contact) {
            fastest = fastest.max(contact.violation().abs());
            contact.recentre();
        }
        fastest
    }

    fn write_impulses(&self, stage: &Stage, solution: &mut StageSolution) {
        for (i, (&bound, link)) in stage.link_spins().iter().zip(&stage.links).enumerate() {
            let StageJoint { stiffness, limit, .. } = turning_friction(bound, link.inertia);
            solution.spin[i] = (-stiffness * solution.twist[i].z).clamp(-limit, limit);
        }
        for (i, (cone, ground)) in self.friction.iter().zip(&self.grounds).enumerate() {
            let impulse = if ground.has_friction() { cone.impulse(ground) } else { Vector3::zeros() };
            solution.friction[i] = impulse.xy();
            if i >= stage.chain() {
                solution.spin[i] = impulse.z;
            }
        }
        for (j, joint) in stage.joints.iter().enumerate() {
            let rate = solution.twist[j + 1].z - solution.twist[j].z;
            let motor = stage.motors.get(j);
            solution.actuator[j] = actuator_impulse(joint, motor, rate);
            if let Some(motor) = motor {
                let StageJoint { stiffness, limit, .. } = turning_friction(motor.friction, stage.links[j].inertia);
                solution.gear[j] = (-stiffness * rate).clamp(-limit, limit);
            }
        }
        for (impulse, (soft, contact)) in solution.contact.iter_mut().zip(self.contact.iter().zip(&stage.contacts)) {
            *impulse = soft.impulse(stage.links[contact.link].mass);
        }
        solution.pair.fill(0.0);
        for (soft, k) in self.self_contact.iter().zip(&self.near) {
            solution.pair[*k] = soft.impulse(stage.links[stage.pairs[*k].links[0]].mass);
        }
    }
}

struct Chain<'a> {
    segments: &'a [Segment<f64>],
    steps: &'a mut [Vector3<f64>],
    head: &'a Quadratic<f64>,
    movables: &'a [Quadratic<f64>],
    constant: &'a mut [f64],
}

impl EliminatedChain<f64, Vector3<f64>, Vector3<f64>> for Chain<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.segments.len()
    }

    #[inline(always)]
    fn step(&self, link: usize) -> Vector3<f64> {
        self.steps[link]
    }

    #[inline(always)]
    fn set_step(&mut self, link: usize, step: Vector3<f64>) {
        self.steps[link] = step;
    }

    #[inline(always)]
    fn respond(&mut self, links: [usize; 2], column: &[Vector3<f64>; 2], response: &mut Vec<Vector3<f64>>) {
        respond((links, column), |link| &self.segments[link], self.head, self.movables, self.constant, response);
    }
}

/// Duality gap relative to the energies of the stage at which it counts as solved, whatever the tolerance.
const TARGET_GAP: f64 = 1e-11;

/// First products, in energies of the stage: a start too far inside costs an iteration, one too near the boundary many.
const SPREAD: f64 = 10.0;

/// Descents, after each of which contacts are taken in that it closes from far.
const MAX_ROUNDS: u32 = 5;

/// Times the impulses become the centres of the contacts' softness, and the violation from which they do, in tolerances.
const MAX_CENTRES: u32 = 2;
const SMALL: f64 = 0.1;

const MAX_ITERATIONS: u32 = 100;

/// Iterations without halving gap and violation after which the search ends.
const PATIENCE: u32 = 30;

/// A step shorter than this means that the products have grown too different; the next one equalises them.
const SHORT: f64 = 0.2;

/// Part of the longest step that is taken.
const FRACTION: f64 = 0.995;
