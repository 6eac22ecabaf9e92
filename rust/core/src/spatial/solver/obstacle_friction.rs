//! Friction of contacts with obstacles in proximal form: discs whose radii follow the contacts' normal impulses, like those
//! of the ground. A stage without them pays for none.

use nalgebra::Vector2;

use crate::laws::Whole;
use crate::math::Real;
use crate::spatial::spatial_vector::{Twist, Wrench};
use crate::spatial::stage::CONTACTS_PER_LINK;
use crate::spatial::{Stage, StageSolution};

use super::friction_term::{FrictionLaw, FrictionTangent, FrictionTerm};
use super::link_term::LinkTerm;
use super::progress::PassLanes;
use super::ray_laws::RayLaws;
use super::sweep::Affine;
use super::terms::ObstacleTerm;

/// Friction of one contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleFrictionTerm<T: Real> {
    tangents: [Wrench<T>; 2],
    law: FrictionLaw<T>,
    friction: FrictionTerm<T>,
}

/// Frictions of the contacts of the stage at hand, one for each, or none.
pub(super) struct ObstacleFriction<T: Real> {
    pub terms: Vec<ObstacleFrictionTerm<T>>,
}

/// How far the laws of a pass are from the solution.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObstacleFrictionError<T> {
    /// How far the radius is from that of the normal impulse \[N s\].
    pub radius: T,
    /// The radius itself \[N s\].
    pub largest: T,
    /// Distance of the centre from the impulse, squared \[N^2 s^2\].
    pub squared: T,
}

impl<T: Real> ObstacleFrictionTerm<T> {
    #[inline(always)]
    fn slip(&self, twist: &Twist<T>) -> Vector2<T> {
        let [along, across] = &self.tangents;
        Vector2::new(along.dot(twist), across.dot(twist))
    }
}

impl<T: Real> ObstacleFriction<T> {
    pub fn new(links: usize) -> Self {
        Self { terms: Vec::with_capacity(CONTACTS_PER_LINK * links) }
    }

    /// Laws with the radii of the warm start.
    #[inline(always)]
    pub fn warm_up(&mut self, stage: &Stage<T>, solution: &StageSolution<T>, penalty: T) {
        self.terms.clear();
        for (k, row) in stage.obstacle_friction.iter().enumerate() {
            let law = FrictionLaw::new(Vector2::new(row.coefficient, row.coefficient), penalty);
            let friction = FrictionTerm::new(&law, law.radius(solution.contact[k]), &solution.obstacle_friction[k]);
            self.terms.push(ObstacleFrictionTerm { tangents: row.tangents, law, friction });
        }
    }

    /// Moves the law of contact `k`, whose normal law has been moved, to its link's twist and adds force and stiffness. Its radius
    /// first takes that of the normal impulse `load`, where it changes by no more than `most`; `penalty` is the stiffness of the
    /// normal law.
    #[inline(always)]
    pub fn evaluate<const RECENTRING: bool>(
        &mut self,
        (k, contact): (usize, &ObstacleTerm<T>),
        (load, penalty): (T, T),
        twist: &Twist<T>,
        model: &mut Affine<T>,
        (lanes, most): (&PassLanes<T>, T),
    ) -> Option<ObstacleFrictionError<T>> {
        let term = self.terms.get_mut(k)?;
        let slip = term.slip(twist);
        let ObstacleFrictionTerm { tangents: [along, across], law, friction } = term;
        let error = friction.follow(law.radius(load), most);
        let radius = (error, law.strength * contact.normal.value);
        let FrictionTangent { stiffness, by_radius } =
            friction.evaluate::<RECENTRING>(Whole, law, &slip, radius, lanes);
        let by_load = contact.direction.scaled(law.strength * penalty);
        // A closure in a map of arrays would be a call.
        let x = along.scaled(stiffness.xx).plus_scaled(across, stiffness.xy).plus_scaled(&by_load, by_radius.x);
        let y = along.scaled(stiffness.xy).plus_scaled(across, stiffness.yy).plus_scaled(&by_load, by_radius.y);
        model.matrix.add_outer(along, &x);
        model.matrix.add_outer(across, &y);
        let impulse = friction.value;
        model.gradient = model.gradient.plus_scaled(along, -impulse.x).plus_scaled(across, -impulse.y);
        let squared = friction.squared_error(Whole, law);
        Some(ObstacleFrictionError { radius: error, largest: friction.radius, squared })
    }

    /// Adds all laws along the step.
    #[inline(always)]
    pub fn add_along(&self, contacts: &[ObstacleTerm<T>], links: &[LinkTerm<T>], ray: &mut RayLaws<T>) {
        for (term, contact) in self.terms.iter().zip(contacts) {
            let link = &links[contact.link];
            term.friction.add_along(Whole, &term.law, &term.slip(&link.twist), &term.slip(&link.step), ray);
        }
    }

    /// Radii, and those of the normal impulses \[N s\].
    #[inline(always)]
    pub fn radii<'a>(&'a mut self, contacts: &'a [ObstacleTerm<T>]) -> impl Iterator<Item = (&'a mut T, T)> {
        let terms = self.terms.iter_mut().zip(contacts);
        terms.map(|(term, contact)| (&mut term.friction.radius, term.law.radius(contact.normal.value)))
    }

    #[inline(always)]
    pub fn frictions(&mut self) -> impl Iterator<Item = &mut FrictionTerm<T>> {
        self.terms.iter_mut().map(|term| &mut term.friction)
    }

    #[inline(always)]
    pub fn write(&self, impulses: &mut [Vector2<T>]) {
        for (impulse, term) in impulses.iter_mut().zip(&self.terms) {
            *impulse = term.friction.value;
        }
    }
}
