//! The [Newton iteration with Coulomb's law as it stands](crate::solver::CoupledStage) on the planar chain.

use nalgebra::{Matrix3, Vector3};

use crate::contact::{LINK_CONTACTS_PER_LINK, PAIRS_PER_LINK};
use crate::planar::{Stage, StageSolution};
use crate::solver::{
    Contacts, CoulombForm, CoupledChain, CoupledLink, CoupledStage, Defect, DrivenAxis, EliminatedChain, Head, LowRank,
};

use super::coulomb_laws::{GroundLaw, LinkGround, SpinLaw};
use super::coulomb_path::CoulombPath;
use super::coulomb_sweep::{chain_link, mass_matrix};
use super::newton::TUNING;

/// Workspace of the solver, re-used from stage to stage.
pub(super) struct CoulombNewton {
    chain: CoupledChain<3, 1, LinkGround, PlanarHead>,
    /// With obstacles, and between links.
    contacts: [Contacts<3>; 2],
    low_rank: LowRank<f64, Vector3<f64>, Vector3<f64>>,
    form: CoulombForm,
    /// Speed below which a defect is no error \[m/s\].
    tolerance: f64,
}

#[derive(Debug, Clone, Copy)]
struct PlanarHead {
    inverse: Matrix3<f64>,
    /// Sign of the determinant.
    orientation: f64,
}

impl Head<3> for PlanarHead {
    fn of(matrix: Matrix3<f64>) -> Self {
        let inverse = matrix.try_inverse().unwrap_or(Matrix3::repeat(f64::NAN));
        Self { inverse, orientation: matrix.determinant().signum() }
    }

    fn solve(&self, load: &Vector3<f64>) -> Vector3<f64> {
        self.inverse * load
    }
}

impl CoulombNewton {
    pub fn new(links: usize) -> Self {
        Self {
            chain: CoupledChain::new(links),
            contacts: [PAIRS_PER_LINK, LINK_CONTACTS_PER_LINK].map(|rows| Contacts::with_capacity(rows * links)),
            low_rank: LowRank::new(links),
            form: CoulombForm::stiff(1.0, 1.0),
            tolerance: 0.0,
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

    /// Velocities that are added to those of contacts with obstacles and of friction at s = 0.
    pub fn set_shifts(&mut self, mut normal: impl FnMut(usize) -> f64, mut along: impl FnMut(usize) -> f64) {
        self.contacts[0].normal.iter_mut().enumerate().for_each(|(k, contact)| contact.shift.full = normal(k));
        let friction = self.contacts.iter_mut().flat_map(|contacts| &mut contacts.friction);
        friction.enumerate().for_each(|(k, law)| law.shift.full = along(k));
    }

    /// Moves to another s.
    pub fn set_share(&mut self, share: f64) {
        self.contacts.iter_mut().for_each(|contacts| contacts.set_share(share));
    }

    /// Sign of the determinant of the tangent matrix of the last step.
    pub fn orientation(&self) -> f64 {
        let heads = self.chain.links.iter().filter_map(|link| link.head).map(|head| head.orientation);
        self.chain.orientation() * heads.product::<f64>() * self.low_rank.orientation()
    }

    /// Visits all unknowns in a fixed order: value, step, and its weight in a length \[m/s\].
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64, f64)) {
        let weight = 1.0 / self.form.weight;
        for link in &mut self.chain.links {
            let (step, arm) = (link.step, link.half_length);
            if link.is_free {
                (0..3).for_each(|axis| visitor(&mut link.twist[axis], step[axis], [1.0, 1.0, arm][axis]));
            } else {
                let [axis] = &mut link.axes;
                visitor(&mut axis.rate, axis.step_rate, arm);
            }
            link.ground.visit(|value, step| visitor(value, step, weight));
        }
        self.contacts.iter_mut().for_each(|contacts| contacts.visit(|value, step| visitor(value, step, weight)));
    }

    /// Twists of links 2..n from that of link 1 and the joint rates.
    pub fn follow_joints(&mut self) {
        self.chain.follow_joints();
    }

    fn load_link(&mut self, stage: &Stage, solution: &StageSolution, i: usize) {
        let (before, link) = (&stage.links[i.saturating_sub(1)], &stage.links[i]);
        let last = self.chain.links.last().filter(|_| i < stage.chain());
        let axis = match i.checked_sub(1).filter(|_| last.is_some()) {
            Some(joint) => {
                let rate = solution.twist[i].z - solution.twist[joint].z;
                let motor = stage.motors.get(joint).zip(solution.gear.get(joint));
                DrivenAxis::new(&stage.joints[joint], motor, before.half_length, TUNING.penalty * before.mass, rate)
            }
            None => DrivenAxis::none(),
        };
        let spin = stage.link_spins().get(i).zip(solution.spin.get(i));
        let spin = spin.map(|(bound, moment)| SpinLaw::new(*bound, *moment, link.half_length));
        let (axes, impulse) = if i < stage.chain() {
            (link.friction.push(0.0), solution.friction[i].push(0.0))
        } else {
            (stage.limit_surface(i), solution.surface_impulse(i))
        };
        let friction = GroundLaw::new(&link.heading, &axes, stage.skin, &impulse);
        let (place, inertia) = ((chain_link(before, link), last.map(|last| last.twist)), mass_matrix(link));
        self.chain.links.push(CoupledLink::new(
            place,
            [axis],
            LinkGround { friction, spin },
            (inertia, inertia * link.reference),
            (link.mass, link.half_length),
            solution.twist[i],
        ));
    }

    /// The Newton step of all velocities and impulses, while s changes by `change`.
    pub fn find_step_with(&mut self, change: f64) {
        let Self { chain, contacts, low_rank, form, .. } = self;
        contacts.iter_mut().for_each(|contacts| contacts.linearise(change, form));
        let [at_obstacles, between_links] = &*contacts;
        let mut left = at_obstacles.len();
        chain.find_step(|i, link, balance| {
            balance.matrix += link.mass_matrix;
            balance.load -= link.missing;
            link.ground.add_to(balance, form);
            at_obstacles.add_to(i, &mut left, balance, form);
            between_links.loads_on(i, form).for_each(|load| balance.load += load);
        });
        between_links.correct(low_rank, chain, form);
        let mut turn = 0.0;
        for link in &mut chain.links {
            link.axes[0].step_rate = link.step.z - turn;
            turn = link.step.z;
            link.ground.find_step(&link.step, form);
        }
        contacts.iter_mut().for_each(|contacts| contacts.find_step(|link| chain.links[link].step, form));
    }
}

impl CoupledStage for CoulombNewton {
    type Stage = Stage;
    type Solution = StageSolution;

    fn load(&mut self, stage: &Stage, solution: &StageSolution, tolerance: f64) {
        let mass = stage.links.iter().map(|link| link.mass).sum::<f64>() / stage.links.len() as f64;
        self.form = CoulombForm::stiff(mass, TUNING.penalty);
        self.tolerance = tolerance;
        self.chain.links.clear();
        (0..stage.links.len()).for_each(|i| self.load_link(stage, solution, i));
        let [at_obstacles, between_links] = &mut self.contacts;
        let friction = (&stage.obstacle_friction[..], &solution.obstacle_friction[..]);
        at_obstacles.load((&stage.contacts, &solution.contact), friction, Vector3::clone);
        let friction = (&stage.pair_friction[..], &solution.pair_friction[..]);
        between_links.load((&stage.pairs, &solution.pair), friction, Vector3::clone);
    }

    fn write(&self, solution: &mut StageSolution) {
        for (i, link) in self.chain.links.iter().enumerate() {
            solution.twist[i] = link.twist;
            let impulse = link.ground.friction.impulse_in_frame();
            solution.friction[i] = impulse.xy();
            if let Some(spin) = &link.ground.spin {
                solution.spin[i] = spin.moment();
            } else if let Some(spin) = solution.spin.get_mut(i) {
                *spin = impulse.z;
            }
            if !link.is_free {
                let (impulse, gear) = link.axes[0].impulses();
                solution.actuator[i - 1] = impulse;
                gear.into_iter().for_each(|friction| solution.gear[i - 1] = friction);
            }
        }
        let [at_obstacles, between_links] = &self.contacts;
        at_obstacles.write(&mut solution.contact, &mut solution.obstacle_friction);
        between_links.write(&mut solution.pair, &mut solution.pair_friction);
    }

    fn form(&mut self) -> &mut CoulombForm {
        &mut self.form
    }

    fn recentre(&mut self) {
        self.chain.links.iter_mut().for_each(|link| link.ground.recentre());
        self.chain.recentre_gears();
        self.contacts.iter_mut().for_each(Contacts::recentre);
    }

    fn centre_error(&self) -> f64 {
        let ground = self.chain.links.iter().map(|link| link.ground.centre_error());
        ground.chain(self.contacts.iter().map(Contacts::centre_error)).fold(self.chain.gear_error(), f64::max)
    }

    fn negligible(&self) -> f64 {
        let fastest = self.chain.links.iter().map(|link| link.twist.xy().norm()).fold(0.0, f64::max);
        (NEGLIGIBLE * self.tolerance).max(LEAST) + ROUND_OFF * fastest
    }

    fn defects(&mut self) -> Defect {
        let Self { chain, contacts, form, .. } = self;
        let mut defect = Defect::NONE;
        for link in &mut chain.links {
            defect.add_impulse(link.ground.friction.measure(&link.twist, form), link.mass);
            link.missing = link.imbalance() - link.ground.friction.force();
            if let Some(spin) = &mut link.ground.spin {
                defect.add_impulse(spin.measure(link.twist.z, form), link.mass);
                link.missing.z -= spin.moment();
            }
        }
        for contacts in contacts {
            contacts.measure(|link| chain.links[link].twist, form);
            for (row, p) in contacts.impulses() {
                defect.add_impulse(p.defect, chain.links[row.first_link()].mass);
                row.parts().for_each(|(link, w)| chain.links[link].missing -= w * p.value);
            }
        }
        chain.add_defects(&mut defect, |missing, arm| {
            let largest = missing.xy().push(missing.z / arm).norm();
            (largest * largest, largest)
        });
        defect
    }

    fn find_step(&mut self) {
        self.find_step_with(0.0);
    }

    fn move_along(&mut self, fraction: f64) {
        self.chain.move_along(fraction);
        self.chain.links.iter_mut().for_each(|link| link.ground.move_along(fraction));
        self.contacts.iter_mut().for_each(|contacts| contacts.move_along(fraction));
    }
}

impl EliminatedChain<f64, Vector3<f64>, Vector3<f64>> for CoupledChain<3, 1, LinkGround, PlanarHead> {
    fn len(&self) -> usize {
        self.links.len()
    }

    fn step(&self, link: usize) -> Vector3<f64> {
        self.links[link].step
    }

    fn set_step(&mut self, link: usize, step: Vector3<f64>) {
        self.links[link].step = step;
    }

    fn respond(&mut self, links: [usize; 2], column: &[Vector3<f64>; 2], response: &mut Vec<Vector3<f64>>) {
        CoupledChain::respond(self, links, column, |_, twist| response.push(twist));
    }
}

/// Error that is negligible: over the tolerance, at least \[m/s\], and over the speed of the fastest link.
const NEGLIGIBLE: f64 = 1e-5;
const LEAST: f64 = 1e-11;
const ROUND_OFF: f64 = 1e-8;
