//! Friction of contacts with obstacles in proximal form: discs whose radii follow the contacts' normal impulses, like those
//! of the ground. A stage without them pays for none.

use nalgebra::Vector2;

use crate::laws::Whole;
use crate::math::Real;
use crate::spatial::spatial_vector::{Momentum, Twist, Wrench};
use crate::spatial::stage::CONTACTS_PER_LINK;
use crate::spatial::{Stage, StageSolution};

use super::friction_term::{FrictionLaw, FrictionTerm};
use super::link_term::LinkTerm;
use super::sweep::Quadratic;
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
    /// By how much the radius had to move \[N s\].
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

    /// As [`LinkTerm::add_change_of_friction`], of a contact and its link's step.
    #[inline(always)]
    pub fn add_change_of_friction(&self, contact: &ObstacleTerm<T>, step: &Twist<T>, gradient: &mut Momentum<T>) {
        let [along, across] = &self.tangents;
        let load = contact.normal.value_after(contact.direction.dot(step));
        let change = self.friction.change_with(self.law.radius(load));
        *gradient = gradient.plus_scaled(along, -change.x).plus_scaled(across, -change.y);
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

    /// Moves the law of contact `k`, under the normal impulse `load`, to its link's twist and adds gradient and Hessian.
    /// Its radius first takes that impulse's, where it changes by no more than `largest_change`.
    #[inline(always)]
    pub fn evaluate<const RECENTRING: bool>(
        &mut self,
        k: usize,
        load: T,
        twist: &Twist<T>,
        model: &mut Quadratic<T>,
        largest_change: T,
        recentred: T::Mask,
    ) -> Option<ObstacleFrictionError<T>> {
        let term = self.terms.get_mut(k)?;
        let slip = term.slip(twist);
        let ObstacleFrictionTerm { tangents: [along, across], law, friction } = term;
        let change = friction.follow(law.radius(load), largest_change);
        let stick = friction.evaluate(Whole, law, &slip);
        if RECENTRING {
            friction.recentre_here(Whole, &slip, &stick, recentred);
        }
        let impulse = friction.value;
        // K = kxx aa + kxy (ab + ba) + kyy bb, as three squares.
        let both = along.plus_scaled(across, T::splat(1.0));
        model.add_rank_one(along, stick.xx - stick.xy, -impulse.x);
        model.add_rank_one(across, stick.yy - stick.xy, -impulse.y);
        model.add_rank_one(&both, stick.xy, T::zero());
        let squared = friction.squared_error(Whole, law);
        Some(ObstacleFrictionError { radius: change, largest: friction.radius, squared })
    }

    /// First and second derivative of all laws' functions along the step.
    #[inline(always)]
    pub fn along(&self, contacts: &[ObstacleTerm<T>], links: &[LinkTerm<T>], alpha: T) -> (T, T) {
        let (mut slope, mut curvature) = (T::zero(), T::zero());
        for (term, contact) in self.terms.iter().zip(contacts) {
            let link = &links[contact.link];
            let (slip, change) = (term.slip(&link.twist), term.slip(&link.step));
            let (first, second) = term.friction.along(Whole, &term.law, &slip, &change, alpha);
            slope += first;
            curvature += second;
        }
        (slope, curvature)
    }

    /// Calls `see` with the places along the step where a slip is least.
    #[inline(always)]
    pub fn visit_kinks(&self, contacts: &[ObstacleTerm<T>], links: &[LinkTerm<T>], mut see: impl FnMut(T)) {
        for (term, contact) in self.terms.iter().zip(contacts) {
            let link = &links[contact.link];
            see(term.friction.kink(Whole, &term.slip(&link.twist), &term.slip(&link.step)));
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
