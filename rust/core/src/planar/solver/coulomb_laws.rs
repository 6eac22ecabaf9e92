//! The [laws with impulses as unknowns of their own](crate::solver::LawImpulse) of the ground: friction on a link, or on
//! something that can be pushed, and against spin.

use nalgebra::{Matrix3, Vector3};

use crate::laws::{Ball, ConvexSet, Interval, Skin};
use crate::planar::Heading;
use crate::solver::{CoulombForm, DiscTangent, LawImpulse};

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
    pub p: LawImpulse<Vector3<f64>>,
}

/// Friction of the ground against the spin of a link.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpinLaw {
    /// From rates to velocities \[m\].
    lever: f64,
    /// Largest impulse at the lever \[N s\].
    bound: f64,
    pub p: LawImpulse<f64>,
}

/// Both on one link.
pub(super) struct LinkGround {
    pub friction: GroundLaw,
    pub spin: Option<SpinLaw>,
}

impl LinkGround {
    /// Adds the linearised laws to the balance of the link.
    pub fn add_to(&self, balance: &mut Balance, form: &CoulombForm) {
        self.friction.add_to(balance, form);
        self.spin.iter().for_each(|spin| spin.add_to(balance, form));
    }

    pub fn find_step(&mut self, twist_step: &Vector3<f64>, form: &CoulombForm) {
        self.friction.find_step(twist_step, form);
        self.spin.iter_mut().for_each(|spin| spin.find_step(twist_step.z, form));
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.friction.p.move_along(fraction);
        self.spin.iter_mut().for_each(|spin| spin.p.move_along(fraction));
    }

    pub fn recentre(&mut self) {
        self.friction.p.recentre();
        self.spin.iter_mut().for_each(|spin| spin.p.recentre());
    }

    /// How far an impulse is from its centre at most \[N s\].
    pub fn centre_error(&self) -> f64 {
        let of_spin = self.spin.map_or(0.0, |spin| spin.p.off_centre().abs());
        self.friction.p.off_centre().amax().max(of_spin)
    }

    /// Visits the numbers of the impulses with their steps.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        self.friction.p.visit(&mut visitor);
        self.spin.iter_mut().for_each(|spin| spin.p.visit(&mut visitor));
    }
}

impl GroundLaw {
    /// Friction within these semi-axes, \[N s\] and \[N m s\]: the third is zero for a link.
    pub fn new(heading: &Heading, axes: &Vector3<f64>, skin: Option<Skin>, impulse: &Vector3<f64>) -> Self {
        let radius = axes.xy().max();
        let shape = if radius > 0.0 { axes / radius } else { Vector3::zeros() };
        let (c, s) = (heading.cos, heading.sin);
        let rows = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let stretched = impulse.zip_map(&shape, |p, shape| if shape > 0.0 { p / shape } else { 0.0 });
        let p = LawImpulse::new(stretched);
        Self { rows: Matrix3::from_diagonal(&shape) * rows, shape, radius, skin, side: 1.0, p }
    }

    /// Evaluates the law at the link's twist; returns the defect \[N s\].
    pub fn measure(&mut self, twist: &Vector3<f64>, form: &CoulombForm) -> f64 {
        let (slip, p) = (self.rows * twist, &mut self.p);
        (p.z, self.side) = form.argument(self.skin, &p.value, &p.centre, &slip);
        let nearest = Ball { radius: self.radius }.project(p.z);
        p.defect = p.value - Vector3::new(self.side * nearest.x, nearest.y, nearest.z);
        p.defect.norm()
    }

    fn tangent(&self, form: &CoulombForm) -> DiscTangent<3> {
        DiscTangent::on_side(self.side, &self.p.z, &self.p.defect, self.radius, form)
    }

    /// Adds the linearised law to the balance of its link.
    pub fn add_to(&self, balance: &mut Balance, form: &CoulombForm) {
        let DiscTangent { constant, from_slip, .. } = self.tangent(form);
        balance.matrix -= self.rows.tr_mul(&(from_slip * self.rows));
        balance.load += self.rows.tr_mul(&constant);
    }

    pub fn force(&self) -> Vector3<f64> {
        self.rows.tr_mul(&self.p.value)
    }

    pub fn find_step(&mut self, twist_step: &Vector3<f64>, form: &CoulombForm) {
        let DiscTangent { constant, from_slip, .. } = self.tangent(form);
        self.p.set_step(constant + from_slip * (self.rows * twist_step));
    }

    /// In the link's frame \[N s\], \[N m s\].
    pub fn impulse_in_frame(&self) -> Vector3<f64> {
        self.p.value.component_mul(&self.shape)
    }
}

impl SpinLaw {
    pub fn new(bound: f64, moment: f64, lever: f64) -> Self {
        Self { lever, bound: bound / lever, p: LawImpulse::new(moment / lever) }
    }

    /// \[N m s\]
    pub fn moment(&self) -> f64 {
        self.p.value * self.lever
    }

    /// Evaluates the law; returns the defect \[N s\].
    pub fn measure(&mut self, rate: f64, form: &CoulombForm) -> f64 {
        self.p.z = self.p.argument(self.lever * rate, form);
        self.p.defect = self.p.value - Interval { limit: self.bound }.project(self.p.z);
        self.p.defect
    }

    /// Step of the impulse at constant rate, and its change with the slip.
    fn tangent(&self, form: &CoulombForm) -> (f64, f64) {
        let LawImpulse { z, defect, .. } = self.p;
        if z.abs() <= self.bound { form.opening_tangent(true, defect) } else { (-defect, 0.0) }
    }

    /// As [`GroundLaw::add_to`].
    pub fn add_to(&self, balance: &mut Balance, form: &CoulombForm) {
        let (constant, slope) = self.tangent(form);
        balance.matrix[(2, 2)] -= self.lever * self.lever * slope;
        balance.load.z += self.lever * constant;
    }

    pub fn find_step(&mut self, rate_step: f64, form: &CoulombForm) {
        let (constant, slope) = self.tangent(form);
        self.p.set_step(constant + slope * self.lever * rate_step);
    }
}
