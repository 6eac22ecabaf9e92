//! Laws of contact with impulses as unknowns of their own, and their tangents.
//!
//! A law holds if P = prox_C(z) with z = P - rho (gamma + delta (P - centre)) (T 4.88). Around the centre zero that is
//! the law with a compliance delta, whose impulses are the shortest (T 4.78 != D43); rho only selects the form of the
//! law. Sets of friction are those of the present normal impulse.

use nalgebra::{Matrix2, Vector2};

use crate::laws::HalfLine;

/// The proximal form in which laws are evaluated.
#[derive(Debug, Clone, Copy)]
pub struct CoulombForm {
    /// rho \[kg\].
    pub weight: f64,
    /// delta \[1/kg\].
    pub compliance: f64,
}

impl CoulombForm {
    /// Change of a normal impulse, and the same per velocity, with which the linearised law holds.
    pub fn opening_tangent(&self, closed: bool, defect: f64) -> (f64, f64) {
        if closed { (-defect / (self.weight * self.compliance), -1.0 / self.compliance) } else { (-defect, 0.0) }
    }
}

/// The law of a unilateral contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnilateralLaw {
    offset: f64,
    pub impulse: f64,
    pub centre: f64,
    start: f64,
    step: f64,
    z: f64,
    /// P - prox(z) \[N s\].
    pub defect: f64,
}

impl UnilateralLaw {
    pub fn new(offset: f64, impulse: f64) -> Self {
        Self { offset, impulse, centre: 0.0, start: 0.0, step: 0.0, z: 0.0, defect: 0.0 }
    }

    /// Evaluates the law at the velocity `w . u`; returns the defect \[N s\].
    pub fn measure(&mut self, velocity: f64, form: &CoulombForm) -> f64 {
        let opening = velocity + self.offset;
        self.z = self.impulse - (opening + (self.impulse - self.centre) * form.compliance) * form.weight;
        self.defect = self.impulse - HalfLine.project(self.z);
        self.defect
    }

    /// Change of the impulse, and the same per velocity, with which the linearised law holds.
    pub fn tangent(&self, form: &CoulombForm) -> (f64, f64) {
        form.opening_tangent(self.z > 0.0, self.defect)
    }

    /// Whether friction grows with the impulse.
    pub fn carries(&self) -> bool {
        self.z > 0.0 || self.impulse > 0.0
    }

    /// Computes the change of the impulse with that of the velocity.
    pub fn find_step(&mut self, velocity_step: f64, form: &CoulombForm) {
        let (constant, slope) = self.tangent(form);
        self.start = self.impulse;
        self.step = constant + slope * velocity_step;
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.impulse = self.start + self.step * fraction;
    }

    /// Visits the impulse with its step.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        visitor(&mut self.impulse, self.step);
    }
}

/// Change of a friction impulse with which the linearised law holds.
pub(crate) struct DiscTangent {
    pub constant: Vector2<f64>,
    /// Per change of the radius: nothing when sticking, the direction of the friction when sliding.
    pub outward: Vector2<f64>,
    pub from_slip: Matrix2<f64>,
}

impl DiscTangent {
    pub fn new(z: &Vector2<f64>, defect: &Vector2<f64>, radius: f64, form: &CoulombForm) -> Self {
        let CoulombForm { weight, compliance } = *form;
        let (length, soft) = (z.norm(), weight * compliance);
        if length <= radius && radius > 0.0 {
            let from_slip = Matrix2::identity() * (-1.0 / compliance);
            return Self { constant: -defect / soft, outward: Vector2::zeros(), from_slip };
        }
        let (outward, part) = if length > 0.0 { (z / length, radius / length) } else { (Vector2::zeros(), 0.0) };
        let across = Matrix2::identity() - outward * outward.transpose();
        // The law with its own part of the defect solved for: I - (1 - rho delta) part across.
        let stiff = 1.0 / (1.0 - (1.0 - soft) * part);
        let turned = defect + across * defect * (stiff - 1.0);
        Self { constant: -turned, outward, from_slip: across * (-weight * part * stiff) }
    }
}
