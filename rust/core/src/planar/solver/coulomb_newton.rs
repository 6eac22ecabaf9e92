//! The [Newton iteration with Coulomb's law as it stands](crate::solver::CoupledStage) on the planar chain.

use nalgebra::{Matrix3, Vector3};

use crate::contact::{LINK_CONTACTS_PER_LINK, PAIRS_PER_LINK};
use crate::planar::{Stage, StageContact, StagePair, StageSolution};
use crate::rows::Row;
use crate::solver::{CoulombForm, CoupledStage, Coupling, Defect, EliminatedChain, LawForm, LowRank, MotorTerm};

use super::coulomb_laws::{ContactFrictionLaw, ContactLaw, GroundLaw, SpinLaw, mass_matrix};
use super::coulomb_path::CoulombPath;
use super::coulomb_sweep::{Balance, ChainLink};
use super::newton::TUNING;
use super::terms::ActuatorTerm;

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub(super) struct CoulombNewton {
    links: Vec<Link>,
    contacts: Vec<ContactLaw<StageContact>>,
    friction: Vec<ContactFrictionLaw<StageContact>>,
    pairs: Vec<ContactLaw<StagePair>>,
    pair_friction: Vec<ContactFrictionLaw<StagePair>>,
    low_rank: LowRank<f64, Vector3<f64>, Vector3<f64>>,
    form: CoulombForm,
    /// Speed below which a defect is no error \[m/s\].
    tolerance: f64,
    /// Sign of the determinant of the last tangent matrix.
    orientation: f64,
}

#[derive(Debug, Clone, Copy)]
struct Link {
    chain: ChainLink,
    /// Whether it hangs on no other link: link 1, and obstacles that can be pushed.
    is_free: bool,
    /// Inverse of its balance with all that hangs on it, and its load, where it is.
    head: (Matrix3<f64>, Vector3<f64>),
    ground: GroundLaw,
    /// Of the joint before the link, and its stiffness.
    actuator: ActuatorTerm<f64>,
    motor: Option<MotorTerm<f64>>,
    /// Friction of the ground against spin.
    spin: Option<SpinLaw>,
    stiffness: f64,
    /// Impulse of the joint on the link \[N m s\].
    moment: f64,
    inertia: Matrix3<f64>,
    momentum: Vector3<f64>,
    mass: f64,
    half_length: f64,
    /// Twist and joint rate, where the Newton step starts, and the step.
    twist: Vector3<f64>,
    start: Vector3<f64>,
    step: Vector3<f64>,
    rate: f64,
    start_rate: f64,
    /// Imbalance of the link.
    missing: Vector3<f64>,
    /// Constant of an elimination for another load.
    constant: f64,
}

impl Link {
    /// Laws of the joint at its rate.
    fn evaluate_joint(&mut self) {
        self.stiffness = self.actuator.evaluate(LawForm::Present, self.rate);
        self.moment = self.actuator.impulse;
        if let Some(motor) = &mut self.motor {
            let drive = (self.moment, self.stiffness);
            (self.actuator.impulse, self.moment, self.stiffness) = motor.drive(LawForm::Present, self.rate, drive);
        }
    }
}

impl CoulombNewton {
    pub fn new(links: usize) -> Self {
        let contacts = PAIRS_PER_LINK * links;
        Self {
            links: Vec::with_capacity(links),
            contacts: Vec::with_capacity(contacts),
            friction: Vec::with_capacity(contacts),
            pairs: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            pair_friction: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            low_rank: LowRank::new(links),
            form: CoulombForm::stiff(1.0, 1.0),
            tolerance: 0.0,
            orientation: 1.0,
        }
    }

    /// Solves `stage` along the [path](CoulombPath) that has this number. Returns linear solves and whether it arrived; if
    /// not, `solution` is unchanged.
    pub fn follow(
        &mut self,
        path: &mut CoulombPath,
        number: u32,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
    ) -> (u32, bool) {
        self.load(stage, solution, tolerance);
        let (solves, has_arrived) = path.follow(self, number);
        let (more, solved) = if has_arrived { self.close(solution) } else { (0, false) };
        (solves + more, solved)
    }

    /// Velocities that are added to those of contacts and their friction at s = 0.
    pub fn set_shifts(&mut self, mut normal: impl FnMut(usize) -> f64, mut along: impl FnMut(usize) -> f64) {
        self.contacts.iter_mut().enumerate().for_each(|(k, contact)| contact.shift.full = normal(k));
        let friction = self.friction.iter_mut().map(|row| &mut row.shift);
        let friction = friction.chain(self.pair_friction.iter_mut().map(|row| &mut row.shift));
        friction.enumerate().for_each(|(k, shift)| shift.full = along(k));
    }

    /// Moves to another s.
    pub fn set_share(&mut self, share: f64) {
        self.contacts.iter_mut().for_each(|contact| contact.shift.set_share(share));
        self.friction.iter_mut().for_each(|row| row.set_share(share));
        self.pair_friction.iter_mut().for_each(|row| row.set_share(share));
    }

    /// Sign of the determinant of the tangent matrix of the last step.
    pub fn orientation(&self) -> f64 {
        self.orientation
    }

    /// Visits all unknowns in a fixed order: value, step, and its weight in a length \[m/s\].
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64, f64)) {
        let (weight, mut turn) = (1.0 / self.form.weight, 0.0);
        for link in &mut self.links {
            let (step, arm) = (link.step, link.half_length);
            if link.is_free {
                (0..3).for_each(|axis| visitor(&mut link.twist[axis], step[axis], [1.0, 1.0, arm][axis]));
            } else {
                visitor(&mut link.rate, step.z - turn, arm);
            }
            turn = step.z;
            link.ground.visit(|value, step| visitor(value, step, weight));
            link.spin.iter_mut().for_each(|spin| spin.visit(|value, step| visitor(value, step, weight)));
        }
        self.contacts.iter_mut().for_each(|contact| contact.law.visit(|value, step| visitor(value, step, weight)));
        self.friction.iter_mut().for_each(|row| row.visit(|value, step| visitor(value, step, weight)));
        self.pairs.iter_mut().for_each(|pair| pair.law.visit(|value, step| visitor(value, step, weight)));
        self.pair_friction.iter_mut().for_each(|row| row.visit(|value, step| visitor(value, step, weight)));
    }

    /// Twists of links 2..n from that of link 1 and the joint rates.
    pub fn follow_joints(&mut self) {
        let mut before = self.links[0].twist;
        for link in self.links.iter_mut().skip(1).filter(|link| !link.is_free) {
            link.twist = link.chain.follow(&before, link.rate);
            before = link.twist;
        }
    }

    fn load_link(&mut self, stage: &Stage, solution: &StageSolution, i: usize) {
        let (before, link) = (&stage.links[i.saturating_sub(1)], &stage.links[i]);
        let chain = ChainLink::new(before, link);
        let is_free = i == 0 || i >= stage.chain();
        let (twist, rate, actuator) = match self.links.last().filter(|_| !is_free) {
            Some(last) => {
                let rate = solution.twist[i].z - solution.twist[i - 1].z;
                let actuator = ActuatorTerm::new(&stage.joints[i - 1], solution.actuator[i - 1]);
                (chain.follow(&last.twist, rate), rate, actuator)
            }
            None => (solution.twist[i], 0.0, ActuatorTerm::none()),
        };
        let motor = i.checked_sub(1).and_then(|joint| {
            let (motor, impulse) = (stage.motors.get(joint)?, solution.gear.get(joint)?);
            Some(MotorTerm::new(motor, *impulse, before.half_length, TUNING.penalty * before.mass))
        });
        let spin = stage.link_spins().get(i).zip(solution.spin.get(i));
        let spin = spin.map(|(bound, moment)| SpinLaw::new(*bound, *moment, link.half_length));
        let inertia = mass_matrix(link);
        let (axes, impulse) = if i < stage.chain() {
            (link.friction.push(0.0), solution.friction[i].push(0.0))
        } else {
            (stage.limit_surface(i), solution.surface_impulse(i))
        };
        self.links.push(Link {
            chain,
            is_free,
            head: (Matrix3::zeros(), Vector3::zeros()),
            ground: GroundLaw::new(&link.heading, &axes, stage.skin, &impulse),
            actuator,
            motor,
            spin,
            stiffness: 0.0,
            moment: 0.0,
            inertia,
            momentum: inertia * link.reference,
            mass: link.mass,
            half_length: link.half_length,
            twist,
            start: twist,
            step: Vector3::zeros(),
            rate,
            start_rate: rate,
            missing: Vector3::zeros(),
            constant: 0.0,
        });
    }

    /// Laws of contacts at the present velocities and impulses, and what is missing on each link.
    fn contact_defects(&mut self, defect: &mut Defect) {
        let Self { links, contacts, friction, pairs, pair_friction, form, .. } = self;
        defects_of(contacts, friction, links, form, defect);
        defects_of(pairs, pair_friction, links, form, defect);
    }

    /// Eliminates the chain from tail to head, and what it can push. Returns the sign of the determinant of what is left.
    fn eliminate(&mut self) -> f64 {
        let Self { links, contacts, friction, pairs, pair_friction, form, .. } = self;
        let mut contacts_left = contacts.iter().rev().peekable();
        let mut friction = friction.iter().rev().peekable();
        let none = Balance { matrix: Matrix3::zeros(), load: Vector3::zeros() };
        let (mut behind, mut orientation) = (none, 1.0);
        for (i, link) in links.iter_mut().enumerate().rev() {
            behind.matrix += link.inertia;
            behind.load -= link.missing;
            link.ground.add_to(&mut behind, form);
            link.spin.iter().for_each(|spin| spin.add_to(&mut behind, form));
            while let Some(contact) = contacts_left.next_if(|contact| contact.row.link == i) {
                contact.add_to(&mut behind, form);
            }
            while let Some(law) = friction.next_if(|law| law.row.along.link == i) {
                law.add_to(&mut behind, &contacts[law.row.normal]);
            }
            let loads = pairs.iter().map(|pair| (&pair.row, pair.tangent(form).0));
            for (row, load) in loads.chain(pair_friction.iter().map(|law| (&law.row.along, law.constant))) {
                row.parts().filter(|(link, _)| *link == i).for_each(|(_, w)| behind.load += w * load);
            }
            if link.is_free {
                let Balance { matrix, load } = std::mem::replace(&mut behind, none);
                link.head = (matrix.try_inverse().unwrap_or(Matrix3::repeat(f64::NAN)), load);
                orientation *= matrix.determinant().signum();
            } else {
                behind = link.chain.eliminate(behind, link.stiffness, link.moment);
            }
        }
        orientation
    }

    /// The Newton step of all velocities and impulses, while s changes by `change`.
    pub fn find_step_with(&mut self, change: f64) {
        let form = self.form;
        self.contacts.iter_mut().for_each(|contact| contact.shift.set_share_step(change));
        linearise(&mut self.friction, &self.contacts, change, &form);
        linearise(&mut self.pair_friction, &self.pairs, change, &form);
        let heads = self.eliminate();
        let Self { links, contacts, friction, pairs, pair_friction, low_rank, .. } = self;
        let mut before = Vector3::zeros();
        for link in links.iter_mut() {
            let (head, load) = &link.head;
            before = if link.is_free { head * load } else { link.chain.substitute(&before) };
            (link.start, link.start_rate, link.step) = (link.twist, link.rate, before);
        }
        low_rank.clear();
        let stiff = pairs.iter().map(|pair| (&pair.row, &pair.row, pair.tangent(&form).1));
        let growing = pair_friction.iter().map(|law| (law.driver(&pairs[law.row.normal]), &law.row.along, law.slope));
        for (row, column, slope) in stiff.chain(growing).filter(|(_, _, slope)| *slope != 0.0) {
            let coupling = Coupling { links: row.links, direction: row.direction, stiffness: -slope };
            low_rank.apply(coupling, &column.direction, &mut Chain { links });
        }
        let pivots = links.iter().filter(|link| !link.is_free).map(|link| link.chain.orientation());
        self.orientation = pivots.product::<f64>() * heads * low_rank.orientation();
        for link in links.iter_mut() {
            link.ground.find_step(&link.step, &form);
            link.spin.iter_mut().for_each(|spin| spin.find_step(link.step.z, &form));
        }
        find_steps(contacts, friction, links, &form);
        find_steps(pairs, pair_friction, links, &form);
    }
}

/// Laws of contacts and their friction at the present velocities and impulses, and what is then missing on each link.
fn defects_of<R: Row<Vector3<f64>, f64>>(
    contacts: &mut [ContactLaw<R>],
    friction: &mut [ContactFrictionLaw<R>],
    links: &mut [Link],
    form: &CoulombForm,
    defect: &mut Defect,
) {
    for contact in contacts.iter_mut() {
        let missing = contact.measure(|link| links[link].twist, form);
        defect.add_impulse(missing, links[contact.row.first_link()].mass);
        contact.row.parts().for_each(|(link, w)| links[link].missing -= w * contact.law.impulse);
    }
    for law in friction {
        let missing = law.measure(|link| links[link].twist, &contacts[law.row.normal].law, form);
        defect.add_impulse(missing, links[law.row.along.first_link()].mass);
        law.row.along.parts().for_each(|(link, w)| links[link].missing -= w * law.impulse);
    }
}

/// Tangents of friction, while s changes by `change`.
fn linearise<R: Row<Vector3<f64>, f64>>(
    friction: &mut [ContactFrictionLaw<R>],
    contacts: &[ContactLaw<R>],
    change: f64,
    form: &CoulombForm,
) {
    for law in friction {
        law.set_share_step(change);
        law.linearise(&contacts[law.row.normal], form);
    }
}

/// Changes of the impulses with the links' steps.
fn find_steps<R: Row<Vector3<f64>, f64>>(
    contacts: &mut [ContactLaw<R>],
    friction: &mut [ContactFrictionLaw<R>],
    links: &[Link],
    form: &CoulombForm,
) {
    contacts.iter_mut().for_each(|contact| contact.find_step(|link| links[link].step, form));
    friction.iter_mut().for_each(|law| law.find_step(|link| links[link].step, &contacts[law.row.normal]));
}

impl CoupledStage for CoulombNewton {
    type Stage = Stage;
    type Solution = StageSolution;

    fn load(&mut self, stage: &Stage, solution: &StageSolution, tolerance: f64) {
        let mass = stage.links.iter().map(|link| link.mass).sum::<f64>() / stage.links.len() as f64;
        self.form = CoulombForm::stiff(mass, TUNING.penalty);
        self.tolerance = tolerance;
        self.links.clear();
        (0..stage.links.len()).for_each(|i| self.load_link(stage, solution, i));
        self.contacts.clear();
        self.contacts.extend(stage.contacts.iter().zip(&solution.contact).map(|(row, &p)| ContactLaw::new(*row, p)));
        self.friction.clear();
        let rows = stage.obstacle_friction.iter().zip(&solution.obstacle_friction);
        self.friction.extend(rows.map(|(row, &p)| ContactFrictionLaw::new(*row, p)));
        self.pairs.clear();
        self.pairs.extend(stage.pairs.iter().zip(&solution.pair).map(|(pair, &p)| ContactLaw::new(*pair, p)));
        self.pair_friction.clear();
        let rows = stage.pair_friction.iter().zip(&solution.pair_friction);
        self.pair_friction.extend(rows.map(|(row, &p)| ContactFrictionLaw::new(*row, p)));
    }

    fn write(&self, solution: &mut StageSolution) {
        for (i, link) in self.links.iter().enumerate() {
            solution.twist[i] = link.twist;
            let impulse = link.ground.impulse_in_frame();
            solution.friction[i] = impulse.xy();
            if let Some(spin) = &link.spin {
                solution.spin[i] = spin.moment();
            } else if let Some(spin) = solution.spin.get_mut(i) {
                *spin = impulse.z;
            }
            if !link.is_free {
                solution.actuator[i - 1] = link.actuator.impulse;
                if let Some(motor) = &link.motor {
                    solution.gear[i - 1] = motor.friction;
                }
            }
        }
        for (impulse, contact) in solution.contact.iter_mut().zip(&self.contacts) {
            *impulse = contact.law.impulse.max(0.0);
        }
        for (impulse, row) in solution.obstacle_friction.iter_mut().zip(&self.friction) {
            *impulse = row.impulse;
        }
        for (impulse, pair) in solution.pair.iter_mut().zip(&self.pairs) {
            *impulse = pair.law.impulse.max(0.0);
        }
        for (impulse, law) in solution.pair_friction.iter_mut().zip(&self.pair_friction) {
            *impulse = law.impulse;
        }
    }

    fn form(&mut self) -> &mut CoulombForm {
        &mut self.form
    }

    fn recentre(&mut self) {
        self.links.iter_mut().for_each(|link| link.ground.centre = link.ground.impulse);
        self.links.iter_mut().filter_map(|link| link.motor.as_mut()).for_each(|motor| motor.recentre(true));
        self.links.iter_mut().filter_map(|link| link.spin.as_mut()).for_each(|spin| spin.centre = spin.impulse);
        self.contacts.iter_mut().for_each(|contact| contact.law.centre = contact.law.impulse);
        self.friction.iter_mut().for_each(|row| row.centre = row.impulse);
        self.pairs.iter_mut().for_each(|pair| pair.law.centre = pair.law.impulse);
        self.pair_friction.iter_mut().for_each(|law| law.centre = law.impulse);
    }

    fn centre_error(&self) -> f64 {
        let ground = self.links.iter().map(|link| (link.ground.impulse - link.ground.centre).amax());
        let unilateral =
            self.contacts.iter().map(|contact| &contact.law).chain(self.pairs.iter().map(|pair| &pair.law));
        let unilateral = unilateral.map(|law| (law.impulse - law.centre).abs());
        let friction = self.friction.iter().map(|row| (row.impulse - row.centre).abs());
        let friction = friction.chain(self.pair_friction.iter().map(|row| (row.impulse - row.centre).abs()));
        let gears = self.links.iter().filter_map(|link| link.motor.as_ref()).map(MotorTerm::centre_error);
        let spins = self.links.iter().filter_map(|link| link.spin).map(|spin| (spin.impulse - spin.centre).abs());
        ground.chain(unilateral).chain(friction).chain(gears).chain(spins).fold(0.0, f64::max)
    }

    fn negligible(&self) -> f64 {
        let fastest = self.links.iter().map(|link| link.twist.xy().norm()).fold(0.0, f64::max);
        (NEGLIGIBLE * self.tolerance).max(LEAST) + ROUND_OFF * fastest
    }

    fn defects(&mut self) -> Defect {
        let mut defect = Defect::NONE;
        for link in &mut self.links {
            defect.add_impulse(link.ground.measure(&link.twist, &self.form), link.mass);
            link.missing = link.inertia * link.twist - link.momentum - link.ground.force();
            if let Some(spin) = &mut link.spin {
                defect.add_impulse(spin.measure(link.twist.z, &self.form), link.mass);
                link.missing.z -= spin.moment();
            }
        }
        self.contact_defects(&mut defect);
        let mut behind = Vector3::zeros();
        for link in self.links.iter_mut().rev() {
            behind += link.missing;
            let (mass, arm) = (link.mass, link.half_length);
            if link.is_free {
                defect.add_impulse(behind.xy().push(behind.z / arm).norm(), mass);
                behind = Vector3::zeros();
                continue;
            }
            link.evaluate_joint();
            defect.add_impulse((link.chain.hinge_moment(&behind) - link.moment) / arm, mass);
            behind = link.chain.carry_force(&behind);
        }
        defect
    }

    fn find_step(&mut self) {
        self.find_step_with(0.0);
    }

    fn move_along(&mut self, fraction: f64) {
        let (mut before, mut turn) = (Vector3::zeros(), 0.0);
        for link in &mut self.links {
            link.rate = link.start_rate + fraction * (link.step.z - turn);
            let first = link.start + link.step * fraction;
            before = if link.is_free { first } else { link.chain.follow(&before, link.rate) };
            (link.twist, turn) = (before, link.step.z);
            link.ground.move_along(fraction);
            link.spin.iter_mut().for_each(|spin| spin.move_along(fraction));
        }
        self.contacts.iter_mut().for_each(|contact| contact.law.move_along(fraction));
        self.friction.iter_mut().for_each(|row| row.move_along(fraction));
        self.pairs.iter_mut().for_each(|pair| pair.law.move_along(fraction));
        self.pair_friction.iter_mut().for_each(|law| law.move_along(fraction));
    }
}

struct Chain<'a> {
    links: &'a mut [Link],
}

impl EliminatedChain<f64, Vector3<f64>, Vector3<f64>> for Chain<'_> {
    fn len(&self) -> usize {
        self.links.len()
    }

    fn step(&self, link: usize) -> Vector3<f64> {
        self.links[link].step
    }

    fn set_step(&mut self, link: usize, step: Vector3<f64>) {
        self.links[link].step = step;
    }

    fn respond(&mut self, of: [usize; 2], column: &[Vector3<f64>; 2], response: &mut Vec<Vector3<f64>>) {
        let mut load = Vector3::zeros();
        for (i, link) in self.links.iter_mut().enumerate().rev() {
            for (_, w) in of.iter().zip(column).filter(|(of, _)| **of == i) {
                load += w;
            }
            if link.is_free {
                link.head.1 = std::mem::replace(&mut load, Vector3::zeros());
            } else {
                (load, link.constant) = link.chain.eliminate_load(load);
            }
        }
        let mut twist = Vector3::zeros();
        for link in self.links.iter() {
            let (head, load) = &link.head;
            twist = if link.is_free { head * load } else { link.chain.substitute_with(link.constant, &twist) };
            response.push(twist);
        }
    }
}

/// Error that is negligible: over the tolerance, at least \[m/s\], and over the speed of the fastest link.
const NEGLIGIBLE: f64 = 1e-5;
const LEAST: f64 = 1e-11;
const ROUND_OFF: f64 = 1e-8;
