//! Contacts in Newton's method with [Coulomb's law as it stands](super::CoupledStage): rows on one link, or on two, whose
//! impulses are unknowns of their own, and friction along rows between the same links, whose bound grows with the normal
//! impulse.

use nalgebra::SVector;

use crate::laws::{ConvexSet, Interval};
use crate::rows::{FrictionRow, Row, Screw};

use super::coulomb_laws::{CoulombForm, LawImpulse, UnilateralLaw};
use super::coulomb_sweep::Balance;
use super::low_rank::{Coupling, EliminatedChain, LinkStep, LowRank};

/// A row on one link or on two, as vectors of `N` numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LawRow<const N: usize> {
    links: [usize; 2],
    direction: [SVector<f64, N>; 2],
    ends: usize,
}

/// Contacts of one kind, with obstacles or between links, and their friction.
pub(crate) struct Contacts<const N: usize> {
    pub normal: Vec<ContactLaw<N>>,
    /// Of those that have it.
    pub friction: Vec<FrictionLaw<N>>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactLaw<const N: usize> {
    pub row: LawRow<N>,
    law: UnilateralLaw,
    pub shift: Shift,
}

/// A velocity `(1 - s) full` that is added to that of a law, away from the end s = 1 of a path of solutions.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shift {
    pub full: f64,
    /// At the present s, and its change over the present step.
    now: f64,
    step: f64,
}

/// Friction of one of the contacts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrictionLaw<const N: usize> {
    /// Index of the contact whose impulse presses.
    normal: usize,
    pub row: LawRow<N>,
    /// mu.
    coefficient: f64,
    /// Part s of the coefficient that is in force, and its change over the present step.
    share: f64,
    share_step: f64,
    pub shift: Shift,
    p: LawImpulse<f64>,
    /// Change of the impulse for which the linearised law holds: constant, and slope by the velocity along the row, or by
    /// that of the normal row while friction grows with its impulse.
    constant: f64,
    slope: f64,
    grows: bool,
}

impl<const N: usize> LawRow<N> {
    fn new<S: Screw<f64>>(row: &impl Row<S, f64>, vector: impl Fn(&S) -> SVector<f64, N>) -> Self {
        let mut parts = row.parts().map(|(link, w)| (link, vector(w)));
        let first = parts.next().unwrap_or((0, SVector::zeros()));
        let second = parts.next();
        let (other, ends) = second.map_or((first, 1), |second| (second, 2));
        Self { links: [first.0, other.0], direction: [first.1, other.1], ends }
    }

    pub fn first_link(&self) -> usize {
        self.links[0]
    }

    /// The links on which it acts, and its directions.
    pub fn parts(&self) -> impl Iterator<Item = (usize, &SVector<f64, N>)> {
        self.links.into_iter().zip(&self.direction).take(self.ends)
    }

    /// Rate along `factor` times the row under these twists.
    fn rate(&self, factor: f64, twist: impl Fn(usize) -> SVector<f64, N>) -> f64 {
        self.parts().map(|(link, w)| (w * factor).dot(&twist(link))).sum()
    }
}

impl<const N: usize> Contacts<N> {
    pub fn with_capacity(rows: usize) -> Self {
        Self { normal: Vec::with_capacity(rows), friction: Vec::with_capacity(rows) }
    }

    /// Takes in the rows of a stage with the impulses of a solution.
    pub fn load<S: Screw<f64>, R: Row<S, f64>>(
        &mut self,
        (rows, impulses): (&[R], &[f64]),
        (friction, friction_impulses): (&[FrictionRow<R>], &[f64]),
        vector: impl Fn(&S) -> SVector<f64, N>,
    ) {
        self.normal.clear();
        self.normal.extend(rows.iter().zip(impulses).map(|(row, &impulse)| ContactLaw {
            row: LawRow::new(row, &vector),
            law: UnilateralLaw::new(row.offset(), impulse),
            shift: Shift::default(),
        }));
        self.friction.clear();
        self.friction.extend(friction.iter().zip(friction_impulses).map(|(row, &impulse)| FrictionLaw {
            normal: row.normal,
            row: LawRow::new(&row.along, &vector),
            coefficient: row.coefficient,
            share: 1.0,
            share_step: 0.0,
            shift: Shift::default(),
            p: LawImpulse::new(impulse),
            constant: 0.0,
            slope: 0.0,
            grows: false,
        }));
    }

    pub fn write(&self, normal: &mut [f64], friction: &mut [f64]) {
        for (impulse, contact) in normal.iter_mut().zip(&self.normal) {
            *impulse = contact.law.p.value.max(0.0);
        }
        for (impulse, law) in friction.iter_mut().zip(&self.friction) {
            *impulse = law.p.value;
        }
    }

    /// Evaluates all laws at these twists.
    pub fn measure(&mut self, twist: impl Fn(usize) -> SVector<f64, N>, form: &CoulombForm) {
        for contact in &mut self.normal {
            contact.law.measure(contact.row.rate(1.0, &twist) + contact.shift.now, form);
        }
        for law in &mut self.friction {
            law.measure(&twist, &self.normal[law.normal].law, form);
        }
    }

    /// All rows with their impulses.
    pub fn impulses(&self) -> impl Iterator<Item = (&LawRow<N>, &LawImpulse<f64>)> {
        let friction = self.friction.iter().map(|law| (&law.row, &law.p));
        self.normal.iter().map(|contact| (&contact.row, &contact.law.p)).chain(friction)
    }

    fn impulses_mut(&mut self) -> impl Iterator<Item = &mut LawImpulse<f64>> {
        let friction = self.friction.iter_mut().map(|law| &mut law.p);
        self.normal.iter_mut().map(|contact| &mut contact.law.p).chain(friction)
    }

    pub fn recentre(&mut self) {
        self.impulses_mut().for_each(LawImpulse::recentre);
    }

    /// How far an impulse is from its centre at most \[N s\].
    pub fn centre_error(&self) -> f64 {
        self.impulses().map(|(_, p)| p.off_centre().abs()).fold(0.0, f64::max)
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.impulses_mut().for_each(|p| p.move_along(fraction));
    }

    /// Visits the impulses with their steps.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        self.impulses_mut().for_each(|p| p.visit(&mut visitor));
    }

    /// Takes the part s of the coefficients of friction, and of what is added to velocities.
    pub fn set_share(&mut self, share: f64) {
        self.normal.iter_mut().for_each(|contact| contact.shift.set_share(share));
        for law in &mut self.friction {
            law.share = share;
            law.shift.set_share(share);
        }
    }

    /// Linearises friction together with the contacts, for a step over which s changes by `change`.
    pub fn linearise(&mut self, change: f64, form: &CoulombForm) {
        self.normal.iter_mut().for_each(|contact| contact.shift.set_share_step(change));
        for law in &mut self.friction {
            law.share_step = change;
            law.shift.set_share_step(change);
            law.linearise(&self.normal[law.normal], form);
        }
    }

    /// Contributions of the linearised laws to the load on a link.
    pub fn loads_on(&self, link: usize, form: &CoulombForm) -> impl Iterator<Item = SVector<f64, N>> {
        let normal = self.normal.iter().map(|contact| (&contact.row, contact.tangent(form).0));
        let loads = normal.chain(self.friction.iter().map(|law| (&law.row, law.constant)));
        loads.flat_map(move |(row, load)| row.parts().filter(move |(of, _)| *of == link).map(move |(_, w)| w * load))
    }

    /// Turns the step of the links without the stiffness of rows between links into that with it.
    pub fn correct<S: LinkStep<f64, SVector<f64, N>>>(
        &self,
        low_rank: &mut LowRank<f64, SVector<f64, N>, S>,
        chain: &mut impl EliminatedChain<f64, SVector<f64, N>, S>,
        form: &CoulombForm,
    ) {
        low_rank.clear();
        let normal = self.normal.iter().map(|contact| (&contact.row, &contact.row, contact.tangent(form).1));
        let friction = self.friction.iter().map(|law| (law.driver(&self.normal), &law.row, law.slope));
        for (row, column, slope) in normal.chain(friction).filter(|(_, _, slope)| *slope != 0.0) {
            let coupling = Coupling { links: row.links, direction: row.direction, stiffness: -slope };
            low_rank.apply(coupling, &column.direction, chain);
        }
    }

    /// Computes the changes of the impulses with the steps of the links.
    pub fn find_step(&mut self, twist_step: impl Fn(usize) -> SVector<f64, N>, form: &CoulombForm) {
        for contact in &mut self.normal {
            let (constant, slope) = contact.law.tangent(form);
            let velocity = contact.row.rate(1.0, &twist_step) + contact.shift.step;
            contact.law.p.set_step(constant + slope * velocity);
        }
        for law in &mut self.friction {
            let change = law.driver(&self.normal).rate(law.slope, &twist_step);
            law.p.set_step(law.constant + change);
        }
    }

    /// Adds the linearised laws of rows on `link` alone to its balance. Links are visited from the last to the first;
    /// `left` is the number of contacts and of frictions on links that are still to come, at first of all.
    pub fn add_to(
        &self,
        link: usize,
        left: &mut [usize; 2],
        Balance { matrix, load }: &mut Balance<N>,
        form: &CoulombForm,
    ) {
        while let Some(contact) = self.normal[..left[0]].last().filter(|contact| contact.row.first_link() == link) {
            let (constant, slope) = contact.tangent(form);
            let [w, _] = &contact.row.direction;
            *matrix -= w * (w * slope).transpose();
            *load += w * constant;
            left[0] -= 1;
        }
        while let Some(law) = self.friction[..left[1]].last().filter(|law| law.row.first_link() == link) {
            let ([w, _], [driver, _]) = (&law.row.direction, &law.driver(&self.normal).direction);
            *matrix -= w * (driver * law.slope).transpose();
            *load += w * law.constant;
            left[1] -= 1;
        }
    }

    /// How many contacts and frictions there are.
    pub fn len(&self) -> [usize; 2] {
        [self.normal.len(), self.friction.len()]
    }
}

impl<const N: usize> ContactLaw<N> {
    /// Change of the impulse, and the same per velocity, with which the linearised law holds.
    fn tangent(&self, form: &CoulombForm) -> (f64, f64) {
        let (constant, slope) = self.law.tangent(form);
        (constant + slope * self.shift.step, slope)
    }
}

impl<const N: usize> FrictionLaw<N> {
    /// Evaluates the law under its contact's normal impulse.
    fn measure(&mut self, twist: impl Fn(usize) -> SVector<f64, N>, normal: &UnilateralLaw, form: &CoulombForm) {
        self.p.z = self.p.argument(self.row.rate(1.0, twist) + self.shift.now, form);
        self.p.defect = self.p.value - Interval { limit: self.bound(normal) }.project(self.p.z);
    }

    /// The row by whose velocity the impulse changes.
    fn driver<'a>(&'a self, normal: &'a [ContactLaw<N>]) -> &'a LawRow<N> {
        if self.grows { &normal[self.normal].row } else { &self.row }
    }

    fn bound(&self, normal: &UnilateralLaw) -> f64 {
        self.share * self.coefficient * normal.p.value.max(0.0)
    }

    /// Linearises the law together with that of its contact.
    fn linearise(&mut self, contact: &ContactLaw<N>, form: &CoulombForm) {
        let bound = self.bound(&contact.law);
        self.grows = self.p.z.abs() > bound || bound <= 0.0;
        if self.grows {
            let (constant, slope) = if contact.law.carries() { contact.tangent(form) } else { (0.0, 0.0) };
            let coefficient = self.coefficient.copysign(self.p.z);
            let grows = self.share * coefficient;
            let grown = self.share_step * coefficient * contact.law.p.value.max(0.0);
            self.constant = grows * constant + grown - self.p.defect;
            self.slope = grows * slope;
        } else {
            let (constant, slope) = form.opening_tangent(true, self.p.defect);
            (self.constant, self.slope) = (constant + slope * self.shift.step, slope);
        }
    }
}

impl Shift {
    fn set_share(&mut self, share: f64) {
        self.now = (1.0 - share) * self.full;
    }

    fn set_share_step(&mut self, change: f64) {
        self.step = -change * self.full;
    }
}
