//! Laws of contact with impulses as unknowns of their own, and their tangents.
//!
//! A law holds if P = prox_C(z) with z = P - rho (gamma + delta (P - centre)) (T 4.88). Around the centre zero that is
//! the law with a compliance delta, whose impulses are the shortest (T 4.78 != D43); rho only selects the form of the
//! law. Sets of friction are those of the present normal impulse.

use std::ops::{Add, Mul, Sub};

use nalgebra::{ArrayStorage, SMatrix, SVector, Vector2};

use crate::laws::{HalfLine, Halves, Skin};

/// The proximal form in which laws are evaluated.
#[derive(Debug, Clone, Copy)]
pub struct CoulombForm {
    /// rho \[kg\].
    pub weight: f64,
    /// delta \[1/kg\].
    pub compliance: f64,
    /// Whether impulses are no unknowns but those of the convex problem in which friction lags, at the present
    /// velocities: P = prox_C(centre - (gamma + lag) / delta).
    pub is_lagged: bool,
}

impl CoulombForm {
    /// Of a stage whose links have this `mass` on average, with the compliance of its stiff contacts.
    pub fn stiff(mass: f64, penalty: f64) -> Self {
        Self { weight: mass, compliance: 1.0 / (penalty * mass), is_lagged: false }
    }

    /// z of a law of friction, and the share of its side; of a skin z = S (grad h(P) - rho (gamma + ...)).
    pub fn argument<const N: usize>(
        &self,
        skin: Option<Skin>,
        impulse: &SVector<f64, N>,
        centre: &SVector<f64, N>,
        slip: &SVector<f64, N>,
    ) -> (SVector<f64, N>, f64) {
        let softened = (impulse - centre) * self.compliance;
        let mut z = impulse - (slip + softened) * self.weight;
        let Some(skin) = skin else { return (z, 1.0) };
        let in_plane = |v: &SVector<f64, N>| Vector2::new(v[0], v[1]);
        let y = skin.gradient(&in_plane(&(impulse - softened * self.weight))) - in_plane(slip) * self.weight;
        let side = skin.side(y.x);
        let scaled = skin.scaled(&y, side);
        (z[0], z[1]) = (scaled.x, scaled.y);
        (z, side)
    }

    /// Change of a normal impulse, and the same per velocity, with which the linearised law holds.
    pub fn opening_tangent(&self, closed: bool, defect: f64) -> (f64, f64) {
        if closed { (-defect / (self.weight * self.compliance), -1.0 / self.compliance) } else { (-defect, 0.0) }
    }
}

/// The impulse of a law as an unknown of its own, in one number or in several.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LawImpulse<V> {
    /// P \[N s\].
    pub value: V,
    pub centre: V,
    start: V,
    step: V,
    pub z: V,
    /// P - prox(z) \[N s\].
    pub defect: V,
}

/// The law of a unilateral contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnilateralLaw {
    offset: f64,
    pub p: LawImpulse<f64>,
}

/// One number or several.
pub(crate) trait Numbers: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {
    const ZERO: Self;
}

impl Numbers for f64 {
    const ZERO: Self = 0.0;
}

impl<const N: usize> Numbers for SVector<f64, N> {
    const ZERO: Self = Self::from_array_storage(ArrayStorage([[0.0; N]]));
}

impl<V: Numbers> LawImpulse<V> {
    /// Around the centre zero.
    pub fn new(value: V) -> Self {
        Self { value, centre: V::ZERO, start: V::ZERO, step: V::ZERO, z: V::ZERO, defect: V::ZERO }
    }

    /// z at this velocity.
    pub fn argument(&self, velocity: V, form: &CoulombForm) -> V {
        self.value - (velocity + self.off_centre() * form.compliance) * form.weight
    }

    pub fn off_centre(&self) -> V {
        self.value - self.centre
    }

    pub fn recentre(&mut self) {
        self.centre = self.value;
    }

    pub fn set_step(&mut self, step: V) {
        (self.start, self.step) = (self.value, step);
    }

    pub fn move_along(&mut self, fraction: f64) {
        self.value = self.start + self.step * fraction;
    }
}

impl LawImpulse<f64> {
    /// Visits the impulse with its step.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        visitor(&mut self.value, self.step);
    }
}

impl<const N: usize> LawImpulse<SVector<f64, N>> {
    /// Visits the numbers of the impulse with their steps.
    pub fn visit(&mut self, mut visitor: impl FnMut(&mut f64, f64)) {
        self.value.iter_mut().zip(self.step.iter()).for_each(|(value, step)| visitor(value, *step));
    }
}

impl UnilateralLaw {
    pub fn new(offset: f64, impulse: f64) -> Self {
        Self { offset, p: LawImpulse::new(impulse) }
    }

    /// Evaluates the law at the velocity `w . u`; returns the defect \[N s\].
    pub fn measure(&mut self, velocity: f64, form: &CoulombForm) -> f64 {
        if form.is_lagged {
            let z = self.lagged(velocity, form);
            self.p = LawImpulse { value: HalfLine.project(z), z, defect: 0.0, ..self.p };
        } else {
            self.p.z = self.p.argument(velocity + self.offset, form);
            self.p.defect = self.p.value - HalfLine.project(self.p.z);
        }
        self.p.defect
    }

    /// The impulse of the convex problem at this velocity before its projection.
    pub fn lagged(&self, velocity: f64, form: &CoulombForm) -> f64 {
        self.p.centre - (velocity + self.offset) / form.compliance
    }

    /// Change of the impulse, and the same per velocity, with which the linearised law holds.
    pub fn tangent(&self, form: &CoulombForm) -> (f64, f64) {
        form.opening_tangent(self.p.z > 0.0, self.p.defect)
    }

    /// Whether friction grows with the impulse.
    pub fn carries(&self) -> bool {
        self.p.z > 0.0 || self.p.value > 0.0
    }
}

/// Change of a friction impulse with which the linearised law holds.
pub(crate) struct DiscTangent<const N: usize> {
    pub constant: SVector<f64, N>,
    /// Per change of the radius: nothing when sticking, the direction of the friction when sliding.
    pub outward: SVector<f64, N>,
    pub from_slip: SMatrix<f64, N, N>,
}

impl<const N: usize> DiscTangent<N> {
    /// On the side of a skin that has this share: of S p, by the slip itself.
    pub fn on_side(side: f64, z: &SVector<f64, N>, defect: &SVector<f64, N>, radius: f64, form: &CoulombForm) -> Self {
        let mut scale = SMatrix::<f64, N, N>::identity();
        scale[(0, 0)] = side;
        let mut of_side = *defect;
        of_side[0] *= if side > 0.0 { 1.0 / side } else { 0.0 };
        let Self { mut constant, outward, from_slip } = Self::new(z, &of_side, radius, form);
        constant[0] = if side > 0.0 { side * constant[0] } else { -defect[0] };
        Self { constant, outward: scale * outward, from_slip: scale * from_slip * scale }
    }

    pub fn new(z: &SVector<f64, N>, defect: &SVector<f64, N>, radius: f64, form: &CoulombForm) -> Self {
        let CoulombForm { weight, compliance, .. } = *form;
        let (length, soft) = (z.norm(), weight * compliance);
        if length <= radius && radius > 0.0 {
            let from_slip = SMatrix::identity() * (-1.0 / compliance);
            return Self { constant: -defect / soft, outward: SVector::zeros(), from_slip };
        }
        let (outward, part) = if length > 0.0 { (z / length, radius / length) } else { (SVector::zeros(), 0.0) };
        let across = SMatrix::identity() - outward * outward.transpose();
        // The law with its own part of the defect solved for: I - (1 - rho delta) part across.
        let stiff = 1.0 / (1.0 - (1.0 - soft) * part);
        let turned = defect + across * defect * (stiff - 1.0);
        Self { constant: -turned, outward, from_slip: across * (-weight * part * stiff) }
    }
}
