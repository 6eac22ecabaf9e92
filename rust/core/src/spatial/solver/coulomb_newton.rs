//! Newton's method on a stage with Coulomb's law as it stands: friction follows the normal impulse in the tangent, too.
//!
//! The solver of the lanes holds friction radii fixed in each step and updates them afterwards, which converges where
//! friction is weak: a change dP of a normal impulse changes friction by mu dP at the height of the CG, which turns the
//! link and changes normal impulses again. Here velocities and impulses are both unknowns, each law is imposed as
//! `P = prox_C(P)(...)` with the [set that belongs to the present normal impulse](super::coulomb_laws), and the tangent
//! is the unsymmetric one of all that. There is no function to minimise: a step is halved until the squared defects of
//! all laws and balances fall below the largest of the last few, and where no fraction of it achieves that, a tenth is
//! taken anyway, which leaves the kink. Continuation starts from soft contacts: with their compliance normal impulses
//! change little and the problem is nearly convex; its solution is followed to that of the stiff contacts.

use nalgebra::{LU, Matrix6, U6, Vector6};

use crate::laws::Backlash;
use crate::spatial::{Stage, StageSolution};

use super::coulomb_laws::{GroundLaws, LawForm, PegLaw};
use super::coulomb_pairs::CoulombPairs;
use super::coulomb_rough::RoughLaw;
use super::coulomb_sweep::{Balance, ChainLink, mass_matrix, spatial_vector, stacked};
use super::newton::PENALTY;
use super::terms::actuator;

/// Workspace of the solver, re-used from stage to stage.
#[derive(Debug, Clone)]
pub struct CoulombNewton {
    links: Vec<Link>,
    pegs: Vec<PegLaw>,
    /// Friction of each entry of `pegs`; empty where no obstacle has any.
    rough: Vec<RoughLaw>,
    pairs: CoulombPairs,
    form: LawForm,
    /// Speed below which a defect is no error \[m/s\].
    tolerance: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Link {
    pub chain: ChainLink,
    laws: GroundLaws,
    actuators: [Backlash; 2],
    mass_matrix: Matrix6<f64>,
    momentum: Vector6<f64>,
    mass: f64,
    half_length: f64,
    /// Twist and rates, where the Newton step starts, and the step.
    pub twist: Vector6<f64>,
    start: Vector6<f64>,
    pub step: Vector6<f64>,
    rates: [f64; 2],
    start_rates: [f64; 2],
    pub step_rates: [f64; 2],
    /// Imbalance of the link.
    missing: Vector6<f64>,
}

/// How far velocities and impulses are from solving the stage.
#[derive(Debug, Clone, Copy)]
struct Defect {
    /// Sum of squares over masses \[J\].
    energy: f64,
    /// The largest \[m/s\].
    speed: f64,
}

impl CoulombNewton {
    pub fn new(links: usize) -> Self {
        let form = LawForm { weight: 1.0, compliance: 1.0 };
        Self {
            links: Vec::with_capacity(links),
            pegs: Vec::with_capacity(4 * links),
            rough: Vec::with_capacity(4 * links),
            pairs: CoulombPairs::new(links),
            form,
            tolerance: 0.0,
        }
    }

    /// Solves `stage` from the velocities and impulses in `solution`, to velocities far below `tolerance` \[m/s\].
    /// Returns the linear solves it took and whether it converged; if not, `solution` is unchanged.
    pub fn solve(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        self.load(stage, solution, tolerance);
        let (solves, solved) = self.close();
        if solved {
            self.write(solution);
        }
        (solves, solved)
    }

    /// The same by continuation from soft contacts to stiff ones; if it does not reach these, `solution` is the last
    /// one found.
    pub fn continuation(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        let (mut softness, mut ratio, mut solves) = (SOFTEST, FIRST_RATIO, 0);
        let mut next = softness;
        while ratio > LAST_RATIO && solves < MOST_SOLVES {
            self.load(stage, solution, tolerance);
            self.form.compliance *= next;
            let (more, solved) = self.converge();
            solves += more;
            if solved {
                self.write(solution);
                if next == 1.0 {
                    break;
                }
                (softness, ratio) = (next, (ratio * ratio).min(LARGEST_RATIO));
            } else {
                ratio = ratio.sqrt();
            }
            next = (softness / ratio).max(1.0);
        }
        let (more, solved) = self.solve(stage, solution, tolerance);
        (solves + more, solved)
    }

    fn load(&mut self, stage: &Stage, solution: &StageSolution, tolerance: f64) {
        let mass = stage.links.iter().map(|link| link.mass).sum::<f64>() / stage.links.len() as f64;
        self.form = LawForm { weight: mass, compliance: 1.0 / (PENALTY * mass) };
        self.tolerance = tolerance;
        self.links.clear();
        for i in 0..stage.links.len() {
            let link = self.link(stage, solution, i);
            self.links.push(link);
        }
        self.pegs.clear();
        self.pegs.extend((0..stage.pegs.len()).map(|k| PegLaw::new(stage, solution, k)));
        self.rough.clear();
        self.rough.extend((0..stage.peg_friction.len()).map(|k| RoughLaw::new(stage, solution, k)));
        self.pairs.load(stage, solution);
    }

    fn link(&self, stage: &Stage, solution: &StageSolution, i: usize) -> Link {
        let (before, link) = (&stage.links[i.saturating_sub(1)], &stage.links[i]);
        let chain = ChainLink::new(before, link);
        let (twist, rates, actuators) = match self.links.last() {
            Some(last) => {
                let relative = solution.twist[i].angular - solution.twist[i - 1].angular;
                let rates = [before.axes[1].dot(&relative), link.axes[0].dot(&relative)];
                (chain.follow(&last.twist, &rates), rates, [0, 1].map(|axis| actuator(&stage.joints[i - 1][axis])))
            }
            None => (stacked(&solution.twist[0]), [0.0; 2], [Backlash::none(); 2]),
        };
        Link {
            chain,
            laws: GroundLaws::new(stage, solution, i),
            actuators,
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

    /// Solves the problem with the compliance, which selects the impulses, and then moves the centres to them, with
    /// less compliance, until its effect is negligible.
    fn close(&mut self) -> (u32, bool) {
        let (mut solves, mut solved) = self.converge();
        self.form.compliance *= STIFFER;
        for _ in 0..MOST_CENTRES {
            if !solved || self.is_exact() {
                break;
            }
            self.links.iter_mut().for_each(|link| link.laws.centre = link.laws.impulse);
            self.pegs.iter_mut().for_each(|peg| peg.centre = peg.impulse);
            self.rough.iter_mut().for_each(|rough| rough.centre = rough.impulse);
            self.pairs.recentre();
            let (more, again) = self.converge();
            (solves, solved) = (solves + more, again);
        }
        (solves, solved)
    }

    /// Whether the effect of the compliance on the velocities is negligible.
    fn is_exact(&self) -> bool {
        let ground = self.links.iter().map(|link| (link.laws.impulse - link.laws.centre).amax());
        let pegs = self.pegs.iter().map(|peg| (peg.impulse - peg.centre).abs());
        let rough = self.rough.iter().map(|rough| (rough.impulse - rough.centre).amax());
        ground.chain(pegs).chain(rough).fold(self.pairs.centre_error(), f64::max) * self.form.compliance <= self.exact()
    }

    /// Error that is negligible \[m/s\].
    fn exact(&self) -> f64 {
        let fastest = self.links.iter().map(|link| link.twist.fixed_rows::<3>(0).norm()).fold(0.0, f64::max);
        EXACT * fastest + EXACT_AT_REST * self.tolerance
    }

    /// Newton's method until the defects vanish. Returns the linear solves and whether they did.
    fn converge(&mut self) -> (u32, bool) {
        let mut here = self.measure();
        let mut recent = [here.energy; MEMORY];
        for solves in 0..MAX_ITERATIONS {
            if here.speed <= ROUND_OFF * self.exact() {
                return (solves, true);
            }
            self.look();
            let reference = recent.iter().copied().fold(0.0, f64::max);
            let found = self.search(reference);
            if found.is_none() && here.speed <= self.exact() {
                self.arrive(0.0);
                return (solves + 1, true);
            }
            here = found.unwrap_or_else(|| self.arrive(KICK));
            recent[solves as usize % MEMORY] = here.energy;
        }
        (MAX_ITERATIONS, here.speed <= self.exact())
    }

    /// Takes the largest fraction of the step that decreases the defects, if there is one.
    fn search(&mut self, reference: f64) -> Option<Defect> {
        let mut fraction = 1.0;
        for _ in 0..MAX_HALVINGS {
            let there = self.arrive(fraction);
            if there.energy < (1.0 - DESCENT * fraction) * reference {
                return Some(there);
            }
            fraction *= 0.5;
        }
        None
    }

    fn arrive(&mut self, fraction: f64) -> Defect {
        self.go(fraction);
        self.measure()
    }

    /// Evaluates all laws and balances at the present velocities and impulses.
    fn measure(&mut self) -> Defect {
        let Self { links, pegs, rough, pairs, form, .. } = self;
        let mut defect = Defect { energy: 0.0, speed: 0.0 };
        let mut behind = Vector6::zeros();
        for link in links.iter_mut() {
            let (squared, largest) = link.laws.measure(&link.twist, form);
            defect.add(squared / link.mass, largest / link.mass);
            link.missing = link.mass_matrix * link.twist - link.momentum - link.laws.force();
        }
        for (k, peg) in pegs.iter_mut().enumerate() {
            let link = &mut links[peg.link];
            if let Some(rough) = rough.get_mut(k) {
                let missing = rough.measure(&link.twist, peg.impulse, form);
                defect.add(missing * missing / link.mass, missing / link.mass);
                link.missing -= rough.force();
            }
            let missing = peg.measure(&link.twist, form);
            defect.add(missing * missing / link.mass, missing.abs() / link.mass);
            link.missing -= peg.force();
        }
        pairs.measure(|link| links[link].twist, form);
        for pair in pairs.laws() {
            let mass = links[pair.links[0]].mass;
            defect.add(pair.defect * pair.defect / mass, pair.defect.abs() / mass);
            for (link, direction) in pair.links.into_iter().zip(&pair.direction) {
                links[link].missing -= direction * pair.impulse;
            }
        }
        for (i, link) in links.iter().enumerate().rev() {
            behind += link.missing;
            let (mass, arm) = (link.mass, link.half_length);
            if i == 0 {
                let (force, moment) = (behind.fixed_rows::<3>(0).norm(), behind.fixed_rows::<3>(3).norm() / arm);
                let squared = force * force + moment * moment;
                defect.add(squared / mass, squared.sqrt() / mass);
                break;
            }
            for (axis, moment) in link.chain.hinge_moments(&behind).into_iter().enumerate() {
                let missing = (moment - link.actuators[axis].evaluate(link.rates[axis]).0) / arm;
                defect.add(missing * missing / mass, missing.abs() / mass);
            }
            behind = link.chain.carry_force(&behind);
        }
        defect
    }

    /// The Newton step of all velocities and impulses.
    fn look(&mut self) {
        let Self { links, pegs, rough, pairs, form, .. } = self;
        rough.iter_mut().zip(&*pegs).for_each(|(rough, peg)| rough.linearise(peg, form));
        let mut pegs_left = pegs.iter().enumerate().rev().peekable();
        let mut behind = Balance { matrix: Matrix6::zeros(), load: Vector6::zeros() };
        for (i, link) in links.iter_mut().enumerate().rev() {
            link.laws.linearise(form);
            let (matrix, load) = link.laws.tangent();
            behind.matrix += link.mass_matrix + matrix;
            behind.load += load - link.missing + pairs.load_on(i, form);
            while let Some((k, peg)) = pegs_left.next_if(|(_, peg)| peg.link == i) {
                let friction = rough.get(k).map(RoughLaw::tangent);
                for (matrix, load) in std::iter::once(peg.tangent(form)).chain(friction) {
                    behind.matrix += matrix;
                    behind.load += load;
                }
            }
            if i > 0 {
                let [yaw, pitch] = [0, 1].map(|axis| link.actuators[axis].evaluate(link.rates[axis]));
                behind = link.chain.eliminate(behind, [yaw.1, pitch.1], [yaw.0, pitch.0]);
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
        links.iter_mut().for_each(|link| link.laws.look(&link.step));
        for (k, peg) in pegs.iter_mut().enumerate() {
            let step = &links[peg.link].step;
            peg.look(step, form);
            rough.get_mut(k).into_iter().for_each(|rough| rough.look(step));
        }
        pairs.look(|link| links[link].step, form);
    }

    /// Moves a fraction of the step on from its start.
    fn go(&mut self, fraction: f64) {
        let mut before = self.links[0].start + self.links[0].step * fraction;
        for (i, link) in self.links.iter_mut().enumerate() {
            if i > 0 {
                for axis in 0..2 {
                    link.rates[axis] = link.start_rates[axis] + fraction * link.step_rates[axis];
                }
                before = link.chain.follow(&before, &link.rates);
            }
            link.twist = before;
            link.laws.go(fraction);
        }
        self.pegs.iter_mut().for_each(|peg| peg.go(fraction));
        self.rough.iter_mut().for_each(|rough| rough.go(fraction));
        self.pairs.go(fraction);
    }

    fn write(&self, solution: &mut StageSolution) {
        for (i, link) in self.links.iter().enumerate() {
            solution.twist[i] = spatial_vector(&link.twist);
            link.laws.write(solution, i);
            if i > 0 {
                solution.rate[i - 1] = link.rates;
                solution.actuator[i - 1] = [0, 1].map(|axis| link.actuators[axis].evaluate(link.rates[axis]).0);
            }
        }
        for (impulse, peg) in solution.peg.iter_mut().zip(&self.pegs) {
            *impulse = peg.impulse.max(0.0);
        }
        for (impulse, rough) in solution.peg_friction.iter_mut().zip(&self.rough) {
            *impulse = rough.impulse;
        }
        self.pairs.write(&mut solution.pair);
    }
}

/// The change of link 1's twist under a load; NaN where the balance is singular.
pub(super) fn solve_head(head: &LU<f64, U6, U6>, load: &Vector6<f64>) -> Vector6<f64> {
    head.solve(load).unwrap_or(Vector6::repeat(f64::NAN))
}

impl Defect {
    fn add(&mut self, energy: f64, speed: f64) {
        self.energy += energy;
        self.speed = self.speed.max(speed);
    }
}

/// Newton steps for one position of the centres.
const MAX_ITERATIONS: u32 = 100;

/// How often the centres of the laws move to the impulses, and how much less compliance there is around them.
const MOST_CENTRES: u32 = 10;
const STIFFER: f64 = 1e-2;

/// A step must not end above the worst of as many before it.
const MEMORY: usize = 6;

/// By which part of its length a step must decrease the defects, and how often it is halved.
const DESCENT: f64 = 1e-4;
const MAX_HALVINGS: u32 = 12;

/// Part of a step that is taken where none decreases the defects.
const KICK: f64 = 0.1;

/// Largest compliance over that of the stage, by what it is divided at first, at most, and at least, and linear solves
/// for all of that.
const SOFTEST: f64 = 1e4;
const FIRST_RATIO: f64 = 10.0;
const LARGEST_RATIO: f64 = 1e3;
const LAST_RATIO: f64 = 1.01;
const MOST_SOLVES: u32 = 3000;

/// Violation of the laws that is left to the compliance over the speed of the robot, and over the tolerance.
const EXACT: f64 = 1e-8;
const EXACT_AT_REST: f64 = 1e-6;

/// Defects that are left, over that.
const ROUND_OFF: f64 = 0.1;
