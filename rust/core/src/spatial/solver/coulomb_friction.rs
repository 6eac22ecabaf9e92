//! Friction at obstacles in [`CoulombNewton`](super::CoulombNewton): discs that grow with the contact's own normal impulse.

use nalgebra::{Matrix2x6, Matrix3x6, Vector2, Vector3, Vector6};

use crate::laws::{Cone, ConvexSet, Disc};
use crate::solver::{CoulombForm, DiscTangent};
use crate::spatial::{Stage, StageSolution};

use super::coulomb_laws::{LawRows, ObstacleLaw};
use super::coulomb_sweep::stacked;

/// Law of the friction of one contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleFrictionLaw {
    pub laws: LawRows<2>,
    coefficient: f64,
    /// In the convex problem \[m/s\].
    lag: f64,
}

impl ObstacleFrictionLaw {
    /// Of contact `k` with the impulses of `solution`.
    pub fn new(stage: &Stage, solution: &StageSolution, k: usize) -> Self {
        let row = &stage.obstacle_friction[k];
        let rows = row.tangents.map(|tangent| stacked(&tangent).transpose());
        let laws = LawRows::new(Matrix2x6::from_rows(&rows), solution.obstacle_friction[k]);
        Self { laws, coefficient: row.coefficient, lag: 0.0 }
    }

    /// Impulses of friction and contact in the convex problem, and their slopes.
    pub fn project(&mut self, contact: &mut ObstacleLaw, twist: &Vector6<f64>, form: &CoulombForm) {
        let stiffness = 1.0 / form.compliance;
        let normal = contact.law.lagged(contact.direction.dot(twist) + self.lag, form);
        let along = self.laws.p.centre - self.laws.rows * twist * stiffness;
        let (inside, derivative) =
            Cone { coefficient: self.coefficient }.evaluate(&Vector3::new(normal, along.x, along.y));
        (contact.law.p.value, self.laws.p.value) = (inside.x, inside.yz());
        let [first, second] = [0, 1].map(|row| self.laws.rows.row(row).into_owned());
        let rows = Matrix3x6::from_rows(&[contact.direction.transpose(), first, second]);
        let slope = derivative * rows * -stiffness;
        (contact.constant, contact.slope) = (0.0, slope.row(0).transpose());
        (self.laws.constant, self.laws.slope) = (Vector2::zeros(), slope.fixed_rows::<2>(1).into_owned());
    }

    /// Lag of the next convex problem: that of the present slip.
    pub fn lag(&mut self, twist: &Vector6<f64>) {
        self.lag = self.coefficient * (self.laws.rows * twist).norm();
    }

    /// Evaluates the law under its contact's normal impulse; returns the defect \[N s\].
    pub fn measure(&mut self, twist: &Vector6<f64>, normal: f64, form: &CoulombForm) -> f64 {
        let radius = self.radius(normal);
        let LawRows { rows, p, .. } = &mut self.laws;
        p.z = p.argument(*rows * twist, form);
        p.defect = p.value - Disc { radius }.project(p.z);
        p.defect.norm()
    }

    fn radius(&self, normal: f64) -> f64 {
        self.coefficient * normal.max(0.0)
    }

    /// Linearises the law together with that of its contact.
    pub fn linearise(&mut self, contact: &ObstacleLaw, form: &CoulombForm) {
        let radius = self.radius(contact.law.p.value);
        let LawRows { rows, p, constant, slope } = &mut self.laws;
        let tangent = DiscTangent::new(&p.z, &p.defect, radius, form);
        let (growth, along) = contact.growth();
        *constant = tangent.constant + tangent.outward * (self.coefficient * growth);
        *slope = tangent.from_slip * *rows + tangent.outward * (along * self.coefficient).transpose();
    }
}
