//! The [Newton iteration with Coulomb's law as it stands](crate::solver::CoupledStage) on the 3D chain.

use nalgebra::{LU, Matrix6, U6, Vector6};

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::solver::{
    Contacts, CoulombForm, CoupledChain, CoupledLink, CoupledStage, Defect, DrivenAxis, EliminatedChain, Head,
    LinkStep, LowRank,
};
use crate::spatial::stage::CONTACTS_PER_LINK;
use crate::spatial::{Stage, StageSolution, hinge_directions};

use super::coulomb_friction::ObstacleFrictionLaw;
use super::coulomb_laws::{GroundLaws, ObstacleLaw};
use super::coulomb_sweep::{chain_link, mass_matrix, spatial_vector, stacked};

/// Workspace of the solver, re-used from stage to stage.
pub struct CoulombNewton {
    pub(super) chain: CoupledChain<6, 2, GroundLaws, LU<f64, U6, U6>>,
    pub(super) contacts: Vec<ObstacleLaw>,
    /// Friction of each entry of `contacts`; empty where no obstacle has any.
    pub(super) obstacle_friction: Vec<ObstacleFrictionLaw>,
    /// Between links.
    pairs: Contacts<6>,
    low_rank: LowRank<f64, Vector6<f64>, ChainStep>,
    pub(super) form: CoulombForm,
    /// Speed below which a defect is no error \[m/s\].
    pub(super) tolerance: f64,
}

/// Change of a link's twist and of the rates of the joint before it.
#[derive(Debug, Clone, Copy)]
struct ChainStep {
    twist: Vector6<f64>,
    rates: [f64; 2],
}

impl LinkStep<f64, Vector6<f64>> for ChainStep {
    fn along(&self, direction: &Vector6<f64>) -> f64 {
        direction.dot(&self.twist)
    }

    fn plus_scaled(&self, other: &Self, factor: f64) -> Self {
        let rates = [0, 1].map(|axis| self.rates[axis] + other.rates[axis] * factor);
        Self { twist: self.twist + other.twist * factor, rates }
    }
}

impl Head<6> for LU<f64, U6, U6> {
    fn of(matrix: Matrix6<f64>) -> Self {
        matrix.lu()
    }

    fn solve(&self, load: &Vector6<f64>) -> Vector6<f64> {
        LU::solve(self, load).unwrap_or(Vector6::repeat(f64::NAN))
    }
}

impl CoulombNewton {
    pub fn new(links: usize) -> Self {
        Self {
            chain: CoupledChain::new(links),
            contacts: Vec::with_capacity(CONTACTS_PER_LINK * links),
            obstacle_friction: Vec::with_capacity(CONTACTS_PER_LINK * links),
            pairs: Contacts::with_capacity(LINK_CONTACTS_PER_LINK * links),
            low_rank: LowRank::new(links),
            form: CoulombForm::stiff(1.0, 1.0),
            tolerance: 0.0,
        }
    }

    fn load_link(&mut self, stage: &Stage, solution: &StageSolution, i: usize) {
        let (before, link) = (&stage.links[i.saturating_sub(1)], &stage.links[i]);
        let joint_axes = stage.axes_of(i.saturating_sub(1));
        let is_free = i == 0 || i >= stage.chain();
        let last = self.chain.links.last().filter(|_| !is_free);
        let axes = match i.checked_sub(1).filter(|_| !is_free) {
            Some(joint) => {
                let relative = solution.twist[i].angular - solution.twist[joint].angular;
                let directions = hinge_directions(joint_axes, &before.axes, &link.axes);
                [0, 1].map(|axis| {
                    let rate = if joint_axes.has(axis) { directions[axis].dot(&relative) } else { 0.0 };
                    let motor = stage.motors.get(2 * joint + axis).zip(solution.gear.get(2 * joint + axis));
                    let drive = &stage.joints[joint][axis];
                    DrivenAxis::new(drive, motor, before.half_length, PENALTY * before.mass, rate)
                })
            }
            None => [DrivenAxis::none(); 2],
        };
        let place = (chain_link(joint_axes, before, link), last.map(|last| last.twist));
        self.chain.links.push(CoupledLink::new(
            place,
            axes,
            GroundLaws::new(stage, solution, i),
            (mass_matrix(link), stacked(&link.momentum)),
            (link.mass, link.half_length),
            stacked(&solution.twist[i]),
        ));
    }
}

impl CoupledStage for CoulombNewton {
    type Stage = Stage;
    type Solution = StageSolution;

    fn load(&mut self, stage: &Stage, solution: &StageSolution, tolerance: f64) {
        let chain = &stage.links[..stage.chain()];
        let mass = chain.iter().map(|link| link.mass).sum::<f64>() / chain.len() as f64;
        self.form = CoulombForm::stiff(mass, PENALTY);
        self.tolerance = tolerance;
        self.chain.links.clear();
        (0..stage.links.len()).for_each(|i| self.load_link(stage, solution, i));
        self.contacts.clear();
        self.contacts.extend((0..stage.contacts.len()).map(|k| ObstacleLaw::new(stage, solution, k)));
        self.obstacle_friction.clear();
        self.obstacle_friction
            .extend((0..stage.obstacle_friction.len()).map(|k| ObstacleFrictionLaw::new(stage, solution, k)));
        self.pairs.load((&stage.pairs, &solution.pair), (&[], &[]), stacked);
    }

    fn form(&mut self) -> &mut CoulombForm {
        &mut self.form
    }

    fn recentre(&mut self) {
        self.chain.links.iter_mut().for_each(|link| link.ground.laws.p.recentre());
        self.chain.recentre_gears();
        self.contacts.iter_mut().for_each(|contact| contact.law.p.recentre());
        self.obstacle_friction.iter_mut().for_each(|friction| friction.laws.p.recentre());
        self.pairs.recentre();
    }

    fn centre_error(&self) -> f64 {
        let ground = self.chain.links.iter().map(|link| link.ground.laws.p.off_centre().amax());
        let contacts = self.contacts.iter().map(|contact| contact.law.p.off_centre().abs());
        let friction = self.obstacle_friction.iter().map(|friction| friction.laws.p.off_centre().amax());
        let rest = [self.chain.gear_error(), self.pairs.centre_error()];
        ground.chain(contacts).chain(friction).chain(rest).fold(0.0, f64::max)
    }

    fn negligible(&self) -> f64 {
        let fastest = self.chain.links.iter().map(|link| link.twist.fixed_rows::<3>(0).norm()).fold(0.0, f64::max);
        (EXACT * fastest).min(self.tolerance) + EXACT_AT_REST * self.tolerance
    }

    fn defects(&mut self) -> Defect {
        let Self { chain, contacts, obstacle_friction, pairs, form, .. } = self;
        let mut defect = Defect::NONE;
        for link in &mut chain.links {
            let (squared, largest) = link.ground.measure(&link.twist, form);
            defect.add(squared / link.mass, largest / link.mass);
            link.missing = link.imbalance() - link.ground.laws.force();
        }
        for (k, contact) in contacts.iter_mut().enumerate() {
            let link = &mut chain.links[contact.link];
            if let Some(friction) = obstacle_friction.get_mut(k) {
                if form.is_lagged {
                    friction.project(contact, &link.twist, form);
                    link.missing -= contact.force() + friction.laws.force();
                    continue;
                }
                let missing = friction.measure(&link.twist, contact.law.p.value, form);
                defect.add_impulse(missing, link.mass);
                link.missing -= friction.laws.force();
            }
            let missing = contact.measure(&link.twist, form);
            defect.add_impulse(missing, link.mass);
            link.missing -= contact.force();
        }
        pairs.measure(|link| chain.links[link].twist, form);
        for (row, p) in pairs.impulses() {
            defect.add_impulse(p.defect, chain.links[row.first_link()].mass);
            row.parts().for_each(|(link, w)| chain.links[link].missing -= w * p.value);
        }
        chain.add_defects(&mut defect, |missing, arm| {
            let (force, moment) = (missing.fixed_rows::<3>(0).norm(), missing.fixed_rows::<3>(3).norm() / arm);
            let squared = force * force + moment * moment;
            (squared, squared.sqrt())
        });
        defect
    }

    fn find_step(&mut self) {
        let Self { chain, contacts, obstacle_friction, pairs, low_rank, form, .. } = self;
        if !form.is_lagged || obstacle_friction.is_empty() {
            contacts.iter_mut().for_each(|contact| contact.linearise(form));
        }
        if !form.is_lagged {
            chain.links.iter_mut().for_each(|link| link.ground.linearise(form));
            obstacle_friction
                .iter_mut()
                .zip(&*contacts)
                .for_each(|(friction, contact)| friction.linearise(contact, form));
        }
        let mut contacts_left = contacts.iter().enumerate().rev().peekable();
        chain.find_step(|i, link, balance| {
            let (matrix, load) = link.ground.laws.tangent();
            balance.matrix += link.mass_matrix + matrix;
            balance.load += load - link.missing + pairs.loads_on(i, form).sum::<Vector6<f64>>();
            while let Some((k, contact)) = contacts_left.next_if(|(_, contact)| contact.link == i) {
                let friction = obstacle_friction.get(k).map(|friction| friction.laws.tangent());
                for (matrix, load) in std::iter::once(contact.tangent()).chain(friction) {
                    balance.matrix += matrix;
                    balance.load += load;
                }
            }
        });
        pairs.correct(low_rank, chain, form);
        chain.links.iter_mut().for_each(|link| link.ground.laws.find_step(&link.step));
        for (k, contact) in contacts.iter_mut().enumerate() {
            let step = &chain.links[contact.link].step;
            contact.find_step(step);
            obstacle_friction.get_mut(k).into_iter().for_each(|friction| friction.laws.find_step(step));
        }
        pairs.find_step(|link| chain.links[link].step, form);
    }

    fn move_along(&mut self, fraction: f64) {
        self.chain.move_along(fraction);
        self.chain.links.iter_mut().for_each(|link| link.ground.laws.p.move_along(fraction));
        self.contacts.iter_mut().for_each(|contact| contact.law.p.move_along(fraction));
        self.obstacle_friction.iter_mut().for_each(|friction| friction.laws.p.move_along(fraction));
        self.pairs.move_along(fraction);
    }

    fn write(&self, solution: &mut StageSolution) {
        for (i, link) in self.chain.links.iter().enumerate() {
            solution.twist[i] = spatial_vector(&link.twist);
            link.ground.write(solution, i);
            if let Some(joint) = i.checked_sub(1).filter(|_| !link.is_free) {
                for (axis, driven) in link.axes.iter().enumerate() {
                    solution.rate[joint][axis] = driven.rate;
                    let (impulse, gear) = driven.impulses();
                    solution.actuator[joint][axis] = impulse;
                    gear.into_iter().for_each(|friction| solution.gear[2 * joint + axis] = friction);
                }
            }
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contacts) {
            *impulse = contact.law.p.value.max(0.0);
        }
        for (impulse, friction) in solution.obstacle_friction.iter_mut().zip(&self.obstacle_friction) {
            *impulse = friction.laws.p.value;
        }
        self.pairs.write(&mut solution.pair, &mut []);
    }
}

impl EliminatedChain<f64, Vector6<f64>, ChainStep> for CoupledChain<6, 2, GroundLaws, LU<f64, U6, U6>> {
    fn len(&self) -> usize {
        self.links.len()
    }

    fn step(&self, link: usize) -> ChainStep {
        let link = &self.links[link];
        ChainStep { twist: link.step, rates: link.axes.map(|axis| axis.step_rate) }
    }

    fn set_step(&mut self, link: usize, ChainStep { twist, rates }: ChainStep) {
        let link = &mut self.links[link];
        link.step = twist;
        link.axes.iter_mut().zip(rates).for_each(|(axis, rate)| axis.step_rate = rate);
    }

    fn respond(&mut self, links: [usize; 2], column: &[Vector6<f64>; 2], response: &mut Vec<ChainStep>) {
        CoupledChain::respond(self, links, column, |rates, twist| response.push(ChainStep { twist, rates }));
    }
}

/// Violation of the laws that is left to the compliance over the speed of the robot, and over the tolerance.
const EXACT: f64 = 1e-8;
const EXACT_AT_REST: f64 = 1e-6;

/// Stiffness of contacts over the mass of a link, less than that of [`Newton`](super::Newton): a stiffer one takes more steps.
const PENALTY: f64 = 1e5;
