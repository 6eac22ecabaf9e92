//! Obstacles that are no vertical bodies: uneven ground, convex bodies, poles and pipes. The spatial model only.

use super::solid::{SolidContact, SolidLine};
use super::surface::{contact_at, part_of, visit_contacts};
use super::{Cylinder, HeightField, Polyhedron, Rectangle};

use std::sync::Arc;

/// One of them.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    HeightField(Arc<HeightField>),
    Polyhedron(Arc<Polyhedron>),
    Cylinder(Cylinder),
}

impl Body {
    /// Around the body, seen from above.
    pub fn rectangle(&self) -> Rectangle {
        match self {
            Self::HeightField(field) => field.rectangle(),
            Self::Polyhedron(hull) => hull.rectangle(),
            Self::Cylinder(cylinder) => cylinder.rectangle(),
        }
    }

    pub fn height_field(&self) -> Option<&HeightField> {
        match self {
            Self::HeightField(field) => Some(field),
            _ => None,
        }
    }

    /// Coulomb coefficient at a feature where the body has its own, given that of the obstacle; none where links have
    /// the friction of the ground.
    pub fn coefficient(&self, feature: usize, of_obstacle: f64) -> Option<f64> {
        match self {
            Self::HeightField(field) => field.coefficient(part_of(feature)),
            _ => Some(of_obstacle),
        }
    }

    /// Calls `visit` with the contacts of a centre line whose parts may lie within `reach`, by feature; those that are
    /// redundant count for the depth of the line alone.
    pub fn visit_contacts(&self, line: &SolidLine, reach: f64, visit: impl FnMut(usize, SolidContact)) {
        match self {
            Self::HeightField(field) => visit_contacts(field.as_ref(), line, reach, visit),
            Self::Polyhedron(hull) => visit_contacts(hull.as_ref(), line, reach, visit),
            Self::Cylinder(cylinder) => cylinder.visit_contacts(line, visit),
        }
    }

    /// The contact at a feature; where there is none, one of the same place of the line.
    pub fn contact_at(&self, line: &SolidLine, reach: f64, feature: usize) -> SolidContact {
        match self {
            Self::HeightField(field) => contact_at(field.as_ref(), line, reach, feature),
            Self::Polyhedron(hull) => contact_at(hull.as_ref(), line, reach, feature),
            Self::Cylinder(cylinder) => cylinder.contact_at(line, feature),
        }
    }

    /// Distance of a centre line that is nearer than `reach`, negative where it has entered the body, else infinite
    /// \[m\].
    pub fn distance(&self, line: &SolidLine, reach: f64) -> f64 {
        let mut least = f64::INFINITY;
        self.visit_contacts(line, reach, |_, contact| least = least.min(contact.distance));
        least
    }
}
