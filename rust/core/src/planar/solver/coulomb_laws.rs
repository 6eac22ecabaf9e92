//! The [laws with impulses as unknowns of their own](crate::solver::UnilateralLaw) of the planar chain: friction on the
//! ground, contacts with obstacles and between links, and their friction, whose bound grows with the normal impulse.

use nalgebra::{Matrix3, Vector3};

use crate::laws::{Ball, ConvexSet, Interval, Skin};
use crate::planar::{Heading, StageContact, StageLink};
use crate::rows::{FrictionRow, Row};
use crate::solver::{CoulombForm, DiscTangent, UnilateralLaw};

use super::coulomb_sweep::Balance;

/// Friction of the ground on one link, or on something that can be pushed, in coordinates in which the other axes are stretched
/// to the longest force.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundLaw {
    /// Slip per twist.
    rows: Matrix3<f64>,
    shape: Vector3<f64>,
    radius: f64,
    skin: Option<Skin>,
    /// Share of the side of z.
    side: f64,
    pub impulse: Vector3<f64>,
    pub centre: Vector3<f64>,
    start: Vector3<f64>,
    step: Vector3<f64>,
    z: Vector3<f64>,
    /// P - prox(z) \[N s\].
    defect: Vector3<f64>,
}

/// Contact with an obstacle or between links.
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactLaw<R> {
    pub row: R,
    pub law: UnilateralLaw,
    pub shift: Shift,
}

/// A velocity `(1 - s) full` that is added to that of a law, away from the end s = 1 of a
/// [path](super::coulomb_path).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shift {
    pub full: f64,
    /// At the present s, and its change over the present step.
    now: f64,
    step: f64,
}

/// Friction of one of these contacts.
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactFrictionLaw<R> {
    pub row: FrictionRow<R>,
    /// Part s of the coefficient that is in force, and its change over the present step.
    share: f64,
    share_step: f64,
    pub shift: Shift,
    pub impulse: f64,
    pub centre: f64,
    start: f64,
    step: f64,
    z: f64,
    /// P - prox(z) \[N s\].
    defect: f64,
    /// Change of the impulse for which the linearised law holds: constant, and slope by the velocity along the row, or by
    /// that of the normal row while friction grows with its impulse.
    pub constant: f64,
    pub slope: f64,
    grows: bool,
}

/// Friction of the ground against the spin of a link.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpinLaw {
    /// From rates to velocities \[m\].
    lever: f64,
    /// Largest impulse at the lever \[N s\].
    bound: f64,
    pub impulse: f64,
    pub centre: f64,
    start: f64,
    step: f64,
    z: f64,
    /// P - prox(z) \[N s\].
    defect: f64,
}

impl GroundLaw {
    /// Friction within these semi-axes, \[N s\] and \[N m s\]: the third is zero for a link.
    pub fn new(heading: &Heading, axes: &Vector3<f64>, skin: Option<Skin>, impulse: &Vector3<f64>) -> Self {
        let radius = axes.xy().max();
        let shape = if radius > 0.0 { axes / radius } else { Vector3::zeros() };
        let (c, s) = (heading.cos, heading.sin);
        let rows = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let stretched = impulse.zip_map(&shape, |p, shape| if shape > 0.0 { p / shape } else { 0.0 });
        let none = Vector3::zeros();
        Self {
            rows: Matrix3::from_diagonal(&shape) * rows,
            shape,
            radius,
            skin,
            side: 1.0,
            impulse: stretched,
            centre: none,
            start: none,
            step: none,
            z: none,
            defect: none,
        }
    }

    /// Evaluates the law at the link's twist; returns the defect \[N s\].
    pub fn measure(&mut self, twist: &Vector3<f64>, form: &CoulombForm) -> f64 {
        let slip = self.rows * twist;
        (self.z, self.side) = form.argument(self.skin, &self.impulse, &self.centre, &slip);
        let nearest = Ball { radius: self.radius }.project(self.z);
        self.defect = self.impulse - Vector3::new(self.side * nearest.x, nearest.y, nearest.z);
        self.defect.norm()
    }

    fn tangent(&self, form: &CoulombForm) -> DiscTangent<3> {
        DiscTangent::on_side(self.side, &self.z, &self.defect, self.radius, form)
    }

    /// Adds the linearised law to the balance of its link.
    pub fn add_to(&self, balance: &mut Balance, form: &CoulombForm) {
        let DiscTangent { constant, from_slip, .. } = self.tangent(form);
        balance.matrix -= self.rows.tr_mul(&(from_slip * self.rows));
        balance.load += self.rows.tr_mul(&constant);
    }

    pub fn force(&self) -> Vector3<f64> {
        self.rows.tr_mul(&self.impulse)
    }

    pub fn find_step(&mut self, twist_step: &Vector3<f64>, form: &CoulombForm) {
        let DiscTangent { constant, from_slip, .. } = self.tangent(form);
        self.start = self.impulse;
        self.step = constant + from_slip * (self.rows * twist_step);
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.impulse = self.start + self.step * fraction;
    }

    /// Visits the impulse with its step.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        self.impulse.iter_mut().zip(self.step.iter()).for_each(|(value, step)| visitor(value, *step));
    }

    /// In the link's frame \[N s\], \[N m s\].
    pub fn impulse_in_frame(&self) -> Vector3<f64> {
        self.impulse.component_mul(&self.shape)
    }
}

impl Shift {
    pub fn set_share(&mut self, share: f64) {
        self.now = (1.0 - share) * self.full;
    }

    pub fn set_share_step(&mut self, change: f64) {
        self.step = -change * self.full;
    }
}

impl<R: Row<Vector3<f64>, f64>> ContactLaw<R> {
    pub fn new(row: R, impulse: f64) -> Self {
        let law = UnilateralLaw::new(row.offset(), impulse);
        Self { row, law, shift: Shift::default() }
    }

    /// Change of the impulse, and the same per velocity, with which the linearised law holds.
    pub fn tangent(&self, form: &CoulombForm) -> (f64, f64) {
        let (constant, slope) = self.law.tangent(form);
        (constant + slope * self.shift.step, slope)
    }

    /// Returns the defect \[N s\].
    pub fn measure(&mut self, twist: impl Fn(usize) -> Vector3<f64>, form: &CoulombForm) -> f64 {
        self.law.measure(rate(&self.row, 1.0, twist) + self.shift.now, form)
    }

    pub fn find_step(&mut self, twist_step: impl Fn(usize) -> Vector3<f64>, form: &CoulombForm) {
        self.law.find_step(rate(&self.row, 1.0, twist_step) + self.shift.step, form);
    }
}

impl ContactLaw<StageContact> {
    /// As [`GroundLaw::add_to`].
    pub fn add_to(&self, balance: &mut Balance, form: &CoulombForm) {
        let (constant, slope) = self.tangent(form);
        let w = &self.row.direction;
        balance.matrix -= w * (w * slope).transpose();
        balance.load += w * constant;
    }
}

impl<R: Row<Vector3<f64>, f64>> ContactFrictionLaw<R> {
    pub fn new(row: FrictionRow<R>, impulse: f64) -> Self {
        Self {
            row,
            share: 1.0,
            share_step: 0.0,
            shift: Shift::default(),
            impulse,
            centre: 0.0,
            start: 0.0,
            step: 0.0,
            z: 0.0,
            defect: 0.0,
            constant: 0.0,
            slope: 0.0,
            grows: false,
        }
    }

    /// Evaluates the law under its contact's normal impulse; returns the defect \[N s\].
    pub fn measure(
        &mut self,
        twist: impl Fn(usize) -> Vector3<f64>,
        normal: &UnilateralLaw,
        form: &CoulombForm,
    ) -> f64 {
        let slip = rate(&self.row.along, 1.0, twist) + self.shift.now;
        self.z = self.impulse - (slip + (self.impulse - self.centre) * form.compliance) * form.weight;
        self.defect = self.impulse - Interval { limit: self.bound(normal) }.project(self.z);
        self.defect
    }

    fn bound(&self, normal: &UnilateralLaw) -> f64 {
        self.share * self.row.coefficient * normal.impulse.max(0.0)
    }

    /// Linearises the law together with that of its contact.
    pub fn linearise(&mut self, contact: &ContactLaw<R>, form: &CoulombForm) {
        let bound = self.bound(&contact.law);
        self.grows = self.z.abs() > bound || bound <= 0.0;
        if self.grows {
            let (constant, slope) = if contact.law.carries() { contact.tangent(form) } else { (0.0, 0.0) };
            let coefficient = self.row.coefficient.copysign(self.z);
            let grows = self.share * coefficient;
            let grown = self.share_step * coefficient * contact.law.impulse.max(0.0);
            self.constant = grows * constant + grown - self.defect;
            self.slope = grows * slope;
        } else {
            let (constant, slope) = form.opening_tangent(true, self.defect);
            (self.constant, self.slope) = (constant + slope * self.shift.step, slope);
        }
    }

    /// The row by whose velocity the impulse changes.
    pub fn driver<'a>(&'a self, contact: &'a ContactLaw<R>) -> &'a R {
        if self.grows { &contact.row } else { &self.row.along }
    }

    /// Takes the part s of the coefficient.
    pub fn set_share(&mut self, share: f64) {
        self.share = share;
        self.shift.set_share(share);
    }

    /// Prepares a step over which s changes.
    pub fn set_share_step(&mut self, change: f64) {
        self.share_step = change;
        self.shift.set_share_step(change);
    }

    pub fn find_step(&mut self, twist_step: impl Fn(usize) -> Vector3<f64>, contact: &ContactLaw<R>) {
        self.start = self.impulse;
        self.step = self.constant + rate(self.driver(contact), self.slope, twist_step);
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.impulse = self.start + self.step * fraction;
    }

    /// Visits the impulse with its step.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        visitor(&mut self.impulse, self.step);
    }
}

impl ContactFrictionLaw<StageContact> {
    /// As [`GroundLaw::add_to`].
    pub fn add_to(&self, balance: &mut Balance, contact: &ContactLaw<StageContact>) {
        let w = &self.row.along.direction;
        balance.matrix -= w * (self.driver(contact).direction * self.slope).transpose();
        balance.load += w * self.constant;
    }
}

/// Rate along `factor` times a row under these twists.
fn rate(row: &impl Row<Vector3<f64>, f64>, factor: f64, twist: impl Fn(usize) -> Vector3<f64>) -> f64 {
    row.parts().map(|(link, w)| (w * factor).dot(&twist(link))).sum()
}

impl SpinLaw {
    pub fn new(bound: f64, moment: f64, lever: f64) -> Self {
        let impulse = moment / lever;
        Self { lever, bound: bound / lever, impulse, centre: 0.0, start: 0.0, step: 0.0, z: 0.0, defect: 0.0 }
    }

    /// \[N m s\]
    pub fn moment(&self) -> f64 {
        self.impulse * self.lever
    }

    /// Evaluates the law; returns the defect \[N s\].
    pub fn measure(&mut self, rate: f64, form: &CoulombForm) -> f64 {
        let slip = self.lever * rate;
        self.z = self.impulse - (slip + (self.impulse - self.centre) * form.compliance) * form.weight;
        self.defect = self.impulse - Interval { limit: self.bound }.project(self.z);
        self.defect
    }

    /// Step of the impulse at constant rate, and its change with the slip.
    fn tangent(&self, form: &CoulombForm) -> (f64, f64) {
        if self.z.abs() <= self.bound { form.opening_tangent(true, self.defect) } else { (-self.defect, 0.0) }
    }

    /// As [`GroundLaw::add_to`].
    pub fn add_to(&self, balance: &mut Balance, form: &CoulombForm) {
        let (constant, slope) = self.tangent(form);
        balance.matrix[(2, 2)] -= self.lever * self.lever * slope;
        balance.load.z += self.lever * constant;
    }

    pub fn find_step(&mut self, rate_step: f64, form: &CoulombForm) {
        let (constant, slope) = self.tangent(form);
        (self.start, self.step) = (self.impulse, constant + slope * self.lever * rate_step);
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.impulse = self.start + self.step * fraction;
    }

    /// Visits the impulse with its step.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        visitor(&mut self.impulse, self.step);
    }
}

/// The matrix of masses of a link.
pub(super) fn mass_matrix(link: &StageLink) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(link.mass, link.mass, link.inertia))
}
