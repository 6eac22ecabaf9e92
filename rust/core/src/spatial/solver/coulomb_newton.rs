//! The [Newton iteration with Coulomb's law as it stands](crate::solver::CoupledStage) on the 3D chain.

use nalgebra::{LU, Matrix6, U6, Vector6};

use crate::laws::Backlash;
use crate::solver::{CoulombForm, CoupledStage, Defect, LawForm, MotorTerm};
use crate::spatial::stage::CONTACTS_PER_LINK;
use crate::spatial::{Stage, StageSolution, hinge_directions};

use super::coulomb_friction::ObstacleFrictionLaw;
use super::coulomb_laws::{GroundLaws, ObstacleLaw};
use super::coulomb_pairs::CoulombPairs;
use super::coulomb_sweep::{Balance, ChainLink, mass_matrix, spatial_vector, stacked};
use super::newton::PENALTY;
use super::terms::actuator;

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct CoulombNewton {
    pub(super) links: Vec<Link>,
    pub(super) contacts: Vec<ObstacleLaw>,
    /// Friction of each entry of `contacts`; empty where no obstacle has any.
    pub(super) obstacle_friction: Vec<ObstacleFrictionLaw>,
    pairs: CoulombPairs,
    pub(super) form: CoulombForm,
    /// Speed below which a defect is no error \[m/s\].
    pub(super) tolerance: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Link {
    pub chain: ChainLink,
    pub laws: GroundLaws,
    actuators: [Backlash; 2],
    motors: [Option<MotorTerm<f64>>; 2],
    /// Impulse of each actuator, impulse and stiffness of the whole axis.
    drive: [f64; 2],
    pub moment: [f64; 2],
    stiffness: [f64; 2],
    mass_matrix: Matrix6<f64>,
    momentum: Vector6<f64>,
    mass: f64,
    half_length: f64,
    /// Twist and rates, where the Newton step starts, and the step.
    pub twist: Vector6<f64>,
    start: Vector6<f64>,
    pub step: Vector6<f64>,
    pub rates: [f64; 2],
    start_rates: [f64; 2],
    pub step_rates: [f64; 2],
    /// Imbalance of the link.
    pub missing: Vector6<f64>,
}

impl Link {
    /// Laws of the joint's axes at their rates.
    fn evaluate_axes(&mut self) {
        for axis in 0..2 {
            let rate = self.rates[axis];
            let drive = self.actuators[axis].evaluate(rate);
            (self.drive[axis], self.moment[axis], self.stiffness[axis]) = match &mut self.motors[axis] {
                Some(motor) => motor.drive(LawForm::Present, rate, drive),
                None => (drive.0, drive.0, drive.1),
            };
        }
    }
}

impl CoulombNewton {
    pub fn new(links: usize) -> Self {
        Self {
            links: Vec::with_capacity(links),
            contacts: Vec::with_capacity(CONTACTS_PER_LINK * links),
            obstacle_friction: Vec::with_capacity(CONTACTS_PER_LINK * links),
            pairs: CoulombPairs::new(links),
            form: CoulombForm::stiff(1.0, 1.0),
            tolerance: 0.0,
        }
    }

    fn link(&self, stage: &Stage, solution: &StageSolution, i: usize) -> Link {
        let (before, link) = (&stage.links[i.saturating_sub(1)], &stage.links[i]);
        let axes = stage.axes_of(i.saturating_sub(1));
        let chain = ChainLink::new(axes, before, link);
        let (twist, rates, actuators) = match self.links.last() {
            Some(last) => {
                let relative = solution.twist[i].angular - solution.twist[i - 1].angular;
                let directions = hinge_directions(axes, &before.axes, &link.axes);
                let rates = [0, 1].map(|axis| if axes.has(axis) { directions[axis].dot(&relative) } else { 0.0 });
                (chain.follow(&last.twist, &rates), rates, [0, 1].map(|axis| actuator(&stage.joints[i - 1][axis])))
            }
            None => (stacked(&solution.twist[0]), [0.0; 2], [Backlash::none(); 2]),
        };
        let motors = [0, 1].map(|axis| {
            let axis = (2 * i + axis).checked_sub(2)?;
            let (motor, impulse) = (stage.motors.get(axis)?, solution.gear.get(axis)?);
            Some(MotorTerm::new(motor, *impulse, before.half_length, PENALTY * before.mass))
        });
        Link {
            chain,
            laws: GroundLaws::new(stage, solution, i),
            actuators,
            motors,
            drive: [0.0; 2],
            moment: [0.0; 2],
            stiffness: [0.0; 2],
            mass_matrix: mass_matrix(link),
            momentum: stacked(&link.momentum),
            mass: link.mass,
            half_length: link.half_length,
            twist,
            start: twist,
            step: Vector6::zeros(),
            rates,
            start_rates: rates,
            step_rates: [0.0; 2],
            missing: Vector6::zeros(),
        }
    }
}

impl CoupledStage for CoulombNewton {
    type Stage = Stage;
    type Solution = StageSolution;

    fn load(&mut self, stage: &Stage, solution: &StageSolution, tolerance: f64) {
        let mass = stage.links.iter().map(|link| link.mass).sum::<f64>() / stage.links.len() as f64;
        self.form = CoulombForm::stiff(mass, PENALTY);
        self.tolerance = tolerance;
        self.links.clear();
        for i in 0..stage.links.len() {
            let link = self.link(stage, solution, i);
            self.links.push(link);
        }
        self.contacts.clear();
        self.contacts.extend((0..stage.contacts.len()).map(|k| ObstacleLaw::new(stage, solution, k)));
        self.obstacle_friction.clear();
        self.obstacle_friction
            .extend((0..stage.obstacle_friction.len()).map(|k| ObstacleFrictionLaw::new(stage, solution, k)));
        self.pairs.load(stage, solution);
    }

    fn form(&mut self) -> &mut CoulombForm {
        &mut self.form
    }

    fn recentre(&mut self) {
        self.links.iter_mut().for_each(|link| link.laws.centre = link.laws.impulse);
        self.links.iter_mut().flat_map(|link| &mut link.motors).flatten().for_each(|motor| motor.recentre(true));
        self.contacts.iter_mut().for_each(|contact| contact.law.centre = contact.law.impulse);
        self.obstacle_friction.iter_mut().for_each(|friction| friction.centre = friction.impulse);
        self.pairs.recentre();
    }

    fn centre_error(&self) -> f64 {
        let ground = self.links.iter().map(|link| (link.laws.impulse - link.laws.centre).amax());
        let contacts = self.contacts.iter().map(|contact| (contact.law.impulse - contact.law.centre).abs());
        let friction = self.obstacle_friction.iter().map(|friction| (friction.impulse - friction.centre).amax());
        let gears = self.links.iter().flat_map(|link| &link.motors).flatten().map(MotorTerm::centre_error);
        ground.chain(contacts).chain(friction).chain(gears).fold(self.pairs.centre_error(), f64::max)
    }

    fn negligible(&self) -> f64 {
        let fastest = self.links.iter().map(|link| link.twist.fixed_rows::<3>(0).norm()).fold(0.0, f64::max);
        (EXACT * fastest).min(self.tolerance) + EXACT_AT_REST * self.tolerance
    }

    fn defects(&mut self) -> Defect {
        let Self { links, contacts, obstacle_friction, pairs, form, .. } = self;
        let mut defect = Defect::NONE;
        let mut behind = Vector6::zeros();
        for link in links.iter_mut() {
            let (squared, largest) = link.laws.measure(&link.twist, form);
            defect.add(squared / link.mass, largest / link.mass);
            link.missing = link.mass_matrix * link.twist - link.momentum - link.laws.force();
        }
        for (k, contact) in contacts.iter_mut().enumerate() {
            let link = &mut links[contact.link];
            if let Some(friction) = obstacle_friction.get_mut(k) {
                if form.is_lagged {
                    friction.project(contact, &link.twist, form);
                    link.missing -= contact.force() + friction.force();
                    continue;
                }
                let missing = friction.measure(&link.twist, contact.law.impulse, form);
                defect.add_impulse(missing, link.mass);
                link.missing -= friction.force();
            }
            let missing = contact.measure(&link.twist, form);
            defect.add_impulse(missing, link.mass);
            link.missing -= contact.force();
        }
        pairs.measure(|link| links[link].twist, form);
        for pair in pairs.laws() {
            let mass = links[pair.links[0]].mass;
            defect.add_impulse(pair.law.defect, mass);
            for (link, direction) in pair.links.into_iter().zip(&pair.direction) {
                links[link].missing -= direction * pair.law.impulse;
            }
        }
        for (i, link) in links.iter_mut().enumerate().rev() {
            behind += link.missing;
            let (mass, arm) = (link.mass, link.half_length);
            if i == 0 {
                let (force, moment) = (behind.fixed_rows::<3>(0).norm(), behind.fixed_rows::<3>(3).norm() / arm);
                let squared = force * force + moment * moment;
                defect.add(squared / mass, squared.sqrt() / mass);
                break;
            }
            link.evaluate_axes();
            for (axis, moment) in link.chain.hinge_moments(&behind) {
                let missing = (moment - link.moment[axis]) / arm;
                defect.add_impulse(missing, mass);
            }
            behind = link.chain.carry_force(&behind);
        }
        defect
    }

    fn find_step(&mut self) {
        let Self { links, contacts, obstacle_friction, pairs, form, .. } = self;
        if !form.is_lagged || obstacle_friction.is_empty() {
            contacts.iter_mut().for_each(|contact| contact.linearise(form));
        }
        if !form.is_lagged {
            links.iter_mut().for_each(|link| link.laws.linearise(form));
            obstacle_friction
                .iter_mut()
                .zip(&*contacts)
                .for_each(|(friction, contact)| friction.linearise(contact, form));
        }
        let mut contacts_left = contacts.iter().enumerate().rev().peekable();
        let mut behind = Balance { matrix: Matrix6::zeros(), load: Vector6::zeros() };
        for (i, link) in links.iter_mut().enumerate().rev() {
            let (matrix, load) = link.laws.tangent();
            behind.matrix += link.mass_matrix + matrix;
            behind.load += load - link.missing + pairs.load_on(i, form);
            while let Some((k, contact)) = contacts_left.next_if(|(_, contact)| contact.link == i) {
                let friction = obstacle_friction.get(k).map(ObstacleFrictionLaw::tangent);
                for (matrix, load) in std::iter::once(contact.tangent()).chain(friction) {
                    behind.matrix += matrix;
                    behind.load += load;
                }
            }
            if i > 0 {
                behind = link.chain.eliminate(behind, link.stiffness, link.moment);
            }
        }
        let head = behind.matrix.lu();
        let mut before = solve_head(&head, &behind.load);
        for (i, link) in links.iter_mut().enumerate() {
            if i > 0 {
                (link.step_rates, before) = link.chain.substitute(&before);
            }
            (link.start, link.start_rates, link.step) = (link.twist, link.rates, before);
        }
        pairs.correct(links, &head, form);
        links.iter_mut().for_each(|link| link.laws.find_step(&link.step));
        for (k, contact) in contacts.iter_mut().enumerate() {
            let step = &links[contact.link].step;
            contact.find_step(step);
            obstacle_friction.get_mut(k).into_iter().for_each(|friction| friction.find_step(step));
        }
        pairs.find_step(|link| links[link].step, form);
    }

    fn move_along(&mut self, fraction: f64) {
        let mut before = self.links[0].start + self.links[0].step * fraction;
        for (i, link) in self.links.iter_mut().enumerate() {
            if i > 0 {
                for axis in 0..2 {
                    link.rates[axis] = link.start_rates[axis] + fraction * link.step_rates[axis];
                }
                before = link.chain.follow(&before, &link.rates);
            }
            link.twist = before;
            link.laws.move_along(fraction);
        }
        self.contacts.iter_mut().for_each(|contact| contact.law.move_along(fraction));
        self.obstacle_friction.iter_mut().for_each(|friction| friction.move_along(fraction));
        self.pairs.move_along(fraction);
    }

    fn write(&self, solution: &mut StageSolution) {
        for (i, link) in self.links.iter().enumerate() {
            solution.twist[i] = spatial_vector(&link.twist);
            link.laws.write(solution, i);
            if i > 0 {
                solution.rate[i - 1] = link.rates;
                solution.actuator[i - 1] = link.drive;
                for (axis, motor) in link.motors.iter().enumerate() {
                    if let Some(motor) = motor {
                        solution.gear[2 * (i - 1) + axis] = motor.friction;
                    }
                }
            }
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contacts) {
            *impulse = contact.law.impulse.max(0.0);
        }
        for (impulse, friction) in solution.obstacle_friction.iter_mut().zip(&self.obstacle_friction) {
            *impulse = friction.impulse;
        }
        self.pairs.write(&mut solution.pair);
    }
}

/// The change of link 1's twist under a load; NaN where the balance is singular.
pub(super) fn solve_head(head: &LU<f64, U6, U6>, load: &Vector6<f64>) -> Vector6<f64> {
    head.solve(load).unwrap_or(Vector6::repeat(f64::NAN))
}

/// Violation of the laws that is left to the compliance over the speed of the robot, and over the tolerance.
const EXACT: f64 = 1e-8;
const EXACT_AT_REST: f64 = 1e-6;
