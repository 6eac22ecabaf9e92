//! Friction at obstacles in [`CoulombNewton`](super::CoulombNewton): discs that grow with the contact's own normal impulse.

use nalgebra::{Matrix2x6, Matrix3x6, Matrix6, Vector2, Vector3, Vector6};

use crate::laws::{Cone, ConvexSet, Disc};
use crate::solver::{CoulombForm, DiscTangent};
use crate::spatial::{Stage, StageSolution};

use super::coulomb_laws::ObstacleLaw;
use super::coulomb_sweep::stacked;

/// Law of the friction of one contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleFrictionLaw {
    rows: Matrix2x6<f64>,
    coefficient: f64,
    pub impulse: Vector2<f64>,
    pub centre: Vector2<f64>,
    start: Vector2<f64>,
    step: Vector2<f64>,
    z: Vector2<f64>,
    /// P - prox(z) \[N s\].
    defect: Vector2<f64>,
    /// Change of the impulse with the twist for which the linearised law holds.
    constant: Vector2<f64>,
    slope: Matrix2x6<f64>,
    /// In the convex problem \[m/s\].
    lag: f64,
}

impl ObstacleFrictionLaw {
    /// Of contact `k` with the impulses of `solution`.
    pub fn new(stage: &Stage, solution: &StageSolution, k: usize) -> Self {
        let row = &stage.obstacle_friction[k];
        let rows = row.tangents.map(|tangent| stacked(&tangent).transpose());
        let none = Vector2::zeros();
        Self {
            rows: Matrix2x6::from_rows(&rows),
            coefficient: row.coefficient,
            impulse: solution.obstacle_friction[k],
            centre: none,
            start: none,
            step: none,
            z: none,
            defect: none,
            constant: none,
            slope: Matrix2x6::zeros(),
            lag: 0.0,
        }
    }

    /// Impulses of friction and contact in the convex problem, and their slopes.
    pub fn project(&mut self, contact: &mut ObstacleLaw, twist: &Vector6<f64>, form: &CoulombForm) {
        let stiffness = 1.0 / form.compliance;
        let normal = contact.law.lagged(contact.direction.dot(twist) + self.lag, form);
        let along = self.centre - self.rows * twist * stiffness;
        let (inside, derivative) =
            Cone { coefficient: self.coefficient }.evaluate(&Vector3::new(normal, along.x, along.y));
        (contact.law.impulse, self.impulse) = (inside.x, inside.yz());
        let [first, second] = [0, 1].map(|row| self.rows.row(row).into_owned());
        let rows = Matrix3x6::from_rows(&[contact.direction.transpose(), first, second]);
        let slope = derivative * rows * -stiffness;
        (contact.constant, contact.slope) = (0.0, slope.row(0).transpose());
        (self.constant, self.slope) = (Vector2::zeros(), slope.fixed_rows::<2>(1).into_owned());
    }

    /// Lag of the next convex problem: that of the present slip.
    pub fn lag(&mut self, twist: &Vector6<f64>) {
        self.lag = self.coefficient * (self.rows * twist).norm();
    }

    /// Evaluates the law under its contact's normal impulse; returns the defect \[N s\].
    pub fn measure(&mut self, twist: &Vector6<f64>, normal: f64, form: &CoulombForm) -> f64 {
        let velocity = self.rows * twist;
        self.z = self.impulse - (velocity + (self.impulse - self.centre) * form.compliance) * form.weight;
        self.defect = self.impulse - Disc { radius: self.radius(normal) }.project(self.z);
        self.defect.norm()
    }

    fn radius(&self, normal: f64) -> f64 {
        self.coefficient * normal.max(0.0)
    }

    /// Linearises the law together with that of its contact.
    pub fn linearise(&mut self, contact: &ObstacleLaw, form: &CoulombForm) {
        let tangent = DiscTangent::new(&self.z, &self.defect, self.radius(contact.law.impulse), form);
        let (constant, slope) = contact.growth();
        self.constant = tangent.constant + tangent.outward * (self.coefficient * constant);
        self.slope = tangent.from_slip * self.rows + tangent.outward * (slope * self.coefficient).transpose();
    }

    /// Contribution of the linearised law to its link's tangent and load.
    pub fn tangent(&self) -> (Matrix6<f64>, Vector6<f64>) {
        (-self.rows.tr_mul(&self.slope), self.rows.tr_mul(&self.constant))
    }

    pub fn force(&self) -> Vector6<f64> {
        self.rows.tr_mul(&self.impulse)
    }

    pub fn find_step(&mut self, twist_step: &Vector6<f64>) {
        self.start = self.impulse;
        self.step = self.constant + self.slope * twist_step;
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.impulse = self.start + self.step * fraction;
    }
}
